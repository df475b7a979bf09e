"""Captions of the figures, and alternative text for screen readers."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from xy_sysid.fitting import Fit
from xy_sysid.report.axis_fits import AxisFits
from xy_sysid.report.signals import Excitation, Motion
from xy_sysid.report.words import estimate_text, number, quantity
from xy_sysid.response.frf import FrequencyResponse

FITS = (
    "LLS and NLLS absorb the delay in their polynomials (the paper's method); ML models delay and hold. Top and middle: magnitude "
    "and phase. Bottom: relative error of each fit at each line. An error at the grey noise of the measurement cannot be reduced; "
    "far above it, the model misses something."
)
NO_FIT = "No axis of this recording could be fitted; the remarks say why."
COEFFICIENTS = (
    "LLS and NLLS are the paper's method (nllsfdi: all poles free, delay absorbed, errors weighted by 1/|FRF|). ML models delay, "
    "hold and window and weights each line by its measured variance. Its last coefficient is 0 because the axis integrates."
)


def summary(one: AxisFits) -> str:
    """The summary line at the top of the page."""
    if not one.fits:
        return f"Axis {one.axis}: {one.problem}"
    ml = one.fits["ML"]
    text = f"Axis {one.axis}: relative error {number(ml.error_cost, 2)} %"
    if not ml.converged:
        return f"{text}, but the fit did not converge: {ml.reason}"
    if ml.structure.free_delay:
        text += f", delay {estimate_text(ml.interval('delay'))}"
    if one.pair is not None:
        if one.pair.antiresonance is not None:
            text += f", antiresonance {estimate_text(one.pair.antiresonance)}"
        text += f", resonance {estimate_text(one.pair.resonance)}"
    return f"{text}." if ml.consistent is not False else f"{text}. The model misses something in the data; the intervals do not include this error."


def excitation(inputs: Mapping[str, Excitation], unit: str) -> str:
    """Caption of figure 2."""
    each = ". ".join(
        f"Axis {axis}: {quantity(one.rms, unit, 3)} rms, peak {quantity(one.peak, unit, 3)}, {_excited(one)}" for axis, one in inputs.items()
    )
    return f"Top: an excerpt, each value held to the next sample. Middle: distribution of all samples. Bottom: power spectral density. {each}."


def _excited(one: Excitation) -> str:
    if one.rms == 0.0 or not math.isfinite(one.density.low):
        return "not excited"
    return f"excited from {number(one.density.low, 3)} to {number(one.density.high, 3)} Hz (−10 dB, dotted)"


def position(outputs: Mapping[str, Motion], unit: str) -> str:
    """Caption of figure 3."""
    each = ". ".join(
        f"Axis {axis}: from {quantity(one.low, unit, 3)} to {quantity(one.high, unit, 3)}, "
        f"drift {quantity(one.drift * 60, unit, 3)} a minute (dashed)"
        for axis, one in outputs.items()
    )
    return f"The measured position, drawn as minimum and maximum of short intervals, so no peak is lost. {each}."


def response(responses: Mapping[str, FrequencyResponse]) -> str:
    """Caption of figure 4."""
    each = []
    for axis, frf in responses.items():
        used = frf.trusted
        if not bool(np.any(used)):
            each.append(f"Axis {axis}: no line can be trusted; all are drawn without a band")
            continue
        typical = float(np.median(frf.sigma[used] / np.abs(frf.response[used])))
        each.append(
            f"Axis {axis}: {int(np.sum(used))} lines, {number(frf.averages, 3)} averages, typical standard deviation {number(100 * typical, 2)} %"
        )
    return (
        "Magnitude and phase of the measured response (H1) with the 95 % band of each line. A band that is not visible is "
        f"thinner than the line. {'. '.join(each)}."
    )


def coherence(responses: Mapping[str, FrequencyResponse], least: float) -> str:
    """Caption of figure 5."""
    each = []
    for axis, frf in responses.items():
        used = frf.coherence[frf.trusted]
        lowest = f"median {number(float(np.median(used)), 4)}, lowest used {number(float(np.min(used)), 3)}" if used.size else "no line used"
        each.append(f"Axis {axis}: {lowest}")
    return (
        "At 1 the input explains all of the output. Crosses are lines that no fit uses: not excited, or below the limit of "
        f"{number(least, 2)} (dotted). {'. '.join(each)}."
    )


def fit(axis: str, fits: Mapping[str, Fit]) -> str:
    """The caption of figure 6 for one axis."""
    each = ", ".join(f"{name} {number(one.error_cost, 3)} %" for name, one in fits.items())
    banded = "; shaded: 95 % band of the ML fit, widened by its error beyond noise" if math.isfinite(fits["ML"].misfit) else ""
    return f"Axis {axis}: fits over the measured response{banded}; relative error {each}."
