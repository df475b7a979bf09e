"""Where does a model fail? The velocity error on held-out data, compared with the noise floor.

By frequency, speed, direction of motion, position (once or repeating), amplitude of the input, and time: each place with its
error in multiples of the noise floor.

The noise floor is the smallest error that the data can show: the encoder's noise, plus the fraction of the motion to which
laws are trusted (EPSILON). Fits are judged by the same floor. The error over the floor is one number for the full recording; the
error in bins of speed, position, amplitude and time is scaled so that its mean power is the square of that number.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy

from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import EPSILON
from xy_sysid.greybox.floor import Floor, Windows, bands, encoder_noise, floor
from xy_sysid.samples.block import FloatArray
from xy_sysid.tables import Table, with_sentence
from xy_sysid.units import USUAL, Units, motion, moved, told

PlaceKind = Literal["frequency", "speed", "direction", "position", "amplitude", "time"]

SKIP = 0.5  # s at the start until initial conditions of the simulation have decayed; a fifth of a short run
SHORTEST_RUN = 600  # samples
WINDOWS = 7  # least number of window lengths in the samples
TWICE = 2.0  # multiple of the floor from which a place is reported
STANDS_OUT = 1.3  # multiple of the overall error from which a bin is a place of its own
SPEED_BINS, POSITION_BINS, AMPLITUDE_BINS, TIME_BINS = 10, 24, 6, 10
UNEVEN = 0.3  # of the overall error: least difference between the two directions
FEWEST = 200  # samples in a bin
PERIODS = 200  # spatial periods tested, from SHORTEST to a third of the travel
SHORTEST = 2e-4  # m
ENVELOPE = 0.1  # s over which the amplitude of the input is taken


@dataclass(frozen=True, slots=True)
class Place:
    """One place where the model fails: a range of ``kind`` from low to high in ``unit``, and its error over the floor."""

    kind: PlaceKind
    low: float
    high: float
    unit: str
    error_over_floor: float
    sentence: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """A model compared with held-out samples, in velocity, or in acceleration if that was measured.

    time: (n,) s; measured, predicted: (n,) in ``unit``; position: (n,) m
    motion, error, noise_floor: rms, m/s, up to the top band
    band_end: Hz, where motion and noise meet; error_below_end, floor_below_end: rms up to there, m/s
    frequency: (bands,) Hz centres; error_over_floor: (bands,) amplitude ratio; places: worst first
    """

    time: FloatArray
    measured: FloatArray
    predicted: FloatArray
    position: FloatArray
    motion: float
    error: float
    noise_floor: float
    error_below_end: float
    floor_below_end: float
    band_end: float
    unit: str
    frequency: FloatArray
    error_over_floor: FloatArray
    places: tuple[Place, ...]

    def __repr__(self) -> str:
        return f"<Comparison: {self.sentence}>"

    @property
    def table(self) -> Table:
        """Each place where the model fails, worst first: its range, and the error there in multiples of the noise floor."""
        rows = ((place.kind, place.low, place.high, place.unit, place.error_over_floor) for place in self.places)
        return Table(("place", "from", "to", "unit", "error over floor"), tuple(rows))

    def __str__(self) -> str:
        """The sentence and the table."""
        return with_sentence(self.sentence, self.table)

    @property
    def sentence(self) -> str:
        """The result in words."""
        if not np.isfinite(self.error):
            return "the simulation diverges: the model is not stable."
        ratio = self.error / self.noise_floor if self.noise_floor > 0 else float("inf")
        if not self.places:
            return f"nothing stands out: the error is {told(ratio, 2)} times the noise floor."
        return f"the error is {told(ratio)} times the noise floor; " + "; ".join(place.sentence for place in self.places[:4]) + "."


@dataclass(frozen=True, slots=True)
class Unseen:
    """Held-out samples of one or several consecutive gap-free runs.

    voltage, position: (n,) input and output; begins: time of the first sample, s
    encoder: rms of the encoder's noise, in units.output, if known from more of the recording; None: from these samples
    held: held-out windows of the velocity, and the floor, as a fit has defined them; None: every sample counts
    starts: index at which each run starts; several runs need ``held``
    """

    voltage: FloatArray
    position: FloatArray
    sampling_rate: float
    units: Units = USUAL
    begins: float = 0.0
    encoder: float | None = None
    held: tuple[Windows, Floor] | None = None
    starts: tuple[int, ...] = (0,)

    def of_each(self, values: FloatArray, made: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """Apply ``made`` to the samples (n,) of each run and join the results."""
        return np.concatenate([made(part) for part in np.split(values, self.starts[1:])])

    def windows(self, measured: FloatArray) -> tuple[Windows, Floor]:
        """Windows that are compared, and their floor. measured: (n,) velocity."""
        if self.held is not None:
            return self.held
        encoder = encoder_noise(self.sampling_rate, self.position, self.units.sensed, self.voltage) if self.encoder is None else self.encoder
        layout = bands(self.sampling_rate, measured.size // WINDOWS, sensed=self.units.sensed)
        every = Windows(layout, np.arange(0, max(measured.size - layout.length, 0) + 1, layout.length // 2))
        return every, floor(every, measured, encoder, EPSILON)

    @property
    def skipped(self) -> int:
        """Number of samples at the start that do not count."""
        return min(int(SKIP * self.sampling_rate), self.position.shape[0] // 5) if self.held is None else 0


def compare_velocity(model: FloatArray, u: FloatArray, y: FloatArray, sampling_rate: float, units: Units = USUAL, begins: float = 0.0) -> Comparison:
    """A simulated mean velocity (n - 1,) of any model against the measured output (n,). begins: time of the first sample, s."""
    return compare_motion(model, Unseen(voltage=u, position=y, sampling_rate=sampling_rate, units=units, begins=begins))


def compare_motion(model: FloatArray, unseen: Unseen) -> Comparison:
    """A simulated mean velocity (n - 1,) of any model, or (n - r,) over r runs, against the measured output (n,)."""
    unit, sampling_rate, y = unseen.units.judged, unseen.sampling_rate, unseen.position
    if y.shape[0] < SHORTEST_RUN or model.shape[0] != y.shape[0] - len(unseen.starts):
        raise BadInput("number of samples", y.shape[0], f"{SHORTEST_RUN} or more", "Give a longer recording.")
    first = unseen.skipped
    measured, predicted = unseen.of_each(y, np.diff)[first:] * sampling_rate, model[first:]
    here, driven = (unseen.of_each(values, lambda part: part[:-1])[first:] for values in (y, unseen.voltage))
    error = measured - predicted
    windows, least = unseen.windows(measured)
    counts = windows.covered(error.size) if unseen.held is not None else slice(None)
    layout = windows.layout
    accelerated = unseen.units.sensed == "acceleration"
    offset = 0.0 if accelerated else float(np.mean(error[counts]))  # a constant velocity is invisible in an acceleration
    power = layout.power(windows.spectrum(error - offset))
    edges = layout.edges()
    centres = np.append(0.5 * edges[1], np.sqrt(edges[2:] * edges[1:-1]))
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        ratio = np.sqrt(power / np.maximum(least.power, 1e-300))
    audible = np.flatnonzero(least.motion > least.noise)
    seen = int(audible[-1]) + 1 if audible.size else layout.count
    end = float(edges[seen])
    whole, allowed = float(np.hypot(layout.rms(power), offset)), layout.rms(least.power)
    low_speed = _low_pass(measured, end, sampling_rate)
    if accelerated:
        error, measured, predicted = (np.diff(values, append=values[-1:]) * sampling_rate for values in (error, measured, predicted))
    low_error = _low_pass(error, end, sampling_rate)
    time = unseen.begins + (np.arange(error.shape[0]) + first) / sampling_rate
    total = float(np.sqrt(np.mean(low_error[counts] ** 2)))
    noise = total * allowed / max(whole, 1e-300)  # the mean power over the bins then matches the overall ratio
    places = _frequency_places(edges, ratio, end, by_chance(layout.lines * windows.begins.size))
    if abs(offset) > TWICE * allowed:
        text = f"a constant error of {moved(offset, unit)}, {told(abs(offset) / allowed)} times the floor"
        places.append(_place("frequency", (0.0, float(edges[1])), "Hz", abs(offset) / allowed, text))
    if noise > 0.0 and np.isfinite(noise):
        width = max(int(ENVELOPE * sampling_rate), 1)
        power_in = np.asarray(scipy.signal.oaconvolve(driven**2, np.full(width, 1.0 / width), mode="same"), dtype=np.float64)
        envelope, place = np.sqrt(np.maximum(power_in, 0.0))[counts], here[counts]
        off, speed = low_error[counts], low_speed[counts]
        places += _binned("speed", (np.abs(speed), unseen.units.speed), SPEED_BINS, off, noise)
        places += _direction(speed, off, noise, unit)
        places += _binned("position", (place, unseen.units.output), POSITION_BINS, off, noise)
        places += _periodic(place, off, noise, unseen.units.output)
        places += _binned("amplitude", (envelope, unseen.units.input), AMPLITUDE_BINS, off, noise)
        places += _binned("time", (time[counts], "s"), TIME_BINS, off, noise)
    return Comparison(
        time=time,
        measured=measured,
        predicted=predicted,
        position=here,
        motion=layout.rms(least.motion),
        error=whole,
        noise_floor=allowed,
        error_below_end=total,
        floor_below_end=float(np.sqrt(np.sum((layout.lines * least.power)[:seen]) * 2.0 / layout.length)),
        band_end=end,
        unit=unit,
        frequency=centres,
        error_over_floor=ratio,
        places=tuple(
            sorted((place for place in places if place.error_over_floor >= TWICE and np.isfinite(whole)), key=lambda place: -place.error_over_floor)
        ),
    )


def _place(kind: PlaceKind, span: tuple[float, float], unit: str, ratio: float, sentence: str) -> Place:
    return Place(kind=kind, low=span[0], high=span[1], unit=unit, error_over_floor=ratio, sentence=sentence)


def _low_pass(values: FloatArray, end: float, sampling_rate: float) -> FloatArray:
    if end >= 0.45 * sampling_rate:
        return values
    taps = scipy.signal.firwin(257, end, fs=sampling_rate)
    return np.asarray(scipy.signal.oaconvolve(values, taps, mode="same"), dtype=np.float64)


def by_chance(averaged: FloatArray) -> FloatArray:
    """(bands,) error over floor that noise alone exceeds in one of a thousand bands. averaged: (bands,) lines times windows.

    The power of one line of one window is distributed as chi-square with two degrees of freedom.
    """
    degrees = 2.0 * np.maximum(averaged, 1.0)
    return np.asarray(np.sqrt(scipy.special.chdtri(degrees, 1e-3) / degrees))


def _frequency_places(edges: FloatArray, ratio: FloatArray, end: float, chance: FloatArray) -> list[Place]:
    """Runs of neighbouring bands above twice the floor and above the chance level: a few lines and windows scatter widely."""
    places: list[Place] = []
    known = np.flatnonzero(np.isfinite(ratio))
    filled = np.interp(np.arange(ratio.size), known, ratio[known]) if known.size else ratio  # the lowest bands may contain no line
    bad = (filled > np.maximum(TWICE, chance)) & (edges[1:] <= end * 1.05)
    start: int | None = None
    for k, flag in enumerate([*bad.tolist(), False]):
        if flag and start is None:
            start = k
        if not flag and start is not None:
            size = float(np.max(filled[start:k]))
            low, high = float(edges[start]), float(edges[k])
            at = start + int(np.argmax(filled[start:k]))
            worst = float(np.sqrt(edges[at] * edges[at + 1])) if edges[at] > 0.0 else 0.5 * float(edges[at + 1])
            text = f"{told(size)} times the floor near {worst:.3g} Hz, above twice the floor from {low:.3g} to {high:.3g} Hz"
            places.append(_place("frequency", (low, high), "Hz", size, text))
            start = None
    return places


def _binned(kind: PlaceKind, of: tuple[FloatArray, str], number: int, error: FloatArray, noise: float) -> list[Place]:
    """The bin (equal counts) with the largest error, joined with neighbours that also exceed the limit. of: (n,) values, and their unit."""
    (by, unit), total = of, float(np.sqrt(np.mean(error**2)))
    edges = np.unique(np.quantile(by, np.linspace(0.0, 1.0, number + 1)))
    if edges.size < 3:
        return []
    which = np.clip(np.searchsorted(edges, by, side="right") - 1, 0, edges.size - 2)
    count = np.bincount(which, minlength=edges.size - 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.sqrt(np.bincount(which, weights=error**2, minlength=edges.size - 1) / count)
    high = (size > STANDS_OUT * total) & (count >= FEWEST)
    if not bool(high.any()) or bool(high.all()):
        return []
    worst = int(np.argmax(np.where(high, size, 0.0)))
    left, right = worst, worst
    while left > 0 and high[left - 1]:
        left -= 1
    while right < high.size - 1 and high[right + 1]:
        right += 1
    ratio = float(size[worst] / noise)
    scale, shown = motion(unit)
    span = f"{edges[left] * scale:.3g} to {edges[right + 1] * scale:.3g} {shown}"
    words = {"speed": f"at speeds of {span}", "position": f"at positions of {span}", "amplitude": f"at input amplitudes of {span}"}
    sentence = f"{told(ratio)} times the floor {words.get(kind, f'from {span}')}"
    return [_place(kind, (float(edges[left]), float(edges[right + 1])), unit, ratio, sentence)]


def _direction(speed: FloatArray, error: FloatArray, noise: float, unit: str) -> list[Place]:
    """A mean error that differs between the two directions of motion."""
    slow = 0.1 * float(np.sqrt(np.mean(speed**2)))
    forth, back = error[speed > slow], error[speed < -slow]
    if min(forth.size, back.size) < FEWEST:
        return []
    difference = 0.5 * abs(float(np.mean(forth)) - float(np.mean(back)))
    if difference < TWICE * noise or difference < UNEVEN * float(np.sqrt(np.mean(error**2))):
        return []
    ratio = difference / noise
    return [_place("direction", (-difference, difference), unit, ratio, f"{told(ratio)} times the floor between the two directions of motion")]


def _periodic(position: FloatArray, error: FloatArray, noise: float, unit: str) -> list[Place]:
    """A part of the error that is periodic in position, with at least three periods."""
    travel = float(np.ptp(position))
    if travel < 6 * SHORTEST:
        return []
    bins = min(int(np.ceil(8.0 * travel / SHORTEST)), 2**16)
    place = np.minimum((position - position.min()) / travel * bins, bins - 1).astype(np.int64)
    turns = np.fft.rfft(np.bincount(place, error, bins), 4 * bins)
    periods = np.geomspace(SHORTEST, travel / 3.0, PERIODS)
    size = np.sqrt(2.0) * np.abs(turns[np.minimum(np.round(4.0 * travel / periods), 2 * bins).astype(np.int64)]) / error.size
    best = int(np.argmax(size))
    ratio = float(size[best] / noise)
    if size[best] < 6.0 * float(np.median(size)):
        return []
    period = float(periods[best])
    return [_place("position", (period, period), unit, ratio, f"{told(ratio)} times the floor, repeating every {moved(period, unit)} of position")]
