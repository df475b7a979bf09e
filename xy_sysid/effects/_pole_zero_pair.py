"""Resonances on the sampled motion: a pair of poles with a pair of zeros, or without.

Poles and zeros are mapped by z = exp(s / fs) (matched z-transform; Franklin, Powell & Workman, Digital Control of Dynamic
Systems, 3rd ed., sec. 6.2.3), with gain 1 at 0 Hz. Poles and zeros lie close together, so errors of the mapping far above
them cancel.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.effects._contract import law
from xy_sysid.effects._scene import Guess, Scene, columns
from xy_sysid.samples.block import FloatArray

_DAMPING = 0.03  # damping ratio of the first guess; real frames and screws have 0.01 to 0.1
_HIGHEST = 0.35  # of the sampling rate: lines of a response
_WEAKEST = 1e-3  # power of a line of the input over the largest
_COHERENT = 0.1  # least coherence of a line; its weight falls with it
_LIKELY = 4  # most frequencies whose traces are computed


@law
def polynomial(frequency: float, damping: float, fs: float) -> tuple[float, float]:
    """c1, c2 of z^2 + c1 z + c2 for an oscillation at ``frequency`` (Hz) with this damping ratio."""
    w = 2.0 * math.pi * frequency / fs
    decay = math.exp(-damping * w)
    under = 1.0 - damping * damping
    turn = math.cos(w * math.sqrt(under)) if under > 0.0 else math.cosh(w * math.sqrt(-under))
    return -2.0 * decay * turn, decay * decay


@law
def pair(zero: float, zero_damping: float, pole: float, pole_damping: float, fs: float) -> tuple[float, float, float, float, float]:
    """b0, b1, b2, a1, a2 of the section with zeros and poles at these frequencies (Hz)."""
    b1, b2 = polynomial(zero, zero_damping, fs)
    a1, a2 = polynomial(pole, pole_damping, fs)
    b0 = (1.0 + a1 + a2) / (1.0 + b1 + b2)
    return b0, b0 * b1, b0 * b2, a1, a2


@law
def section(split: float, frequency: float, damping: float, pole_damping: float, fs: float) -> tuple[float, float, float, float, float]:
    """The pair of an effect: its resonance is ``split`` above its antiresonance ``frequency`` (Hz)."""
    return pair(frequency, damping, frequency * (1.0 + split), pole_damping, fs)


def guesses(scene: Scene, low: float, high: float) -> Iterator[Guess]:
    """The most likely pairs with poles between ``low`` and ``high`` (Hz)."""
    for trace, frequency in traces(scene, low, high):
        yield Guess(trace, partial(_read, frequency))


def traces(scene: Scene, low: float, high: float) -> Iterator[tuple[FloatArray, float]]:
    """(2, n) traces of the most likely poles between ``low`` and ``high`` (Hz), and their frequencies; none if sampling is too slow."""
    top = min(high, _HIGHEST * scene.sampling_rate)
    if top <= low:
        return
    model = scene.velocity - scene.error
    for frequency in _likely(scene, np.geomspace(low, top, max(int(math.log(top / low) / 0.06), 2))):
        w = 2.0 * math.pi * float(frequency)
        c = w / math.tan(0.5 * w / scene.sampling_rate)  # s = c (z - 1) / (z + 1), exact at the pair
        a = np.array([c * c + 2.0 * _DAMPING * w * c + w * w, 2.0 * (w * w - c * c), c * c - 2.0 * _DAMPING * w * c + w * w])
        poles = scipy.signal.lfilter([1.0], a, model)  # the two numerators follow
        once, twice = np.append(0.0, poles[:-1]), np.concatenate(((0.0, 0.0), poles[:-2]))
        yield columns(c * c * (poles - 2.0 * once + twice), c * w * (poles - twice)), float(frequency)


def _likely(scene: Scene, frequencies: FloatArray) -> FloatArray:
    """The few frequencies (Hz) at which a pair explains most of the error that changes of gain, delay and pole cannot, by averaged
    spectra, in which nonlinear effects count as linear."""
    f, power, cross, weight = _error_spectra(scene)
    if f.size == 0:
        return frequencies[:_LIKELY]
    s, w = 2j * math.pi * f, 2.0 * math.pi * frequencies[:, None]
    below = 1.0 / (s * s + 2.0 * _DAMPING * w * s + w * w)
    base = np.stack((np.ones_like(s), s / abs(s[-1]), scene.pole / (s + scene.pole)))
    columns = np.concatenate((np.broadcast_to(base, (w.size, *base.shape)), np.stack((s * s * below, w * s * below), axis=1)), axis=1)
    columns = columns * np.sqrt(power * weight)
    rows, seen = np.concatenate((columns.real, columns.imag), axis=2), cross * np.sqrt(weight / power)
    inner, outer = rows @ rows.transpose(0, 2, 1), rows @ np.concatenate((seen.real, seen.imag))
    gain = np.einsum("fj,fjk,fk->f", outer, np.linalg.pinv(inner, rcond=1e-9, hermitian=True), outer)
    peaks = scipy.signal.find_peaks(np.concatenate(((0.0,), gain, (0.0,))))[0] - 1
    return np.asarray(frequencies[peaks[np.argsort(gain[peaks])[::-1][:_LIKELY]]])


def _error_spectra(scene: Scene) -> tuple[FloatArray, FloatArray, NDArray[np.complex128], FloatArray]:
    """Frequency (Hz), power of the model's motion, its cross spectrum with the error, and a weight that makes octaves count equally."""
    f, seen = _spectra(scene)
    error, model = seen[2], seen[1] - seen[2]
    power, own, cross = _mean(model, model).real, _mean(error, error).real, _mean(model, error)
    used = (f > 0.0) & (f < _HIGHEST * scene.sampling_rate) & (power > 0.0) & (own > 0.0)
    return f[used], power[used], cross[used], (1.0 / np.where(used, own * f, 1.0))[used]


