"""No file is replaced without --force."""

from __future__ import annotations

from pathlib import Path

from xy_sysid.bags.atomic import taken
from xy_sysid.errors import BadInput


def free(what: str, path: Path, force: bool, act: str) -> None:
    """Raises BadInput if the file or a link of that name exists, unless ``force``; act: how to force it."""
    if taken(path) and not force:
        link = f", a link to {path.resolve()}" if path.is_symlink() else ""
        raise BadInput(what, f"{path}{link}", "a name that is not there yet", f"Choose another name, or {act} to replace it.")
