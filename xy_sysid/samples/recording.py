"""A recording: input and output of all axes, checked and in SI."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import OF, SCALES, Sensed, Units

STANDS = 0.02  # of the longest distance within a second: an axis with less motion and no drive counts as at rest
COMPARABLE = 0.5  # of the longest stretch; shorter ones contain too few of its windows
MOST_STRETCHES = 24  # most stretches that are analysed together
SLOWEST = 3.0  # Hz; a lower rate is not a machine axis but a wrong time unit
SAME_RATE = 1e-3  # relative; sampling rates that differ by more do not belong together


@dataclass(frozen=True, slots=True)
class Origin:
    """The origin of a result: axis, SHA-256 of its samples (empty if unknown), and notes for the user."""

    axis: str = ""
    data: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Run:
    """Consecutive samples of one axis, without a gap.

    sampling_rate: Hz
    voltage:       (n,) input in ``input_unit``, held from its instant to the next
    position:      (n,) output in ``output_unit`` at its instant
    first:         index of the first sample in the recording
    measured:      quantity of the sensor; ``position`` is the integral of a velocity or an acceleration
    """

    axis: str
    sampling_rate: float
    voltage: FloatArray
    position: FloatArray
    first: int = 0
    input_unit: str = "V"
    output_unit: str = "m"
    measured: Sensed = "position"

    def __post_init__(self) -> None:
        if self.voltage.ndim != 1 or self.voltage.shape != self.position.shape:
            shapes = f"{self.voltage.shape} and {self.position.shape}"
            raise BadInput("shape of voltage and position", shapes, "one and the same (n,)", "Give one value per sample in both.")

    def __len__(self) -> int:
        return int(self.voltage.shape[0])

    @property
    def seconds(self) -> float:
        """Length in time."""
        return len(self) / self.sampling_rate

    @property
    def rows(self) -> slice:
        """The rows of the samples in the recording."""
        return slice(self.first, self.first + len(self))

    def until(self, seconds: float) -> Run:
        """The samples before that time; all if the run is shorter."""
        last = round(seconds * self.sampling_rate)
        return replace(self, voltage=self.voltage[:last], position=self.position[:last])

    def after(self, sample: int) -> Run:
        """The samples from this index on."""
        return replace(self, voltage=self.voltage[sample:], position=self.position[sample:], first=self.first + sample)

    @property
    def units(self) -> Units:
        """Units of input and output."""
        return OF[self.measured](self.input_unit, self.output_unit)

    @property
    def digest(self) -> str:
        """SHA-256 of the samples; runs with the same hash hold the same data."""
        return hashlib.sha256(self.voltage.tobytes() + self.position.tobytes()).hexdigest()

    def recording(self) -> Recording:
        """The run as a recording of one axis."""
        seq = np.arange(self.first, self.first + len(self), dtype=np.int64)
        return Recording(
            sampling_rate=self.sampling_rate,
            axes=(self.axis,),
            seq=seq,
            time=seq / self.sampling_rate,
            voltage=self.voltage[:, None],
            position=self.position[:, None],
            input_unit=self.input_unit,
            output_unit=self.output_unit,
            measured=self.measured,
        )

    @property
    def signals(self) -> tuple[FloatArray, FloatArray, float]:
        """(voltage, position, sampling rate), for comparison with a simulation."""
        return self.voltage, self.position, self.sampling_rate

    @property
    def sensed(self) -> tuple[FloatArray, FloatArray, float]:
        """(voltage, output as its sensor reads it, sampling rate), for comparison with a transfer function."""
        output = as_sensed(self.position, self.sampling_rate, self.measured)
        return self.voltage[: output.size], output, self.sampling_rate

    def __repr__(self) -> str:
        length = f"{len(self)} samples, {self.seconds:.6g} s at {self.sampling_rate:g} Hz"
        return f"<Run of axis {self.axis}: {length}, {self.input_unit} -> {self.units.measured}>"


@dataclass(frozen=True, slots=True)
class Recording:
    """Paired samples of input and output.

    sampling_rate: Hz, from the time stamps
    axes:          names, one per column
    seq:           (n,) strictly increasing sample counter; a step larger than one is a gap
    time:          (n,) sample instants, s
    voltage:       (n, axes) input in ``input_unit``, held from its instant to the next
    position:      (n, axes) output in ``output_unit`` at its instant
    reference:     (n, axes) the commanded position if the file has one (a sign of closed loop), otherwise None
    notes:         conversions and assumptions in reading, one sentence each
    measured:      quantity of the sensor; ``position`` is the integral of a velocity or an acceleration
    machine:       its name in the metadata of the file, otherwise empty
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
    measured: Sensed = "position"
    machine: str = ""

    @property
    def units(self) -> Units:
        """Units of input and output."""
        return OF[self.measured](self.input_unit, self.output_unit)

    def of_axes(self, axes: Sequence[str]) -> Recording:
        """The recording with only these axes, in this order. Raises BadInput for an unknown name."""
        places = [self._column(axis) for axis in axes]
        reference = None if self.reference is None else self.reference[:, places]
        return replace(self, axes=tuple(axes), voltage=self.voltage[:, places], position=self.position[:, places], reference=reference)

    @classmethod
    def from_arrays(
        cls, sampling_rate: float, voltage: Any, position: Any, axes: Sequence[str] = (), units: tuple[str, str] = ("V", "m")
    ) -> Recording:
        """A gap-free recording from samples in memory: lists, arrays, columns of a table, or a mapping of them by axis.

        sampling_rate: Hz; voltage, position: (n,) of one axis, (n, axes), or {axis: (n,)}, both at the same instants
        axes:          names, one per column; x, y, ... if not given
        units:         of voltage and position; lengths, voltages and angles are converted to SI (mm -> m), others are kept
        Raises BadInput if values are not finite numbers, or if shapes do not fit together.
        """
        inputs, outputs, axes = _columns(voltage, position, axes)
        names = tuple(axes) or tuple("xyzabc"[: inputs.shape[1]] if inputs.shape[1] <= 6 else (f"axis{k + 1}" for k in range(inputs.shape[1])))
        if len(set(names)) != inputs.shape[1]:
            raise BadInput("axes", ", ".join(names), f"{inputs.shape[1]} different names", "Give one name per column.")
        (input_unit, scale), (output_unit, stretch) = (SCALES.get(unit, (unit, 1.0)) for unit in units)
        seq = np.arange(inputs.shape[0], dtype=np.int64)
        return cls(
            sampling_rate=_rate(sampling_rate),
            axes=names,
            seq=seq,
            time=seq / _rate(sampling_rate),
            voltage=inputs * scale,
            position=outputs * stretch,
            input_unit=input_unit,
            output_unit=output_unit,
            source="arrays",
        )

    def __repr__(self) -> str:
        gaps = len(self.runs()) - 1
        told = f", {gaps} gap{'s' if gaps > 1 else ''}" if gaps > 0 else ""
        return f"<Recording of {', '.join(self.axes)}: {len(self)} samples, {self.duration:.6g} s at {self.sampling_rate:g} Hz{told}>"

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
        """Length of the data without gaps, s."""
        return len(self) / self.sampling_rate

    def runs(self) -> list[slice]:
        """Slices of consecutive samples; the recording has ``len(runs()) - 1`` gaps."""
        edges = np.flatnonzero(np.diff(self.seq) != 1) + 1
        bounds = [0, *edges.tolist(), len(self)]
        return [slice(a, b) for a, b in itertools.pairwise(bounds) if b > a]

    def only(self, rows: slice | NDArray[np.bool_]) -> Recording:
        """Some of the samples; omitted ones between them become a gap. Raises BadInput for a mask of another length."""
        check_mask(rows, len(self))
        return replace(
            self,
            seq=self.seq[rows],
            time=self.time[rows],
            voltage=self.voltage[rows],
            position=self.position[rows],
            reference=None if self.reference is None else self.reference[rows],
        )

    def axis(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Input and output of one axis, (n,) each; raises BadInput for an unknown name."""
        column = self._column(name)
        return self.voltage[:, column], self.position[:, column]

    def _column(self, axis: str) -> int:
        if axis not in self.axes:
            raise BadInput("axis", repr(axis), ", ".join(self.axes), "Choose one of these.")
        return self.axes.index(axis)

    def run(self, axis: str) -> Run:
        """The longest stretch of one axis without a gap (the first if several are equal), without idle ends: no drive, no motion.

        Raises BadInput if there is no such axis, or no sample.
        """
        if len(self) == 0:
            raise BadInput("number of samples", 0, "1 or more", "Record for longer, or choose another part.")
        return self._within(axis, max(self.runs(), key=_size))

    def stretches(self, axis: str) -> tuple[Run, ...]:
        """All stretches of one axis without a gap that are at least half as long as the longest, in their order; at most ``MOST_STRETCHES``.

        Each without idle ends (no drive, no motion). Raises BadInput as ``run``.
        """
        least = COMPARABLE * _size(self.run(axis).rows)
        found = [self._within(axis, part) for part in self.runs() if _size(part) >= least]
        longest = sorted(found, key=len, reverse=True)[:MOST_STRETCHES]
        return tuple(sorted(longest, key=lambda run: run.first))

    def left_out(self, axes: Sequence[str]) -> tuple[str, ...]:
        """Data that are in none of the ``stretches`` of these axes, one sentence per axis with omitted data."""
        found = ((axis, self._left_out(axis)) for axis in axes if len(self))
        return tuple(f"axis {axis}: left out {said}" for axis, said in found if said)

    def _left_out(self, axis: str) -> str:
        used = self.stretches(axis)
        whole = [next(_size(part) for part in self.runs() if part.start <= run.first < part.stop) for run in used]
        ends = sum(size - len(run) for size, run in zip(whole, used, strict=True)) / self.sampling_rate
        short, rest = len(self.runs()) - len(used), (len(self) - sum(whole)) / self.sampling_rate
        said = [f"{ends:.3g} s at the ends, where it is not driven and stands"] if ends else []
        said += [f"{short} short {'stretch' if short == 1 else 'stretches'} between gaps, {rest:.3g} s"] if short else []
        return " and ".join(said)

    def every_stretch(self, axis: str) -> tuple[Run, ...]:
        """All stretches of one axis without a gap, however short, complete as recorded. Raises BadInput if there is no such axis."""
        u, y = self.axis(axis)
        return tuple(self._run(axis, u, y, part) for part in self.runs())

    def _within(self, axis: str, whole: slice) -> Run:
        u, y = self.axis(axis)
        driven = _driven(u[whole], y[whole], max(round(self.sampling_rate), 1))
        return self._run(axis, u, y, slice(whole.start + driven.start, whole.start + driven.stop))

    def _run(self, axis: str, u: FloatArray, y: FloatArray, rows: slice) -> Run:
        return Run(
            axis=axis,
            sampling_rate=self.sampling_rate,
            voltage=u[rows],
            position=y[rows],
            first=rows.start,
            input_unit=self.input_unit,
            output_unit=self.output_unit,
            measured=self.measured,
        )


def check_mask(mask: slice | NDArray[np.bool_], count: int) -> None:
    """Raises BadInput if a mask does not have one value for each of the ``count`` rows."""
    if not isinstance(mask, slice) and mask.shape != (count,):
        raise BadInput("shape of the mask", mask.shape, f"({count},)", "Give True or False for each.")


def as_sensed(position: FloatArray, sampling_rate: float, measured: Sensed) -> FloatArray:
    """The output as its sensor reads it, from the integrated position (n,): (n,), (n - 1,) or (n - 2,) samples.

    The inverse of ``samples.integral``: a velocity as it was measured, an acceleration without its mean and slow drift.
    """
    order = {"position": 0, "velocity": 1, "acceleration": 2}[measured]
    return np.asarray(np.diff(position, n=order) * sampling_rate**order) if order else position


def _size(rows: slice) -> int:
    return int(rows.stop - rows.start)


def _driven(voltage: FloatArray, position: FloatArray, second: int) -> slice:
    """The samples (n,) without idle ends, where the input is constant and the output at rest; one second is kept at each end."""
    begins = np.arange(0, max(voltage.size - second, 0) + 1, second)
    ways, inputs = (np.array([np.ptp(signal[at : at + second]) for at in begins]) for signal in (position, voltage))
    lively = np.flatnonzero((inputs > 0.0) | (ways > STANDS * ways.max(initial=0.0)))
    if lively.size == 0:
        return slice(0, voltage.size)
    first, last = int(begins[max(lively[0] - 1, 0)]), int(lively[-1]) + 2
    return slice(first, int(begins[last]) if last < begins.size else voltage.size)


def _rate(value: Any) -> float:
    try:
        rate = float(value)
    except (TypeError, ValueError):
        raise BadInput("sampling rate", repr(value), "> 0 Hz", "Give samples per second.") from None
    if not (np.isfinite(rate) and rate > 0):
        raise BadInput("sampling rate", rate, "> 0 Hz", "Give samples per second.")
    return rate


def _columns(voltage: Any, position: Any, axes: Sequence[str]) -> tuple[FloatArray, FloatArray, Sequence[str]]:
    """(n, axes) of both, and the names of the axes if given."""
    if isinstance(voltage, Mapping) != isinstance(position, Mapping):
        raise BadInput("voltage and position", "one by axis and one not", "both by axis, or both arrays", "Give both alike.")
    both = {"voltage": voltage, "position": position}
    if isinstance(voltage, Mapping):
        axes = tuple(axes) or tuple(str(name) for name in voltage)
        for name, columns in both.items():
            missing = [axis for axis in axes if axis not in columns]
            if missing:
                raise BadInput(name, f"without axis {missing[0]!r}", ", ".join(map(str, columns)), "Give one column per axis in both.")
        parts = {name: [_numbers(name, columns[axis]) for axis in axes] for name, columns in both.items()}
        sizes = {part.shape for columns in parts.values() for part in columns}
        if len(sizes) != 1:
            raise BadInput("samples", " and ".join(map(str, sorted(sizes))), "one and the same (n,) for every axis", "Give one value per sample.")
        inputs, outputs = (np.column_stack(columns) for columns in parts.values())
    else:
        inputs, outputs = (_numbers(name, values) for name, values in both.items())
    if inputs.shape != outputs.shape or inputs.ndim > 2:
        shapes = f"{inputs.shape} and {outputs.shape}"
        raise BadInput("shape of voltage and position", shapes, "one and the same, (n,) or (n, axes)", "Give one row per sample.")
    return (inputs[:, None], outputs[:, None], axes) if inputs.ndim == 1 else (inputs, outputs, axes)


def _numbers(name: str, values: Any) -> FloatArray:
    """Finite numbers from any array-like value."""
    try:
        found = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise BadInput(
            name, f"{type(values).__name__} that is not an array of numbers", "real numbers, one per sample", "Give (n,) or (n, axes)."
        ) from None
    if found.ndim == 0 or found.size == 0:
        raise BadInput(name, "empty" if found.ndim else "one number", "samples, (n,) or (n, axes)", "Give one value per sample.")
    bad = int(np.sum(~np.isfinite(found)))
    if bad:
        raise BadInput(name, f"not finite in {bad} of {found.size} values", "finite numbers", "Leave those samples out, and cut the recording there.")
    return found


def one_run(data: Run | Recording) -> Run:
    """A run, or the longest run of a recording with a single axis; raises BadInput for a recording with several."""
    if isinstance(data, Run):
        return data
    if not isinstance(data, Recording):
        raise BadInput("data", type(data).__name__, "a Run or a Recording of one axis", "Load it, and choose an axis with .run(name).")
    if len(data.axes) != 1:
        raise BadInput("recording", f"of {len(data.axes)} axes", "one axis", f"Choose one with .run(name): {', '.join(data.axes)}.")
    return data.run(data.axes[0])


def rate_from_time(time: FloatArray, seq: NDArray[np.int64] | None = None) -> float:
    """Sampling rate in Hz from sample instants, robust to jitter and gaps.

    The median step gives the scale. All regular steps give the rate: with a counter by a straight line, else by their mean. A rate within
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
    regular = np.abs(steps - counts * period) < (0.5 if seq is None else 1.5) * period  # without a counter a lost sample makes one step too long
    number, instant = (np.concatenate(([0.0], np.cumsum(values[regular]))) for values in (counts, steps))
    if seq is None:  # a varying period has a mean but no line
        return whole_rate(float(number[-1] / instant[-1]) if instant[-1] > 0 else 1.0 / period)
    number -= number.mean()
    slope = float(number @ instant) / float(number @ number) if number.size > 1 else period
    return whole_rate(1.0 / slope if slope > 0 else 1.0 / period)


def whole_rate(rate: float) -> float:
    """The rate, rounded to an integer number of Hz if it is within 20 ppm of it."""
    whole = float(round(rate))
    return whole if whole > 0 and abs(rate / whole - 1.0) < 20e-6 else rate