def _read(frequency: float, c: FloatArray) -> tuple[float, ...]:
    """(antiresonance, its damping, split, damping of the resonance) from the two coefficients of a pole at ``frequency``."""
    stretch = max(1.0 + float(c[0]), 1.02)
    zero = frequency / math.sqrt(stretch)
    damping = (2.0 * _DAMPING + float(c[1])) / (2.0 * math.sqrt(stretch))
    return (frequency / zero - 1.0, zero, min(max(damping, 0.005), 0.2), _DAMPING)


def joint(scene: Scene, low: float, high: float) -> Iterator[tuple[float, float, float, tuple[float, ...]]]:
    """Gain, delay beyond the scene's, pole, and the pair's parameters, all from the frequency response; the pair must lie between
    ``low`` and ``high`` (Hz)."""
    found = of_response(scene, zeros=2)
    if found is None or found.zero is None:
        return
    bottom, top = found.zero[0], found.pair[0]
    if low <= bottom <= high and top > bottom:
        yield found.gain, found.delay, found.pole, (top / bottom - 1.0, bottom, found.zero[1], found.pair[1])


@dataclass(frozen=True, slots=True)
class OfResponse:
    """A base with a pair of poles, fitted to a frequency response: gain, m/s/V; delay beyond the scene's, s; pole, rad/s;
    frequency (Hz) and damping ratio of the pair, and of the zeros if they are a complex pair."""

    gain: float
    delay: float
    pole: float
    pair: tuple[float, float]
    zero: tuple[float, float] | None


