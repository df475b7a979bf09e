"""Dialog that assigns the columns of a table before it is opened: ``xy-sysid columns``, ``--map``, ``--unit``, ``--scale``, ``--rate`` by mouse."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from nicegui import run, ui
from nicegui.events import ValueChangeEventArguments

from xy_sysid.errors import BadInput, XySysidError
from xy_sysid.imports.reading import OF_AN_AXIS
from xy_sysid.page.beside import beside, waited
from xy_sysid.page.fields import on_press, typed
from xy_sysid.page.orders import Reading, read_so
from xy_sysid.page.session import Session

if TYPE_CHECKING:
    from xy_sysid.imports.listing import Listed, Listing

NONE = "(none)"
HEADS = ("column", "unit", "first", "least", "most", "looks like", "taken as")


@dataclass(frozen=True, slots=True)
class AxisColumns:
    """The choices for one axis; an empty unit means the file's unit, and an empty factor is 1. The reference is optional."""

    axis: str
    input: str
    output: str
    input_unit: str = ""
    output_unit: str = ""
    input_scale: str = ""
    output_scale: str = ""
    reference: str = ""


def reading_of(time: str, rate: float | None, axes: Sequence[AxisColumns], usual: Reading, time_unit: str = "") -> Reading:
    """Options for reading the file, for the worker and as command options. Raises BadInput for impossible choices."""
    if not time and not rate:
        raise BadInput("time", "no column and no rate", "a column, or a rate in Hz", "Choose the column that holds the time, or give the rate.")
    names = [one.axis for one in axes]
    if not names or not all(names) or len(set(names)) < len(names):
        raise BadInput("axes", ", ".join(names) or "none", "a different name for each axis", "Name the axes, for example x and y.")
    columns = {"time": time} if time else {}
    units = {"time": time_unit} if time and time_unit else {}
    scales: dict[str, str] = {}
    for one in axes:
        for role, column, unit, scale in (
            ("input", one.input, one.input_unit, one.input_scale),
            ("output", one.output, one.output_unit, one.output_scale),
            ("reference", one.reference, "", ""),
        ):
            what = f"{one.axis}.{role}"
            if column:
                columns[what] = column
            elif role != "reference":
                raise BadInput(f"{role} of {one.axis}", "not chosen", "a column", "Choose one.")
            units |= {what: unit} if unit else {}
            scales |= {what: scale} if scale else {}
    given = (("--map", columns), ("--unit", units), ("--scale", scales))
    words = [text for option, said in given for what, value in said.items() for text in (option, f"{what}={value}")]
    words += ["--rate", f"{rate:.15g}"] if rate else []
    return read_so(usual, words)


def guesses(found: Listing) -> tuple[str, list[AxisColumns]]:
    """(time, columns of each axis) as the file would be read without options; unknown columns are empty."""
    roles = {one.role: one.name for one in found.columns if one.role}
    axes = list(dict.fromkeys(role.rpartition(".")[0] for role in roles if "." in role)) or ["x"]
    clock = next((one.name for one in found.columns if one.looks.startswith("a clock")), "")

    def column(axis: str, role: str) -> str:
        return roles.get(f"{axis}.{role}", roles.get(role, ""))

    return roles.get("time", clock), [
        AxisColumns(axis, column(axis, "input"), column(axis, "output"), reference=column(axis, "reference")) for axis in axes
    ]


def usable(found: Listing) -> list[str]:
    """Names of numeric columns."""
    return [one.name for one in found.columns if one.looks not in ("words", "no numbers")]


async def columns_dialog(session: Session, name: str) -> None:
    """Show the columns of a table on the shelf, let the user assign them, and open the table."""
    found: Listing | None = await waited(session, f"Reading the columns of {name} ...", lambda: _listed(session.shelf.find(name)))
    if found is not None:
        ColumnsDialog(session, name, found)


