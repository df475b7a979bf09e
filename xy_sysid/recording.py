"""A recording: what was applied to the axes and what their encoders read, checked and in SI."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadInput
from xy_sysid.stream import FloatArray


@dataclass(frozen=True, slots=True)
class Recording:
    """Paired samples of input and output.

    sampling_rate: Hz, from the time stamps
    axes:          names, one per column
    seq:           (n,) strictly increasing sample counter; a step larger than one is a gap
    time:          (n,) sample instants, s
    voltage:       (n, axes) input in ``input_unit``, held from its instant to the next
    position:      (n, axes) output in ``output_unit`` at its instant
    reference:     (n, axes) the commanded position where the file has one (a sign of closed loop), else None
    notes:         what was converted or assumed while reading, one sentence each
    """

    sampling_rate: float
    axes: tuple[str, ...]
    seq: NDArray[np.int64]
    time: FloatArray
    voltage: FloatArray
    position: FloatArray
    input_unit: str = "V"
    output_unit: str = "m"
    reference: FloatArray | None = None
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        rows = self.seq.shape[0]
        expected = (rows, len(self.axes))
        for name in ("voltage", "position"):
            shape = getattr(self, name).shape
            if shape != expected:
                raise BadInput(f"shape of {name}", shape, str(expected), "Give one row per sample and one column per axis.")
        if self.time.shape != (rows,):
            raise BadInput("shape of time", self.time.shape, str((rows,)), "Give one instant per sample.")
        if not (np.isfinite(self.sampling_rate) and self.sampling_rate > 0):
            raise BadInput("sampling rate", self.sampling_rate, "> 0 Hz", "Check the time column.")
        if rows > 1 and not bool(np.all(np.diff(self.seq) > 0)):
            raise BadInput("seq", "not increasing", "strictly increasing", "Sort the samples and drop repeated ones.")

    def __len__(self) -> int:
        return int(self.seq.shape[0])

    @property
    def duration(self) -> float:
        """Length of the data itself, without its gaps, s."""
        return len(self) / self.sampling_rate

    def runs(self) -> list[slice]:
        """Slices of consecutive samples; the recording has ``len(runs()) - 1`` gaps."""
        edges = np.flatnonzero(np.diff(self.seq) != 1) + 1
        bounds = [0, *edges.tolist(), len(self)]
        return [slice(a, b) for a, b in itertools.pairwise(bounds) if b > a]

    def axis(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Input and output of one axis, (n,) each; raises BadInput for a name that is not there."""
        if name not in self.axes:
            raise BadInput("axis", repr(name), ", ".join(self.axes), "Choose one of these.")
        column = self.axes.index(name)
        return self.voltage[:, column], self.position[:, column]


def rate_from_time(time: FloatArray, seq: NDArray[np.int64] | None = None) -> float:
    """Sampling rate in Hz from sample instants, robust to jitter and gaps.

    The median step gives the scale, a straight line through the longest gap-free part gives the figure; a rate within
    20 ppm of a whole number is that number. Raises BadInput if time does not increase.
    """
    if time.shape[0] < 2:
        raise BadInput("number of samples", time.shape[0], "2 or more", "Record for longer.")
    steps = np.diff(time)
    if not bool(np.all(np.isfinite(steps))):
        raise BadInput("time column", "not finite", "finite seconds", "Remove the rows without a time.")
    counts = np.ones_like(steps) if seq is None else np.diff(seq).astype(np.float64)
    period = float(np.median(steps / counts))
    if period <= 0:
        raise BadInput("median time step", f"{period:.3g} s", "> 0 s", "Sort the rows by time and drop repeated ones.")
    regular = np.abs(steps - counts * period) < 0.5 * period
    span, number = float(np.sum(steps[regular])), float(np.sum(counts[regular]))
    rate = number / span if span > 0 else 1.0 / period
    whole = float(round(rate))
    return whole if whole > 0 and abs(rate / whole - 1.0) < 20e-6 else rate
