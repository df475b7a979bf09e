"""Sentences that the report must contain where they are true."""

from __future__ import annotations

import numpy as np

from xy_sysid.fitting import Fit
from xy_sysid.report.study import AxisStudy
from xy_sysid.report.tables import roots_text
from xy_sysid.report.words import estimate_text, interval_text, number
from xy_sysid.response.frf import ComplexArray

MUCH_BETTER = 3.0  # factor between the errors above which the missing delay is named as the reason
NOT_A_CONFIDENCE = (
    "The “parameter confidence” of the paper is 100 minus the error cost. It is shown for comparison, but it is not a confidence "
    "interval and gives no uncertainty of a parameter. The brackets in the tables are 95 % confidence intervals from the variance "
    "of the measurement."
)
PRINTED = (
    "The NLLS denominators printed in the paper have negative coefficients. Taken literally they are unstable, with a pole far "
    "above the measured band. They describe the response in the band, not the machine."
)
PAPER_VALUES = "For comparison, the paper reports errors of 39 % (LLS) and 11 % (NLLS), and delays of 1.29 ms (x) and 1.38 ms (y)."


def axis_remarks(one: AxisStudy) -> list[str]:
    """What a reader should know about the fits of one axis."""
    made = [f"Axis {one.axis}: {one.problem}"] if one.problem else []
    made += [f"Axis {one.axis}: {note}" for note in (one.estimate.notes if one.estimate else ())]
    if not one.fits:
        return made
    made += _delay(one)
    for name, fit in one.fits.items():
        made += _fit(one.axis, name, fit)
    if one.change is not None:
        made += _change(one)
    return made


def _delay(one: AxisStudy) -> list[str]:
    nlls, ml = one.fits["NLLS"], one.fits["ML"]
    if not ml.converged or nlls.error_cost < MUCH_BETTER * ml.error_cost:
        return []
    return [
        f"Axis {one.axis}: with the delay absorbed in the polynomials the relative error is {number(one.fits['LLS'].error_cost, 3)} % (LLS) and "
        f"{number(nlls.error_cost, 3)} % (NLLS); with delay and hold in the model the same data fit to {number(ml.error_cost, 3)} %."
    ]


def _fit(axis: str, name: str, fit: Fit) -> list[str]:
    made = []
    label = f"Axis {axis}, {name}"
    if not fit.converged:
        made.append(f"{label}: {fit.reason} Its numbers are the last iterate, not a result.")
    unstable = fit.poles[fit.poles.real > 1e-9 * np.maximum(np.abs(fit.poles), 1e-300)]
    if unstable.size:
        made.append(f"{label}: unstable, pole at {roots_text(unstable)} rad/s.")
    outside = poles_outside(fit)
    if outside.size:
        low, high = float(fit.frequency[0]), float(fit.frequency[-1])
        made.append(
            f"{label}: poles outside the measured band ({number(low, 3)} to {number(high, 4)} Hz): {roots_text(outside)} rad/s. "
            "They shape the curve inside the band, but as properties of the machine they are extrapolated."
        )
    if name == "ML":
        made += [f"{label}: {text}" for text in fit.warnings if not text.startswith("Unstable")]
    return made


def poles_outside(fit: Fit) -> ComplexArray:
    """Poles, except integrators, whose frequency is below the first or above the last line."""
    frequency = np.abs(fit.poles) / (2 * np.pi)
    outside = (np.abs(fit.poles) > 0) & ((frequency < fit.frequency[0]) | (frequency > fit.frequency[-1]))
    return np.asarray(fit.poles[outside], dtype=np.complex128)


def _change(one: AxisStudy) -> list[str]:
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
