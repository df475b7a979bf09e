"""Columns of a file --> their roles: the time, and input, output and reference of each axis.

The user's choice (``Reading.columns``) has priority, then the contract's names (``time``, ``x_voltage``, ``x_position``), then the words of a
name; a note reports guesses.
"""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace

from xy_sysid.errors import BadRecording
from xy_sysid.imports.names import Meaning, by_unit, meaning, tells_time
from xy_sysid.imports.reading import OF_AN_AXIS, Reading
from xy_sysid.imports.sheet import Column, Sheet, spoken
from xy_sysid.samples.recording import SLOWEST
from xy_sysid.units import listed

CONTRACT: Mapping[str, tuple[str, ...]] = {
    "input": ("voltage", "u", "input"),
    "output": ("position", "y", "output"),
    "reference": ("reference", "r"),
}
WORDS: Mapping[str, str] = {"input": "voltage", "output": "position"}  # names of a missing role in an error
JOINT_WORDS = ({"joint"}, {"joint", "name"}, {"name"}, {"axis"}, {"axis", "name"}, {"achse"}, {"gelenk"}, {"joint", "id"})
EXAMPLE = "Name them with --map time=...,input=...,output=... (see xy-sysid columns FILE)."
Found = dict[str, Column]


@dataclass(frozen=True, slots=True)
class Roles:
    """Columns by role; guessed: whether a role was guessed from a name, which a note then reports."""

    time: Column | None
    seq: Column | None
    joint: Column | None
    inputs: Found
    outputs: Found
    references: Found
    guessed: bool

    def sides(self) -> tuple[tuple[str, Found], ...]:
        """Role and its columns by axis, for input, output and reference."""
        return ("input", self.inputs), ("output", self.outputs), ("reference", self.references)

    def of(self, axes: Sequence[str]) -> Roles:
        """The roles of some axes only."""
        inputs, outputs, references = ({axis: side[axis] for axis in axes if axis in side} for _, side in self.sides())
        return replace(self, inputs=inputs, outputs=outputs, references=references)


def assigned(sheet: Sheet, reading: Reading, notes: list[str]) -> Roles:
    """The columns of each role. Raises BadRecording if an input or output is missing or ambiguous."""
    said = {what: sheet.find(name) for what, name in reading.columns.items() if "." in what or what in ("time", "seq", "joint")}
    meanings = {column.name: understood for column in sheet.columns if (understood := meaning(column.name, column.unit)) is not None}
    found, guessed = _sides(sheet, reading, said, meanings, notes)
    pairs = _named(sheet, found, notes)
    own = any(column.clock is not None for column in pairs["output"].values())  # then no other column needs to be the time
    time, by_name = (said.get("time"), False) if own else _time(sheet, said, meanings, notes)
    counter = said.get("seq") or next((sheet.usable(column) for column in sheet.columns if column.name == "seq"), None)
    if not own and time is None and counter is None and sheet.fs is None and reading.rate is None:
        taken = {column.name for columns in pairs.values() for column in columns.values()}
        time = _by_steps(sheet, {*meanings, *taken}, notes)
    return Roles(
        time=time,
        seq=counter,
        joint=said.get("joint") or next((column for column in sheet.columns if column.words and set(spoken(column.name)) in JOINT_WORDS), None),
        inputs=pairs["input"],
        outputs=pairs["output"],
        references=pairs["reference"],
        guessed=guessed or by_name,
    )


def _sides(sheet: Sheet, reading: Reading, said: Found, meanings: Mapping[str, Meaning], notes: list[str]) -> tuple[dict[str, Found], bool]:
    """Input, output and reference of each axis: as chosen, by the contract's names, by words, or by units; and whether words were used."""
    found: dict[str, Found] = {}
    plain, guessed = _contract(sheet), False
    for role in OF_AN_AXIS:
        given = {what.rpartition(".")[0]: column for what, column in said.items() if what.endswith(f".{role}")}
        if role in reading.columns:
            given |= _of_any_axis(sheet, reading.columns[role])
        found[role] = given or {axis: sheet.usable(column) for axis, column in plain.get(role, {}).items()}
    if not _paired(found):
        for role in OF_AN_AXIS:
            if not any(what == role or what.endswith(f".{role}") for what in reading.columns):
                found[role], guessed = _by_words(sheet, meanings, role, notes) or found[role], True
    for role in ("input", "output"):
        found[role] = found[role] or _by_unit(sheet, meanings, role)
        if not found[role]:
            raise BadRecording(sheet.path, f"no {WORDS[role]} {sheet.kind}; {sheet.names()}", EXAMPLE)
    return found, guessed


def _time(sheet: Sheet, said: Found, meanings: Mapping[str, Meaning], notes: list[str]) -> tuple[Column | None, bool]:
    """The column of instants, and whether it was guessed from its name."""
    if "time" in said:
        return said["time"], False
    clocks = [column for column in sheet.columns if column.name in meanings and meanings[column.name].role == "time"]
    plain = next((column for column in sheet.columns if column.name in ("time", "t")), None)
    if plain is None and not clocks:
        return None, False
    taken = plain or clocks[0]
    others = [repr(column.name) for column in clocks if column is not taken]
    if others:
        notes.append(f"{taken.name!r} is taken as the time, not {', '.join(others)}; choose with --map time=...")
    return sheet.usable(taken), plain is None


