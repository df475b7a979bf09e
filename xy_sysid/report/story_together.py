"""Several recordings, axes and models in one figure: overlaid responses, and the error of each model below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from xy_sysid.report.parts import band, broken, frequency_axis, outline, plain, positive, true_runs, turns
from xy_sysid.report.story_curves import between
from xy_sysid.report.story_parts import Document, drawing, floor_line, nothing, pictured, ratio_axis, row, words
from xy_sysid.report.theme import axis_colour
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import over, readable

HEIGHT = 560  # px
DASHES = ("dash", "dot", "dashdot", "longdash")


@dataclass(frozen=True, slots=True)
class Entry:
    """One axis of one recording: its label, its story, and the steps whose models are drawn."""

    name: str
    document: Document
    steps: tuple[int, ...] = ()


def together(entries: Sequence[Entry], mode: str = "light") -> go.Figure:
    """Measured responses with 95 % bands, one colour each; the chosen models in the same colour, and their error divided by the noise floor.

    Entries with different units share one dB scale; the axis title then names both units.
    """
    shown = [entry for entry in entries if entry.document["measured"] is not None]
    if not shown:
        return nothing("Choose at least one axis of a recording that has been read.", mode)
    figure = drawing([0.44, 0.30, 0.26], HEIGHT, mode)
    phases: list[FloatArray] = []
    ratios: list[FloatArray] = []
    for number, entry in enumerate(shown):
        colour = axis_colour(number)
        turn = _turn(entry, shown[0])
        phases.append(_measured(figure, entry, colour, turn))
        for place, step in enumerate(entry.steps):
            ratios += _model(figure, entry, step, turn, {"color": colour, "width": 1.6, "dash": DASHES[place % len(DASHES)]})
    units = dict.fromkeys(f"1 {over(readable(e.document['units']['output'])[1], e.document['units']['input'])}" for e in shown)
    figure.update_yaxes(title_text=f"dB re {plain(', '.join(units))}", row=1, col=1)
    figure.update_yaxes(title_text="phase (°)", dtick=turns(phases), row=2, col=1)
    if ratios:
        ratio_axis(figure, ratios, at=3)
        floor_line(figure, at=3)
    figure.update_yaxes(title_text="error / floor", row=3, col=1)
    frequency_axis(figure, 3, [row(entry.document["measured"]["frequency_response"]["frequency"]) for entry in shown])
    return figure


def _measured(figure: go.Figure, entry: Entry, colour: str, turn: float) -> FloatArray:
    """Draw the measured response, with its phase shifted by ``turn`` degrees; returns the phase of trusted lines, degrees."""
    measured = entry.document["measured"]["frequency_response"]
    lift = _lift(entry)
    frequency, trusted = row(measured["frequency"]), np.array(measured["trusted"], dtype=bool)
    pieces = true_runs(trusted) or [slice(0, frequency.size)]
    for at, name, low, high, up in (
        (1, "magnitude_db", "magnitude_low_db", "magnitude_high_db", lift),
        (2, "phase_deg", "phase_low_deg", "phase_high_deg", turn),
    ):
        band(figure, at, outline(pieces, frequency, row(measured[low]) + up, row(measured[high]) + up), colour, entry.name, "")
        figure.add_scatter(
            x=broken(pieces, frequency), y=broken(pieces, row(measured[name]) + up), mode="lines", line={"color": colour, "width": 1.8},
            name=plain(entry.name), legendgroup=entry.name, showlegend=at == 1, row=at, col=1,
        )  # fmt: skip
    return _phase(entry) + turn


def _phase(entry: Entry) -> FloatArray:
    """Phase of trusted lines, degrees."""
    measured = entry.document["measured"]["frequency_response"]
    phase, trusted = row(measured["phase_deg"]), np.array(measured["trusted"], dtype=bool)
    return phase[trusted] if bool(trusted.any()) else phase


def _turn(entry: Entry, first: Entry) -> float:
    """Multiple of 360 degrees that brings the phase close to that of the first entry."""
    return 360.0 * round(float(np.median(_phase(first)) - np.median(_phase(entry))) / 360.0)


def _model(figure: go.Figure, entry: Entry, step: int, turn: float, line: dict[str, object]) -> list[FloatArray]:
    """Draw one model over the measurement, and its error; returns the error, if there is one."""
    picture = pictured(entry.document, step)
    if picture is None:
        return []
    measured, model = entry.document["measured"]["frequency_response"], picture["pictures"]["frequency_response"]
    inside = between(np.array(measured["trusted"], dtype=bool))
    frequency = row(measured["frequency"])[inside]
    name = f"{entry.name}: {words(str(picture['label']))}"
    for at, values in ((1, row(model["magnitude_db"]) + _lift(entry)), (2, row(model["phase_deg"]) + turn)):
        figure.add_scatter(
            x=frequency, y=values[inside], mode="lines", line=line, name=plain(name), legendgroup=name, showlegend=at == 1, row=at, col=1
        )
    error = picture["pictures"]["residual"]["frequency"]
    at_frequency, ratio = row(error["frequency"]), row(error["error_over_floor"])
    known = np.isfinite(ratio) & (at_frequency <= 1.05 * float(error["up_to"]))
    figure.add_scatter(
        x=at_frequency[known], y=positive(ratio[known]), mode="lines", line=line, name=plain(name), legendgroup=name, showlegend=False, row=3, col=1
    )
    return [ratio[known]]


def _lift(entry: Entry) -> float:
    """dB from SI to the display unit of the output."""
    return float(20 * np.log10(readable(entry.document["units"]["output"])[0]))
