"""Location of recordings of real machines for the tests that need them; they are never part of the project."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from helpers import ROOT


def data(path: str) -> Path:
    """A file or folder below $XY_SYSID_DATA (or ../shared/data next to the project); the test is skipped without it."""
    folder = Path(os.environ.get("XY_SYSID_DATA") or ROOT.parent / "shared" / "data")
    found = folder / path
    if not found.exists():
        pytest.skip(f"no {path} in the measured data; say where they lie with XY_SYSID_DATA")
    return found
