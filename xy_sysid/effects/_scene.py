"""The measured motion, from which effects compute their traces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, lru_cache

import numpy as np
import scipy

from xy_sysid.effects._similarity import Similarity
from xy_sysid.samples.block import FloatArray

USUAL_SWING = 2e-4  # m between two reversals on the usual machine of ``Similarity``
PLACES = 2048  # along the travel, for what repeats with it
REPEATS = 1.5  # periods within the travel at least: what is longer acts as a polynomial, and explains anything
SHORT = 2**16  # samples up to which a scene keeps all columns of its guesses: 50 MB
FINER = 16  # steps of the period lengths, in parts of a period over the travel: half a step leaves 0.3 % of the power of a sine


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """One axis in motion, with the base model's view of it; each is its own, so that what is worked out of it can be kept.

    sampling_rate: Hz; gain: m/s/V; pole: rad/s of the base
    voltage:  (n,) what arrives at the amplifier (delayed), mean over each sample, V
    velocity: (n,) measured mean velocity of each sample, m/s
    position: (n,) measured, at the middle of each sample, m
    error:    (n,) measured velocity minus the model's, m/s
    recordings: samples of each recording that it is made of, one after the other; empty for one
    prompt: the same motion behind a drive that answers at once, where the delay that the base has is so long that it may be astray
    sections: b0, b1, b2, a1, a2 of each that the motion passes behind the base
    """

    sampling_rate: float
    gain: float
    pole: float
    voltage: FloatArray
    velocity: FloatArray
    position: FloatArray
    error: FloatArray
    recordings: tuple[int, ...] = ()
    prompt: Scene | None = None
    sections: tuple[tuple[float, ...], ...] = ()
    _known: dict[tuple[str, float], FloatArray] = field(init=False, repr=False, compare=False, default_factory=dict)
    _guesses: dict[str, list[Guess]] = field(init=False, repr=False, compare=False, default_factory=dict)

    def kept(self, name: str, guesses: Callable[[], list[Guess]]) -> list[Guess]:
        """What an effect guesses: score test and inverse identification both ask, so that it is worked out once if that is no load."""
        if self.error.size > SHORT:
            return guesses()
        if name not in self._guesses:
            self._guesses[name] = guesses()
        return self._guesses[name]

    @property
    def time(self) -> FloatArray:
        """(n,) s since the start, at the middle of each sample."""
        return np.asarray((np.arange(self.voltage.size) + 0.5) / self.sampling_rate, dtype=np.float64)

    @property
    def similar(self) -> Similarity:
        """How this motion compares with the usual one."""
        return _similar(self)

    @property
    def swing(self) -> float:
        """Typical distance between two reversals, m."""
        return swing(self.sampling_rate, self.smooth(self.velocity, 300.0), self.velocity)

    def smooth(self, signal: FloatArray, cutoff: float) -> FloatArray:
        """The signal below ``cutoff`` (Hz), without shift in time. Of the scene's own signals each is worked out once."""
        own = next((name for name in ("voltage", "velocity", "error") if signal is getattr(self, name)), None)
        if own is None:
            return self._smoothed(signal, cutoff)
        if (own, cutoff) not in self._known:
            self._known[own, cutoff] = self._smoothed(signal, cutoff)
        return self._known[own, cutoff]

    def _smoothed(self, signal: FloatArray, cutoff: float) -> FloatArray:
        return smoothed(self.sampling_rate, signal, cutoff)

    def direction(self) -> FloatArray:
        """(n,) -1..1, the direction of motion, blurred where noise hides it."""
        v = self.smooth(self.velocity, 300.0)
        noise = float(np.std(self.velocity - v)) + 1e-12
        return np.asarray(np.tanh(v / noise))

    def missing_force(self) -> FloatArray:
        """(n,) force against the drive that would explain the error, V, below 100 Hz."""
        e = self.smooth(self.error, 100.0)
        return -(np.gradient(e) * self.sampling_rate / self.pole + e) / self.gain

    def periods(self, numerator: FloatArray, denominator: FloatArray, count: int = 4, least: float = REPEATS) -> list[float]:
        """Lengths (m) at which numerator / denominator repeats along the travel, strongest first.

        Only lengths with ``least`` periods within the travel. At each length a sine is
        fitted to the places, each counted by the denominator there (Lomb 1976; Zechmeister & Kurster 2009, eq. 5), and less towards the ends.
        """
        low, high = np.quantile(self.position, [0.01, 0.99])
        travel = float(high - low)
        if travel <= 0.0:
            return []
        place = np.clip(((self.position - low) / travel * PLACES).astype(np.int64), 0, PLACES - 1)
        weight = np.hanning(PLACES)
        top = np.bincount(place, numerator, PLACES) * weight
        bottom = np.bincount(place, denominator, PLACES) * weight
        whole = float(np.sum(bottom))
        if whole <= 0.0:
            return []
        seen = np.fft.rfft(top - bottom * float(np.sum(top)) / whole, FINER * PLACES)[: FINER * PLACES // 8]
        twice = np.fft.rfft(bottom, FINER * PLACES)[: 2 * seen.size : 2]
        power = (whole * np.abs(seen) ** 2 - (seen * seen * twice.conj()).real) / np.maximum(whole**2 - np.abs(twice) ** 2, 1e-12 * whole**2)
        inside = np.arange(power.size) >= FINER * least
        peaks, _ = scipy.signal.find_peaks(np.where(inside, power, 0.0))
        best = peaks[np.argsort(power[peaks])[::-1][:count]]
        return [float(FINER * travel / peak) for peak in best]


@lru_cache(maxsize=1)
def _similar(scene: Scene) -> Similarity:
    return Similarity.of(scene.sampling_rate, scene.voltage, scene.velocity)


def smoothed(sampling_rate: float, signal: FloatArray, cutoff: float) -> FloatArray:
    """(n,) a signal below ``cutoff`` (Hz), without shift in time."""
    return np.asarray(scipy.signal.sosfiltfilt(_low_pass(min(2.0 * cutoff / sampling_rate, 0.9)), signal), dtype=np.float64)


def swing(sampling_rate: float, smooth: FloatArray, velocity: FloatArray) -> float:
    """The way (m) between two reversals, in the mean, from a velocity (n,) and the same without its noise (m/s)."""
    forth = np.sign(smooth[np.abs(smooth) > float(np.std(velocity - smooth))])
    legs = 1 + int(np.count_nonzero(forth[1:] != forth[:-1]))
    return float(np.sum(np.abs(smooth))) / sampling_rate / legs


@cache
def _low_pass(share: float) -> FloatArray:
    return np.asarray(scipy.signal.butter(2, share, output="sos"), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Guess:
    """A trace that an effect would leave, to first order.

    columns: (k, n) per unit coefficient: V against the drive, or m/s of an effect that acts behind the base (``Effect.is_behind``)
    read:    start values of all parameters, in order, from the k coefficients that explain the error best
    inverse_only: a start for base and effect together, and no trace of the effect beside a base that stays
    whole:   the law is the column as it is, once: its coefficient says how well it fits, and no size (what lies above a limit)
    """

    columns: FloatArray
    read: Callable[[FloatArray], tuple[float, ...]]
    inverse_only: bool = False
    whole: bool = False


def columns(*signals: FloatArray) -> FloatArray:
    """(k, n) from k signals of n samples."""
    return np.vstack(signals)
