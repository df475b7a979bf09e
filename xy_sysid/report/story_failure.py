"""Error divided by the noise floor by one variable, as small figures: four fit side by side on one scale."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import plotly.graph_objects as go

from xy_sysid.report.parts import frequency_axis, plain, positive, stretches
from xy_sysid.report.story_parts import Document, drawing, floor_line, nothing, pictured, row, shade, words
from xy_sysid.report.theme import FAILS, MODEL, UNTRUSTED, fade
from xy_sysid.report.words import number
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import motion

By = Literal["frequency", "speed", "position", "time"]
HEIGHT = 190  # px
SHADED = 3  # maximum shaded places of a kind


def failure(document: Document, by: By, step: int | None = None, mode: str = "light") -> go.Figure:
    """Error divided by the noise floor, by frequency, speed, position or time: the step's model, and the rigid model in grey.

    All four share one scale, set by the rigid model's largest error, so that the reader sees where and how far the error falls.
    """
    shown, base = pictured(document, step), pictured(document, 0)
    if shown is None or base is None:
        return nothing(document["sentence"], mode)
    figure = drawing([1.0], HEIGHT, mode)
    scale, unit = _people(document, by)
    curves = [(shown, MODEL, "solid", "this model")]
    if shown is not base:
        curves.insert(0, (base, UNTRUSTED, "dash", "rigid"))
    for item, colour, dash, name in curves:
        x, ratio = _curve(item, by)
        figure.add_scatter(
            x=x * scale, y=positive(ratio), mode="lines", line={"color": colour, "width": 2.0 if dash == "solid" else 1.4, "dash": dash},
            name=name, fill="tozeroy" if dash == "solid" else None, fillcolor=fade(colour, 0.12), row=1, col=1,
        )  # fmt: skip
    x, _ = _curve(shown, by)
    if x.size > 1:
        _places(figure, shown, by, (float(x[0]), float(x[-1])), scale)
    floor_line(figure, label="noise floor" if by == "frequency" else "")
    bottom, top = _ends(document)
    figure.update_yaxes(title_text="error / floor", type="log", range=[bottom, top], dtick=1 if top - bottom > 1.2 else "D2", tickformat="~g")
    if by == "frequency":
        frequency_axis(figure, 1, [x])
    else:
        figure.update_xaxes(title_text=f"{'velocity' if by == 'speed' else by} ({plain(unit)})")
    figure.update_layout(showlegend=False, margin={"l": 8, "r": 8, "t": 8, "b": 8})
    return figure


def _curve(step: Document, by: By) -> tuple[FloatArray, FloatArray]:
    picture = step["pictures"]["residual"][by]
    x, ratio = row(picture[by]), row(picture["error_over_floor"])
    if by == "frequency":
        inside = np.isfinite(ratio) & (x <= 1.05 * float(picture["up_to"]))
        return x[inside], ratio[inside]
    return x, ratio


def _people(document: Document, by: By) -> tuple[float, str]:
    output = document["units"]["output"]
    return {"frequency": (1.0, "Hz"), "speed": motion(f"{output}/s"), "position": motion(output), "time": (1.0, "s")}[by]


def _ends(document: Document) -> tuple[float, float]:
    """log10 of the ends of the common scale."""
    base = pictured(document, 0)
    assert base is not None
    highest = max(float(np.nanmax(_curve(base, by)[1], initial=2.0)) for by in ("frequency", "speed", "position", "time"))
    return -0.5, float(np.log10(max(highest, 3.0))) + 0.25


def _places(figure: go.Figure, step: Document, by: By, ends: tuple[float, float], scale: float) -> None:
    """Shade the places where the model fails; label the worst."""
    places: list[Any] = [item for item in step["pictures"]["failing"] if item["kind"] == by and item["to"] > item["from"]][:SHADED]
    if by == "speed":  # a place is a range of |speed|; the figure has signed velocity
        mirrored = [{**item, "from": -item["to"], "to": -item["from"]} for item in places]
        places = [{**a, "from": b["from"]} if a["from"] <= 0 else a for a, b in zip(places, mirrored, strict=True)] + [
            b for a, b in zip(places, mirrored, strict=True) if a["from"] > 0
        ]
    shade(figure, places[:1], ends, log=by == "frequency", scale=scale)
    others = ((max(float(item["from"]), ends[0]), min(float(item["to"]), ends[1])) for item in places[1:])
    stretches(figure, [(low * scale, high * scale) for low, high in others if high > low], fade(FAILS, 0.13))


def failure_words(document: Document, by: By, step: int | None = None) -> str:
    """The figure in words, for screen readers."""
    shown = pictured(document, step)
    if shown is None:
        return str(document["sentence"])
    _, ratio = _curve(shown, by)
    known = ratio[np.isfinite(ratio)]
    most = f"{number(float(known.max()), 2)} times the noise floor at most" if known.size else "not known"
    return f"Error over the noise floor by {by}, axis {document['axis']}, model {words(str(shown['label']))}: {most}."