def _by_steps(sheet: Sheet, known: Container[str], notes: list[str]) -> Column | None:
    """The only column without a meaning or role that rises evenly, by less than the longest period of an axis: it is used as the time, s."""
    rest = [column for column in sheet.columns if not column.unit and column.name not in known]
    clocks = [column for column in rest if 0.0 < column.step < 1.0 / SLOWEST]
    if len(clocks) != 1:
        return None
    name, step = clocks[0].name, clocks[0].step
    notes.append(f"{name!r} rises by {step:.6g} from row to row: it is used as the time, in s (another unit with --map time={name} --unit time=ms)")
    return sheet.usable(clocks[0])


def _contract(sheet: Sheet) -> dict[str, Found]:
    """Columns with the contract's own names, by role and axis."""
    found: dict[str, Found] = {}
    for role, endings in CONTRACT.items():
        for ending in endings:
            columns = _ending(sheet, ending)
            if columns:
                found[role] = columns
                break
    return found


def _ending(sheet: Sheet, ending: str) -> Found:
    """Columns named ``<axis>_<ending>``, or only ``ending``, which is the axis x."""
    found: Found = {}
    for column in sheet.columns:
        axis, _, last = column.name.rpartition("_")
        if last == ending and (axis or column.name == ending) and not tells_time(axis):
            found.setdefault(axis or "x", column)
    return found


def _of_any_axis(sheet: Sheet, name: str) -> Found:
    """The column of this name, or the columns of all axes whose names end in it."""
    if name not in [column.name for column in sheet.columns]:
        columns = _ending(sheet, name)
        if columns:
            return {axis: sheet.usable(column) for axis, column in columns.items()}
    return {"": sheet.find(name)}


def _paired(found: Mapping[str, Found]) -> bool:
    """Whether an axis has both input and output, or may have."""
    inputs, outputs = found["input"], found["output"]
    return bool(set(inputs) & set(outputs)) or (len(inputs) == len(outputs) == 1 and ("" in inputs or "" in outputs))


def _by_words(sheet: Sheet, meanings: Mapping[str, Meaning], role: str, notes: list[str]) -> Found:
    """The most likely column of a role, for each axis. Raises BadRecording if two are equally likely."""
    offers: dict[str, list[tuple[int, Column]]] = {}
    for column in sheet.columns:
        known = meanings.get(column.name)
        if known is not None and known.role == role and not column.words:
            offers.setdefault(known.axis, []).append((known.rank, column))
    found: Found = {}
    for axis, columns in offers.items():
        least = min(rank for rank, _ in columns)
        best = [column for rank, column in columns if rank == least]
        found[axis] = sheet.usable(best[0])
        if len(best) > 1 and role != "reference":
            names = listed([repr(column.name) for column in best])
            what = f"{axis}.{role}" if axis else role
            raise BadRecording(sheet.path, f"{names} may both be the {role}", f"Choose one with --map {what}={best[0].name!r}.")
        others = [column.name for rank, column in columns if rank > least]
        if others and role != "reference":
            notes.append(f"{best[0].name!r} is taken as the {role}, not {', '.join(map(repr, others))}; choose with --map")
    return found


def _by_unit(sheet: Sheet, meanings: Mapping[str, Meaning], role: str) -> Found:
    """The column that has a role by its unit or symbol alone; raises BadRecording if there are several."""
    columns = [column for column in sheet.columns if column.name not in meanings and not column.words and by_unit(column.name, column.unit) == role]
    if len(columns) > 1:
        names = listed([repr(column.name) for column in columns])
        raise BadRecording(sheet.path, f"{names} may both be the {role}", f"Choose one with --map {role}={columns[0].name!r}.")
    return {"": sheet.usable(columns[0])} if columns else {}


def _named(sheet: Sheet, found: dict[str, Found], notes: list[str]) -> dict[str, Found]:
    """The columns with a name for every axis; raises BadRecording if no axis has both input and output."""
    inputs, outputs = found["input"], found["output"]
    if len(inputs) == len(outputs) == 1 and set(inputs) != set(outputs) and ("" in inputs or "" in outputs or not _contract(sheet)):
        axis = next((name for name in (*outputs, *inputs) if name), "x")
        inputs, outputs = {axis: next(iter(inputs.values()))}, {axis: next(iter(outputs.values()))}
        references = found["reference"]
        found = {"input": inputs, "output": outputs, "reference": {axis: next(iter(references.values()))} if len(references) == 1 else references}
    axes = [axis for axis in found["input"] if axis in found["output"]]
    if not axes:
        raise BadRecording(sheet.path, f"no axis has both an input and an output; {sheet.names()}", EXAMPLE)
    if set(found["input"]) != set(found["output"]):
        have = f"{listed([_axis(axis) for axis in axes])} {'has' if len(axes) == 1 else 'have'}"
        notes.append(f"only {have} both an input and an output; the others are left out")
    return {role: {_axis(axis): column for axis, column in columns.items()} for role, columns in found.items()}


def _axis(name: str) -> str:
    return f"axis{name}" if name.isdigit() else name or "x"
