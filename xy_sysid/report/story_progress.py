"""Story figures of progress: errors of all steps, two steps overlaid, and the candidates with their errors."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go

from xy_sysid.report.parts import frequency_axis, plain, positive
from xy_sysid.report.story_parts import LINE, Document, drawing, floor_line, legend_name, nothing, pictured, ratio_axis, row, speed_unit, words
from xy_sysid.report.theme import AFTER, BEFORE, FLOOR, MODEL, UNTRUSTED, fade
from xy_sysid.report.words import number, quantity

LOWEST = 170  # px, least height of the candidates figure: a lower one has no room for the axis title
LEAST = 0.35  # decades on each side, so that a scale has at least two labelled ticks
WIDE = 14  # letters of a label below a step; Plotly does not draw a label that crosses the edge


def ladder(document: Document, mode: str = "light") -> go.Figure:
    """Training error, held-out error and noise floor of all steps, as a falling staircase."""
    rungs = list(document["ladder"])
    if not rungs:
        return nothing(document["sentence"], mode)
    scale, unit = speed_unit(document)
    count = len(rungs)
    edges = np.repeat(np.arange(count + 1) - 0.5, 2)[1:-1]
    steps = {"x": "step ({})".format("; ".join(f"{place}: {words(str(item['label']))}" for place, item in enumerate(rungs)))}  # for a table
    errors = {name: np.repeat([float(item[name]) for item in rungs], 2) * scale for name in ("noise_floor", "train_error", "held_out_error")}
    figure = drawing([1.0], 320, mode)
    dotted = {"color": FLOOR, "width": 2, "dash": "dot"}
    figure.add_scatter(x=edges, y=errors["noise_floor"], mode="lines", line=dotted, name="noise floor", hoverinfo="y+name", meta=steps)
    figure.add_scatter(
        x=edges, y=errors["held_out_error"], mode="lines", line={"color": MODEL, "width": 3}, fill="tonexty", fillcolor=fade(MODEL, 0.13),
        name="held-out error", hoverinfo="y+name", meta=steps,
    )  # fmt: skip
    figure.add_scatter(
        x=edges,
        y=errors["train_error"],
        mode="lines",
        line={"color": BEFORE, "width": 1.6, "dash": "dash"},
        name="training error",
        hoverinfo="y+name",
        meta=steps,
    )
    for place, item in enumerate(rungs):
        value = float(item["held_out_error"]) * scale
        above = max(value, float(item["train_error"]) * scale)
        figure.add_annotation(
            text=f"<b>{number(value, 3)}</b>" + (" ✓" if item["explained"] else ""),
            x=place,
            y=np.log10(above),
            yanchor="bottom",
            yshift=3,
            showarrow=False,
        )
    known = np.concatenate([values[np.isfinite(values) & (values > 0)] for values in errors.values()])
    bottom, top = np.log10(float(known.min())), np.log10(float(known.max()))
    middle, half = 0.5 * (bottom + top), max(0.5 * (top - bottom), LEAST)
    bottom, top, room = middle - half, middle + half, 2.0 * half
    figure.update_yaxes(
        title_text=f"rms error ({plain(unit)})", type="log", range=[bottom - 0.12 * room, top + 0.2 * room], dtick="D2" if room < 1.5 else 1,
        tickformat="~g", row=1, col=1,
    )  # fmt: skip
    figure.update_xaxes(
        tickvals=list(range(count)), ticktext=[_in_lines(item) for item in rungs], tickangle=0, range=[-0.55, count - 0.45], row=1, col=1
    )
    return figure


def before_after(document: Document, first: int = 0, last: int | None = None, mode: str = "light") -> go.Figure:
    """Two steps overlaid: error divided by the noise floor by frequency, and the error in time around the rigid model's largest error."""
    before, after = pictured(document, first), pictured(document, last)
    if before is None or after is None:
        return nothing(document["sentence"], mode)
    scale, unit = speed_unit(document)
    figure = drawing([0.55, 0.45], 460, mode, gap=0.17, shared=False)
    measured = row(document["measured"]["zoom"]["velocity"])
    time = float(document["measured"]["zoom"]["start"]) + np.arange(measured.size) / float(document["sampling_rate"])
    ratios = []
    for shown, colour, dash, name in ((before, BEFORE, "dash", "before"), (after, AFTER, "solid", "after")):
        picture = shown["pictures"]["residual"]["frequency"]
        frequency, ratio = row(picture["frequency"]), row(picture["error_over_floor"])
        known = np.isfinite(ratio)
        ratios.append(ratio)
        line = {"color": colour, "width": 1.8, "dash": dash}
        figure.add_scatter(
            x=frequency[known],
            y=positive(ratio[known]),
            mode="lines",
            line=line,
            name=_of_step(name, shown),
            legendgroup=name,
            row=1,
            col=1,
        )
        error, thin = (measured - row(shown["pictures"]["zoom"]["velocity"])) * scale, {**line, "width": 1.3}
        figure.add_scatter(x=time, y=error, mode="lines", line=thin, legendgroup=name, showlegend=False, name=_of_step(name, shown), row=2, col=1)
        frequency_axis(figure, 1, [frequency])
    figure.update_xaxes(
        type="linear", title_text="time (s)", range=[float(time[0]), float(time[-1])], dtick=None, tickformat="", minor={}, row=2, col=1
    )
    ratio_axis(figure, ratios)
    floor_line(figure)
    figure.update_yaxes(title_text=f"error ({plain(unit)})", row=2, col=1)
    return figure


