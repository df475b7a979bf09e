"""The identifier's memory on disk: written whole or not at all, so that a kill in the middle loses nothing."""

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
    """Write beside the old file, then put it in its place. Raises BadRecording if it cannot be written."""
    arrays: dict[str, Any] = dict(state)
    with whole(path) as part, part.open("wb") as file:
        np.savez(file, **arrays)


def load_state(path: Path) -> State:
    """What was saved; raises BadRecording if the file is none of ours."""
    try:
        regular_file(path)
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except DAMAGED as problem:
        raise BadRecording(
            path, f"is no state of the identifier ({' '.join(str(problem).split())[:120]})", "Delete it, or name another with state_file."
        ) from None


def set_aside(path: Path) -> Path:
    """Keep a state that cannot be used under another name, so that it is neither used nor lost."""
    aside = path.with_name(path.name + ".unusable")
    path.replace(aside)
    return aside
