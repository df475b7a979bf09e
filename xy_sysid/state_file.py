"""The identifier's memory on disk: written whole or not at all, so that a kill in the middle loses nothing."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from xy_sysid.errors import BadRecording
from xy_sysid.spectra import State


def save_state(path: Path, state: State) -> None:
    """Write beside the old file, then put it in its place."""
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    with fresh.open("wb") as file:
        arrays: dict[str, Any] = dict(state)
        np.savez(file, **arrays)
        file.flush()
        os.fsync(file.fileno())
    fresh.replace(path)


def load_state(path: Path) -> State:
    """What was saved; raises BadRecording if the file is none of ours."""
    try:
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except (OSError, ValueError, zipfile.BadZipFile, EOFError) as problem:
        raise BadRecording(path, f"is no state of the identifier ({problem})", "Delete it, or name another with state_file.") from None


def set_aside(path: Path) -> Path:
    """Keep a state that cannot be used under another name, so that it is neither used nor lost."""
    aside = path.with_name(path.name + ".unusable")
    path.replace(aside)
    return aside
