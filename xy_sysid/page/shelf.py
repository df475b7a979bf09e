"""The folder whose recordings the page may open and to which it may record. Names from a browser are looked up, never joined to a path."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from xy_sysid.errors import BadInput
from xy_sysid.imports.registry import TABLES
from xy_sysid.imports.several_files import others

TEXTS = (".txt", ".log", ".json")  # rarely recordings: listed on request only
LISTED = (*(ending for ending in TABLES if ending not in TEXTS), ".mcap", ".db3")
MOST = 200  # recordings listed
DEEP = 2  # folder levels that are searched, including the shelf itself
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")


class Shelf:
    """The recordings of one folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()

    def names(self, texts: bool = False) -> list[str]:
        """Recordings: bags (folders with a metadata.yaml) and tables, by their path below the folder. texts: include those of TEXTS."""
        found: list[str] = []
        self._look(self.folder, DEEP, found, (*LISTED, *TEXTS) if texts else LISTED)
        return sorted(found)[:MOST]

    def _look(self, folder: Path, deep: int, found: list[str], endings: tuple[str, ...]) -> None:
        try:
            entries = sorted(folder.iterdir())
        except OSError:
            return
        for entry in entries:
            if entry.name.startswith(".") or entry.is_symlink():
                continue
            name = str(entry.relative_to(self.folder))
            if entry.is_dir():
                if (entry / "metadata.yaml").is_file():
                    found.append(name)
                elif deep > 1 and len(found) < MOST:
                    self._look(entry, deep - 1, found, endings)
            elif entry.suffix.lower() in endings:
                found.append(name)

    def find(self, name: str) -> Path:
        """The recording of that name; raises BadInput for a name that is not in the list, including a path that leads elsewhere."""
        if name not in self.names(texts=True):
            raise BadInput("recording", repr(name[:80]), f"one of the list of {self.folder.name}", "Choose one.")
        return self.folder / name

    def beside(self, path: Path, columns: Mapping[str, str]) -> None:
        """Raises BadInput if one of the columns (FILE:COLUMN) is in a file that is not in the list."""
        here = {self.folder / name for name in self.names(texts=True)}
        for other in others(path, columns):
            if other not in here:
                raise BadInput("file of a column", repr(other.name[:80]), f"one of the list of {self.folder.name}", "Choose one.")

    def new(self, name: str) -> Path:
        """The path of a new bag with that name; raises BadInput unless it is a plain name that is not in use."""
        if not NAME.fullmatch(name):
            raise BadInput("name of the bag", repr(name[:80]), "1 to 64 letters, digits, - _ and . (no folders)", "Give another name.")
        path = self.folder / name
        if path.exists() or path.is_symlink():
            raise BadInput("name of the bag", repr(name), "a name that does not exist", "Give another name.")
        return path
