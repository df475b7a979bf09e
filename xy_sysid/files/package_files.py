"""Location of the files that come with the package: the source tree, or the share folder of an installation."""

from __future__ import annotations

from pathlib import Path

from xy_sysid.errors import BadInput

PACKAGE = "xy_sysid"


def share(start: Path | None = None) -> Path:
    """The folder that holds ``config`` and ``launch``.

    A source tree (an editable install, a colcon build with symlinks) has them next to the package; an installation
    (pip, colcon) has them in ``share/xy_sysid`` of the prefix that holds the package.

    Raises BadInput if neither exists.
    """
    package = (start or Path(__file__)).resolve().parents[1]
    if (package.parent / "package.xml").is_file():
        return package.parent
    for prefix in package.parents:
        if (prefix / "share" / PACKAGE / "package.xml").is_file():
            return prefix / "share" / PACKAGE
    raise BadInput("installation", f"without share/{PACKAGE}", f"{PACKAGE} installed by pip or colcon", "Install it again.")


def find(name: str, folder: str = "config") -> Path:
    """A file by path, or by name among the files that come with the package.

    Raises BadInput that lists the existing names.
    """
    given = Path(name).expanduser()
    if given.is_file():
        return given
    there = share() / folder
    known = sorted(path.name for path in there.glob("*.yaml"))
    for candidate in (name, f"{name}.yaml"):
        if candidate in known:
            return there / candidate
    raise BadInput("file", repr(name), f"a file, or one of {', '.join(known)}", "Give one that exists.")
