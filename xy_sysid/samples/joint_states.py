"""Converts samples with a time stamp and no counter (sensor_msgs/JointState) to counted samples, so that they pair like blocks.

Without a voltage stream they are counted by their stamps, which may jitter (``stamp_counter``). With one, the counter is that of the
voltage sample nearest in time.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from xy_sysid.jit import compiled
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.samples.integral import Path
from xy_sysid.samples.joint_fields import JointOutput
from xy_sysid.samples.ring import RATE_SAMPLES
from xy_sysid.samples.stamp_counter import FOLLOW, StampCounter

RESTART = 1.0  # s by which a stamp goes back at a restart of the source
APART = 1.0  # s between the newest stamps of voltage and joint states, above which their clocks differ
ANCHORS = 20  # samples of voltage for the first estimate of the rate
SAME_RATE = 0.01  # relative difference allowed between the rates of voltage and joint states, estimated from 200 jittering stamps
CATCHING_UP = 0.2  # relative difference allowed between the step over long stretches and the median step
LOOK, FEW_LOOK, MANY_LOOK = 2.0, RATE_SAMPLES // 2, 40_000  # s of stamps, and least and largest number, between two checks of the rate
OTHER_RATE = 1.01  # factor by which their counted and their mean step must both differ: losses change only the mean, bursts only the count
PIECE = 4096  # stamps that ``feed`` looks through at once
COUNTED = 3  # iterations of the step: stamps are counted with it, and a line through them gives the next
STICKS = 0.8  # samples by which a sample may deviate from its voltage sample before it is assigned to another
STILL = 20  # consecutive messages with one stamp after which they count as unstamped


def counted_step(times: FloatArray) -> float:
    """Step between samples, s, by a straight line through stamps counted with the usual step: losses and jitter do not change it, bursts do."""
    step = float(np.median(np.diff(times)))
    for _ in range(COUNTED):
        count = _counted(times, step)
        count -= count.mean()
        step = float(count @ (times - times.mean()) / (count @ count))
    return step


@compiled
def _counted(times: FloatArray, step: float) -> FloatArray:
    """Number of each stamp, on an even time grid that follows the stamps slowly, so that jitter does not accumulate."""
    count = np.zeros(times.shape[0])
    instant = times[0]
    for k in range(1, times.shape[0]):
        passed = np.rint((times[k] - instant) / step)
        instant += passed * step
        instant += FOLLOW * (times[k] - instant)
        count[k] = count[k - 1] + passed
    return count


def usual_step(times: FloatArray) -> float:
    """Step between samples, s: the counted step, or that of a straight line if most cycles only catch up after a delay."""
    times = times[np.concatenate(([True], np.diff(np.maximum.accumulate(times)) > 0))]
    far = max(len(times) // 4, 1)
    step, mean = float(np.median(np.diff(times))), float(np.median(times[far:] - times[:-far])) / far
    if abs(mean / step - 1.0) < CATCHING_UP:
        return counted_step(times)
    count = np.arange(len(times)) - (len(times) - 1) / 2
    return float(count @ (times - times.mean()) / (count @ count))


class JointCounter:
    """add(time, row) -> a block of one or more counted samples, or None while the rate is unknown."""

    def __init__(self, axes: tuple[str, ...], with_voltage: bool, output: JointOutput = "position") -> None:
        """with_voltage: counters come from ``see_voltage``; otherwise from the stamps alone.

        output: quantity of the first ``axes`` numbers of each row; velocities become positions
        """
        self._axes = axes
        self._path = Path(len(axes)) if output == "velocity" else None
        self._with_voltage = with_voltage
        self._rate: float | None = None
        self._anchor: tuple[float, float] | None = None  # (time, counter)
        self._begin: tuple[float, float] | None = None  # first of the voltage samples for the rate
        self._early: list[tuple[float, FloatArray]] = []
        self._counter: StampCounter | None = None
        self._undecided: deque[FloatArray] = deque()  # samples whose number is unknown so far
        self._offset: int | None = None  # from numbers to counters of the voltage
        self._stamps: deque[float] = deque(maxlen=RATE_SAMPLES)
        self._newest, self._still = 0.0, 0
        self._latest = 0.0  # stamp of the newest used sample
        self._since: list[float] = []  # stamps since the last check of the period
        self._other = 0  # 1 if the last check found a longer step than the learned one, -1 for a shorter one, else 0

    def see_voltage(self, block: Block) -> None:
        """Learn rate and counter from the voltage stream; blocks may have one row."""
        if not self._with_voltage or len(block) == 0 or not bool(np.isfinite(block.time).all()):
            return
        first, last = (float(block.time[0]), float(block.seq[0])), (float(block.time[-1]), float(block.seq[-1]))
        if self._begin is None or self._goes_elsewhere(*first):
            self._begin, self._rate, self._counter = first, None, None
        self._anchor = last
        if last[1] - self._begin[1] >= ANCHORS - 1 and last[0] > self._begin[0]:
            self._rate = (last[1] - self._begin[1]) / (last[0] - self._begin[0])

    def _goes_elsewhere(self, time: float, seq: float) -> bool:
        """True if the voltage has restarted: its counter or time went back, or they no longer match."""
        assert self._anchor is not None
        before_time, before_seq = self._anchor
        lapse = (seq - before_seq) / self._rate if self._rate is not None else time - before_time
        return seq <= before_seq or time <= before_time or abs(time - before_time - lapse) > APART

    def wrong(self) -> str:
        """Why stamped samples cannot be counted, in words; empty if they can."""
        if not np.isfinite(self._newest):
            return "joint_states: the stamps are not finite; stamp each message with its instant."
        if self._still >= STILL:
            stamps = "are zero" if self._newest == 0 else f"stay at {self._newest:.6f} s"
            return f"joint_states: the stamps {stamps}; the driver must stamp each message with its instant."
        if not self._with_voltage or self._anchor is None:
            return ""
        apart = self._newest - self._anchor[0]
        if abs(apart) > APART:
            return (
                f"the clocks of voltage and joint_states are apart by {abs(apart):.6g} s (voltage {self._anchor[0]:.3f} s, "
                f"joint_states {self._newest:.3f} s); stamp both in ROS time, on computers whose clocks agree."
            )
        own = self._own_rate()
        if self._rate is not None and own is not None and abs(own / self._rate - 1.0) > SAME_RATE:
            return (
                f"the rates differ: voltage comes at {self._rate:.6g} Hz, joint_states at {own:.6g} Hz; "
                "set the parameter rate of the excitation to that of the joint states."
            )
        return ""

    def _own_rate(self) -> float | None:
        """Hz, from the newest stamps, None while there are too few."""
        times = np.array(self._stamps)
        times = times[np.concatenate(([True], np.diff(times) > 0))] if times.size else times
        return 1.0 / counted_step(times) if times.size > RATE_SAMPLES // 2 else None

    def _watch(self, time: float) -> None:
        self._still = self._still + 1 if time == self._newest else 0
        if np.isfinite(time) and time < self._newest:
            self._stamps.clear()
        self._newest = time
        if np.isfinite(time):
            self._stamps.append(time)

    def add(self, time: float, row: FloatArray) -> Block | None:
        """Add one sample with its stamp in s, (axes,) or more numbers; returns None for a stamp that does not advance the counter."""
        self._watch(time)
        if not np.isfinite(time):
            return None
        self._early.append((time, row))
        if self._rate is None or self._anchor is None:
            if self._with_voltage:
                self._early = self._early[-4 * RATE_SAMPLES :]
            elif len(self._early) >= RATE_SAMPLES:
                self._learn()
            if self._rate is None or self._anchor is None:
                return None
        waiting, self._early = self._early, []
        return self._count(waiting)

    def feed(self, times: FloatArray, rows: FloatArray) -> tuple[Block, NDArray[np.int64]]:
        """Add samples as ``add`` does, one after the other; returns all their blocks as one, and the index of the sample that each row came with.

        times: (n,) s; rows: (n, numbers)
        """
        found: list[tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray]] = []
        begin = 0
        while begin < len(times):
            end = begin + self._plain(times[begin : begin + PIECE])
            if end > begin:
                found.append(self._stretch(begin, times[begin:end], rows[begin:end]))
            else:
                block, end = self.add(float(times[begin]), rows[begin]), begin + 1
                if block is not None:
                    found.append((np.full(len(block), begin), block.seq, block.time, block.values))
            begin = end
        if not found:
            found.append((np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros((0, rows.shape[1]))))
        index, seq, time, values = (np.concatenate(parts) for parts in zip(*found, strict=True))
        return Block(self._axes, seq, time, values), index

    def _plain(self, times: FloatArray) -> int:
        """Number of the next stamps that are counted together: up to a restart, a check of the rate or one not finite; 0 with voltage or velocity."""
        if self._rate is None or self._counter is None or self._with_voltage or self._path is not None:
            return 0
        latest = np.maximum.accumulate(np.concatenate(([self._latest], times)))[:-1]
        later = times > latest
        count = len(self._since) + np.cumsum(later)
        since = self._since[0] if self._since else times[np.argmax(later)]
        look = later & (count >= FEW_LOOK) & ((times - since >= LOOK) | (count >= MANY_LOOK))
        other = look | ~np.isfinite(times) | (times < latest - RESTART)
        return int(np.argmax(other)) if other.any() else len(times)

    def _stretch(self, begin: int, times: FloatArray, rows: FloatArray) -> tuple[NDArray[np.int64], FloatArray, FloatArray, FloatArray]:
        """(index of the deciding sample, from ``begin``, counter, instant, row) of each sample that is decided by these plain ones."""
        assert self._counter is not None
        steps = np.diff(times, prepend=self._newest)
        moves, backs = np.flatnonzero(steps != 0.0), np.flatnonzero(steps < 0.0)
        self._still = len(times) - 1 - int(moves[-1]) if moves.size else self._still + len(times)
        if backs.size:
            self._stamps.clear()
        self._stamps.extend(times[backs[-1] if backs.size else 0 :].tolist())
        self._newest = float(times[-1])
        decided = self._counter.feed(times)
        self._since += times[decided.used].tolist()
        self._latest = max(self._latest, float(np.max(times)))
        waiting = np.concatenate((np.reshape(np.array(self._undecided), (-1, rows.shape[1])), rows[decided.used]))
        done = len(decided.number)
        self._undecided = deque(waiting[done:])
        known = decided.number >= 0
        return begin + decided.at[known], decided.number[known].astype(np.float64), decided.instant[known], waiting[:done][known]

    def _learn(self) -> None:
        times = np.array([time for time, _ in self._early])
        steps = np.diff(times)
        usable = steps[steps > 0]
        if usable.size < RATE_SAMPLES // 4:
            self._early = []
            return
        period = usual_step(times)
        self._rate, self._anchor = 1.0 / period, (float(times[0]) - period, -1.0)

    def _learn_again(self, time: float) -> None:
        """Estimate the rate again from the newest stamps: the driver may have changed it, or the first estimate was made during a delay."""
        self._since.append(time)
        count, seconds = len(self._since), time - self._since[0]
        if count < FEW_LOOK or (seconds < LOOK and count < MANY_LOOK):
            return
        assert self._rate is not None
        times, self._since = np.array(self._since), []
        steps = self._rate * np.array([counted_step(times), seconds / (count - 1)])
        other = int(np.all(steps > OTHER_RATE)) - int(np.all(steps < 1.0 / OTHER_RATE))
        if other and other == self._other:  # for the second time: all of these stamps are from after the change
            self._rate, self._counter, other = 1.0 / usual_step(times), None, 0
        self._other = other

    def _count(self, samples: list[tuple[float, FloatArray]]) -> Block | None:
        assert self._rate is not None and self._anchor is not None
        seqs: list[float] = []
        times: list[float] = []
        rows: list[FloatArray] = []
        for time, row in samples:
            if self._with_voltage and abs(time - self._anchor[0]) > APART:
                continue
            if time < self._latest - RESTART:
                self._since = []
            if not self._with_voltage and time > self._latest:
                self._learn_again(time)
            if self._counter is None or time < self._latest - RESTART:
                self._counter, self._offset = StampCounter(1.0 / self._rate), None
                self._undecided.clear()
                seqs, times, rows = [], [], []
            decided = self._counter.feed(np.array([time]))
            if not decided.used[0]:
                continue
            self._latest = time
            self._undecided.append(row)
            for number, instant in zip(decided.number.tolist(), decided.instant.tolist(), strict=True):
                seq, row_of_it = self._place(number, instant), self._undecided.popleft()
                if seq >= 0 and not (seqs and seq <= seqs[-1]):
                    seqs.append(seq)
                    times.append(instant)
                    rows.append(row_of_it)
        if not seqs:
            return None
        block = Block(self._axes, np.array(seqs), np.array(times), np.array(rows))
        if self._path is not None and self._counter is not None:
            moved = block.values[:, : len(self._axes)]
            moved[:] = self._path.add(block.seq, moved, self._counter.period)
        return block

    def _place(self, number: int, instant: float) -> float:
        """The counter of a sample: its number, or that of the voltage sample at the same instant, at a constant offset while it fits."""
        if not self._with_voltage:
            return float(number)
        assert self._rate is not None and self._anchor is not None
        nearest = self._anchor[1] + (instant - self._anchor[0]) * self._rate
        if self._offset is None or abs(nearest - number - self._offset) > STICKS:
            self._offset = round(nearest) - number
        return float(number + self._offset)
