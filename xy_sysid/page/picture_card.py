"""The cards of pictures of one axis: each with how to read it, and its content in words for who cannot see it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import plotly.graph_objects as go
from nicegui import events, run, ui

from xy_sysid.page.session import Session
from xy_sysid.page.wishes import Source
from xy_sysid.report import story_figures as draw

Document = Mapping[str, Any]
EMPTY = {"paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)"}
CONFIG = {"displaylogo": False, "responsive": True, "modeBarButtonsToRemove": ["select2d", "lasso2d", "autoScale2d"], "scrollZoom": False}


@dataclass(frozen=True, slots=True)
class Picture:
    """One picture of a story; tab: which of the card's pictures are chosen between; words: what it shows, for screen readers."""

    name: str
    card: str
    tab: str
    figure: Callable[..., go.Figure]
    reading: str


def aligned(make: Callable[..., go.Figure]) -> Callable[..., go.Figure]:
    """The figure with the frequencies of the whole response and with fixed margins, so that those under each other line up."""

    def made(document: Document) -> go.Figure:
        figure = make(document)
        frequency = [value for value in document["measured"]["frequency_response"]["frequency"] if value]
        figure.update_xaxes(range=[math.log10(frequency[0]) - 0.03, math.log10(frequency[-1]) + 0.03], autorange=None)
        figure.update_yaxes(automargin=False)
        figure.update_layout(margin={"l": 64, "r": 12})
        return figure

    return made


FREQUENCY, WHERE, TIME, ROOTS = "Measured and modelled over frequency", "Where the model fails", "In time", "Poles and zeros"
PICTURES = (
    Picture(
        "bode",
        FREQUENCY,
        "",
        aligned(draw.bode),
        "Where the dashed model leaves the band of the measurement, something is missing. Grey crosses are noise.",
    ),
    Picture(
        "coherence",
        FREQUENCY,
        "",
        aligned(draw.coherence),
        "Near 1: the voltage explains the motion. Low: too little excitation, noise, or something not linear.",
    ),
    Picture(
        "residual",
        FREQUENCY,
        "",
        aligned(draw.residual),
        "Error on data that no fit saw, in multiples of the noise floor. At 1 nothing is left; shaded bands fail.",
    ),
    Picture("residual_speed", WHERE, "speed", draw.residual_speed, "High at low speed: friction. Rising with speed: drag or saturation."),
    Picture("residual_position", WHERE, "position", draw.residual_position, "Uneven along the travel: cogging, lead error, a stiffening end."),
    Picture("residual_time", WHERE, "time", draw.residual_time, "Growing with time: something warms up, drifts or comes loose."),
    Picture(
        "zoom",
        TIME,
        "half a second",
        draw.zoom,
        "Measured and simulated around the largest error of the rigid model. Drag to zoom, double click to go back.",
    ),
    Picture(
        "velocity", TIME, "speed, all", draw.velocity, "The whole record, least and most of each stretch. The shaded part was held out of every fit."
    ),
    Picture(
        "position", TIME, "position, all", draw.position, "Position, measured and summed up from the simulated speed: a slow drift apart is usual."
    ),
    Picture("poles_zeros", ROOTS, "", draw.poles_zeros, "Of the linear part: crosses left of 0 are stable; close to the vertical axis they ring."),
)


class Cards:
    """All pictures of the axis that is shown."""

    def __init__(self, session: Session, source: Source) -> None:
        self._session, self._source = session, source
        self._plots: dict[str, Plot] = {}
        self._cards: dict[str, ui.element] = {}
        self._live = LiveCards(session) if source.live else None
        for title in dict.fromkeys(picture.card for picture in PICTURES):
            with ui.element("section").classes("card").props(f'aria-label="{title}"') as card:
                ui.html(f"<h2>{title}</h2>", sanitize=False)
                self._fill([picture for picture in PICTURES if picture.card == title])
            self._cards[title] = card

    async def refresh(self, axis: str) -> None:
        """Draw again what has changed."""
        if self._live is not None:
            await self._live.refresh(axis)
        stamp = self._source.stamp(axis)  # before the document: see StoryCard
        document = self._source.document(axis)
        there = document is not None and bool(document["steps"])
        for card in self._cards.values():
            card.set_visibility(there)
        if document is None or not there:
            return
        for picture in PICTURES:
            key = (self._source.key, axis, stamp, len(document["steps"]), picture.name)
            await self._plots[picture.name].show(self._session, key, picture.figure, document)
            self._plots[picture.name].say(words(picture, document))

    def _fill(self, pictures: list[Picture]) -> None:
        tabs = [picture for picture in pictures if picture.tab]
        if not tabs:
            for picture in pictures:
                self._plots[picture.name] = Plot(picture.reading, picture.name)
            if len(pictures) > 1:
                Linked([self._plots[picture.name] for picture in pictures])
            return
        with ui.tabs().props("dense no-caps align=left inline-label") as bar:
            for picture in tabs:
                ui.tab(picture.name, picture.tab)
        with ui.tab_panels(bar, value=tabs[0].name, animated=False, keep_alive=True).props("animated=false").style("background: transparent"):
            for picture in tabs:
                with ui.tab_panel(picture.name).style("padding: 0"):
                    self._plots[picture.name] = Plot(picture.reading, picture.name)


