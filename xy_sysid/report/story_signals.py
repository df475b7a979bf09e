"""Pictures of a story in time: measured and simulated velocity, and position."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from xy_sysid.report.parts import plain
from xy_sysid.report.story_parts import SMALL, Document, drawing, legend_name, nothing, pictured, row, shade_held_out, speed_unit
from xy_sysid.report.theme import FAILS, MEASURED, MODEL, fade
from xy_sysid.units import readable


def zoom(document: Document, step: int | None = None, mode: str = "light") -> go.Figure:
    """Measured and simulated velocity around the rigid model's largest error, and below their difference."""
    shown = pictured(document, step)
    if shown is None:
        return nothing(document["sentence"], mode)
    scale, unit = speed_unit(document)
    picture = document["measured"]["zoom"]
    measured, model = row(picture["velocity"]) * scale, row(shown["pictures"]["zoom"]["velocity"]) * scale
    time = float(picture["start"]) + np.arange(measured.size) / float(document["sampling_rate"])
    figure = drawing([0.66, 0.34], 360, mode)
    curves = (
        (1, measured, {"color": MEASURED, "width": 1.8}, "measured"),
        (1, model, {"color": MODEL, "width": 1.6, "dash": "dash"}, legend_name("simulated", shown)),
        (2, measured - model, {"color": FAILS, "width": 1.3}, "difference"),
    )
    for at, values, line, name in curves:
        figure.add_scatter(x=time, y=values, mode="lines", line=line, name=name, showlegend=at == 1, row=at, col=1)
    figure.update_yaxes(title_text=f"velocity ({plain(unit)})", row=1, col=1)
    figure.update_yaxes(title_text="difference", row=2, col=1)
    figure.update_xaxes(title_text="time (s)", row=2, col=1)
    return figure


def velocity(document: Document, step: int | None = None, mode: str = "light") -> go.Figure:
    """The full record: minimum and maximum velocity in each bin, measured and simulated; zoomable."""
    shown = pictured(document, step)
    if shown is None:
        return nothing(document["sentence"], mode)
    scale, unit = speed_unit(document)
    measured = document["measured"]["time"]
    time = row(measured["time"])
    figure = drawing([1.0], SMALL, mode)
    simulated = legend_name("simulated", shown)
    for part, colour, opacity, name in ((measured, MEASURED, 0.35, "measured"), (shown["pictures"]["time"], MODEL, 0.3, simulated)):
        low, high = row(part["velocity_low"]) * scale, row(part["velocity_high"]) * scale
        around, edge = np.concatenate((time, time[::-1])), np.concatenate((high, low[::-1]))
        figure.add_scatter(
            x=around, y=edge, mode="lines", line={"color": colour, "width": 0.8}, fill="toself",
            fillcolor=fade(colour, opacity), hoverinfo="skip", name=name, row=1, col=1,
        )  # fmt: skip
    shade_held_out(figure, document, shown)
    figure.update_xaxes(title_text="time (s)", row=1, col=1)
    figure.update_yaxes(title_text=f"velocity ({plain(unit)})", row=1, col=1)
    return figure


def position(document: Document, step: int | None = None, mode: str = "light") -> go.Figure:
    """The full record: measured position, and position simulated from the input alone."""
    shown = pictured(document, step)
    if shown is None:
        return nothing(document["sentence"], mode)
    scale, unit = readable(document["units"]["output"])
    measured = document["measured"]["time"]
    time = row(measured["time"])
    figure = drawing([1.0], SMALL, mode)
    figure.add_scatter(
        x=time, y=row(measured["position"]) * scale, mode="lines", line={"color": MEASURED, "width": 1.8}, name="measured", row=1, col=1
    )
    figure.add_scatter(
        x=time, y=row(shown["pictures"]["time"]["position"]) * scale, mode="lines", line={"color": MODEL, "width": 1.6, "dash": "dash"},
        name=legend_name("simulated", shown), row=1, col=1,
    )  # fmt: skip
    shade_held_out(figure, document, shown)
    figure.update_xaxes(title_text="time (s)", row=1, col=1)
    figure.update_yaxes(title_text=f"position ({plain(unit)})", row=1, col=1)
    return figure
