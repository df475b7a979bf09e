"""The trend of a fleet as one page that opens offline: the changes, and every parameter of every axis over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from xy_sysid.fleets.history import Axis
from xy_sysid.fleets.trends import Event, Trend, Trends
from xy_sysid.fleets.words import chance, clocked, day, gaps, percent, sentence, summary, told, widest
from xy_sysid.report.cover import Cover
from xy_sysid.report.parts import plain, rows
from xy_sysid.report.sheet import Drawing, block, listing, paragraph, section, table_html, whole
from xy_sysid.report.tables import Table
from xy_sysid.report.theme import AFTER, BEFORE, METHODS, axis_colour, fade
from xy_sysid.units import Units, readable

MOST = 4  # parameters drawn per event, the most certain first
ABOUT = (
    "Each point is the parameter of one recording. Its interval (95 %) holds the recording's own error and the spread between recordings of an "
    "axis that does not change, which is learned from all axes of the table. The vertical line is the first recording after a change, the "
    "shaded part the 95 % interval of that date."
)
OVER = "The same parameter of all axes, over its median before any change, in per cent. Coloured: the axes on which it changed, or the only axis."


def trend_page(found: Trends, title: str) -> str:
    """The whole page. title: name of the table."""
    axes = {(one.machine, one.axis): one for one in found.axes}
    drawings: list[Drawing] = []
    parts: list[str] = []
    for number, event in enumerate(found.events):
        axis = axes[event.machine, event.axis]
        name = f"{event.machine} {event.axis}"
        made = [Drawing(f"plot-event-{number}", axis_figure(_drawn(found, event), axis), f"The parameters of {name} over time")]
        drawings += made
        extra = listing(f"{told(one, axis)}; such evidence arises by chance {chance(one)}" for one in event.moved)
        heading = f"{name}, {day(event.since)}: {event.cause.cause if event.cause is not None else 'cause unknown'}"
        parts.append(section(f"event-{number}", heading, made, ABOUT if number == 0 else "", extra))
    columns = list(dict.fromkeys(one.history.column for one in found.trends))
    made = []
    for column in columns:
        own = [one for one in found.trends if one.history.column == column]
        made.append(Drawing(f"plot-{column}", overview_figure(own), f"{column} of all axes over time", column))
    drawings += made
    parts.append(section("all", "All axes", made, OVER))
    spreads = [(name, percent(between), percent(own)) for name, between, own in widest(found)]
    words = "Standard deviations, median over the axes. Where the first is larger, the interval of one recording is not valid for the next one."
    table = Table("", ("parameter", "between recordings", "within one recording"), tuple(spreads))
    parts.append(block("spread", "Spread between recordings", words, table_html(table)))
    head = [sentence(one, axes[one.machine, one.axis]) for one in found.events] or ["Nothing changed."]
    about = "".join(paragraph(text) for text in (f"{summary(found)}.", *gaps(found)))
    return whole(Cover(f"Trend of {title}"), f"<h1>Trend of {plain(title)}</h1>{about}{listing(head)}", parts, drawings)


def _drawn(found: Trends, event: Event) -> list[Trend]:
    wanted = [one.column for one in event.moved]
    own = [one for one in found.trends if (one.machine, one.axis) == (event.machine, event.axis) and one.history.column in wanted]
    return sorted(own, key=lambda one: wanted.index(one.history.column))[:MOST]


def axis_figure(trends: Sequence[Trend], axis: Axis) -> go.Figure:
    """Parameters of an axis over time, stacked, with their intervals and the dates of their changes."""
    figure = rows(max(len(trends), 1), shared=True, gap=0.06)
    for row, one in enumerate(trends, 1):
        history = one.history
        scale, unit = readable(Units(*axis.units).of(history.unit))
        value, low, high = scale * history.value, scale * one.low, scale * one.high
        error = {"type": "data", "symmetric": False, "array": high - value, "arrayminus": value - low, "thickness": 1.2, "width": 3}
        times, _ = clocked(history.dates)
        figure.add_scatter(
            x=times, y=value, error_y=error, mode="markers", marker={"color": BEFORE, "size": 7}, name="95 % with spread",
            legendgroup="all", showlegend=row == 1, row=row, col=1,
        )  # fmt: skip
        for change in one.moved:
            (first, last, since), _ = clocked((change.earliest, change.latest, change.since))
            figure.add_vrect(x0=first, x1=last, fillcolor=fade(AFTER, 0.15), line_width=0, row=row, col=1)
            figure.add_vline(x=since, line={"color": AFTER, "width": 1.5}, row=row, col=1)
        figure.update_yaxes(
            title_text=plain(f"{history.column}<br>({unit})" if unit else history.column).replace("&lt;br&gt;", "<br>"), row=row, col=1
        )
    if trends:
        figure.update_xaxes(title_text=clocked(trends[0].history.dates)[1], row=len(trends), col=1)
    return figure


def overview_figure(trends: Sequence[Trend], column: str = "") -> go.Figure:
    """One parameter of all axes, in per cent of its median before any change. column: its name, for the axis title."""
    figure = rows(1, shared=False, gap=0.1)
    coloured = 0
    for one in sorted(trends, key=lambda item: bool(item.moved)):
        history = one.history
        quiet = [value for date, value in zip(history.dates, history.value, strict=True) if not one.moved or date < one.moved[0].since]
        part = 100.0 * (history.value / float(np.median(quiet or history.value)) - 1.0)
        name = plain(f"{one.machine} {one.axis}")
        strong = bool(one.moved) or len(trends) == 1
        colour = axis_colour(coloured) if strong else fade(METHODS["measured"], 0.5)
        coloured += strong
        times, title = clocked(history.dates)
        figure.add_scatter(
            x=times, y=part, mode="lines+markers" if strong else "lines", name=name, showlegend=strong and len(trends) > 1,
            line={"color": colour, "width": 2.0 if strong else 1.0},
        )  # fmt: skip
        figure.update_xaxes(title_text=title)
    figure.update_yaxes(title_text=plain(f"{column} (%)" if column else "change (%)"))
    return figure
