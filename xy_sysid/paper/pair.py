"""The antiresonance and resonance before and after: figure 7 of the paper, its caption, table and remarks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go

from xy_sysid.paper.study import AxisStudy, BeforeAfter
from xy_sysid.report.axis_fits import Pair
from xy_sysid.report.parts import decibel, phase_of, plain, rows
from xy_sysid.report.remarks import axis_remarks
from xy_sysid.report.tables import Table, together
from xy_sysid.report.theme import AFTER, BEFORE, METHODS, fade
from xy_sysid.report.words import estimate_text, interval_text, number
from xy_sysid.response.frf import Z95
from xy_sysid.units import over, readable


def pair_figure(change: BeforeAfter) -> go.Figure:
    """Figure 7, for one axis: the pair before and after, measured and fitted, with intervals; below, the shift in Hz."""
    shifts = change.shifts
    heights = [0.47, 0.28, 0.25] if shifts else [0.6, 0.4]
    figure = rows(len(heights), shared=False, gap=0.11, heights=heights)
    sides = [(change.before_name, change.before, BEFORE, "solid"), (change.after_name, change.after, AFTER, "dash")]
    known = [(name, pair, colour, dash) for name, pair, colour, dash in sides if pair is not None]
    low, high = _zoom([pair for _, pair, _, _ in known])
    turned: float | None = None
    for name, pair, colour, dash in known:
        fit = pair.fit
        chosen = (fit.frequency >= low) & (fit.frequency <= high)
        frequency, measured, model = fit.frequency[chosen], fit.measured[chosen], fit.response[chosen]
        factor = 2j * np.pi * frequency if fit.structure.power > 0 else np.ones_like(measured)
        sigma = 1.0 / fit.weight[chosen] if fit.structure.weighting == "sigma" else np.zeros(frequency.size)
        part = Z95 * sigma / np.sqrt(2) / np.abs(measured)
        phase = phase_of(measured * factor)
        if turned is not None and phase.size:
            phase = phase + 360 * np.round((turned - np.mean(phase)) / 360)
        turned = float(np.mean(phase)) if phase.size else turned
        curves = (
            (1, decibel(measured * factor, fit.tf.output_unit), 20 * np.log10(1 + part), decibel(model * factor, fit.tf.output_unit)),
            (2, phase, np.degrees(part), phase + np.degrees(np.angle(model / measured))),
        )
        for row, points, half, curve in curves:
            figure.add_scatter(
                x=frequency, y=points, mode="markers", marker={"color": fade(colour, 0.8), "size": 4},
                error_y={"type": "data", "array": half, "thickness": 1, "width": 0, "color": fade(colour, 0.6)},
                name=f"{name}, measured", legendgroup=name, showlegend=row == 1, row=row, col=1,
            )  # fmt: skip
            figure.add_scatter(
                x=frequency, y=curve, mode="lines", line={"color": colour, "width": 1.6, "dash": dash}, name=f"{name}, fit",
                legendgroup=name, showlegend=row == 1, row=row, col=1,
            )  # fmt: skip
        for item in (pair.antiresonance, pair.resonance):
            if item is not None:
                for row in (1, 2):
                    figure.add_vrect(x0=item.low, x1=item.high, line_width=0, fillcolor=fade(colour, 0.35), row=row, col=1)
                    figure.add_vline(x=item.value, line={"color": colour, "width": 1, "dash": dash}, row=row, col=1)
    if shifts:
        figure.add_scatter(
            x=[one.value for one in shifts], y=[one.name for one in shifts], mode="markers", marker={"color": METHODS["ML"], "size": 9},
            error_x={"type": "data", "array": [one.high - one.value for one in shifts], "thickness": 2, "width": 6},
            name="shift, 95 % interval", showlegend=False, row=3, col=1,
        )  # fmt: skip
        figure.add_vline(x=0, line={"color": METHODS["measured"], "width": 1}, row=3, col=1)
        figure.update_xaxes(title_text=f"shift, {change.after_name} − {change.before_name} (Hz)", row=3, col=1)
        figure.update_yaxes(range=[-0.6, len(shifts) - 0.4], row=3, col=1)
    speed = bool(known) and known[0][1].fit.structure.power > 0
    tf = known[0][1].fit.tf if known else None
    ratio = over(f"{readable(tf.output_unit)[1]}{'/s' if speed else ''}", tf.input_unit) if tf is not None else ""
    figure.update_yaxes(title_text=f"dB re {plain(ratio)}", row=1, col=1)
    figure.update_yaxes(title_text="phase (°)", row=2, col=1)
    figure.update_xaxes(title_text="", range=[low, high], matches="x", row=1, col=1)
    figure.update_xaxes(title_text="frequency (Hz)", range=[low, high], matches="x", row=2, col=1)
    figure.update_layout(height=640 if shifts else 480)
    return figure


def _zoom(pairs: list[Pair]) -> tuple[float, float]:
    """(lowest, highest) Hz around all antiresonances and resonances, with a margin of at least a third of the frequency on each side."""
    found = [item.value for pair in pairs for item in (pair.antiresonance, pair.resonance) if item is not None]
    if not found:
        return 0.0, 1.0
    room = max(0.35 * min(found), 1.5 * (max(found) - min(found)))
    return max(min(found) - room, 0.3 * min(found)), max(found) + room


def pair_caption(axis: str, one: BeforeAfter) -> str:
    """The caption of figure 7 for one axis."""
    each = ", ".join(f"{s.name} {interval_text(s.value, s.low, s.high, 'Hz')}" for s in one.shifts)
    return f"Axis {axis}: the pair in {one.before_name} and {one.after_name}; shift: {each or 'unknown'}."


def pair_title(studies: Mapping[str, AxisStudy]) -> str:
    """Heading of figure 7."""
    found = [one.pair.resonance.value for one in studies.values() if one.pair is not None]
    return f"the {number(float(np.mean(found)), 2)} Hz pair" if found else "antiresonance and resonance"


def figure_caption(studies: Mapping[str, AxisStudy]) -> str:
    """Caption of figure 7."""
    changes = [one.change for one in studies.values() if one.change is not None and (one.change.before or one.change.after)]
    if not changes:
        return "No lightly damped resonance was found in the band of this recording."
    names = f"{changes[0].before_name} and {changes[0].after_name}"
    second = " of this recording" if changes[0].before_name == "first half" else ", two recordings"
    return (
        "Antiresonance and resonance in detail, as velocity response (for an integrating axis, the response times jω). "
        f"Dots with 95 % bars are measured, lines are fitted. Vertical lines and bands: both frequencies with intervals; {names}{second}. "
        "Loose bolts of the base lower both frequencies. Bottom: the shift with its 95 % interval. If the bar crosses 0, no shift is proven."
    )


def change_table(studies: Mapping[str, AxisStudy]) -> Table | None:
    """The pair before and after, for every axis that has it; None if no axis has it."""
    rows: list[tuple[str, ...]] = []
    heads = ("", "before", "after", "shift")
    for axis, one in studies.items():
        change = one.change
        if change is None or change.before is None or change.after is None:
            continue
        heads = ("", change.before_name, change.after_name, "shift")
        for shift in change.shifts:
            was, now = getattr(change.before, shift.name), getattr(change.after, shift.name)
            moved = interval_text(shift.value, shift.low, shift.high, "Hz")
            rows.append((f"{shift.name}, axis {axis}", together(estimate_text(was)), together(estimate_text(now)), together(moved)))
    return Table("Antiresonance and resonance: value [95 % interval]", heads, tuple(rows)) if rows else None


def study_remarks(one: AxisStudy) -> list[str]:
    """What a reader should know about the fits of one axis and the shift of its pair."""
    return [*axis_remarks(one), *_of_change(one)]


def _of_change(one: AxisStudy) -> list[str]:
    change = one.change
    if change is None:
        return []
    made = [f"Axis {one.axis}, {change.problem}"] if change.problem else []
    for pair, name in ((change.before, change.before_name), (change.after, change.after_name)):
        if pair is not None and pair.fit.consistent is False and one.fits["ML"].consistent is not False:
            made.append(
                f"Axis {one.axis}, {name}: the model misses something in this part. The machine may have changed during the recording, "
                f"so that {estimate_text(pair.resonance)} is a mean."
            )
    for shift in change.shifts:
        direction = "left (down)" if shift.value < 0 else "right (up)"
        if not shift.certain:
            continue
        size = interval_text(shift.value, shift.low, shift.high, "Hz")
        text = f"Axis {one.axis}: the {shift.name} moved {direction} from {change.before_name} to {change.after_name}: {size}."
        if any(pair is not None and pair.fit.consistent is False for pair in (change.before, change.after)):  # the error exceeds the noise
            text += (
                " The model error exceeds the noise, and the interval includes noise only. A shift that is small compared with the spacing of "
                "the lines may not be a change of the machine."
            )
        made.append(text)
    if change.shifts and not any(shift.certain for shift in change.shifts):
        made.append(f"Axis {one.axis}: the shift of the pair is within its interval.")
    return made
