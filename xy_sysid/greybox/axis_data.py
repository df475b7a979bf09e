"""The data of a fit: one axis in one or several recordings, divided into fitted and held-out windows.

Held-out windows are spread over the record, in blocks between the fitted ones, and share no sample with them, so both contain similar
motion. Each of several recordings is divided in this way.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from xy_sysid.axis.model import sample_velocity
from xy_sysid.effects._scene import smoothed, swing
from xy_sysid.effects._similarity import Similarity
from xy_sysid.errors import BadInput
from xy_sysid.greybox.floor import Bands, Floor, Windows, bands, encoder_noise, floor
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import SLOWEST
from xy_sysid.units import USUAL, Units

FIRST = 28_000  # samples of the first stage of a fit, of all recordings together
TRAINING = 2.0 / 3.0  # fraction of the record for one-step prediction, which must run without interruption from the start
EPSILON = 1e-3  # assumed relative accuracy of laws and their integration
FEWEST_SCREENING_WINDOWS = 2  # least number of windows of a screening fit
EXCITED_PART = 0.1  # least power of the first stage in each excited band, compared with that of all data
FEWEST = 256  # least samples of all recordings together
SHORTEST = 16  # least samples of each recording
WINDOWS, ROOM = 14.0, 4.0  # least window lengths of all recordings together, and of the longest; otherwise windows are shortened
FITTED_BLOCK, HELD_OUT_BLOCK = 3.0, 1.5  # window lengths of a fitted block, and of a held-out block
PATH_STEP = 0.05  # s between the positions that are summed to a path, so that noise does not lengthen it
PASSED_AGAIN = 1.2  # times the travel: a shorter path passes each position only once
SHIFTS = 4  # tested positions of the held-out blocks


class Work:
    """The amount of simulation so far: samples times sub-steps. It does not depend on the computer or its load."""

    def __init__(self) -> None:
        self._sum = 0.0
        self._new: deque[float] = deque()

    def add(self, samples: float) -> None:
        """Add to the sum; any thread may call this."""
        self._new.append(samples)

    @property
    def done(self) -> float:
        """The sum; only the searching thread may call this."""
        while self._new:
            self._sum += self._new.popleft()
        return self._sum


@dataclass(frozen=True)
class AxisData:
    """One axis without gaps, ready for fits, with its noise floor.

    voltage, position: (n,) V and m, recordings one after the other; velocity: (n - r,) mean of each sample, m/s, of r recordings
    starts: sample of ``voltage`` at which each recording begins
    fitted, held_out: windows of ``velocity`` for the fit, and held-out windows
    early: samples of each recording's velocity in the first stage, which ``first_stage`` returns
    screening_windows: windows of a screening fit; they begin at a sample of ``first_stage(velocity)``
    training: samples of ``velocity`` for filters that must run without interruption
    units: the actual units of what is called V and m here, used in sentences
    work: amount of simulation
    """

    sampling_rate: float
    voltage: FloatArray
    position: FloatArray
    velocity: FloatArray
    starts: tuple[int, ...]
    layout: Bands
    fitted: Windows
    held_out: Windows
    screening_windows: Windows
    training: int
    early: tuple[int, ...]
    floor: Floor
    units: Units = USUAL
    work: Work = field(default_factory=Work, compare=False, repr=False)

    @property
    def holds_out(self) -> bool:
        """True if some windows are held out; False if the windows are so few that all of them are fitted and judge the fit as well."""
        return not np.array_equal(self.held_out.begins, self.fitted.begins)

    @property
    def longest_delay(self) -> float:
        """s: a quarter of the data of the first stage."""
        return self.first / self.sampling_rate / 4.0

    @property
    def noise_floor(self) -> float:
        """The smallest error that the data can show: encoder noise and the tolerated part of the motion, m/s rms."""
        return self.layout.rms(self.floor.power)

    @property
    def noise(self) -> float:
        """rms of the encoder's noise in velocity, below the top band, m/s."""
        return self.layout.rms(self.floor.noise)

    @property
    def encoder(self) -> float:
        """rms of the sensor's noise, as noise of the position from one sample to the next, m."""
        return self.floor.encoder / self.sampling_rate ** {"position": 0, "velocity": 1, "acceleration": 2}[self.units.sensed]

    @property
    def runs(self) -> tuple[slice, ...]:
        """The samples of each recording."""
        return tuple(slice(a, b) for a, b in zip(self.starts, (*self.starts[1:], self.voltage.size), strict=True))

    @property
    def steps(self) -> tuple[slice, ...]:
        """The samples of ``velocity`` of each recording."""
        return tuple(slice(run.start - k, run.stop - k - 1) for k, run in enumerate(self.runs))

    @property
    def first(self) -> int:
        """Number of samples of the first stage."""
        return sum(self.early)

    def counts(self, early: bool) -> tuple[int, ...]:
        """Number of samples of each recording's velocity in the first stage, or in total."""
        return self.early if early else tuple(step.stop - step.start for step in self.steps)

    def first_stage(self, signal: FloatArray) -> FloatArray:
        """(first,) of a signal (n - r,), or (first,) of a signal (n,): the first stage of each recording, one after the other."""
        places = self.steps if signal.size == self.velocity.size else self.runs
        return np.concatenate([signal[part.start : part.start + count] for part, count in zip(places, self.early, strict=True)])

    @cached_property
    def similar(self) -> Similarity:
        """Ratio of this motion to that of the reference machine, for which the bounds of effects are given."""
        return Similarity.of(self.sampling_rate, self.voltage, self.velocity)

    @cached_property
    def swing(self) -> float:
        """Typical distance between two reversals, m."""
        return swing(self.sampling_rate, smoothed(self.sampling_rate, self.velocity, 300.0), self.velocity)

    @cached_property
    def reach(self) -> tuple[float, float]:
        """Least and largest position, m."""
        return float(np.min(self.position)), float(np.max(self.position))

    @cached_property
    def passed_once(self) -> bool:
        """True if each position is passed only once, so a position-dependent effect cannot be distinguished from a drift."""
        apart = max(int(PATH_STEP * self.sampling_rate), 1)
        way = sum(float(np.sum(np.abs(np.diff(self.position[run][::apart])))) for run in self.runs)
        return way < PASSED_AGAIN * (self.reach[1] - self.reach[0])

    def begins(self, signal: FloatArray) -> FloatArray:
        """(n - r,) value of a signal (n,), such as the voltage, at the start of each sample of ``velocity``."""
        return np.concatenate([signal[run][:-1] for run in self.runs])

    def middle(self) -> FloatArray:
        """(n - r,) measured position at the middle of each sample, m."""
        return np.concatenate([0.5 * (self.position[run][1:] + self.position[run][:-1]) for run in self.runs])

    def held_samples(self) -> NDArray[np.bool_]:
        """(n - r,) True for samples of ``velocity`` in a held-out window."""
        return self.held_out.covered(self.velocity.size)

    def first_windows(self) -> Windows:
        """Every window of the first stage, fitted and held out; only held-out windows if the first stage contains all data."""
        if self.first >= self.velocity.size:
            return self.held_out
        both = np.sort(np.concatenate((self.screening_windows.begins, _within(self.held_out, self.steps, self.early).begins)))
        return Windows(self.layout, np.unique(both))


