"""The fleet's table: a folder with one Parquet file for each machine, every column with its unit and meaning in the file.

A file is written completely or not at all. Rows of one machine are sorted by axis, date and source, so that equal rows give an equal file.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
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
ORDER = ["machine", "axis", "date", "source"]
KNOWS = ("source", "file_sha256", "date", "axis")  # columns that identify a recording
NAMED = re.compile(r"[^\w.-]+")
LONGEST = 255 - len(f"-01234567{ENDING}")  # bytes of a machine in a file name: file systems allow 255 with hash and ending


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
    """The rows in the table's order; columns unknown to the library, for example of another run's own effects, come last.

    A byte of a path that is not UTF-8 becomes a question mark, since Parquet cannot hold it.
    """
    pa, known = arrow(), schema(library)
    ordered = sorted(({name: _text(value) for name, value in row.items()} for row in rows), key=_place)
    others = dict.fromkeys(name for row in ordered for name in row if name not in known.names)
    more = [pa.field(name, pa.infer_type([row.get(name) for row in ordered])) for name in others]
    return pa.Table.from_pylist(ordered, schema=pa.schema([*known, *more]))


def _text(value: Any) -> Any:
    return value.encode(errors="replace").decode() if isinstance(value, str) else value


def _place(row: Row) -> tuple[str, str, bool, datetime | None, str]:
    date = row.get("date")
    return row["machine"], row["axis"], date is not None, date or datetime.min, row["source"]


def write(table: pyarrow.Table, path: Path) -> None:
    """Write one Parquet file, completely or not at all. Raises BadRecording."""
    with whole(path) as part:
        arrow().parquet.write_table(table, part, compression="zstd")


def read(folder: Path, names: Sequence[str] | None = None) -> pyarrow.Table:
    """The table, sorted by machine, axis, date and source. names: of the columns to read; None is all.

    Raises BadRecording if it is not a table of a fleet.
    """
    pa = arrow()
    if folder.is_file() and folder.suffix != ENDING:
        act = "Give the folder that xy-sysid fleet made; to compare the parts of one recording, add --every 10min."
        raise BadRecording(folder, "not a table of a fleet", act)
    files = _files(folder)
    if not files:
        problem = "no Parquet files in it" if folder.exists() else "does not exist"
        raise BadRecording(folder, problem, "Make the table first: xy-sysid fleet PATH -o TABLE.")
    parts = [_of_file(file) for file in files]
    try:
        found = pa.concat_tables(parts, promote_options="default")
    except pa.ArrowException as error:
        raise BadRecording(folder, f"its files do not fit together ({_first_line(error)})", "Give a table that xy-sysid fleet made.") from None
    missing = [name for name in names or ("machine", "axis", "date") if name not in found.column_names]
    if missing:
        raise BadRecording(folder, f"no column {missing[0]!r}", "Give a table that xy-sysid fleet made.")
    known = schema()
    kinds = [known.field(field.name) if field.name in known.names else field for field in found.schema]
    try:
        found = found.cast(pa.schema(kinds))
    except pa.ArrowException as error:
        raise BadRecording(folder, f"a column of another kind ({_first_line(error)})", "Give a table that xy-sysid fleet made.") from None
    return found.select(list(names)) if names is not None else found


def _files(folder: Path) -> list[Path]:
    """The Parquet files of a table. Raises BadRecording if it cannot be listed, or an entry is not a file."""
    try:
        files = [folder] if folder.is_file() else sorted(folder.glob(f"*{ENDING}"))
    except OSError as error:
        raise BadRecording(folder, f"cannot be read ({error.strerror or error})", "Check the path and the permissions.") from None
    for file in files:
        regular_file(file)
    return files


def _of_file(file: Path, names: Sequence[str] | None = None) -> pyarrow.Table:
    """A machine's file; names: of the columns to read if present, None is all. Raises BadRecording."""
    pa = arrow()
    try:
        return pa.parquet.read_table(file, columns=None if names is None else list(names), partitioning=None)
    except (OSError, pa.ArrowException) as error:
        act = "If xy-sysid fleet made it, move it away and run xy-sysid fleet again."
        raise BadRecording(file, f"cannot be read as Parquet ({_first_line(error)})", act) from None


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


