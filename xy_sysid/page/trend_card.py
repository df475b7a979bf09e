"""The trend of a fleet's table: changes and causes, and every parameter of an axis over time, in the words of ``xy-sysid trend``."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import run, ui

from xy_sysid.errors import BadInput
from xy_sysid.page.beside import beside, returned
from xy_sysid.page.plot import Plot
from xy_sysid.page.session import Session
from xy_sysid.page.shelf import Shelf

if TYPE_CHECKING:
    from xy_sysid.fleets.history import Axis
    from xy_sysid.fleets.trends import Trend, Trends

MOST = 4  # maximum number of parameters drawn at a time
DEEP = 2  # folder levels below the shelf that are searched
ABOUT = (
    "Each point is the parameter of one recording. Its 95 % interval holds the recording's own error and the spread between recordings. "
    "The vertical line is the first recording after a change, the shaded part the 95 % interval of that date."
)
OVER = (
    "The change of the parameter, in per cent of its median before any change. Coloured, with 95 % intervals: the axes on which it changed, or all "
    "axes if there are few. Point at a grey line to see the name of its axis."
)


class TrendCard:
    """Tables of the shelf, and the trend of the open one; shown if the shelf has a table."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._found: Trends | None = None
        self._name = ""
        names = tables(session.shelf)
        with ui.element("section").classes("card trend").props('id=trend aria-label="trend"') as card:
            ui.html("<h2>Trend</h2>", sanitize=False)
            with ui.element("div").classes("buttons"):
                self._table = ui.select(names, value=names[0] if names else None, label="table").props('outlined dense data-part="table"')
                self._table.classes("pick")
                self._open = ui.button("Compare recordings", on_click=self._compare).props("outline dense data-act=trend")
            self._wait = ui.linear_progress(show_value=False).props('indeterminate aria-label="comparing recordings"')
            self._summary = ui.label("").props("role=status data-part=summary")
            self._events = ui.element("ul").classes("events")
            with ui.element("div").classes("buttons") as self._choose:
                self._axis = ui.select({}, label="axis", on_change=self._turn).props('outlined dense data-part="trend axis"').classes("pick")
                self._columns = ui.select([], multiple=True, value=[], label="parameters", on_change=self._draw)
                self._columns.props('outlined dense use-chips data-part="trend parameters"').classes("pick grow")
            self._own = Plot(ABOUT, "trend", 250)
            self._over = ui.label("").props('data-part="trend of all axes"')
            self._all = Plot(OVER, "trend_of_all_axes", 280)
        card.set_visibility(bool(names))
        self._show(False)

    async def _compare(self) -> None:
        """Compute the trend of the chosen table in a separate process, so that STOP and the page do not wait."""
        self._show(False)
        self._wait.set_visibility(True)
        self._open.disable()
        name = str(self._table.value)
        self._found = await beside(self._session, lambda: run.cpu_bound(returned, found, find(self._session.shelf, name)))
        self._name = name
        self._wait.set_visibility(False)
        self._open.enable()
        if self._found is not None:
            await self._tell(self._found)

    async def _tell(self, trends: Trends) -> None:
        from xy_sysid.fleets.words import gaps, sentence, summary

        axes = {key(one): one for one in trends.axes}
        self._summary.set_text(" ".join((f"{self._name}: {summary(trends)}.", *gaps(trends))))
        self._events.clear()
        with self._events:
            for text in [sentence(event, axes[f"{event.machine} {event.axis}"]) for event in trends.events] or ["Nothing changed."]:
                with ui.element("li"):
                    ui.label(text)
        drawn = [name for name, one in axes.items() if one.histories]
        first = next((name for one in trends.events if (name := f"{one.machine} {one.axis}") in drawn), drawn[0])
        self._show(True)
        self._axis.set_options(drawn, value=None)
        self._axis.set_value(first)

    def _show(self, answered: bool) -> None:
        self._wait.set_visibility(False)
        for part in (self._summary, self._events, self._choose, self._own.root, self._over, self._all.root):
            part.set_visibility(answered)

    def _turn(self) -> None:
        """Select another axis: its changed parameters, or the first ones."""
        if self._found is None or self._axis.value is None:
            return
        own = trends_of(self._found, str(self._axis.value))
        moved = [one.history.column for one in own if one.moved]
        names = [one.history.column for one in own]
        self._columns.set_options(names, value=(moved or names)[:MOST])

    async def _draw(self) -> None:
        if self._found is None or self._axis.value is None or not self._columns.value:
            return
        from xy_sysid.report.trend_page import axis_figure, overview_figure

        name, wanted = str(self._axis.value), list(self._columns.value)[:MOST]
        own = [one for one in trends_of(self._found, name) if one.history.column in wanted]
        if not own:
            return
        axis = next(one for one in self._found.axes if key(one) == name)
        stamp = id(self._found)
        await self._own.show(self._session, ("trend", stamp, name, *wanted), axis_figure, own, axis)
        self._own.say(f"{', '.join(one.history.column for one in own)} of {name} over time. {ABOUT}")
        column = own[0].history.column
        alike = [one for one in self._found.trends if one.history.column == column]
        await self._all.show(self._session, ("trend of all", stamp, column), overview_figure, alike)
        self._over.set_text(f"{column} of all axes")
        self._all.say(f"{column} of all axes over time. {OVER}")


def found(folder: Path) -> Trends:
    """The trend of a table; may run in any process. Raises BadRecording or BadInput."""
    from xy_sysid.fleets.trends import trend

    return trend(folder)


def key(axis: Axis) -> str:
    """Display name of an axis."""
    return f"{axis.machine} {axis.axis}"


def trends_of(trends: Trends, name: str) -> Sequence[Trend]:
    """The parameters of an axis."""
    return [one for one in trends.trends if f"{one.machine} {one.axis}" == name]


def tables(shelf: Shelf) -> list[str]:
    """Folders below the shelf that hold only Parquet files, as a fleet's table does; the shelf itself is '.'."""
    return sorted(str(folder.relative_to(shelf.folder)) for folder in _tables(shelf.folder, DEEP))


def _tables(folder: Path, deep: int) -> Iterator[Path]:
    """Find tables by names and file types alone; opens no file."""
    try:
        with os.scandir(folder) as entries:
            seen = [entry for entry in entries if not entry.name.startswith(".")]
    except OSError:
        return
    folders = [entry.name for entry in seen if entry.is_dir(follow_symlinks=False)]
    files = {entry.name for entry in seen} - set(folders)
    if files and all(name.endswith(".parquet") for name in files):
        yield folder
    for name in folders if deep else ():
        yield from _tables(folder / name, deep - 1)


def find(shelf: Shelf, name: str) -> Path:
    """The table of that name; raises BadInput for a name that is not in the list."""
    if name not in tables(shelf):
        raise BadInput("table", repr(name[:80]), f"one of the list of {shelf.folder.name}", "Choose one.")
    return shelf.folder / name
