"""Where does a model fail? The velocity error on data that no fit saw, against the floor that the data allow.

By frequency, speed, direction of motion, position (once or repeating), amplitude of the input, and time: each place with its
size in multiples of the noise floor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy import signal

from xy_sysid.errors import BadInput
from xy_sysid.noise_floor import bands, density, floor_density
from xy_sysid.simulation import simulate
from xy_sysid.stream import FloatArray
from xy_sysid.transfer_function import TransferFunction

Kind = Literal["frequency", "speed", "direction", "position", "amplitude", "time"]

SKIP = 0.5  # s at the start, in which the simulation forgets that it started from rest
TWICE = 2.0  # times the floor from which a place is worth a word
STANDS_OUT = 1.3  # times the whole error that a bin must reach to be a place of its own
SPEED_BINS, POSITION_BINS, AMPLITUDE_BINS, TIME_BINS = 10, 24, 6, 10
UNEVEN = 0.3  # of the whole error that the two directions must differ by
FEWEST = 200  # samples in a bin
PERIODS = 200  # spatial periods tried, from SHORTEST to a third of the travel
SHORTEST = 2e-4  # m
SMALL = {"m/s": (1e3, "mm/s"), "m": (1e3, "mm")}  # units that people read in thousandths
ENVELOPE = 0.1  # s over which the amplitude of the input is taken


@dataclass(frozen=True, slots=True)
class Place:
    """One place where the model fails: a range of ``kind`` from low to high in ``unit``, and its error over the floor."""

    kind: Kind
    low: float
    high: float
    unit: str
    error_over_floor: float
    sentence: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """A model against unseen samples, in velocity.

    time: (n,) s; measured, predicted: (n,) m/s; position: (n,) m
    error, noise_floor: rms, m/s, up to ``band_end`` Hz, where signal and floor meet
    frequency: (bands,) Hz centres; error_over_floor: (bands,) amplitude ratio; places: worst first
    """

    time: FloatArray
    measured: FloatArray
    predicted: FloatArray
    position: FloatArray
    error: float
    noise_floor: float
    band_end: float
    unit: str
    frequency: FloatArray
    error_over_floor: FloatArray
    places: tuple[Place, ...]

    @property
    def sentence(self) -> str:
        """For people."""
        if not np.isfinite(self.error):
            return "the simulated model runs away: it is not stable."
        ratio = self.error / self.noise_floor if self.noise_floor > 0 else float("inf")
        if not self.places:
            return f"nothing stands out: the error is {ratio:.2g} times the noise floor."
        return f"the error is {ratio:.3g} times the noise floor; " + "; ".join(place.sentence for place in self.places[:4]) + "."


def compare(tf: TransferFunction, u: FloatArray, y: FloatArray, sampling_rate: float) -> Comparison:
    """A transfer function against input and output (n,) of a gap-free run. Raises BadInput if it is too short."""
    return compare_velocity(np.diff(simulate(tf, sampling_rate, u)) * sampling_rate, u, y, sampling_rate, f"{tf.output_unit}/s", tf.output_unit)


def compare_velocity(
    model: FloatArray, u: FloatArray, y: FloatArray, sampling_rate: float, unit: str = "m/s", length_unit: str = "m", begins: float = 0.0
) -> Comparison:
    """A simulated mean velocity (n - 1,) of any model against the measured output (n,). begins: time of the first sample, s."""
    first = int(SKIP * sampling_rate)
    if y.shape[0] < first + 2000 or model.shape[0] != y.shape[0] - 1:
        raise BadInput("number of samples", y.shape[0], f"{first + 2000} or more", "Give a longer recording.")
    measured, predicted = np.diff(y)[first:] * sampling_rate, model[first:]
    position, drive = y[first:], u[first:-1]
    error = measured - predicted
    floor = floor_density(position, predicted, sampling_rate)
    error_density, signal_density = density(error, sampling_rate), density(predicted, sampling_rate)
    grid = bands(error.shape[0], sampling_rate)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = np.sqrt(grid.mean(error_density) / grid.mean(floor))
    audible = np.flatnonzero(signal_density > floor)
    end = float(grid.frequency[audible[-1]]) if audible.size else float(grid.edges[-1])
    end = min(end, float(grid.edges[-1]))
    inside = (grid.frequency > 0) & (grid.frequency <= end)
    step = grid.frequency[1]
    noise = float(np.sqrt(np.sum(floor[inside]) * step))
    low_error, low_speed = (_low_pass(values, end, sampling_rate) for values in (error, measured))
    centres = np.sqrt(grid.edges[1:] * grid.edges[:-1])
    time = begins + (np.arange(error.shape[0]) + first) / sampling_rate
    places = _frequency_places(grid.edges, ratio, end)
    total = float(np.sqrt(np.mean(low_error**2)))
    offset = float(np.mean(error))
    if abs(offset) > TWICE * noise:
        text = f"a constant error of {_shown(offset, unit)}, {abs(offset) / noise:.3g} times the floor"
        places.append(Place("frequency", 0.0, float(grid.edges[0]), "Hz", abs(offset) / noise, text))
    if total > TWICE * noise:
        width = max(int(ENVELOPE * sampling_rate), 1)
        envelope = np.sqrt(np.maximum(signal.oaconvolve(drive**2, np.full(width, 1.0 / width), mode="same"), 0.0))
        here = position[:-1]
        places += _binned("speed", np.abs(low_speed), low_error, total, noise, SPEED_BINS, unit)
        places += _direction(low_speed, low_error, noise, unit)
        places += _binned("position", here, low_error, total, noise, POSITION_BINS, length_unit)
        places += _periodic(here, low_error, noise, length_unit)
        places += _binned("amplitude", envelope, low_error, total, noise, AMPLITUDE_BINS, "V")
        places += _binned("time", time, low_error, total, noise, TIME_BINS, "s")
    ordered = tuple(sorted(places, key=lambda place: -place.error_over_floor))
    return Comparison(time, measured, predicted, position[:-1], total, noise, end, unit, centres, ratio, ordered)


def _low_pass(values: FloatArray, end: float, sampling_rate: float) -> FloatArray:
    if end >= 0.45 * sampling_rate:
        return values
    taps = signal.firwin(257, end, fs=sampling_rate)
    return np.asarray(signal.oaconvolve(values, taps, mode="same"), dtype=np.float64)


def _frequency_places(edges: FloatArray, ratio: FloatArray, end: float) -> list[Place]:
    """Runs of neighbouring bands that are above twice the floor."""
    places: list[Place] = []
    known = np.flatnonzero(np.isfinite(ratio))
    filled = np.interp(np.arange(ratio.size), known, ratio[known]) if known.size else ratio  # the lowest bands may hold no line
    bad = (filled > TWICE) & (edges[1:] <= end * 1.05)
    start: int | None = None
    for k, flag in enumerate([*bad.tolist(), False]):
        if flag and start is None:
            start = k
        if not flag and start is not None:
            size = float(np.max(filled[start:k]))
            low, high = float(edges[start]), float(edges[k])
            worst = float(np.sqrt(edges[k0 := start + int(np.argmax(filled[start:k]))] * edges[k0 + 1]))
            text = f"{size:.3g} times the floor near {worst:.3g} Hz, above twice the floor from {low:.3g} to {high:.3g} Hz"
            places.append(Place("frequency", low, high, "Hz", size, text))
            start = None
    return places


def _binned(kind: Kind, by: FloatArray, error: FloatArray, total: float, noise: float, number: int, unit: str) -> list[Place]:
    """The bin of equal counts whose error stands out most, joined with neighbours that do too."""
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
    scale, shown = SMALL.get(unit, (1.0, unit))
    span = f"{edges[left] * scale:.3g} to {edges[right + 1] * scale:.3g} {shown}"
    words = {"speed": f"at speeds of {span}", "position": f"at positions of {span}", "amplitude": f"at input amplitudes of {span}"}
    sentence = f"{ratio:.3g} times the floor {words.get(kind, f'from {span}')}"
    return [Place(kind, float(edges[left]), float(edges[right + 1]), unit, ratio, sentence)]


def _shown(value: float, unit: str) -> str:
    """A length or speed as people read it: mm for m."""
    scale, name = SMALL.get(unit, (1.0, unit))
    return f"{value * scale:.3g} {name}"


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
    return [Place("direction", -difference, difference, unit, ratio, f"{ratio:.3g} times the floor apart between the two directions of motion")]


def _periodic(position: FloatArray, error: FloatArray, noise: float, unit: str) -> list[Place]:
    """A part of the error that repeats along the travel, at least three times."""
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
    if ratio < TWICE / 2 or size[best] < 6.0 * float(np.median(size)):
        return []
    period = float(periods[best])
    return [Place("position", period, period, unit, ratio, f"{ratio:.3g} times the floor repeating every {_shown(period, unit)} of position")]
