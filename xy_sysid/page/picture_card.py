"""The figure cards of one axis: each figure with an explanation, and its content in words for screen readers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import plotly.graph_objects as go
from nicegui import ui

from xy_sysid.page.orders import Source
from xy_sysid.page.plot import Linked, Plot
from xy_sysid.page.session import Session
from xy_sysid.page.views import View
from xy_sysid.report import story_figures as draw

Document = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Picture:
    """One figure of a story; tab: its label among the card's tabs; height: of the figure, px."""

    name: str
    card: str
    tab: str
    figure: Callable[..., go.Figure]
    reading: str
    height: int


def aligned(make: Callable[..., go.Figure]) -> Callable[..., go.Figure]:
    """Wrap a figure function: fixed margins and the frequency range of the full response, so that stacked figures line up."""

    def made(document: Document, step: int | None = None) -> go.Figure:
        figure = make(document, step)
        frequency = [value for value in document["measured"]["frequency_response"]["frequency"] if value]
        figure.update_xaxes(range=[math.log10(frequency[0]) - 0.03, math.log10(frequency[-1]) + 0.03], autorange=None)
        figure.update_yaxes(automargin=False)
        figure.update_layout(margin={"l": 64, "r": 12})
        return figure

    return made


FREQUENCY, WHERE, TIME, ROOTS = "Measured and modelled over frequency", "The error in detail", "In time", "Poles and zeros"
PICTURES = (
    Picture(
        name="bode",
        card=FREQUENCY,
        tab="",
        figure=aligned(draw.bode),
        reading="Where the dashed model leaves the band of the measurement, an effect is missing. Grey crosses are noise.",
        height=420,
    ),
    Picture(
        name="coherence",
        card=FREQUENCY,
        tab="",
        figure=aligned(draw.coherence),
        reading="Near 1: the input explains the motion. Low: too little excitation, noise, or a nonlinearity.",
        height=220,
    ),
    Picture(
        name="residual_speed",
        card=WHERE,
        tab="speed",
        figure=draw.residual_speed,
        reading="A mean error that jumps at zero velocity: Coulomb friction. A mean that bends with speed: drag or saturation.",
        height=340,
    ),
    Picture(
        name="residual_position",
        card=WHERE,
        tab="position",
        figure=draw.residual_position,
        reading="Uneven along the travel: cogging, lead error, a stiffening end.",
        height=340,
    ),
    Picture(
        name="residual_time",
        card=WHERE,
        tab="time",
        figure=draw.residual_time,
        reading="Growing with time: warming, drift, or a loose part.",
        height=340,
    ),
    Picture(
        name="residual_correlation",
        card=WHERE,
        tab="correlation",
        figure=draw.residual_correlation,
        reading="Correlation with the input beyond the grey bounds: the model misses a linear effect or delay. Autocorrelation only: coloured noise.",
        height=380,
    ),
    Picture(
        name="zoom",
        card=TIME,
        tab="worst moment",
        figure=draw.zoom,
        reading="Measured and simulated around the largest error of the rigid model. Drag to zoom, double-click to go back.",
        height=360,
    ),
    Picture(
        name="velocity",
        card=TIME,
        tab="speed, all",
        figure=draw.velocity,
        reading="The whole record, as minimum and maximum of short intervals. Grey parts were held out of every fit.",
        height=220,
    ),
    Picture(
        name="position",
        card=TIME,
        tab="position, all",
        figure=draw.position,
        reading="Position, measured and integrated from the simulated speed. A slow drift is normal.",
        height=220,
    ),
    Picture(
        name="poles_zeros",
        card=ROOTS,
        tab="",
        figure=draw.poles_zeros,
        reading="Poles and zeros of the linear part. Crosses left of 0 are stable; close to the vertical axis they are lightly damped.",
        height=260,
    ),
)


class Cards:
    """All figures of the selected axis."""

    def __init__(self, session: Session, source: Source, beside: Plot, chosen: Sequence[str] = ()) -> None:
        """beside: the frequency plot of another card, which zooms with these; chosen: figures of the tabs that are open at first."""
        self._session, self._source, self._beside, self._wanted = session, source, beside, chosen
        self._bars: list[tuple[str, ui.tab_panels]] = []
        self._plots: dict[str, Plot] = {}
        self._cards: dict[str, ui.element] = {}
        for title in dict.fromkeys(picture.card for picture in PICTURES):
            with ui.element("section").classes("card").props(f'aria-label="{title}"') as card:
                ui.html(f"<h2>{title}</h2>", sanitize=False)
                self._fill([picture for picture in PICTURES if picture.card == title])
            self._cards[title] = card

    def chosen(self) -> tuple[str, ...]:
        """Figures of the open tabs, except the first tab of each card."""
        return tuple(str(panels.value) for first, panels in self._bars if panels.value != first)

    async def refresh(self, axis: str, view: View) -> None:
        """Draw again what has changed."""
        stamp = self._source.stamp(axis)  # read before the document: see StoryCard
        document = self._source.document(axis)
        for card in self._cards.values():
            card.set_visibility(not view.linear)
        if view.linear:
            return
        if document is None or not document["steps"]:
            for picture in PICTURES:
                self._plots[picture.name].wait(f"{picture.card}, {picture.name.replace('_', ' ')}, axis {axis}: not fitted yet.")
            return
        for picture in PICTURES:
            key = (self._source.key, axis, stamp, view.step, picture.name)
            await self._plots[picture.name].show(self._session, key, picture.figure, document, view.step)
            self._plots[picture.name].say(words(picture, document, view.step))

    def _fill(self, pictures: list[Picture]) -> None:
        tabs = [picture for picture in pictures if picture.tab]
        if not tabs:
            for picture in pictures:
                self._plots[picture.name] = Plot(picture.reading, picture.name, picture.height)
            if len(pictures) > 1:
                Linked([self._beside, *(self._plots[picture.name] for picture in pictures)])
            return
        with ui.tabs().props("dense no-caps align=left inline-label") as bar:
            for picture in tabs:
                ui.tab(picture.name, picture.tab)
        value = next((picture.name for picture in tabs if picture.name in self._wanted), tabs[0].name)
        panels = ui.tab_panels(bar, value=value, animated=False, keep_alive=True).props("animated=false").style("background: transparent")
        self._bars.append((tabs[0].name, panels))
        with panels:
            for picture in tabs:
                with ui.tab_panel(picture.name).style("padding: 0"):
                    self._plots[picture.name] = Plot(picture.reading, picture.name, picture.height)


def words(picture: Picture, document: Document, at: int | None = None) -> str:
    """The content of a figure in words, for screen readers."""
    step = document["steps"][-1 if at is None else at]
    failing = (step.get("pictures") or {}).get("failing") or []
    told = "; ".join(place["sentence"] for place in failing[:3]) or "nothing stands out"
    return f"{picture.card}, {picture.name.replace('_', ' ')}, axis {document['axis']}, model {step['label']}: {told}. {picture.reading}"