def merged(folder: Path, rows: Iterable[Row], library: Library = STANDARD) -> None:
    """Merge rows into the table.

    A recording replaces rows of the same source, with any machine name, and rows of the same content and name under another
    source. Values that the new rows do not contain are kept, with their columns. If a machine's file cannot be read or written, the rows of all
    other machines are merged nevertheless, and then BadRecording is raised.
    """
    new: dict[str, list[Row]] = {}
    for row in rows:
        new.setdefault(row["machine"], []).append(row)
    sources = {row["source"] for own in new.values() for row in own}
    places = {folder / file_name(machine): own for machine, own in new.items()}
    problems = []
    for path in sorted({*_files(folder), *places}):
        try:
            _merged(path, sources, _each_once(places.get(path, [])), library)
        except BadRecording as problem:
            problems.append(problem)
    if problems:
        raise problems[0]


def _merged(path: Path, sources: Collection[str], own: Sequence[Row], library: Library) -> None:
    """Merge its own rows into a machine's file, and remove rows of ``sources``; a file without rows is removed."""
    stays = _stay(path, sources, own) if path.is_file() else []
    if own and any(stays):
        write(_together(_of_file(path).filter(stays), as_table(own, library)), path)
    elif own:
        write(as_table(own, library), path)
    elif not any(stays):
        path.unlink()
    elif not all(stays):
        write(_of_file(path).filter(stays), path)


def _stay(path: Path, sources: Collection[str], own: Sequence[Row]) -> list[bool]:
    """For each row of a machine's file, True if no new row of it, nor of the sources of all new rows, replaces it."""
    there = _of_file(path, KNOWS)
    if set(KNOWS) - {*there.column_names}:
        raise BadRecording(path, f"not all of the columns {', '.join(KNOWS)}", "Remove it, or choose another folder for the table.")
    copies = {tuple(row.get(name) for name in KNOWS[1:]) for row in own if row.get("file_sha256")}
    rows = zip(*(there[name].to_pylist() for name in KNOWS), strict=True)
    return [source not in sources and tuple(content) not in copies for source, *content in rows]


def _together(old: pyarrow.Table, new: pyarrow.Table) -> pyarrow.Table:
    """Rows of two tables in the table's order: columns of the newer one, then those that only the older one has, if not empty."""
    pa = arrow()
    others = [field for field in old.schema if field.name not in new.schema.names and old[field.name].null_count < len(old)]
    whole = pa.schema([*new.schema, *others])
    both = pa.concat_tables([_with(old, whole), _with(new, whole)])
    places = [_place(row) for row in both.select(ORDER).to_pylist()]
    return both.take(sorted(range(len(places)), key=places.__getitem__)).combine_chunks()


def _with(table: pyarrow.Table, whole: pyarrow.Schema) -> pyarrow.Table:
    """The table with these columns; missing ones are empty."""
    pa = arrow()
    arrays = [table[one.name].cast(one.type) if one.name in table.column_names else pa.nulls(len(table), one.type) for one in whole]
    return pa.Table.from_arrays(arrays, schema=whole)


def _each_once(rows: Iterable[Row]) -> list[Row]:
    """The last of all rows of the same axis, date and content, which may be stored in two places."""
    return list({(row.get("file_sha256") or row["source"], row.get("date"), row["axis"]): row for row in rows}.values())


def file_name(machine: str) -> str:
    """File name for a machine: its name, or a plain and possibly shorter form of it with a hash if the name is not a valid file name."""
    plain = NAMED.sub("_", machine).encode()[:LONGEST].decode(errors="ignore").strip("._") or "machine"
    return f"{plain}{ENDING}" if plain == machine else f"{plain}-{hashlib.sha256(machine.encode(errors='surrogateescape')).hexdigest()[:8]}{ENDING}"


def rows_so_far(folder: Path, names: Sequence[str]) -> list[Row]:
    """The rows of a table with these columns; empty if there is no table yet."""
    there = folder.is_dir() and any(folder.glob(f"*{ENDING}"))
    return read(folder, names).to_pylist() if there else []


class Known:
    """The keys of recordings in a table, by path."""

    def __init__(self, rows: Iterable[Row], given: Collection[str]) -> None:
        """given: requested paths. A recording with another path may have been moved: then the last parts of its path are equal."""
        found: dict[str | tuple[str, ...], set[str]] = {}
        for row in rows:
            source = str(row["source"])
            for place in (source,) if source in given else _ends(Path(source)):
                found.setdefault(place, set()).add(row["key"])
        self._keys = {place: frozenset(keys) - {""} for place, keys in found.items()}

    def of(self, path: Path) -> frozenset[str]:
        """The possible keys of a recording: few, even if many recordings have its name."""
        return next((self._keys[place] for place in (str(path), *_ends(path)) if place in self._keys), frozenset())


def _ends(path: Path) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return path.parts[-2:], path.parts[-1:]
