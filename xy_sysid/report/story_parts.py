"""Shared parts of a story's figures: the document's rows as arrays, display units, floor lines, shaded places."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from xy_sysid.report.parts import rows, stretches
from xy_sysid.report.theme import FAILS, FLOOR, UNTRUSTED, fade
from xy_sysid.report.words import number
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import motion

Document = Mapping[str, Any]

AHEAD = "one sample ahead"  # in the label of a step whose error is a one-step prediction error, not one of a free simulation
WIDE, SENTENCE = 44, 47  # maximum letters in a line of a legend, and of a sentence
NAMED, LINE = 3, 14  # labelled places per figure, and px per line of small text
MARGIN = {"l": 8, "r": 10, "t": 30, "b": 8}
SMALL = 220  # px, height of a figure of one row


def row(values: Sequence[float | None] | None) -> FloatArray:
    """A row of the document as an array (k,); null becomes NaN, a missing row is empty."""
    return np.array([np.nan if value is None else value for value in values or ()], dtype=np.float64)


def pictured(document: Document, step: int | None = None) -> Mapping[str, Any] | None:
    """The requested step (None: the newest), or the newest earlier step that has figure data; None if there is none."""
    steps = list(document["steps"])
    if not steps:
        return None
    place = len(steps) - 1 if step is None else min(max(step, -len(steps)), len(steps) - 1) % len(steps)
    found: Mapping[str, Any] | None = next((item for item in reversed(steps[: place + 1]) if item["pictures"] is not None), None)
    return found


def speed_unit(document: Document) -> tuple[float, str]:
    """Factor and name of the display unit of errors: 1000 and mm/s for m."""
    return motion(document["units"].get("judged", f"{document['units']['output']}/s"))


def drawing(heights: list[float], height: int, mode: str, gap: float = 0.07, shared: bool = True) -> go.Figure:
    """An empty figure with narrow margins; heights: of its rows, fractions of the total."""
    figure = rows(len(heights), shared=shared, gap=gap, heights=heights, mode=mode)
    figure.update_layout(height=height, margin=MARGIN)
    figure.update_xaxes(zeroline=False)
    return figure


def nothing(sentence: str, mode: str) -> go.Figure:
    """An empty figure with a sentence that gives the reason."""
    figure = drawing([1.0], SMALL, mode)
    figure.update_xaxes(visible=False)
    figure.update_yaxes(visible=False)
    lines = textwrap.wrap(sentence, SENTENCE, break_long_words=False, break_on_hyphens=False)
    figure.add_annotation(text="<br>".join(lines), showarrow=False, xref="paper", yref="paper", x=0.5, y=0.5)
    return figure


def floor_line(figure: go.Figure, at: int = 1, label: str = "noise floor") -> None:
    """Draw a horizontal line at the noise floor of a logarithmic axis, with one label at its left end."""
    figure.add_hline(y=1.0, line={"color": FLOOR, "width": 1.5, "dash": "dot"}, row=at, col=1)
    figure.add_annotation(
        text=label, x=0, y=0.0, xref="x domain", yref=_axis("y", at), xanchor="left", yanchor="bottom", showarrow=False,
        font={"color": FLOOR, "size": 11},
    )  # fmt: skip


def shade(
    figure: go.Figure, places: Sequence[Mapping[str, Any]], ends: tuple[float, float], log: bool, scale: float = 1.0, named: int = NAMED
) -> None:
    """Shade failing places and label the first ``named`` with their size, each on its own line; ends: of the axis, in the document's unit."""
    low, high = ends
    for level, item in enumerate(places):
        first, last = max(float(item["from"]), low), min(float(item["to"]), high)
        if not last >= first:
            continue
        stretches(figure, [(first * scale, last * scale)], fade(FAILS, 0.13), row=1, line={"color": fade(FAILS, 0.5), "width": 1})
        if level >= named:
            continue
        middle = np.log10(np.sqrt(first * last) * scale) if log else 0.5 * (first + last) * scale
        left, right = (np.log10([low, high]) if log else np.array([low, high])) + (np.log10(scale) if log else 0.0)
        where = (middle - left) / max(right - left, 1e-300) if log else (middle / scale - low) / max(high - low, 1e-300)
        anchor = "left" if where < 0.25 else "right" if where > 0.75 else "center"
        text = f"fails: {number(float(item['error_over_floor']), 3)} × floor"
        figure.add_annotation(
            text=text, x=float(middle), xref="x", y=1, yref="y domain",
            yanchor="top", yshift=-LINE * level, xanchor=anchor, showarrow=False, font={"color": FAILS, "size": 11},
            hovertext=str(item["sentence"]),
        )  # fmt: skip


def ratio_axis(figure: go.Figure, values: Sequence[FloatArray], at: int = 1) -> None:
    """A log axis for errors divided by the noise floor. It always includes the floor and leaves room for labels above it."""
    known = np.concatenate([item[np.isfinite(item) & (item > 0)] for item in values]) if values else np.ones(1)
    low, high = (float(np.min(known)), float(np.max(known))) if known.size else (1.0, 1.0)
    bottom, top = np.log10(min(max(low, 0.03), 0.6)), np.log10(max(high, 3.0))
    figure.update_yaxes(
        title_text="error / floor", type="log", range=[bottom - 0.05, top + 0.25 * (top - bottom)], dtick="D2" if top - bottom < 1.6 else 1,
        tickformat="~g", row=at, col=1,
    )  # fmt: skip


def words(name: str) -> str:
    """coulomb_friction -> coulomb friction."""
    return name.replace("_", " ")


def legend_name(start: str, shown: Document) -> str:
    """The legend name of a model's curve: all effects of the model, wrapped to the width of a legend."""
    effects = ", ".join([words(str(name)) for name in shown["effects"]] + [AHEAD] * (AHEAD in str(shown["label"])))
    return "<br>".join(textwrap.wrap(f"{start} with {effects}", WIDE)) if effects else start


def shade_held_out(figure: go.Figure, document: Document, shown: Document, at: tuple[int, ...] = (1,)) -> None:
    """Shade held-out data in grey. The first span is labelled at the bottom of the first row."""
    time = document["measured"]["time"]
    ahead = AHEAD in str(shown["label"])
    spans = [(float(time["held_out_from"]), float(document["seconds"]))] if ahead else [(float(a), float(b)) for a, b in time["held_out"]]
    for row_ in at:
        stretches(figure, spans, fade(UNTRUSTED, 0.14), row=row_, layer="below")
    if spans:
        figure.add_annotation(
            text="grey: held out", x=0, xref="x domain", y=0, yref="y domain", xanchor="left", yanchor="bottom", showarrow=False, font={"size": 11}
        )


def grey() -> dict[str, Any]:
    """Marker style of untrusted values."""
    return {"color": fade(UNTRUSTED, 0.75), "size": 4, "symbol": "x-thin", "line": {"width": 1, "color": fade(UNTRUSTED, 0.75)}}


def _axis(letter: str, number: int) -> str:
    return letter if number == 1 else f"{letter}{number}"