@lru_cache(maxsize=2)
def of_response(scene: Scene, zeros: int) -> OfResponse | None:
    """Three poles and ``zeros`` zeros, by iteratively reweighted linear least squares (Sanathanan & Koerner 1963), for delays on a
    grid; cached for all effects. None if the result is not a base with a pair of poles."""
    f, response, weight = _response(scene)
    if f.size < 4:  # three complex lines determine six numbers, more are needed to check them
        return None
    scale = 2.0 * math.pi * float(np.sqrt(f[0] * f[-1]))
    s = 2j * math.pi * f / scale
    box = np.sinc(f / scene.sampling_rate) ** 2  # held input, mean output
    powers = np.stack([s**2, s, s**0], axis=1)
    above = powers[:, 2 - zeros :]

    def fitted(delays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(delays, zeros + 4) numerator and denominator, and (delays,) misfit, for (delays,) s."""
        target = response * np.exp(np.outer(delays, s * scale)) / box
        matrix = np.concatenate((np.broadcast_to(above, (delays.size, *above.shape)), -target[:, :, None] * powers), axis=2)
        right, denominator, found = target * s**3, np.ones_like(target), np.zeros((delays.size, zeros + 4))
        for _ in range(6):
            row = (weight / (np.abs(target) * np.abs(denominator)))[:, :, None]
            both, wanted = matrix * row, right[:, :, None] * row
            q, r = np.linalg.qr(np.concatenate((both.real, both.imag), axis=1))
            found = (np.linalg.pinv(r) @ (q.transpose(0, 2, 1) @ np.concatenate((wanted.real, wanted.imag), axis=1)))[:, :, 0]
            denominator = s**3 + found[:, -3:] @ powers.T
        misfit = np.sum((weight * np.abs(1.0 - found[:, :-3] @ above.T / denominator / target)) ** 2, axis=1)
        return found, np.where(np.isfinite(misfit), misfit, np.inf)

    delays = np.arange(-12.0, 4.01) / scene.sampling_rate  # mostly shorter: a fit without the pair has a longer delay instead
    nearest = delays[int(np.argmin(fitted(delays)[1]))]
    delays = nearest + np.arange(-0.75, 0.76, 0.25) / scene.sampling_rate
    found, misfit = fitted(delays)
    best = int(np.argmin(misfit))
    if not np.isfinite(misfit[best]):
        return None
    c = found[best]
    poles = np.asarray(np.roots([1.0, *c[-3:]]) * scale, dtype=np.complex128)
    real = poles[np.abs(poles.imag) < 1e-9 * np.abs(poles)]
    pair_of = _swinging(poles)
    if real.size != 1 or pair_of is None or real[0].real >= 0.0:
        return None
    zero_of = _swinging(np.asarray(np.roots(c[:-3]) * scale, dtype=np.complex128))
    return OfResponse(gain=float(c[-4] / c[-1]), delay=float(delays[best]), pole=-float(real[0].real), pair=pair_of, zero=zero_of)


def _swinging(roots: NDArray[np.complex128]) -> tuple[float, float] | None:
    """Frequency, Hz, and damping ratio of the complex pair among the roots; None unless there is exactly one."""
    pair_of = roots[roots.imag > 1e-9 * np.abs(roots)]
    if pair_of.size != 1:
        return None
    size = float(abs(pair_of[0]))
    return size / (2.0 * math.pi), max(-float(pair_of[0].real) / size, 1e-3)


@lru_cache(maxsize=1)
def _spectra(scene: Scene) -> tuple[FloatArray, NDArray[np.complex128]]:
    """Frequency (Hz), and (3, windows, lines) spectra of voltage, velocity and error, each Hann window without its mean; up to 2 s each."""
    length = int(2 ** np.floor(np.log2(min(2.0 * scene.sampling_rate, scene.voltage.size / 4.0))))
    signals = np.stack((scene.voltage, scene.velocity, scene.error))
    cut = np.lib.stride_tricks.sliding_window_view(signals, length, axis=-1)[:, :: length // 2]
    seen = scipy.fft.rfft((cut - cut.mean(axis=-1, keepdims=True)) * scipy.signal.get_window("hann", length))
    return np.asarray(scipy.fft.rfftfreq(length, 1.0 / scene.sampling_rate)), np.asarray(seen)


def _mean(one: NDArray[np.complex128], other: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """(lines,) mean cross spectrum of (windows, lines), without scaling."""
    return np.asarray((one.conj() * other).mean(axis=0))


def _response(scene: Scene) -> tuple[FloatArray, NDArray[np.complex128], FloatArray]:
    """Frequency (Hz), response (m/s/V) and weight of the relative error, at the excited lines."""
    f, (voltage, velocity, _) = _spectra(scene)
    cross, power, output = _mean(voltage, velocity), _mean(voltage, voltage).real, _mean(velocity, velocity).real
    coherence = np.clip(np.abs(cross) ** 2 / np.maximum(power * output, 1e-300), 0.0, 0.9999)
    used = (f > 0.0) & (f < _HIGHEST * scene.sampling_rate) & (power > _WEAKEST * np.max(power)) & (coherence > _COHERENT)
    weight = np.sqrt(coherence / (1.0 - coherence))
    return f[used], np.asarray(cross[used] / power[used]), np.asarray(weight[used])
