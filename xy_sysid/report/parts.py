"""Building blocks of figures: rows, log frequency axes, bands, curves with gaps."""

from __future__ import annotations

import copy
import functools
import itertools
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from xy_sysid.report.theme import ROW, fade, template
from xy_sysid.response.frf import Z95, ComplexArray
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import readable

Bounded = tuple[FloatArray, FloatArray, FloatArray]
"""A curve, and the lower and upper end of its band."""

GAP = 2.5  # a curve is interrupted where the spacing exceeds this multiple of the usual line spacing


def plain(text: str) -> str:
    """Escape text from a file where Plotly would read it as HTML."""
    return escape(text, quote=False)


def decibel(response: ComplexArray, output_unit: str) -> FloatArray:
    """20 log10 of the magnitude in the display unit of the output (mm for m)."""
    scale, _ = readable(output_unit)
    return np.asarray(20 * np.log10(np.maximum(np.abs(response) * scale, np.finfo(float).tiny)), dtype=np.float64)


def phase_of(response: ComplexArray) -> FloatArray:
    """Unwrapped phase in degrees."""
    return np.asarray(np.degrees(np.unwrap(np.angle(response))), dtype=np.float64)


def aligned(phase: FloatArray, reference: FloatArray, lines: NDArray[np.bool_] | slice = slice(None)) -> FloatArray:
    """The phase in degrees, moved by full turns so that it is nearest to a reference, in the median over these lines."""
    return np.asarray(phase + 360 * np.round(np.median((reference - phase)[lines]) / 360), dtype=np.float64)


def bounded(response: ComplexArray, sigma: FloatArray, output_unit: str) -> tuple[Bounded, Bounded]:
    """Magnitude in dB and phase in degrees of a measured response with the 95 % band of each line, of no width where sigma is unknown."""
    level, phase = decibel(response, output_unit), phase_of(response)
    part = Z95 * np.where(np.isfinite(sigma), sigma, 0.0) / np.sqrt(2) / np.maximum(np.abs(response), 1e-300)
    turn = np.degrees(np.arcsin(np.minimum(part, 1.0)))
    return (level, level + 20 * np.log10(np.maximum(1 - part, 1e-3)), level + 20 * np.log10(1 + part)), (phase, phase - turn, phase + turn)


def rows(number: int, *, shared: bool, gap: float, heights: list[float] | None = None, mode: str = "light") -> go.Figure:
    """An empty figure with this number of rows; shared: one x axis for all; gap: between rows, fraction of the height; mode: light or dark."""
    return copy.deepcopy(_empty(number, shared, gap, tuple(heights) if heights is not None else None, mode))


@functools.lru_cache(maxsize=64)
def _empty(number: int, shared: bool, gap: float, heights: tuple[float, ...] | None, mode: str) -> go.Figure:
    """The empty figure, built once and cached: Plotly needs 50 ms to check a template, and 2 ms to copy a checked figure.

    The template is given before the rows are made. Otherwise Plotly would merge it with its own default template.
    """
    figure = go.Figure(layout={"template": template(mode), "height": ROW * number + 90, "margin": {"l": 10, "r": 12, "t": 36, "b": 10}})
    figure = make_subplots(
        rows=number, cols=1, shared_xaxes=shared, vertical_spacing=gap, row_heights=list(heights) if heights else None, figure=figure
    )
    figure.update_layout(hovermode="closest")
    figure.update_xaxes(hoverformat=".5g")
    figure.update_yaxes(hoverformat=".4g")
    return figure


def stretches(
    figure: go.Figure, spans: Sequence[tuple[float, float]], fill: str, *, row: int = 1, line: Mapping[str, Any] | None = None, layer: str = "above"
) -> None:
    """Shade spans of x over the full height of a row, all in one call: ``add_vrect`` takes 20 ms for each."""
    number = "" if row == 1 else str(row)
    shape = {
        "type": "rect",
        "xref": f"x{number}",
        "yref": f"y{number} domain",
        "y0": 0,
        "y1": 1,
        "fillcolor": fill,
        "layer": layer,
        "line": line or {"width": 0},
    }
    figure.layout.shapes = (*figure.layout.shapes, *({**shape, "x0": first, "x1": last} for first, last in spans))


def unbroken(frequency: FloatArray) -> list[slice]:
    """Slices of consecutive lines between gaps that are much wider than the usual spacing."""
    steps = np.diff(frequency)
    cuts = np.flatnonzero(steps > GAP * np.median(steps)) + 1 if steps.size else np.array([], dtype=np.int64)
    return [slice(a, b) for a, b in itertools.pairwise([0, *cuts.tolist(), frequency.size])]


def true_runs(flags: NDArray[np.bool_]) -> list[slice]:
    """Slices of consecutive lines for which a flag is True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def broken(pieces: list[slice], values: FloatArray) -> FloatArray:
    """The values with NaN between pieces, so that no line is drawn across a gap."""
    return np.concatenate([np.append(values[piece], np.nan) for piece in pieces])[:-1]


def outline(pieces: list[slice], x: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(x, y) around the area between two curves, piece by piece."""
    across = np.concatenate([np.concatenate((x[piece], x[piece][::-1], [np.nan])) for piece in pieces])
    return across, np.concatenate([np.concatenate((high[piece], low[piece][::-1], [np.nan])) for piece in pieces])


def band(figure: go.Figure, row: int, around: tuple[FloatArray, FloatArray], colour: str, axis: str, name: str) -> None:
    """The area inside an outline; without a name it has no legend."""
    figure.add_scatter(
        x=around[0], y=around[1], mode="lines", line={"width": 0}, fill="toself",
        fillcolor=fade(colour, 0.25), hoverinfo="skip", name=name or "95 % band", legendgroup=axis, showlegend=bool(name), row=row, col=1,
    )  # fmt: skip


def frequency_axis(figure: go.Figure, row: int, frequency: list[FloatArray]) -> None:
    """Log axes over all the frequencies, Hz; the title is at ``row``."""
    low, high = (float(np.log10(limit)) for limit in (min(f[0] for f in frequency), max(f[-1] for f in frequency)))
    room = 0.02 * (high - low)
    figure.update_xaxes(type="log", range=[low - room, high + room], dtick=1, tickformat="~g", minor={"dtick": "D2", "ticklen": 3})
    figure.update_xaxes(title_text="frequency (Hz)", row=row, col=1)


def turns(phases: list[FloatArray]) -> float:
    """Tick spacing of a phase axis: 45 degrees, or more where labels would be too dense."""
    span = max(float(np.max(p)) for p in phases) - min(float(np.min(p)) for p in phases)
    return next((step for step in (45.0, 90.0, 180.0, 360.0, 720.0) if span <= 5.5 * step), 3600.0)


def positive(values: FloatArray) -> FloatArray:
    """Values for a log axis: NaN where not above 0."""
    return np.where(np.isfinite(values) & (values > 0), values, np.nan)
