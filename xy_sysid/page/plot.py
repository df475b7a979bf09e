"""One figure in one browser, with how to read it and buttons to keep it; and figures that zoom together."""

from __future__ import annotations

from collections.abc import Callable
from contextvars import copy_context
from functools import partial
from typing import Any

import plotly.graph_objects as go
from nicegui import events, run, ui

from xy_sysid.page.session import Session
from xy_sysid.report.figure_data import table
from xy_sysid.units import chosen_units

EMPTY = {"paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)"}
CONFIG = {"displayModeBar": False, "responsive": True, "scrollZoom": False}  # its tools would lie over legends and words
HIDDEN = {"visible": False}
KINDS = ("svg", "png", "csv")


class Plot:
    """One figure in one browser, with how to read it and buttons to keep it."""

    def __init__(self, reading: str, name: str = "figure", height: int = 200) -> None:
        """height: px of the figures that it will show, kept free until then."""
        self._empty = {"data": [], "layout": {"height": height, "xaxis": HIDDEN, "yaxis": HIDDEN, **EMPTY}, "config": CONFIG}
        self._shown: object = None
        self._said = ""
        self._drawn: dict[str, Any] = {}
        with ui.element("div").classes("plot awaited") as self.root:
            self.plot = ui.plotly(self._empty).classes("plot").props("role=img tabindex=0").style(f"min-height:{height}px")
            with ui.element("div").classes("under"):
                ui.label(reading).classes("soft small grow")
                for kind in KINDS:
                    keep = ui.button(kind.upper(), on_click=partial(self._keep, kind, name)).props("flat dense no-caps size=sm")
                    keep.props(f'aria-label="save {name} as {kind.upper()}"')

    async def show(self, session: Session, key: tuple[object, ...], make: Callable[..., go.Figure], *arguments: Any, **named: Any) -> None:
        """Draw it unless it is drawn already; computed outside the page's loop, so that nothing waits for it."""
        key = (*key, chosen_units())
        if key == self._shown:
            return
        self._shown = key
        drawn = await run.io_bound(copy_context().run, session.figure, key, lambda: plain(make(*arguments, **named)))
        if drawn is not None:
            self._drawn = drawn
            self.root.classes(remove="awaited")
            self.plot.update_figure(drawn)

    def wait(self, words: str = "") -> None:
        """Show that there is nothing yet; words: what is waited for, for who cannot see it."""
        self.say(words)
        if self._shown is not None:
            self._shown, self._drawn = None, {}
            self.root.classes(add="awaited")
            self.plot.update_figure(self._empty)

    def say(self, words: str) -> None:
        """The picture's content in words."""
        if words != self._said:
            self._said = words
            self.plot.props["aria-label"] = words

    def _keep(self, kind: str, name: str) -> None:
        if kind == "csv":
            ui.download.content(table(self._drawn), f"xy_sysid_{name}.csv", "text/csv")
            return
        self.plot.run_plot_method("downloadImage", {"format": kind, "filename": f"xy_sysid_{name}", "scale": 1 if kind == "svg" else 2})


class Linked:
    """Plots over the same frequencies: who zooms one zooms all."""

    def __init__(self, plots: list[Plot]) -> None:
        self._plots, self._range = plots, ""
        for plot in plots:
            plot.plot.on("plotly_relayout", partial(self._moved, plot))

    def _moved(self, source: Plot, event: events.GenericEventArguments) -> None:
        """Give the others the range of the one that was moved; they answer with the same range, which changes nothing more."""
        ends = [event.args.get(f"{axis}.range[{end}]") for axis in ("xaxis2", "xaxis") for end in (0, 1)]
        found = next((pair for pair in (ends[:2], ends[2:]) if all(isinstance(value, (int, float)) for value in pair)), None)
        whole = bool(event.args.get("xaxis.autorange") or event.args.get("xaxis2.autorange"))
        if (found is None and not whole) or str(found) == self._range:
            return
        self._range = str(found)
        for plot in self._plots:
            if plot is not source:
                change = {"xaxis.autorange": True} if found is None else {"xaxis.range": found}
                plot.plot.run_plot_method("relayout", change)


def plain(figure: go.Figure) -> dict[str, Any]:
    """As the browser takes it; what the user has zoomed into stays."""
    figure.update_layout(uirevision="keep", **EMPTY)
    made: dict[str, Any] = figure.to_plotly_json()
    return {**made, "config": CONFIG}
