"""One figure in one browser, with an explanation and download buttons; and figures that zoom together."""

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
CONFIG = {"displayModeBar": False, "responsive": True, "scrollZoom": False}  # Plotly's toolbar would cover legends and labels
HIDDEN = {"visible": False}
KINDS = ("svg", "png", "csv")


class Plot:
    """One figure in one browser, with an explanation and download buttons."""

    def __init__(self, reading: str, name: str = "figure", height: int = 200) -> None:
        """height: of its figures, px; the space is reserved."""
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
        """Draw the figure unless it is already shown. It is computed outside the event loop, which therefore does not wait."""
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
        """Show an empty space; words: what the page waits for, for screen readers."""
        self.say(words)
        if self._shown is not None:
            self._shown, self._drawn = None, {}
            self.root.classes(add="awaited")
            self.plot.update_figure(self._empty)

    def say(self, words: str) -> None:
        """Set the figure's content in words."""
        if words != self._said:
            self._said = words
            self.plot.props["aria-label"] = words

    def _keep(self, kind: str, name: str) -> None:
        if kind == "csv":
            ui.download.content(table(self._drawn), f"xy_sysid_{name}.csv", "text/csv")
            return
        self.plot.run_plot_method("downloadImage", {"format": kind, "filename": f"xy_sysid_{name}", "scale": 1 if kind == "svg" else 2})


class Linked:
    """Plots over the same frequencies: zooming one zooms all."""

    def __init__(self, plots: list[Plot]) -> None:
        self._plots, self._range = plots, ""
        for plot in plots:
            plot.plot.on("plotly_relayout", partial(self._moved, plot))

    def _moved(self, source: Plot, event: events.GenericEventArguments) -> None:
        """Apply the zoom range of one plot to the others; they answer with the same range, which has no further effect."""
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
    """The figure as JSON for the browser; the user's zoom is kept."""
    figure.update_layout(uirevision="keep", **EMPTY)
    made: dict[str, Any] = figure.to_plotly_json()
    return {**made, "config": CONFIG}
