"""Samples that carry a stamp and no counter (sensor_msgs/JointState) become counted samples, so that they pair like blocks.

With a voltage stream the counter is that of the voltage sample nearest in time; alone, steps of the stamp are counted.
"""

from __future__ import annotations

import numpy as np

from xy_sysid.recording import rate_from_time
from xy_sysid.ring import RATE_SAMPLES
from xy_sysid.stream import Block, FloatArray

RESTART = 1.0  # s that a stamp must go back to mean that the source has started again


class JointCounter:
    """add(time, row) -> a block of one or more counted samples, or None while the rate is not known yet."""

    def __init__(self, axes: tuple[str, ...], with_voltage: bool) -> None:
        """with_voltage: counters come from ``see_voltage``; otherwise from the stamps alone."""
        self._axes = axes
        self._with_voltage = with_voltage
        self._rate: float | None = None
        self._anchor: tuple[float, float] | None = None  # (time, counter)
        self._early: list[tuple[float, FloatArray]] = []

    def see_voltage(self, block: Block) -> None:
        """Learn rate and place from the voltage stream."""
        if not self._with_voltage or len(block) == 0 or not bool(np.isfinite(block.time).all()):
            return
        self._anchor = (float(block.time[-1]), float(block.seq[-1]))
        if self._rate is None and len(block) > 1 and float(block.time[-1]) > float(block.time[0]):
            self._rate = float(block.seq[-1] - block.seq[0]) / float(block.time[-1] - block.time[0])

    def add(self, time: float, row: FloatArray) -> Block | None:
        """One sample, (axes,) at its stamp in s; a stamp that does not advance the counter gives None."""
        if not np.isfinite(time):
            return None
        if self._rate is None or self._anchor is None:
            self._early.append((time, row))
            if self._with_voltage:
                self._early = self._early[-4 * RATE_SAMPLES :]
            elif len(self._early) >= RATE_SAMPLES:
                self._learn()
            if self._rate is None or self._anchor is None:
                return None
            early, self._early = self._early, []
            return self._count(early)
        return self._count([(time, row)])

    def _learn(self) -> None:
        times = np.array([time for time, _ in self._early])
        steps = np.diff(times)
        usable = steps[steps > 0]
        if usable.size < RATE_SAMPLES // 4:
            self._early = []
            return
        counts = np.maximum(np.rint(steps / np.median(usable)), 0).astype(np.int64)
        keep = np.concatenate(([True], counts > 0))
        seq = np.concatenate(([0], np.cumsum(counts)))
        self._rate = rate_from_time(times[keep], seq[keep])
        self._anchor = (float(times[0]) - 1.0 / self._rate, -1.0)

    def _count(self, samples: list[tuple[float, FloatArray]]) -> Block | None:
        assert self._rate is not None and self._anchor is not None
        seqs: list[float] = []
        times: list[float] = []
        rows: list[FloatArray] = []
        for time, row in samples:
            if not self._with_voltage and time < self._anchor[0] - RESTART:
                self._anchor = (time - 1.0 / self._rate, -1.0)
                seqs, times, rows = [], [], []
            seq = self._anchor[1] + round((time - self._anchor[0]) * self._rate)
            if seq < 0 or (seqs and seq <= seqs[-1]) or (not self._with_voltage and seq <= self._anchor[1]):
                continue
            seqs.append(seq)
            times.append(time)
            rows.append(row)
            if not self._with_voltage:
                self._anchor = (time, seq)
        if not seqs:
            return None
        return Block(self._axes, np.array(seqs), np.array(times), np.array(rows))
