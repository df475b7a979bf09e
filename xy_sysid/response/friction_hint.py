"""Does the input have a part that follows the direction of motion? If so, friction distorts the frequency response.

The inverse dynamic model, input = a * acceleration + b * speed + c * direction + d, is fitted by least squares to samples after a common
low-pass (Janot, Gautier, Brunot 2019, for EMPS). This is a hint for the user; the diagnosis names the effect.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from xy_sysid.samples.block import FloatArray

PART_OF_RATE = 0.02  # cut-off of the low-pass over the sampling rate: far below any lag that the model omits
SLOWEST = 0.02  # of the rms speed: for slower motion the direction counts as zero
SURE = 8.0  # least standard errors for the hint; linear simulated axes stay below 3, EMPS has 219
ENOUGH = 200  # samples after decimation needed for a hint


@dataclass(frozen=True, slots=True)
class FrictionHint:
    """level: input opposed to motion, input unit; error: its standard error; share: fraction of the input's variance that it explains alone."""

    level: float
    error: float
    share: float


def friction_hint(u: FloatArray, y: FloatArray, sampling_rate: float) -> FrictionHint | None:
    """The part of the input (n,) that follows the direction of the output's (n,) motion; None if there is too little motion or no reversal."""
    step = max(int(0.25 / PART_OF_RATE), 1)
    if u.shape[0] < ENOUGH * step or float(np.ptp(y)) == 0.0:
        return None
    from scipy import signal

    taps = signal.firwin(8 * step + 1, PART_OF_RATE * sampling_rate, fs=sampling_rate)

    def low(values: FloatArray) -> FloatArray:
        return np.asarray(signal.oaconvolve(values, taps, mode="valid"), dtype=np.float64)

    speed = np.gradient(low(y - y[0])) * sampling_rate
    direction = np.where(np.abs(speed) > SLOWEST * float(np.sqrt(np.mean(speed**2))), np.sign(speed), 0.0)
    pace = low(speed)  # direction is discontinuous and passes through the same filter as the input
    target = low(low(u - u[0]))[::step]
    target = target - float(np.mean(target))
    table = np.column_stack([np.gradient(pace)[::step] * sampling_rate, pace[::step], np.ones_like(target), low(direction)[::step]])
    scale = np.linalg.norm(table, axis=0)
    if not bool(np.all(scale > 0)) or float(target @ target) == 0.0:
        return None
    without = _left_over(table[:, :3] / scale[:3], target)
    solution, _, rank, _ = np.linalg.lstsq(table / scale, target, rcond=None)
    if int(rank) < table.shape[1]:  # an axis that never reverses gives no information on direction
        return None
    rest = target - table / scale @ solution
    deviation = float(np.sqrt(rest @ rest / max(len(target) - 4, 1)) * np.linalg.norm(np.linalg.pinv(table / scale)[3]))
    share = (without - float(rest @ rest)) / float(target @ target)
    way = -1.0 if solution[0] < 0 else 1.0  # input and output may have opposite signs
    return FrictionHint(way * float(solution[3] / scale[3]), deviation / float(scale[3]), share)


def friction_note(hint: FrictionHint | None) -> str:
    """The sentence for the user, empty without a hint.

    It gives no size: with noise, this regression may find a fifth of the friction that a fit by simulation finds exactly.
    """
    if hint is None or hint.level < SURE * hint.error:
        return ""
    return (
        "Friction: part of the input follows the direction of motion. It distorts the frequency response, most at low frequency and small "
        "amplitude, and the response changes with the amplitude. To estimate its size: xy-sysid refine REC --auto."
    )


def _left_over(table: FloatArray, target: FloatArray) -> float:
    solution, *_ = np.linalg.lstsq(table, target, rcond=None)
    rest = target - table @ solution
    return float(rest @ rest)
