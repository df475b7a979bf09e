"""The trend of a fleet as one page that opens offline: the changes, and every parameter of every axis over time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from textwrap import wrap
from typing import Any, TypeVar

import numpy as np
import plotly.graph_objects as go

from xy_sysid.fleets.history import Axis, History
from xy_sysid.fleets.trends import Event, Trend, Trends
from xy_sysid.fleets.words import chance, clocked, day, gaps, percent, sentence, summary, told, widest
from xy_sysid.report.cover import Cover
from xy_sysid.report.parts import plain, rows
from xy_sysid.report.sheet import Drawing, block, chosen, listing, paragraph, section, table_html, whole
from xy_sysid.report.tables import Table
from xy_sysid.report.theme import AFTER, AXES, BEFORE, METHODS, axis_colour, fade
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import Units, readable

Key = TypeVar("Key")
HEIGHT = 160  # px of a row of a figure
TITLE = 38  # px between the rows of a figure, for the name of the lower one
NARROW = 36  # characters of a line of the legend
MOST = 4  # parameters drawn per event, the most certain first
ABOUT = (
    "Each point is the parameter of one recording. Its interval (95 %) holds the recording's own error and the spread between recordings of an "
    "axis that does not change, which is learned from all axes of the table. The vertical line is the first recording after a change, the "
    "shaded part the 95 % interval of that date."
)
OVER = (
    "The same parameter of all axes, over its median before any change, in per cent. Coloured, with 95 % intervals: the axes on which it changed, "
    f"or all axes if there are at most {len(AXES)}. Point at a grey line to see the name of its axis."
)


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
    each = grouped(found.trends, lambda one: (one.machine, one.axis))
    alike = grouped(sorted(found.trends, key=lambda one: not one.moved), lambda one: one.history.column)
    machines: dict[str, list[Drawing]] = {}
    for number, (key, own) in enumerate(each.items()):
        drawn = Drawing(f"axis-{number}", axis_figure(own, axes[key]), f"The parameters of {' '.join(key)} over time", f"Axis {key[1]}")
        machines.setdefault(key[0], []).append(drawn)
    over = {column: [Drawing(f"plot-{column}", overview_figure(own), f"{column} of all axes over time")] for column, own in alike.items()}
    drawings += [one for made in (*machines.values(), *over.values()) for one in made]
    parts += [chosen("machines", "One machine", "machine", machines, ABOUT), chosen("all", "All axes", "parameter", over, OVER)]
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


def grouped(trends: Iterable[Trend], key: Callable[[Trend], Key]) -> dict[Key, list[Trend]]:
    """The trends with each key, in order."""
    found: dict[Key, list[Trend]] = {}
    for one in trends:
        found.setdefault(key(one), []).append(one)
    return found


def axis_figure(trends: Sequence[Trend], axis: Axis) -> go.Figure:
    """Parameters of an axis over time, stacked, with their intervals and the dates of their changes. Each row has its name above it."""
    count = max(len(trends), 1)
    figure = rows(count, shared=True, gap=TITLE / HEIGHT / count)
    curves, names = [], []
    for row, one in enumerate(trends, 1):
        history, number = one.history, "" if row == 1 else str(row)
        scale, unit = readable(Units(*axis.units).of(history.unit))
        value = scale * history.value
        name = plain(f"{history.column} ({unit})" if unit else history.column)
        curves.append(
            go.Scatter(
                x=clocked(history.dates)[0], y=value, error_y=_interval(value, scale * one.low, scale * one.high), mode="markers",
                marker={"color": BEFORE, "size": 7}, name=name, meta={"y": "value"}, showlegend=False, xaxis=f"x{number}", yaxis=f"y{number}",
            )
        )  # fmt: skip
        above = {"x": 0, "y": 1, "xref": "paper", "yref": f"y{number} domain", "xanchor": "left", "yanchor": "bottom", "showarrow": False}
        names.append({"text": name, **above})
    figure.add_traces(curves)
    for row, change in ((row, change) for row, one in enumerate(trends, 1) for change in one.moved):
        (first, last, since), _ = clocked((change.earliest, change.latest, change.since))
        figure.add_vrect(x0=first, x1=last, fillcolor=fade(AFTER, 0.15), line_width=0, row=row, col=1)
        figure.add_vline(x=since, line={"color": AFTER, "width": 1.5}, row=row, col=1)
    figure.update_layout(annotations=names, height=HEIGHT * count + 90)
    if trends:
        _times(figure, trends[0].history)
    return figure


def _times(figure: go.Figure, history: History) -> None:
    """Name the lowest time axis; without a name it has dates, which are no numbers under the mouse either."""
    title = clocked(history.dates)[1]
    if not title:
        figure.update_xaxes(hoverformat="")
    figure.update_xaxes(title_text=title, selector=-1)


def _interval(value: FloatArray, low: FloatArray, high: FloatArray) -> dict[str, Any]:
    return {"type": "data", "symmetric": False, "array": high - value, "arrayminus": value - low, "thickness": 1.2, "width": 3}


def overview_figure(trends: Sequence[Trend], column: str = "") -> go.Figure:
    """One parameter of all axes, in per cent of its median before any change. column: its name, for the axis title."""
    figure = rows(1, shared=False, gap=0.1)
    few = len(trends) <= len(AXES)
    coloured, quiet = [one for one in trends if few or one.moved], [one for one in trends if not few and not one.moved]
    if quiet:
        times: list[Any] = []
        part: list[float | None] = []
        for one in quiet:
            times += [*clocked(one.history.dates)[0], None]
            part += [*_part(one, one.history.value), None]
        names = [plain(f"{one.machine} {one.axis}") for one in quiet for _ in (*one.history.dates, "")]
        line = {"color": fade(METHODS["measured"], 0.5), "width": 1.0}
        figure.add_scatter(x=times, y=part, text=names, mode="lines", line=line, name="other axes", showlegend=bool(coloured))
    for number, one in enumerate(coloured):
        value, low, high = _part(one, one.history.value), _part(one, one.low), _part(one, one.high)
        figure.add_scatter(
            x=clocked(one.history.dates)[0], y=value, error_y=_interval(value, np.minimum(low, high), np.maximum(low, high)),
            mode="lines+markers", name=wrapped(f"{one.machine} {one.axis}"), showlegend=len(trends) > 1,
            line={"color": axis_colour(number), "width": 2.0},
        )  # fmt: skip
    _times(figure, trends[0].history)
    figure.update_yaxes(title_text=plain(f"{column} (%)" if column else "change (%)"))
    return figure


def wrapped(name: str) -> str:
    """A name in lines that fit into the legend of a narrow figure."""
    return "<br>".join(plain(line) for line in wrap(name, NARROW))


def _part(one: Trend, values: FloatArray) -> FloatArray:
    """Values in per cent above the median before any change; over the interval's width where that is 0."""
    history = one.history
    before = [value for date, value in zip(history.dates, history.value, strict=True) if not one.moved or date < one.moved[0].since]
    usual = float(np.median(before or history.value))
    return np.asarray(100.0 * (values - usual) / (usual or history.level))