def prepare(sampling_rate: float, voltage: FloatArray, position: FloatArray, epsilon: float = EPSILON, units: Units = USUAL) -> AxisData:
    """One recording of an axis for fitting. Raises BadInput for less than 256 samples or arrays of different lengths."""
    return prepare_all(sampling_rate, [(voltage, position)], epsilon, units)


def prepare_all(
    sampling_rate: float, recordings: Sequence[tuple[FloatArray, FloatArray]], epsilon: float = EPSILON, units: Units = USUAL
) -> AxisData:
    """Several recordings, V and m, of the same axis for one fit. Raises BadInput as ``prepare``, and for samples that are too slow."""
    if not sampling_rate >= SLOWEST:
        raise BadInput(
            "sampling rate", f"{sampling_rate:.4g} Hz", f"{SLOWEST:g} Hz or more", "Check the unit of time, and whether it is a sample number."
        )
    for voltage, position in recordings:
        if voltage.shape != position.shape or voltage.ndim != 1:
            raise BadInput("shape of voltage and position", f"{voltage.shape} and {position.shape}", "one and the same (n,)", "Give one axis.")
        if voltage.size < SHORTEST:
            raise BadInput("number of samples of a recording", voltage.size, f"{SHORTEST} or more", "Leave it out.")
        if not (np.all(np.isfinite(voltage)) and np.all(np.isfinite(position))):
            raise BadInput("samples", "not finite", "finite numbers", "Remove what is not a number.")
    sizes = [voltage.size for voltage, _ in recordings]
    if sum(sizes) < FEWEST:
        raise BadInput("number of samples", sum(sizes), f"{FEWEST} or more", "Record for longer.")
    starts = tuple(int(start) for start in np.cumsum([0, *sizes[:-1]]))
    velocities = [sample_velocity(sampling_rate, position) for _, position in recordings]
    velocity = np.concatenate(velocities)
    layout = bands(sampling_rate, int(min(sum(sizes) / WINDOWS, max(sizes) / ROOM)), sensed=units.sensed)
    edges = np.cumsum([0, *(item.size for item in velocities)])
    spans = [(int(a), int(b)) for a, b in pairwise(edges)]
    whole = Windows(layout, np.concatenate([_begins(layout.length, *span) for span in spans]))
    encoder = max(encoder_noise(sampling_rate, position, units.sensed, voltage) for voltage, position in recordings)
    fitted, held = _split(layout, spans, velocity)
    driven = np.concatenate([voltage[:-1] for voltage, _ in recordings])
    least = floor(whole, velocity, encoder, epsilon, driven)
    steps = [slice(*span) for span in spans]
    early = _early(whole, fitted, velocity, least, steps)
    return AxisData(
        sampling_rate=sampling_rate,
        voltage=np.concatenate([voltage for voltage, _ in recordings]),
        position=np.concatenate([position for _, position in recordings]),
        velocity=velocity,
        starts=starts,
        layout=layout,
        fitted=fitted,
        held_out=held,
        screening_windows=_within(fitted, steps, early),
        training=int(TRAINING * velocities[0].size),
        early=early,
        floor=least,
        units=units,
    )


