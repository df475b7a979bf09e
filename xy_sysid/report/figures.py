"""Figures of signals, response and fits (2 to 6 of the paper): numbers in, a Plotly figure out. No files, no fits."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from xy_sysid.fitting import Fit
from xy_sysid.fitting.model_band import model_band
from xy_sysid.report.parts import aligned, band, bounded, broken, decibel, frequency_axis, outline, phase_of, plain, positive, rows, turns, unbroken
from xy_sysid.report.signals import Excitation, Motion
from xy_sysid.report.theme import DRIFT, METHODS, axis_colour, fade
from xy_sysid.response.frf import Z95, FrequencyResponse
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import over, readable

DASHES = {"LLS": "dot", "NLLS": "dash", "ML": "solid"}
UNCERTAIN = "ML"  # the fit whose parameters have a covariance


def excitation_figure(inputs: Mapping[str, Excitation], unit: str) -> go.Figure:
    """Figure 2: excerpt in time, distribution compared with the normal one of equal rms, power spectral density with band edges."""
    figure = rows(3, shared=False, gap=0.13)
    for number, (axis, one) in enumerate(inputs.items()):
        colour = axis_colour(number)
        line = {"color": colour, "width": 1.2}
        figure.add_scatter(
            x=one.time, y=one.value, mode="lines", line={**line, "shape": "hv"}, name=f"axis {plain(axis)}", legendgroup=axis, row=1, col=1
        )
        figure.add_scatter(
            x=one.centre, y=one.share, mode="lines", line={**line, "shape": "hvh"}, name=f"axis {plain(axis)}", legendgroup=axis, showlegend=False,
            row=2, col=1,
        )  # fmt: skip
        figure.add_scatter(
            x=one.density.frequency, y=positive(one.density.density), mode="lines", line=line, name=f"axis {plain(axis)}", legendgroup=axis,
            showlegend=False, row=3, col=1,
        )  # fmt: skip
        for edge in (one.density.low, one.density.high):
            if np.isfinite(edge):
                figure.add_vline(x=edge, line={"color": colour, "width": 1, "dash": "dot"}, row=3, col=1)
    widest = max((one.rms for one in inputs.values()), default=0.0)
    if widest > 0:
        level = np.linspace(-4 * widest, 4 * widest, 161)
        bell = np.exp(-0.5 * (level / widest) ** 2) / (widest * np.sqrt(2 * np.pi))
        figure.add_scatter(
            x=level, y=bell, mode="lines", line={"color": METHODS["measured"], "width": 1.2, "dash": "dash"}, name="normal, same rms", row=2, col=1
        )
    figure.update_xaxes(title_text="time (s)", row=1, col=1)
    figure.update_yaxes(title_text=f"input ({plain(unit)})", row=1, col=1)
    figure.update_xaxes(title_text=f"input ({plain(unit)})", row=2, col=1)
    figure.update_yaxes(title_text=f"density ({plain(over('1', unit))})", rangemode="tozero", row=2, col=1)
    figure.update_xaxes(title_text="frequency (Hz)", type="log", dtick=1, tickformat="~g", row=3, col=1)
    highest = max((float(np.max(one.density.density)) for one in inputs.values()), default=1.0)
    figure.update_yaxes(title_text=f"PSD ({plain(over('', unit)[1:])}²/Hz)", type="log", exponentformat="power", dtick=2, row=3, col=1)
    if highest > 0:
        figure.update_yaxes(range=[np.log10(highest) - 8, np.log10(highest) + 0.5], row=3, col=1)
    return figure


def position_figure(outputs: Mapping[str, Motion], unit: str) -> go.Figure:
    """Figure 3: the measured output of each axis over time, and a straight line for its drift."""
    scale, shown = readable(unit)
    figure = rows(len(outputs), shared=True, gap=0.06)
    for number, (axis, one) in enumerate(outputs.items()):
        row = number + 1
        figure.add_scatter(
            x=one.time, y=one.value * scale, mode="lines", line={"color": axis_colour(number), "width": 1}, name=f"axis {plain(axis)}", row=row, col=1
        )
        ends = np.array([0.0, float(one.time[-1])])
        figure.add_scatter(
            x=ends, y=(one.offset + one.drift * ends) * scale, mode="lines", line={"color": DRIFT, "width": 2, "dash": "dash"},
            name="drift", legendgroup="drift", showlegend=number == 0, row=row, col=1,
        )  # fmt: skip
        figure.update_yaxes(title_text=f"{plain(axis)} ({plain(shown)})", row=row, col=1)
    figure.update_xaxes(title_text="time (s)", row=len(outputs), col=1)
    return figure


def response_figure(responses: Mapping[str, FrequencyResponse]) -> go.Figure:
    """Figure 4: magnitude and phase of every axis over log frequency, with the 95 % band of each line."""
    figure = rows(2, shared=True, gap=0.06, heights=[0.55, 0.45])
    phases: list[FloatArray] = []
    spans: list[FloatArray] = []
    for number, (axis, frf) in enumerate(responses.items()):
        lines = frf.select(frf.trusted) if bool(np.any(frf.trusted)) else frf
        colour = axis_colour(number)
        curves, pieces = bounded(lines.response, lines.sigma, frf.output_unit), unbroken(lines.frequency)
        phases.append(curves[1][0])
        spans.append(lines.frequency)
        for row, (middle, low, high) in enumerate(curves, start=1):
            if bool(np.any(frf.trusted)):
                band(figure, row, outline(pieces, lines.frequency, low, high), colour, axis, f"95 % band, {plain(axis)}" if row == 1 else "")
            figure.add_scatter(
                x=broken(pieces, lines.frequency), y=broken(pieces, middle), mode="lines" if len(pieces) == 1 else "lines+markers",
                line={"color": colour, "width": 1.6}, marker={"color": colour, "size": 3}, name=f"axis {plain(axis)}", legendgroup=axis,
                showlegend=row == 1, row=row, col=1,
            )  # fmt: skip
        for name, own, dash in (("noise", lines.noise, "dot"), ("nonlinear distortion", lines.distortion, "dash")):
            if own.size:
                level = np.where(own > 0.0, decibel(np.asarray(own, dtype=np.complex128), frf.output_unit), np.nan)
                figure.add_scatter(
                    x=lines.frequency, y=level, mode="lines", line={"color": colour, "width": 1.2, "dash": dash},
                    name=f"{name}, axis {plain(axis)}", legendgroup=axis, row=1, col=1,
                )  # fmt: skip
    first = next(iter(responses.values()))
    figure.update_yaxes(title_text=f"magnitude (dB re {_ratio(first)})", row=1, col=1)
    figure.update_yaxes(title_text="phase (°)", dtick=turns(phases), row=2, col=1)
    frequency_axis(figure, 2, spans)
    return figure


def coherence_figure(responses: Mapping[str, FrequencyResponse], least: float) -> go.Figure:
    """Figure 5: coherence of every line; lines that no fit uses are small crosses. least: the limit for use."""
    figure = rows(1, shared=True, gap=0.0)
    figure.update_layout(height=320)
    for number, (axis, frf) in enumerate(responses.items()):
        colour = axis_colour(number)
        inside = frf.coherence.copy()
        inside[~frf.trusted] = np.nan
        sparse = float(np.mean(frf.trusted)) < 0.5
        figure.add_scatter(
            x=frf.frequency, y=inside, mode="markers" if sparse else "lines", line={"color": colour, "width": 1.6},
            marker={"color": colour, "size": 5}, name=f"axis {plain(axis)}", legendgroup=axis, row=1, col=1,
        )  # fmt: skip
        outside = ~frf.trusted
        if bool(np.any(outside)):
            figure.add_scatter(
                x=frf.frequency[outside], y=frf.coherence[outside], mode="markers",
                marker={"color": fade(colour, 0.7), "size": 4, "symbol": "x-thin", "line": {"width": 1, "color": fade(colour, 0.7)}},
                name=f"not used, {plain(axis)}", legendgroup=axis, row=1, col=1,
            )  # fmt: skip
    bottom = coherence_bottom(responses)
    if least > bottom:
        figure.add_hline(y=least, line={"color": METHODS["measured"], "width": 1, "dash": "dot"}, row=1, col=1)
    room = 0.03 * (1 - bottom)
    figure.update_yaxes(title_text="coherence", range=[bottom - room, 1 + room], row=1, col=1)
    frequency_axis(figure, 1, [frf.frequency for frf in responses.values()])
    return figure


def fit_figure(frf: FrequencyResponse, fits: Mapping[str, Fit]) -> go.Figure:
    """Figure 6, for one axis: magnitude and phase of the fits and the measurement; below, the relative error per line."""
    figure = rows(3, shared=True, gap=0.05, heights=[0.38, 0.28, 0.34])
    one = next(iter(fits.values()))
    reference = phase_of(one.measured)
    phases = [reference]
    dots = {"color": fade(METHODS["measured"], 0.75), "size": 4}
    for row, values in ((1, decibel(one.measured, frf.output_unit)), (2, reference)):
        figure.add_scatter(
            x=one.frequency, y=values, mode="markers", marker=dots, name="measured", legendgroup="measured", showlegend=row == 1, row=row, col=1
        )
    lines = frf.select(np.isin(frf.frequency, one.frequency))
    noise = 100 * lines.sigma / np.abs(lines.response)
    figure.add_scatter(
        x=lines.frequency, y=positive(noise), mode="lines", line={"color": fade(METHODS["measured"], 0.9), "width": 1},
        name="noise", row=3, col=1,
    )  # fmt: skip
    for name, fit in fits.items():
        line = {"color": METHODS[name], "width": 1.8, "dash": DASHES[name]}
        phase = aligned(phase_of(fit.response), reference)
        phases.append(phase)
        error = 100 * np.abs((fit.measured - fit.response) / fit.measured)
        if name == UNCERTAIN:
            _model_band(figure, fit, decibel(fit.response, frf.output_unit), phase)
        for row, values in ((1, decibel(fit.response, frf.output_unit)), (2, phase), (3, positive(error))):
            figure.add_scatter(
                x=fit.frequency, y=values, mode="lines", line={**line, "width": 1.2} if row == 3 else line, name=name,
                legendgroup=name, showlegend=row == 1, row=row, col=1,
            )  # fmt: skip
    figure.update_yaxes(title_text=f"dB re {_ratio(frf)}", row=1, col=1)
    figure.update_yaxes(title_text="phase (°)", dtick=turns(phases), row=2, col=1)
    figure.update_yaxes(title_text="error (%)", type="log", dtick=1, exponentformat="power", row=3, col=1)
    figure.update_layout(height=680)
    frequency_axis(figure, 3, [one.frequency])
    return figure


def _model_band(figure: go.Figure, fit: Fit, level: FloatArray, phase: FloatArray) -> None:
    """Draw the 95 % band of a fitted response in magnitude and phase; draw nothing if the band is unknown."""
    sigma = model_band(fit)
    if not bool(np.isfinite(sigma.magnitude).all() and np.isfinite(sigma.phase).all()):
        return
    pieces, colour = [slice(0, fit.frequency.size)], METHODS[UNCERTAIN]
    for row, middle, half in ((1, level, 20 / np.log(10) * Z95 * sigma.magnitude), (2, phase, np.degrees(Z95 * sigma.phase))):
        name = f"{UNCERTAIN}, 95 % band" if row == 1 else ""
        band(figure, row, outline(pieces, fit.frequency, middle - half, middle + half), colour, UNCERTAIN, name)


def coherence_bottom(responses: Mapping[str, FrequencyResponse]) -> float:
    """Lower end of figure 5's axis: 0, or a round number below every line if all are coherent."""
    lowest = min((float(np.min(frf.coherence)) for frf in responses.values()), default=0.0)
    return float(np.floor(lowest * 10 - 0.5) / 10) if lowest > 0.5 else 0.0


def _ratio(frf: FrequencyResponse) -> str:
    return plain(f"1 {over(readable(frf.output_unit)[1], frf.input_unit)}")
