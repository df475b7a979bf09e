"""Sentences that the report must contain where they are true."""

from __future__ import annotations

import numpy as np

from xy_sysid.fitting import Fit
from xy_sysid.report.axis_fits import AxisFits
from xy_sysid.report.tables import roots_text
from xy_sysid.report.words import number
from xy_sysid.response.frf import ComplexArray

MUCH_BETTER = 3.0  # factor between the errors above which the missing delay is named as the reason
NOT_A_CONFIDENCE = (
    "The “parameter confidence” of the paper is 100 minus the error cost. It is shown for comparison, but it is not a confidence "
    "interval and gives no uncertainty of a parameter. The brackets in the tables are 95 % confidence intervals from the variance "
    "of the measurement."
)


def axis_remarks(one: AxisFits) -> list[str]:
    """What a reader should know about the fits of one axis."""
    made = [f"Axis {one.axis}: {one.problem}"] if one.problem else []
    made += [f"Axis {one.axis}: {note}" for note in (one.estimate.notes if one.estimate else ())]
    if not one.fits:
        return made
    made += _delay(one)
    for name, fit in one.fits.items():
        made += _fit(one.axis, name, fit)
    return made


def _delay(one: AxisFits) -> list[str]:
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
