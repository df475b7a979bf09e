"""Figures of the identifier's results: its response with model and residual, and the resonance over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from xy_sysid.linear.simulate import held_response
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.live.plain_messages import ArrayMessage
from xy_sysid.page.topics_state import Tracked, columns, thinned
from xy_sysid.report.parts import (
    aligned,
    band,
    bounded,
    broken,
    decibel,
    frequency_axis,
    outline,
    phase_of,
    plain,
    positive,
    rows,
    true_runs,
    turns,
    unbroken,
)
from xy_sysid.report.story_curves import fit_range
from xy_sysid.report.story_parts import LINE, NAMED, grey
from xy_sysid.report.theme import BEFORE, FAILS, MEASURED, MODEL, UNTRUSTED, fade
from xy_sysid.response.frf import Z95
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import LEAST_COHERENCE
from xy_sysid.units import USUAL, Units, over, readable

MOST = 1200  # lines drawn
SOLID, DASHED = {"color": MEASURED, "width": 1.8}, {"color": MODEL, "width": 1.8, "dash": "dash"}
NOTABLE = 4.0  # standard errors above which a range of lines is shaded
STRETCH = 3  # number of neighbouring lines whose mean must exceed it


def response_figure(
    frf: ArrayMessage, comparison: ArrayMessage | None, tf: TransferFunction | None, sampling_rate: float, units: Units = USUAL
) -> go.Figure:
    """Residual in standard errors, magnitude and phase with 95 % band and model, and coherence.

    sampling_rate: Hz, for the hold that is part of the plotted model; 0 if unknown
    """
    table = columns(frf)
    frequency, coherence = table["frequency"], table["coherence"]
    response = table["real"] + 1j * table["imag"]
    kept = thinned(frequency, np.abs(response), MOST)
    kept = kept[frequency[kept] > 0]
    frequency, coherence, response, sigma = frequency[kept], coherence[kept], response[kept], table["sigma"][kept]
    trusted = coherence >= LEAST_COHERENCE
    usable = trusted if bool(trusted.any()) else ~trusted
    figure = rows(4, shared=True, gap=0.04, heights=[0.24, 0.36, 0.24, 0.16])
    curves = bounded(response, sigma, units.output)
    (level, *_), (phase, *_) = curves
    pieces = _pieces(trusted, frequency)
    for row, (middle, low, high) in enumerate(curves, start=2):
        _untrusted(figure, row, frequency, middle, ~trusted, row == 2)
        if pieces:
            band(figure, row, outline(pieces, frequency, low, high), MEASURED, "measured", "95 % band" if row == 2 else "")
            _curve(figure, row, (broken(pieces, frequency), broken(pieces, middle)), SOLID, "measured", row == 2)
    shown = {2: [level], 3: [phase]}
    if tf is not None:
        model = held_response(tf, frequency, sampling_rate) if sampling_rate > 0 else tf.response(frequency)
        shifted = phase_of(model)
        if bool(trusted.any()):
            shifted = aligned(shifted, phase, trusted)
        shown[2].append(decibel(model, units.output))
        shown[3].append(shifted)
        _curve(figure, 2, (frequency, shown[2][1]), DASHED, "model", True)
        _curve(figure, 3, (frequency, shifted), DASHED, "model")
    _untrusted(figure, 4, frequency, coherence, ~trusted, False)
    if pieces:
        _curve(figure, 4, (broken(pieces, frequency), broken(pieces, coherence)), SOLID, "coherence")
    _residual(figure, comparison)
    figure.update_yaxes(title_text="residual (σ)", type="log", dtick=1, tickformat="~g", row=1, col=1)
    figure.update_yaxes(title_text=f"dB re 1 {plain(over(readable(units.output)[1], units.input))}", row=2, col=1)
    figure.update_yaxes(title_text="phase (°)", dtick=turns([phase[usable]]), row=3, col=1)
    figure.update_yaxes(title_text="coherence", range=[-0.03, 1.05], row=4, col=1)
    for row, found in shown.items():
        fit_range(figure, row, [values[usable] for values in found])
    frequency_axis(figure, 4, [frequency])
    figure.update_layout(height=700)
    return figure


def failing(comparison: ArrayMessage | None) -> list[tuple[float, float, float]]:
    """(from, to, largest residual in sigma) of ranges of neighbouring lines where the model fails."""
    table = columns(comparison) if comparison is not None else {}
    if not table:
        return []
    frequency, size = table["frequency"], table["residual_sigma"]
    if size.size < STRETCH:
        return []
    smooth = np.convolve(size, np.full(STRETCH, 1 / STRETCH), mode="same")
    found = [(float(frequency[run][0]), float(frequency[run][-1]), float(size[run].max())) for run in true_runs(smooth > NOTABLE)]
    merged: list[tuple[float, float, float]] = []
    for low, high, worst in found:
        if merged and low < 1.15 * merged[-1][1]:
            merged[-1] = (merged[-1][0], high, max(worst, merged[-1][2]))
        else:
            merged.append((low, high, worst))
    return sorted(merged, key=lambda item: -item[2])


def failing_words(comparison: ArrayMessage | None) -> str:
    """The failing ranges in a sentence."""
    found = failing(comparison)
    if comparison is None:
        return "No model yet."
    if not found:
        return "The linear fit agrees with the measurement within noise at every line."
    worst = "; ".join(f"{low:.3g} to {high:.3g} Hz, up to {size:.2g} standard errors" for low, high, size in found[:3])
    return f"The linear fit fails at {worst}."


def tracking_figure(history: Sequence[Tracked]) -> go.Figure:
    """The watched resonance over seconds of data, its reference, and the times of the alarm."""
    figure = rows(1, shared=True, gap=0.0)
    time = np.array([item.seconds for item in history])
    found = np.array([item.frequency for item in history])
    alarm = np.array([item.alarm for item in history], dtype=bool)
    figure.add_scatter(x=time, y=[item.reference for item in history], mode="lines", line={"color": UNTRUSTED, "dash": "dash"}, name="reference")
    figure.add_scatter(x=time, y=found, mode="lines+markers", line={"color": BEFORE, "width": 1.6}, marker={"size": 4}, name="resonance")
    if bool(alarm.any()):
        figure.add_scatter(x=time[alarm], y=found[alarm], mode="markers", marker={"color": FAILS, "size": 9, "symbol": "diamond"}, name="alarm")
    room = max(0.02 * float(np.median(found)), 0.6 * float(np.ptp(found)))
    figure.update_yaxes(title_text="resonance (Hz)", range=[float(found.min()) - room, float(found.max()) + room])
    figure.update_xaxes(title_text="seconds of data")
    figure.update_layout(height=240)
    return figure


def _residual(figure: go.Figure, comparison: ArrayMessage | None) -> None:
    table = columns(comparison) if comparison is not None else {}
    if not table:
        return
    frequency, size = table["frequency"], table["residual_sigma"]
    kept = thinned(frequency, size, MOST)
    _curve(figure, 1, (frequency[kept], positive(size[kept])), {"color": MODEL, "width": 1.2}, "residual")
    figure.add_hline(y=Z95, line={"color": UNTRUSTED, "width": 1, "dash": "dot"}, row=1, col=1)
    for place, (low, high, worst) in enumerate(failing(comparison)[:NAMED]):
        figure.add_vrect(x0=low, x1=high, fillcolor=fade(FAILS, 0.13), line={"color": fade(FAILS, 0.5), "width": 1}, row=1, col=1)
        figure.add_annotation(
            text=f"fails: {worst:.2g} σ", x=float(np.log10(np.sqrt(low * high))), xref="x", y=1, yref="y domain", yanchor="top", yshift=-LINE * place,
            showarrow=False, font={"color": FAILS, "size": 11},
        )  # fmt: skip
    top = float(np.nanmax(np.log10(np.maximum(size, 1e-2))))
    figure.update_yaxes(range=[-1.0, max(top, 1.0) + 0.35], row=1, col=1)


def _curve(figure: go.Figure, row: int, curve: tuple[FloatArray, FloatArray], line: Mapping[str, Any], name: str, legend: bool = False) -> None:
    x, y = curve
    figure.add_scatter(x=x, y=y, mode="lines", line=line, name=name, legendgroup=name, showlegend=legend, row=row, col=1)


def _untrusted(figure: go.Figure, row: int, x: FloatArray, y: FloatArray, which: np.ndarray, legend: bool) -> None:
    if bool(which.any()):
        figure.add_scatter(
            x=x[which], y=y[which], mode="markers", marker=grey(), name="not trusted", legendgroup="not", showlegend=legend, row=row, col=1
        )


def _pieces(trusted: np.ndarray, frequency: FloatArray) -> list[slice]:
    """Slices of consecutive trusted lines."""
    if bool(trusted.all()):
        return unbroken(frequency) if frequency.size > 2 else [slice(0, frequency.size)]
    return true_runs(trusted)