def candidates(document: Document, mode: str = "light", most: int = 8) -> go.Figure:
    """The held-out error with each candidate, smallest first, with its evidence on hover; dotted: noise floor, dashed: without a candidate.

    most: bars; those of named effects are always there
    """
    named = list(document["effects"])
    tried = sorted(document["candidates"], key=lambda item: (float(f"{item['held_out_error']:.2g}"), item["effect"] not in named))
    kept = {item["effect"] for item in [*(item for item in tried if item["effect"] in named), *tried][:most]}
    tried = [item for item in tried if item["effect"] in kept]
    if not tried:
        return nothing("No candidate was tried: " + str(document["sentence"]), mode)
    scale, unit = speed_unit(document)
    chosen, runner = list(document["effects"]), (document["runner_up"] or {}).get("effect")
    figure = drawing([1.0], max(90 + 34 * len(tried), LOWEST), mode)
    errors = [float(item["held_out_error"]) * scale for item in tried]
    colours = [
        MODEL
        if item["effect"] in chosen[:1]
        else fade(MODEL, 0.5)
        if item["effect"] in chosen
        else BEFORE
        if item["effect"] == runner
        else fade(UNTRUSTED, 0.7)
        for item in tried
    ]
    figures = [f"{number(error, 3)} {unit}{_place(item, chosen, runner)}" for item, error in zip(tried, errors, strict=True)]
    floor, base = document["ladder"][0]["noise_floor"] * scale, float(document["error"]["now"]) * scale
    most_left = max([base, *errors])
    inside = ["inside" if error > 0.5 * most_left else "outside" for error in errors]
    figure.add_bar(
        x=errors, y=[words(item["effect"]) for item in tried], orientation="h", marker={"color": colours}, text=figures, textposition=inside,
        insidetextanchor="end", cliponaxis=False, hovertext=[_evidence(item) for item in tried], hoverinfo="text", showlegend=False,
        name="only this effect added", meta={"y": "effect"},
    )  # fmt: skip
    for at, (level, told, colour, dash, anchor) in enumerate(
        ((floor, "floor", FLOOR, "dot", "left"), (base, "none added", UNTRUSTED, "dash", "right"))
    ):
        figure.add_vline(x=level, line={"color": colour, "width": 1.5, "dash": dash}, row=1, col=1)
        figure.add_annotation(
            text=told,
            x=level,
            y=1,
            yref="y domain",
            yanchor="bottom",
            yshift=LINE * at,
            xanchor=anchor,
            showarrow=False,
            font={"color": colour, "size": 11},
        )
    figure.update_xaxes(title_text=f"held-out error ({plain(unit)})", range=[0, 1.04 * most_left], row=1, col=1)
    figure.update_yaxes(autorange="reversed", row=1, col=1)
    return figure


def _of_step(name: str, shown: Mapping[str, Any]) -> str:
    """Label of a step. before: rigid, with delay; after: all effects of that model."""
    return legend_name(f"{name}:", shown) if shown["effects"] else f"{name}: {words(str(shown['label']))}"


def _in_lines(item: Mapping[str, Any]) -> str:
    label = words(str(item["label"]))
    first, *rest = (label.replace("with ", "+ ", 1) if item["added"] else label).split(" instead of ")
    return "<br>".join([*textwrap.wrap(first, WIDE), *(f"for {other}" for other in rest)])


def _place(item: Mapping[str, Any], chosen: list[str], runner: str | None) -> str:
    if item["effect"] in chosen:
        return " · named" if item["effect"] == chosen[0] else " · also named"
    return " · runner-up" if item["effect"] == runner else ""


def _evidence(item: Mapping[str, Any]) -> str:
    own = {name.partition(".")[2]: value for name, value in item["parameters"].items() if name.startswith(f"{item['effect']}.")}
    values = "<br>".join(f"{name} = {quantity(float(value['value']), value['unit'])}" for name, value in own.items())
    return f"<b>{words(item['effect'])}</b><br>{plain(item['evidence'])}<br>{values}"
