"""No file is replaced unasked."""

from __future__ import annotations

from pathlib import Path

from xy_sysid.errors import BadInput


def free(what: str, path: Path, force: bool, act: str) -> None:
    """Raises BadInput for a file that is there already, unless ``force``; act: how to force it."""
    if path.exists() and not force:
        raise BadInput(what, str(path), "a name that is not there yet", f"Choose another name, or {act} to replace it.")
