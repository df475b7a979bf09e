"""Does the input carry a part that follows the direction of motion? Then friction distorts the frequency response.

The inverse dynamic model, input = a * acceleration + b * speed + c * direction + d, by least squares on samples that went
through one low-pass (Janot, Gautier, Brunot 2019, for EMPS). A hint for people; naming the effect is the diagnosis' work.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from xy_sysid.samples.block import FloatArray

PART_OF_RATE = 0.02  # cut-off of the low-pass over the sampling rate: far below any lag that the model leaves out
SLOWEST = 0.02  # of the rms speed: below, the direction counts as zero
SURE = 8.0  # standard errors from which the hint is given; linear simulated axes stay below 3, EMPS has 219
ENOUGH = 200  # samples after decimation needed for a hint


@dataclass(frozen=True, slots=True)
class FrictionHint:
    """level: input opposed to motion, input unit; error: its standard error; share: of the input's variance it explains alone."""

    level: float
    error: float
    share: float


def friction_hint(u: FloatArray, y: FloatArray, sampling_rate: float) -> FrictionHint | None:
    """The part of the input (n,) that follows the direction of the output's (n,) motion; None if there is too little motion, or none that turns."""
    step = max(int(0.25 / PART_OF_RATE), 1)
    if u.shape[0] < ENOUGH * step or float(np.ptp(y)) == 0.0:
        return None
    from scipy import signal

    taps = signal.firwin(8 * step + 1, PART_OF_RATE * sampling_rate, fs=sampling_rate)

    def low(values: FloatArray) -> FloatArray:
        return np.asarray(signal.oaconvolve(values, taps, mode="valid"), dtype=np.float64)

    speed = np.gradient(low(y - y[0])) * sampling_rate
    direction = np.where(np.abs(speed) > SLOWEST * float(np.sqrt(np.mean(speed**2))), np.sign(speed), 0.0)
    pace = low(speed)  # direction jumps: it goes through the filter like the input, which feels it
    target = low(low(u - u[0]))[::step]
    target = target - float(np.mean(target))
    table = np.column_stack([np.gradient(pace)[::step] * sampling_rate, pace[::step], np.ones_like(target), low(direction)[::step]])
    scale = np.linalg.norm(table, axis=0)
    if not bool(np.all(scale > 0)) or float(target @ target) == 0.0:
        return None
    without = _left_over(table[:, :3] / scale[:3], target)
    solution, _, rank, _ = np.linalg.lstsq(table / scale, target, rcond=None)
    if int(rank) < table.shape[1]:  # an axis that never turns shows no direction
        return None
    rest = target - table / scale @ solution
    deviation = float(np.sqrt(rest @ rest / max(len(target) - 4, 1)) * np.linalg.norm(np.linalg.pinv(table / scale)[3]))
    share = (without - float(rest @ rest)) / float(target @ target)
    way = -1.0 if solution[0] < 0 else 1.0  # input and output may be wired against each other
    return FrictionHint(way * float(solution[3] / scale[3]), deviation / float(scale[3]), share)


def friction_note(hint: FrictionHint | None) -> str:
    """The sentence for people, empty when there is nothing to say.

    It gives no size: a regression through a low-pass finds a fifth of the friction of a machine under noise, which a simulation fits exactly.
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