class Plot:
    """One figure in one browser, with how to read it and buttons to keep it."""

    def __init__(self, reading: str, name: str = "figure") -> None:
        self._shown: object = None
        self._said = ""
        with ui.element("div").classes("plot") as self.root:
            self.plot = ui.plotly({"data": [], "layout": {"height": 200, **EMPTY}, "config": CONFIG}).classes("plot").props("role=img tabindex=0")
            with ui.element("div").classes("under"):
                ui.label(reading).classes("soft small grow")
                for kind in ("svg", "png"):
                    keep = ui.button(kind.upper(), on_click=partial(self._keep, kind, name)).props("flat dense no-caps size=sm")
                    keep.props(f'aria-label="save {name} as {kind.upper()}"')

    async def show(self, session: Session, key: tuple[object, ...], make: Callable[..., go.Figure], *arguments: Any) -> None:
        """Draw it unless it is drawn already; made beside the page's loop, so that nothing waits for it."""
        if key == self._shown:
            return
        self._shown = key
        drawn = await run.io_bound(session.figure, key, lambda: plain(make(*arguments)))
        if drawn is not None:
            self.plot.update_figure(drawn)

    def say(self, words: str) -> None:
        """The picture's content in words."""
        if words != self._said:
            self._said = words
            self.plot.props["aria-label"] = words

    def _keep(self, kind: str, name: str) -> None:
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


def words(picture: Picture, document: Document) -> str:
    """What a picture shows, for a screen reader."""
    step = document["steps"][-1]
    failing = (step.get("pictures") or {}).get("failing") or []
    told = "; ".join(place["sentence"] for place in failing[:3]) or "nothing stands out"
    return f"{picture.card}, {picture.name.replace('_', ' ')}, axis {document['axis']}, model {step['label']}: {told}. {picture.reading}"


class LiveCards:
    """What the identifier publishes."""

    def __init__(self, session: Session) -> None:
        self._session = session
        with ui.element("section").classes("card").props('aria-label="frequency response, live"') as self._card:
            ui.html("<h2>Frequency response, live</h2>", sanitize=False)
            self._words = ui.label("").classes("soft")
            self._plot = Plot(
                "The band narrows as windows come in. Residual: distance of measurement and model in standard errors; above 2 is more than chance."
            )
        with ui.element("section").classes("card").props('aria-label="resonance over time"') as self._track_card:
            ui.html("<h2>Resonance over time</h2>", sanitize=False)
            self._track = Plot("Fitted from the newest windows alone. Two fits in a row away from the reference raise the alarm.", "resonance")

    async def refresh(self, axis: str) -> None:
        """Draw again what has changed."""
        from xy_sysid.page.live_figures import failing_words, response_figure, tracking_figure

        heard = self._session.heard
        key = ("live", axis, heard.version.get(f"axis {axis}", 0))
        frf, comparison = heard.arrays.get(f"frf/{axis}"), heard.arrays.get(f"comparison/{axis}")
        self._card.set_visibility(frf is not None)
        history = list(heard.resonances.get(axis, ()))
        self._track_card.set_visibility(len(history) > 1)
        if frf is not None:
            self._words.set_text(failing_words(comparison))
            await self._plot.show(self._session, key, response_figure, frf, comparison, heard.transfer_function(axis), heard.rate(axis))
            self._plot.say(f"Frequency response of axis {axis}, live. {failing_words(comparison)}")
        if len(history) > 1:
            await self._track.show(self._session, ("track", axis, len(history), history[-1].seconds), tracking_figure, history)
            self._track.say(f"Resonance of axis {axis}: {history[-1].frequency:.2f} Hz, reference {history[-1].reference:.2f} Hz")