def longest(data: AxisData) -> int:
    """The place of the longest recording."""
    sizes = [run.stop - run.start for run in data.runs]
    return sizes.index(max(sizes))


def one_stretch(data: AxisData, place: int) -> AxisData:
    """One of several recordings alone. Raises BadInput if it is too short."""
    run = data.runs[place]
    return prepare(data.sampling_rate, data.voltage[run], data.position[run], data.floor.epsilon, data.units)


def _early(whole: Windows, fitted: Windows, velocity: FloatArray, least: Floor, steps: Sequence[slice]) -> tuple[int, ...]:
    """Samples of each recording in the first stage: enough to excite each band that all data excite (a sweep takes time), and to contain
    two fitted windows."""
    sizes = np.array([step.stop - step.start for step in steps])
    each = FIRST if len(steps) == 1 else max(FIRST // len(steps), int(FITTED_BLOCK * whole.layout.length))
    powers = whole.layout.powers(whole.spectrum(velocity))[:, least.excited]
    ends = whole.begins + whole.layout.length
    while each < sizes.max():
        covered = powers[np.any([(step.start <= whole.begins) & (ends <= step.start + each) for step in steps], axis=0)]
        enough = _within(fitted, steps, np.minimum(sizes, each)).begins.size >= FEWEST_SCREENING_WINDOWS
        if enough and covered.shape[0] and np.all(covered.mean(axis=0) > EXCITED_PART * powers.mean(axis=0)):
            break
        each *= 2
    return tuple(int(size) for size in np.minimum(sizes, each))


def _within(windows: Windows, steps: Sequence[slice], early: Sequence[int] | NDArray[np.int64]) -> Windows:
    """The windows within the first samples of the recordings (``early``), as positions in these samples alone."""
    offsets = np.cumsum([0, *early[:-1]])
    found = []
    for step, count, offset in zip(steps, early, offsets, strict=True):
        inside = (windows.begins >= step.start) & (windows.begins + windows.layout.length <= step.start + count)
        found.append(windows.begins[inside] - step.start + offset)
    return Windows(windows.layout, np.concatenate(found))


def _begins(length: int, start: int, stop: int) -> NDArray[np.int64]:
    """First samples of half-overlapping windows of one recording."""
    return np.arange(start, max(stop - length, start) + 1, max(length // 2, 1), dtype=np.int64)


def _split(layout: Bands, spans: Sequence[tuple[int, int]], velocity: FloatArray) -> tuple[Windows, Windows]:
    """Fitted and held-out windows, with the shift of blocks at which the power of the motion in both is most similar."""
    choices = []
    for shift in range(SHIFTS):
        cut = [_blocks(layout.length, start, stop, shift) for start, stop in spans]
        fitted, held = (Windows(layout, np.concatenate([part[k] for part in cut])) for k in (0, 1))
        if fitted.begins.size and held.begins.size:
            sizes = [float(np.mean(np.abs(windows.spectrum(velocity)) ** 2)) + 1e-300 for windows in (fitted, held)]
            choices.append((abs(float(np.log(sizes[0] / sizes[1]))), shift, fitted, held))
    if not choices:
        whole = Windows(layout, np.concatenate([_begins(layout.length, start, stop) for start, stop in spans]))
        return whole, whole
    _, _, fitted, held = min(choices, key=lambda item: (round(item[0], 1), item[1]))
    return fitted, held


def _blocks(length: int, start: int, stop: int, shift: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First samples of the windows within fitted blocks, and within held-out blocks."""
    fit_length, held_length = int(FITTED_BLOCK * length), int(HELD_OUT_BLOCK * length)
    fitted: list[NDArray[np.int64]] = []
    out: list[NDArray[np.int64]] = []
    at, fits = start - shift * (fit_length + held_length) // SHIFTS, True
    while at < stop:
        end = at + (fit_length if fits else held_length)
        low, high = max(at, start), min(end, stop)
        if high - low >= length:
            (fitted if fits else out).append(_begins(length, low, high))
        at, fits = end, not fits
    none = np.zeros(0, dtype=np.int64)
    return np.concatenate([none, *fitted]), np.concatenate([none, *out])
