"""The identifier's memory on disk: written completely or not at all, so that a kill during writing loses nothing."""

from __future__ import annotations

import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from xy_sysid.bags.atomic import whole
from xy_sysid.bags.opening import regular_file
from xy_sysid.errors import BadRecording
from xy_sysid.response.spectra import State

DAMAGED = (
    OSError,
    ValueError,
    EOFError,
    KeyError,
    TypeError,
    SyntaxError,
    NotImplementedError,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
    struct.error,
)


def save_state(path: Path, state: State) -> None:
    """Write a temporary file, then replace the old one. Raises BadRecording if it cannot be written."""
    arrays: dict[str, Any] = dict(state)
    with whole(path) as part, part.open("wb") as file:
        np.savez(file, **arrays)


def load_state(path: Path) -> State:
    """The saved state; raises BadRecording if the file is not a state file."""
    try:
        regular_file(path)
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except DAMAGED as problem:
        raise BadRecording(
            path, f"is no state of the identifier ({' '.join(str(problem).split())[:120]})", "Delete it, or name another with state_file."
        ) from None


def set_aside(path: Path) -> Path:
    """Rename a state that cannot be used, so that it is neither used nor lost."""
    aside = path.with_name(path.name + ".unusable")
    path.replace(aside)
    return aside
