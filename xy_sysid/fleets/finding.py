"""Folders and patterns -> recordings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from xy_sysid.errors import BadInput
from xy_sysid.imports.registry import BAGS, TABLES

UNASKED = (".json", ".jsonl", ".ndjson", ".txt", ".log", ".prn", ".parquet")  # in a folder these are rarely recordings
ENDINGS = tuple(ending for ending in (*BAGS, *TABLES) if ending and ending not in UNASKED)
METADATA = "metadata.yaml"


def recordings(paths: Iterable[Path | str], besides: Path | None = None) -> tuple[Path, ...]:
    """Every recording once, sorted by absolute path.

    paths: recordings; folders, which are searched for bags and for files with one of ``ENDINGS``; or patterns like data/*/2026*.csv
    besides: a folder that is not searched (the table itself)
    Raises BadInput for a path that does not exist, or if there is no recording.
    """
    found: dict[Path, None] = {}
    given, besides = [Path(path).absolute() for path in paths], besides.absolute() if besides is not None else None
    for path in given:
        matches = [path] if path.exists() else _matching(path)
        if not matches:
            raise BadInput("recordings", str(path), "a recording, a folder with recordings, or a pattern that matches some", "Check the path.")
        for match in matches:
            found |= dict.fromkeys(_below(match, besides))
    if not found and besides in given:
        raise BadInput("-o", str(besides), "another folder than that of the recordings", "Write for example: -o table.")
    if not found:
        what = f"number of recordings in {', '.join(map(str, given))}" if given else "number of paths"
        raise BadInput(what, 0, f"bags, or files that end with {', '.join(ENDINGS)}", "Check the path.")
    return tuple(sorted(found))


def _below(path: Path, besides: Path | None) -> Iterator[Path]:
    if not path.is_dir() or (path / METADATA).is_file():
        yield path
        return
    if path.absolute() == besides:
        return
    for item in sorted(path.iterdir()):
        if item.name.startswith((".", "_")):
            continue
        if item.is_dir():
            yield from _below(item, besides)
        elif item.suffix.lower() in ENDINGS:
            yield item


def _matching(pattern: Path) -> list[Path]:
    """Paths that match a pattern; none if it is not a pattern."""
    fixed = next((number for number, part in enumerate(pattern.parts) if any(sign in part for sign in "*?[")), None)
    if fixed is None:
        return []
    return sorted(Path(*pattern.parts[:fixed]).glob(str(Path(*pattern.parts[fixed:]))))
