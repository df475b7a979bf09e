"""The fleet's table: a folder with one Parquet file for each machine, every column with its unit and meaning in the file.

A file is written whole or not at all. Rows of one machine are sorted by axis, date and source, so that the same rows make the same file.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.bags.atomic import whole
from xy_sysid.bags.opening import regular_file
from xy_sysid.errors import BadRecording, MissingExtra
from xy_sysid.fleets.columns import Column, Kind, columns
from xy_sysid.fleets.row import Row

if TYPE_CHECKING:
    import pyarrow

ENDING = ".parquet"
NAMED = re.compile(r"[^\w.-]+")


def arrow() -> Any:
    """pyarrow. Raises MissingExtra where it is not installed."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingExtra("pyarrow, which writes and reads the fleet's table,", "fleet") from None
    return pyarrow


def schema(library: Library = STANDARD) -> pyarrow.Schema:
    """The columns as Parquet has them; unit and meaning are in the metadata of each field."""
    pa = arrow()
    kinds: Mapping[Kind, Any] = {
        "text": pa.string(),
        "number": pa.float64(),
        "count": pa.int64(),
        "truth": pa.bool_(),
        "date": pa.timestamp("us", tz="UTC"),
    }
    return pa.schema([pa.field(item.name, kinds[item.kind], metadata=_told(item)) for item in columns(library)])


def _told(item: Column) -> dict[str, str]:
    return {"unit": item.unit, "meaning": item.meaning}


def as_table(rows: Iterable[Row], library: Library = STANDARD) -> pyarrow.Table:
    """The rows in the table's order."""
    return arrow().Table.from_pylist(sorted(rows, key=_place), schema=schema(library))


def _place(row: Row) -> tuple[str, str, bool, datetime | None, str]:
    date = row.get("date")
    return row["machine"], row["axis"], date is not None, date or datetime.min, row["source"]


def write(table: pyarrow.Table, path: Path) -> None:
    """One Parquet file, whole or not at all. Raises BadRecording."""
    with whole(path) as part:
        arrow().parquet.write_table(table, part, compression="zstd")


def read(folder: Path, names: Sequence[str] | None = None) -> pyarrow.Table:
    """The table, sorted by machine, axis, date and source. names: of the columns that are wanted; None is all.

    Raises BadRecording for what is no table of a fleet.
    """
    pa = arrow()
    try:
        files = [folder] if folder.is_file() else sorted(folder.glob(f"*{ENDING}"))
        if not files:
            raise BadRecording(folder, "no Parquet files in it", "Make the table first: xy-sysid fleet PATH -o TABLE.")
        for file in files:
            regular_file(file)
        parts = [pa.parquet.read_table(file, partitioning=None) for file in files]
    except (OSError, pa.ArrowInvalid) as error:
        raise BadRecording(folder, f"cannot be read as Parquet ({str(error).splitlines()[0]})", "Make the table again with xy-sysid fleet.") from None
    found = pa.concat_tables(parts, promote_options="default")
    missing = [name for name in names or ("machine", "axis", "date") if name not in found.column_names]
    if missing:
        raise BadRecording(folder, f"no column {missing[0]!r}", "Give a table that xy-sysid fleet made.")
    return found.select(list(names)) if names is not None else found


def rows_in(path: Path) -> list[Row]:
    """The rows of one machine's file; none where there is no file."""
    return arrow().parquet.read_table(path, partitioning=None).to_pylist() if path.is_file() else []


def merged(folder: Path, rows: Iterable[Row], library: Library = STANDARD) -> None:
    """Put rows into the table. A recording replaces what is there of the same source, or of the same content and name."""
    new: dict[str, list[Row]] = {}
    for row in rows:
        new.setdefault(row["machine"], []).append(row)
    for machine, own in new.items():
        sources, keys = {row["source"] for row in own}, {row["key"] for row in own if row["key"]}
        path = folder / file_name(machine)
        kept = [row for row in rows_in(path) if row["source"] not in sources and row["key"] not in keys]
        write(as_table([*kept, *_each_once(own)], library), path)


def _each_once(rows: Sequence[Row]) -> list[Row]:
    """Of rows of the same axis of the same recording, be it in two places, the last."""
    return list({(row["key"] or row["source"], row["axis"]): row for row in rows}.values())


def file_name(machine: str) -> str:
    """Of a machine's file: its name, and where that is no file name, a hash that keeps it apart from others."""
    plain = NAMED.sub("_", machine).strip("._") or "machine"
    return f"{plain}{ENDING}" if plain == machine else f"{plain}-{hashlib.sha256(machine.encode()).hexdigest()[:8]}{ENDING}"


def rows_so_far(folder: Path, names: Sequence[str]) -> list[Row]:
    """The rows of a table with these columns; none where there is no table yet."""
    there = folder.is_dir() and any(folder.glob(f"*{ENDING}"))
    return read(folder, names).to_pylist() if there else []


def keys_of(rows: Iterable[Row]) -> dict[str, frozenset[str]]:
    """By the last part of their paths, which stays when a folder moves: the keys of recordings that are in the table."""
    found: dict[str, set[str]] = {}
    for row in rows:
        found.setdefault(Path(row["source"]).name, set()).add(row["key"])
    return {name: frozenset(keys) - {""} for name, keys in found.items()}
