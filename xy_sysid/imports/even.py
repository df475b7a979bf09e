"""From uneven time to even samples: samples with jittering stamps are counted; samples at uneven instants are resampled, or refused.

If only the stamps jitter, they stay within a period of a straight line on both sides; the samples are even and stay unchanged.
If the instants drift from the line, the samples are uneven: the input, which is held from sample to sample, is averaged over each
even step (so that no drive is lost or doubled), and the output is interpolated (cubic), but not over more than ``GAP`` periods.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.imports.paired_streams import is_jitter, steady
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import rate_from_time

GAP = 2.5  # periods; over a longer step nothing is interpolated
BRIDGED = 10.0  # periods; used instead of GAP if steps jitter so much that fewer than LOCAL come without a gap
LOCAL = 50  # samples over which the period is evaluated
STEADY = 0.005  # relative; a period that varies less counts as even: the error of frequencies is no larger
BURST = 0.2  # of a period; if more than BURSTS of the steps are shorter, the stamps came in bursts
BURSTS = 0.2
STRETCH, APART = (
    200,
    50,
)  # samples over which a period is distinguished from late, lost and jittering stamps; distance of two samples that are compared
DRIFT = 0.02  # relative; a period that changes by more within a recording is not constant
LOST = 0.3  # of the time; jittering steps longer than GAP may cover no more
Values = tuple[FloatArray, ...]


@dataclass(frozen=True, slots=True)
class Even:
    """seq: (n,) sample numbers; time: (n,) s; rate: Hz; values: given or resampled."""

    seq: FloatArray
    time: FloatArray
    rate: float
    values: Values


def even(path: Path, time: FloatArray, held: FloatArray, smooth: Values, notes: list[str]) -> Even:
    """Number samples by their instants. held: (n, axes) the input; smooth: (n, axes) output and reference. Raises BadRecording."""
    try:
        rate = rate_from_time(time)
    except BadInput as error:
        act = "Sort the rows by time, or if stamps are too coarse for the samples give --rate in Hz."
        raise BadRecording(path, f"{error.what} is {error.value}", act) from None
    steps = np.diff(time) * rate
    if float(steps.min()) < -1.0:
        row = int(np.argmin(steps)) + 1
        raise BadRecording(path, f"time falls back from {time[row - 1]:.9g} to {time[row]:.9g} s at sample {row + 1}", "Sort the samples by time.")
    if _wanders(steps):
        return _resampled(path, time, rate, held, smooth, notes)
    seq = np.concatenate(([0.0], np.cumsum(np.rint(steps))))
    drift = np.rint((time - time[0]) * rate)
    if float(np.max(np.abs(seq - drift))) <= 1:
        seq = drift
    if is_jitter(np.diff(seq)):
        notes.append("the time column jitters by more than half a sample; samples are numbered as they stand, with even times")
        instants = steady(time)
        return Even(np.arange(len(time), dtype=np.float64), instants, rate_from_time(instants), (held, *smooth))
    return Even(seq, time, rate, (held, *smooth))


def _wanders(steps: FloatArray) -> bool:
    """True if the period itself changes; False if only single stamps jitter around a constant one."""
    near = steps[(steps > 0) & (steps < GAP)]
    if len(near) < 2 * LOCAL:
        return False
    mean = float(np.mean(near))
    off = near / mean - 1.0
    sums = np.concatenate(([0.0], np.cumsum(off)))
    local = (sums[LOCAL:] - sums[:-LOCAL]) / LOCAL
    line = np.arange(len(sums)) - (len(sums) - 1) / 2
    from_line = sums - sums.mean() - line * (line @ sums) / (line @ line)
    if float(np.max(np.abs(from_line))) < 1.0:  # never off by a full period: jitter, or nothing to lose
        return False
    return float(np.max(np.abs(local))) > STEADY


def drifts(time: FloatArray) -> bool:
    """True if the period itself changes, as on an overloaded machine; late, lost or compensated cycles do not count."""
    steps = np.diff(time)
    if len(time) < 2 * STRETCH or not float(np.median(steps)) > 0:
        return False
    lost = np.concatenate(([0.0], np.cumsum(np.rint(steps / np.median(steps)))))
    return all(_varies(time, count) for count in (np.arange(len(time), dtype=np.float64), lost))


def _varies(time: FloatArray, count: FloatArray) -> bool:
    """True if the period by this count, a median over a stretch, differs between stretches."""
    passed, counted = time[APART:] - time[:-APART], count[APART:] - count[:-APART]
    periods, rows = passed / np.maximum(counted, 1.0), STRETCH - APART
    local = [np.median(periods[begin : begin + rows]) for begin in range(0, len(periods) - rows + 1, STRETCH // 2)]
    return bool(np.ptp(local) > DRIFT * np.median(local))


def _resampled(path: Path, time: FloatArray, rate: float, held: FloatArray, smooth: Values, notes: list[str]) -> Even:
    steps = np.diff(time) * rate
    shortest, middle, longest = (float(value) / rate * 1e3 for value in (steps.min(), np.median(steps), steps.max()))
    uneven = f"time is uneven: steps from {shortest:.4g} to {longest:.4g} ms, most {middle:.4g} ms"
    taken = "If the samples were evenly spaced nevertheless, give --rate in Hz; otherwise record again with a steady clock."
    if float(np.mean(steps < BURST)) > BURSTS:
        raise BadRecording(path, f"{uneven}; {100 * np.mean(steps < BURST):.0f} % of the stamps come in bursts", taken)
    gap = BRIDGED if _scattered(steps) else GAP
    if gap > GAP and float(np.sum(steps[steps > GAP])) > LOST * float(np.sum(steps)):
        raise BadRecording(path, f"{uneven}; {100 * np.sum(steps[steps > GAP]) / np.sum(steps):.0f} % of the time lies in gaps", taken)
    fresh = np.concatenate(([True], np.diff(time) > 1e-3 / rate))
    if not fresh.all():
        notes.append(f"{int(np.sum(~fresh))} samples are there twice; the first is kept")
        time, held, smooth = time[fresh], held[fresh], tuple(values[fresh] for values in smooth)
    spread = float(np.std(np.diff(time)[np.diff(time) * rate < gap])) * rate
    edges = np.flatnonzero(np.diff(time) * rate > gap) + 1
    numbers: list[FloatArray] = []
    parts: list[Values] = []
    for begin, end in zip([0, *edges.tolist()], [*edges.tolist(), len(time)], strict=True):
        if end - begin < 4:
            continue
        first, last = int(np.ceil((time[begin] - time[0]) * rate - 1e-6)), int(np.floor((time[end - 1] - time[0]) * rate - 1.0 + 1e-6))
        if last < first:
            continue
        count = np.arange(first, last + 1, dtype=np.float64)
        instants = time[0] + count / rate
        numbers.append(count)
        mine = slice(begin, end)
        parts.append((_means(time[mine], held[mine], instants, 1.0 / rate), *(between(time[mine], values[mine], instants) for values in smooth)))
    if not numbers:
        raise BadRecording(path, f"{uneven}; no stretch is long enough", taken)
    seq = np.concatenate(numbers)
    notes.append(
        f"{uneven} ({100 * spread:.2g} % rms); {len(time)} samples are resampled to {len(seq)} at {rate:.6g} Hz: "
        "the input is held, the output interpolated"
    )
    return Even(seq, time[0] + seq / rate, rate, tuple(np.concatenate([part[place] for part in parts]) for place in range(1 + len(smooth))))


def _scattered(steps: FloatArray) -> bool:
    """Whether long steps are spread among the others, as with a jittering clock, instead of separating stretches. steps: in periods."""
    edges = np.concatenate(([0], np.flatnonzero(steps > GAP) + 1, [len(steps) + 1]))
    sizes = np.diff(edges)
    return float(np.median(np.repeat(sizes, sizes))) < LOCAL


def _means(time: FloatArray, held: FloatArray, instants: FloatArray, period: float) -> FloatArray:
    """(m, axes) mean of the held input from each instant to the next."""
    lasting = np.diff(time)[:, None] * held[:-1]
    area = np.concatenate((np.zeros((1, held.shape[1])), np.cumsum(lasting, axis=0)))
    edges = np.append(instants, instants[-1] + period)
    return np.diff(np.column_stack([np.interp(edges, time, column) for column in area.T]), axis=0) / period


def between(time: FloatArray, values: FloatArray, instants: FloatArray) -> FloatArray:
    """Values (n, ...) at other instants, by a cubic spline."""
    from scipy.interpolate import CubicSpline  # imported only for uneven samples

    return np.asarray(CubicSpline(time, values, axis=0)(instants))