class ColumnsDialog:
    """The table of columns, a row of choices for each axis, and Open."""

    def __init__(self, session: Session, name: str, found: Listing) -> None:
        self._session, self._name = session, name
        self._names = usable(found)
        self._rows: list[dict[str, Any]] = []
        time, axes = guesses(found)
        with ui.dialog() as self._dialog, ui.element("div").classes("card wide").props('data-part="columns"'):
            ui.html("<h2>Which column is what?</h2>", sanitize=False)
            told = f"reads as {found.reads}. Change what is wrong." if found.reads else "the names are unknown. Choose the columns and their units."
            ui.label(f"{name}: {told}").classes("soft small")
            heads = [{"name": head, "label": head, "field": head, "align": "left"} for head in HEADS]
            ui.table(columns=heads, rows=[dict(zip(HEADS, _cells(one), strict=True)) for one in found.columns]).props("dense flat").classes("columns")
            with ui.element("div").classes("buttons"):
                self._time = self._column("time", time)
                self._time_unit = _word("its unit", "s, ms, us ...", "time-unit")
                self._rate = typed(ui.number("or rate (Hz)", value=None, min=0)).props('outlined dense data-pick="rate"')
                files = [one for one in session.shelf.names(texts=True) if one != name]
                ui.select(files, label="columns of another file, too", with_input=True, on_change=self._more).props(
                    'outlined dense data-pick="other"'
                ).classes("pick").set_visibility(bool(files))
            self._axes = ui.element("div").classes("stack")
            for one in axes:
                self._add(one)
            with ui.element("div").classes("buttons"):
                on_press(ui.button("Open").props('unelevated data-pick="open"'), self._typed, self._open)
                ui.button("Another axis", on_click=lambda: self._add(AxisColumns("", "", ""))).props("flat")
                ui.button("Cancel", on_click=self._dialog.close).props("flat")
        self._dialog.on("hide", self._dialog.delete)
        self._dialog.open()

    def _column(self, role: str, value: str) -> ui.select:
        chosen = value if value in self._names else NONE
        return ui.select([NONE, *self._names], value=chosen, label=role).props(f'outlined dense data-pick="{role}"').classes("pick")

    async def _more(self, event: ValueChangeEventArguments[Any]) -> None:
        """Offer the columns of another file on the shelf, too."""
        other = str(event.value)
        found: Listing | None = await beside(self._session, lambda: run.io_bound(_listed, self._session.shelf.find(other)))
        if found is None:
            return
        folder = self._session.shelf.folder
        file = os.path.relpath(folder / other, (folder / self._name).parent)
        self._names += [name for one in usable(found) if (name := f"{file}:{one}") not in self._names]
        for pick in (self._time, *(row[role] for row in self._rows for role in OF_AN_AXIS)):
            pick.set_options([NONE, *self._names], value=pick.value)

    def _add(self, one: AxisColumns) -> None:
        with self._axes, ui.element("div").classes("buttons"):
            row = {
                "axis": typed(ui.input("axis", value=one.axis)).props('outlined dense data-pick="axis"').classes("narrow"),
                "input": self._column("input", one.input),
                "input_unit": _word("its unit", "V, A, N m ...", "input-unit"),
                "input_scale": _word("times", "1", "input-scale"),
                "output": self._column("output", one.output),
                "output_unit": _word("its unit", "mm, rad, m/s ...", "output-unit"),
                "output_scale": _word("times", "1", "output-scale"),
                "reference": self._column("reference", one.reference),
            }
        self._rows.append(row)

    def _typed(self) -> list[Any]:
        return [self._time_unit, self._rate, *(field for row in self._rows for field in row.values())]

    def _open(self) -> None:
        try:
            axes = [AxisColumns(**{name: _text(element.value) for name, element in row.items()}) for row in self._rows]
            reading = reading_of(_text(self._time.value), self._rate.value or None, axes, self._session.reading, _text(self._time_unit.value))
            path = self._session.shelf.find(self._name)
            self._session.shelf.beside(path, reading.load.get("columns", {}))
            self._session.open(path, self._name, reading)
        except XySysidError as problem:
            self._session.say(str(problem))
            ui.notify(str(problem), type="negative", multi_line=True)
            return
        self._dialog.close()


def _word(label: str, usual: str, pick: str) -> ui.input:
    return typed(ui.input(label, placeholder=usual)).props(f'outlined dense data-pick="{pick}"').classes("narrow")


def _listed(path: Any) -> Listing:
    from xy_sysid.imports.listing import listing

    return listing(path)


def _text(value: object) -> str:
    return "" if value is None or value == NONE else str(value).strip()


def _cells(one: Listed) -> tuple[str, ...]:
    figures = ("" if value is None else f"{value:.5g}" if isinstance(value, float) else str(value)[:40] for value in (one.first, one.low, one.high))
    return one.name, one.unit, *figures, one.looks, one.role
