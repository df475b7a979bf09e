"""The measured motion, from which effects compute their traces."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, lru_cache

import numpy as np
import scipy

from xy_sysid.effects._similarity import Similarity
from xy_sysid.samples.block import FloatArray

USUAL_SWING = 2e-4  # m between two reversals on the reference machine of ``Similarity``
PLACES = 2048  # bins along the travel, for periodic traces
REPEATS = 1.5  # least periods within the travel: a longer wave acts like a polynomial, and explains anything
SHORT = 2**16  # samples up to which a scene caches the columns of its guesses: 50 MB
FINER = 16  # grid steps per period within the travel: half a step off misses 0.3 % of the power of a sine


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Motion of one axis, and its error against the base model. Compared by identity, so that results can be cached.

    sampling_rate: Hz; gain: m/s/V; pole: rad/s of the base
    voltage:  (n,) delayed voltage at the amplifier, mean over each sample, V
    velocity: (n,) measured mean velocity of each sample, m/s
    position: (n,) measured, at the middle of each sample, m
    error:    (n,) measured velocity minus the model's, m/s
    recordings: number of samples of each recording in it, in sequence; empty for one recording
    prompt: the same motion with a base without delay; None unless the base's delay is so long that a wrong value would hide traces
    sections: b0, b1, b2, a1, a2 of each filter section of the motion behind the base
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
        """The guesses of an effect, cached for score test and inverse identification if there are at most ``SHORT`` samples."""
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
        """Ratios of this motion to that of the reference machine."""
        return _similar(self)

    @property
    def swing(self) -> float:
        """Typical distance between two reversals, m."""
        return swing(self.sampling_rate, self.smooth(self.velocity, 300.0), self.velocity)

    def smooth(self, signal: FloatArray, cutoff: float) -> FloatArray:
        """The signal below ``cutoff`` (Hz), without phase shift; cached for the scene's own signals."""
        own = next((name for name in ("voltage", "velocity", "error") if signal is getattr(self, name)), None)
        if own is None:
            return self._smoothed(signal, cutoff)
        if (own, cutoff) not in self._known:
            self._known[own, cutoff] = self._smoothed(signal, cutoff)
        return self._known[own, cutoff]

    def _smoothed(self, signal: FloatArray, cutoff: float) -> FloatArray:
        return smoothed(self.sampling_rate, signal, cutoff)

    def direction(self) -> FloatArray:
        """(n,) direction of motion, -1..1: near 0 where noise exceeds the speed."""
        v = self.smooth(self.velocity, 300.0)
        noise = float(np.std(self.velocity - v)) + 1e-12
        return np.asarray(np.tanh(v / noise))

    def missing_force(self) -> FloatArray:
        """(n,) force against the drive that would explain the error, V, below 100 Hz."""
        e = self.smooth(self.error, 100.0)
        return -(np.gradient(e) * self.sampling_rate / self.pole + e) / self.gain

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the travel, m, without its outermost hundredths."""
        low, high = np.quantile(self.position, [0.01, 0.99])
        return float(low), float(high)

    def periods(self, numerator: FloatArray, denominator: FloatArray, count: int = 4, least: float = REPEATS) -> list[float]:
        """Period lengths (m) of numerator / denominator along the travel, strongest first, at most ``count``.

        Only lengths with at least ``least`` periods within the travel. At each length a sine is
        fitted along the travel, weighted by the denominator (Lomb 1976; Zechmeister & Kurster 2009, eq. 5), and less towards the ends.
        """
        low, high = self.ends
        travel = high - low
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
    """(n,) a signal below ``cutoff`` (Hz), without phase shift."""
    return np.asarray(scipy.signal.sosfiltfilt(_low_pass(min(2.0 * cutoff / sampling_rate, 0.9)), signal), dtype=np.float64)


def swing(sampling_rate: float, smooth: FloatArray, velocity: FloatArray) -> float:
    """Mean distance (m) between two reversals, from a velocity (n,) and the same without its noise (m/s)."""
    forth = np.sign(smooth[np.abs(smooth) > float(np.std(velocity - smooth))])
    legs = 1 + int(np.count_nonzero(forth[1:] != forth[:-1]))
    return float(np.sum(np.abs(smooth))) / sampling_rate / legs


@cache
def _low_pass(share: float) -> FloatArray:
    return np.asarray(scipy.signal.butter(2, share, output="sos"), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Guess:
    """The trace of an effect in the error, to first order.

    columns: (k, n) per unit coefficient: V against the drive, or m/s for an effect behind the base (``Effect.is_behind``)
    read:    start values of all parameters, in order, from the k coefficients that explain the error best
    inverse_only: True for a start of base and effect together that is not used with a fixed base (score test)
    whole:   True if the law is the column times 1: its coefficient shows how well it fits, not a size (voltage beyond a limit, for example)
    """

    columns: FloatArray
    read: Callable[[FloatArray], tuple[float, ...]]
    inverse_only: bool = False
    whole: bool = False


def columns(*signals: FloatArray) -> FloatArray:
    """(k, n) from k signals of n samples."""
    return np.vstack(signals)


def wave(period: float, c: FloatArray) -> tuple[float, float, float]:
    """(amplitude, period, phase) from the coefficients of sine and cosine."""
    return (math.hypot(float(c[0]), float(c[1])), period, math.atan2(float(c[1]), float(c[0])))
