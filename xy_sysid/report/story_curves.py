"""Story figures over frequency: Bode, coherence; and the poles and zeros of the linear part."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from xy_sysid.report.parts import band, broken, frequency_axis, outline, plain, true_runs, turns
from xy_sysid.report.story_parts import SMALL, Document, drawing, grey, legend_name, nothing, pictured, row
from xy_sysid.report.theme import FAILS, MEASURED, MODEL, fade
from xy_sysid.report.words import number
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import LEAST_COHERENCE
from xy_sysid.units import over, readable


def bode(document: Document, step: int | None = None, mode: str = "light") -> go.Figure:
    """Magnitude and phase over log frequency: the measurement with its 95 % band, and the model; untrusted lines in grey."""
    shown = pictured(document, step)
    if shown is None:
        return nothing(document["sentence"], mode)
    measured, model = document["measured"]["frequency_response"], shown["pictures"]["frequency_response"]
    scale, unit = readable(document["units"]["output"])
    lift = 20 * np.log10(scale)
    frequency, trusted = row(measured["frequency"]), np.array(measured["trusted"], dtype=bool)
    pieces, seen = true_runs(trusted), between(trusted)
    figure = drawing([0.58, 0.42], 420, mode)
    curves = (
        (1, "magnitude_db", "magnitude_low_db", "magnitude_high_db", lift),
        (2, "phase_deg", "phase_low_deg", "phase_high_deg", 0.0),
    )
    for at, name, low, high, up in curves:
        values = row(measured[name]) + up
        first = at == 1
        if pieces:
            band(figure, at, outline(pieces, frequency, row(measured[low]) + up, row(measured[high]) + up), MEASURED, "measured", "")
            figure.add_scatter(
                x=broken(pieces, frequency), y=broken(pieces, values), mode="lines", line={"color": MEASURED, "width": 1.8},
                name="measured, 95 % band", legendgroup="measured", showlegend=first, row=at, col=1,
            )  # fmt: skip
        line = {"color": MODEL, "width": 1.8, "dash": "dash"}
        figure.add_scatter(
            x=frequency[seen], y=(row(model[name]) + up)[seen], mode="lines", line=line, name=legend_name("model", shown),
            legendgroup="model", showlegend=first, row=at, col=1,
        )  # fmt: skip
        if not bool(trusted.all()):
            figure.add_scatter(
                x=frequency[~trusted], y=values[~trusted], mode="markers", marker=grey(), name="not trusted", legendgroup="not",
                showlegend=first, row=at, col=1,
            )  # fmt: skip
    fit_range(figure, 1, [(row(measured["magnitude_db"]) + lift)[seen], (row(model["magnitude_db"]) + lift)[seen]])
    fit_range(figure, 2, [row(measured["phase_deg"])[seen], row(model["phase_deg"])[seen]])
    figure.update_yaxes(title_text=f"dB re 1 {plain(over(unit, document['units']['input']))}", row=1, col=1)
    figure.update_yaxes(title_text="phase (°)", dtick=turns([row(measured["phase_deg"])[seen]]), row=2, col=1)
    frequency_axis(figure, 2, [frequency])
    return figure


def coherence(document: Document, step: int | None = None, mode: str = "light") -> go.Figure:  # noqa: ARG001
    """Coherence of every line: 1 where the input explains all of the output; untrusted lines in grey."""
    if document["measured"] is None:
        return nothing(document["sentence"], mode)
    measured = document["measured"]["frequency_response"]
    frequency, values, trusted = row(measured["frequency"]), row(measured["coherence"]), np.array(measured["trusted"], dtype=bool)
    figure = drawing([1.0], SMALL, mode)
    pieces = true_runs(trusted)
    if pieces:
        figure.add_scatter(
            x=broken(pieces, frequency),
            y=broken(pieces, values),
            mode="lines",
            line={"color": MEASURED, "width": 1.8},
            name="coherence",
            row=1,
            col=1,
        )
    if not bool(trusted.all()):
        figure.add_scatter(x=frequency[~trusted], y=values[~trusted], mode="markers", marker=grey(), name="not trusted", row=1, col=1)
    figure.add_hline(y=LEAST_COHERENCE, line={"color": FAILS, "width": 1, "dash": "dot"}, row=1, col=1)
    figure.update_yaxes(title_text="coherence", range=[-0.03, 1.05], row=1, col=1)
    figure.update_layout(showlegend=not bool(trusted.all()))
    frequency_axis(figure, 1, [frequency])
    return figure


def poles_zeros(document: Document, step: int | None = None, mode: str = "light") -> go.Figure:
    """Poles (crosses) and zeros (circles) of the model's linear part; the unstable half-plane is shaded if it contains a root."""
    shown = pictured(document, step)
    if shown is None:
        return nothing(document["sentence"], mode)
    figure = drawing([1.0], 260, mode)
    edge = 1.0
    for name, symbol, colour in (("poles", "x-thin", MODEL), ("zeros", "circle-open", MEASURED)):
        stored = [(item, sign) for item in shown["pictures"]["linear"][name] for sign in ((1, -1) if item["imag"] else (1,))]  # a pair is stored once
        roots = [(float(item["real"]), sign * float(item["imag"]), item) for item, sign in stored]
        if not roots:
            continue
        edge = max(edge, *(abs(value) for x, y, _ in roots for value in (x, y)))
        told = [f"{number(item['frequency'] or 0.0, 4)} Hz, damping {number(item['damping'] or 0.0, 3)}" for _, _, item in roots]
        figure.add_scatter(
            x=[x for x, _, _ in roots], y=[y for _, y, _ in roots], mode="markers", name=name, text=told,
            hovertemplate="%{x:.5g} %{y:+.5g}j rad/s<br>%{text}<extra></extra>",
            marker={"symbol": symbol, "size": 12, "color": colour, "line": {"width": 2.5, "color": colour}}, row=1, col=1,
        )  # fmt: skip
    right = max([0.0, *(float(item["real"]) for item in shown["pictures"]["linear"]["poles"])])
    if right > 0:
        figure.add_vrect(x0=0, x1=1.3 * right, fillcolor=fade(FAILS, 0.13), line_width=0, annotation_text="unstable", row=1, col=1)
    figure.add_vline(x=0, line={"color": "#7f8993", "width": 1}, row=1, col=1)
    figure.add_hline(y=0, line={"color": "#7f8993", "width": 1}, row=1, col=1)
    left = min([0.0, *(float(item["real"]) for kind in ("poles", "zeros") for item in shown["pictures"]["linear"][kind])])
    figure.update_xaxes(title_text="real (rad/s)", range=[1.15 * left - 0.05 * edge, max(1.3 * right, 0.12 * edge)], row=1, col=1)
    figure.update_yaxes(title_text="imaginary (rad/s)", range=[-1.15 * edge, 1.15 * edge], row=1, col=1)
    return figure


def between(trusted: np.ndarray) -> slice:
    """The slice from the first to the last trusted line. Outside it the input has no power and a simulated response means nothing."""
    found = np.flatnonzero(trusted)
    return slice(int(found[0]), int(found[-1]) + 1) if found.size else slice(None)


def fit_range(figure: go.Figure, at: int, curves: list[FloatArray]) -> None:
    """Fit the range of a y axis to the finite values of these curves, with room at both ends."""
    values = np.concatenate([item[np.isfinite(item)] for item in curves])
    if values.size:
        room = max(0.06 * float(np.ptp(values)), 1.0)
        figure.update_yaxes(range=[float(values.min()) - room, float(values.max()) + room], row=at, col=1)
