"""Nonlinearity of an axis: even and odd distortion, measured on lines that a multisine left free.

An odd multisine has no power on even lines: output there is even distortion (a law that differs between the directions).
Omitted odd lines show odd distortion (friction, dead zone, saturation). The part that repeats in every period is
distortion, the rest is noise. (Pintelon & Schoukens, System Identification, 2nd ed., sec. 4.3)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.samples.block import FloatArray

NEAR = 8  # lines on each side of a free line among which there must be an excited one
EXCITED, FREE = 0.5, 0.1  # of the strongest line nearby: an excited line, a free line
WEAK = 1e-3  # of the strongest line overall: weaker ones are not excited
FEWEST = 3  # periods after the first, and free lines
SURE = 4.0  # standard deviations above noise
NO_POWER = 0.02  # fraction of excited lines that may be even by chance
GROUPS = 12  # of free lines, for a readable spectrum


@dataclass(frozen=True, slots=True)
class Part:
    """Distortion of one kind, on free lines, of the velocity.

    level: distortion relative to the output on excited lines, mean power, dB; noise: the same for the part that does not repeat
    over_noise: power ratio; seen: True if it exceeds what noise explains
    frequency: (g,) Hz, groups of free lines; level_db, noise_db: (g,) as above
    """

    lines: int
    level: float
    noise: float
    over_noise: float
    seen: bool
    frequency: FloatArray
    level_db: FloatArray
    noise_db: FloatArray


@dataclass(frozen=True, slots=True)
class Distortion:
    """The distortion of one axis; odd is None if no odd line was left free."""

    period: int
    periods: int
    even: Part
    odd: Part | None

    @property
    def sentence(self) -> str:
        """The result in words."""
        words = [f"even distortion {_words(self.even)}", *([f"odd distortion {_words(self.odd)}"] if self.odd else [])]
        if self.odd is None:
            words.append("no odd line was left free (kind multisine_detect does that)")
        return "; ".join(words) + f" ({self.periods} periods)."


def _words(part: Part) -> str:
    if not part.seen:
        return f"not seen, below {part.noise:.0f} dB"
    return f"at {part.level:.0f} dB of the output, {10.0 * np.log10(part.over_noise):.0f} dB above noise"


def distortion(sampling_rate: float, u: FloatArray, y: FloatArray, period: int) -> Distortion | None:
    """Distortion of a gap-free run (n,) whose input has this period in samples; None if it leaves no even lines free.

    The first period is left out, and the small input on the free lines (centring) is corrected to first order.
    """
    velocity = np.diff(y) * sampling_rate
    periods = velocity.size // period - 1
    if periods < FEWEST:
        return None
    rows = slice(period, (periods + 1) * period)
    inputs, outputs = (np.fft.rfft(values[rows].reshape(periods, period), axis=1)[:, 1:] * 2.0 / period for values in (u, velocity))
    size = np.abs(inputs.mean(axis=0))
    strongest = scipy.ndimage.maximum_filter1d(size, 2 * NEAR + 1)
    used = strongest > WEAK * float(size.max())
    excited = used & (size > EXCITED * strongest)
    number = np.arange(1, size.size + 1)
    if not bool(excited.any()) or float(np.mean(number[excited] % 2 == 0)) > NO_POWER:
        return None
    inside = (number >= number[excited][0]) & (number <= number[excited][-1])
    free = used & inside & (size < FREE * strongest)
    response = outputs.mean(axis=0)[excited] / inputs.mean(axis=0)[excited]
    linear = np.interp(number, number[excited], response.real) + 1j * np.interp(number, number[excited], response.imag)
    rest = outputs - linear * inputs
    mean, noise = rest.mean(axis=0), rest.var(axis=0, ddof=1) / periods
    reference = float(np.mean(np.abs(outputs.mean(axis=0)[excited]) ** 2))
    frequency = number * sampling_rate / period
    parts = [_part(frequency[lines], np.abs(mean[lines]) ** 2, noise[lines], reference, periods) for lines in _free(free, number)]
    even = parts[0]
    return None if even is None else Distortion(period, periods, even, parts[1])


def _free(free: NDArray[np.bool_], number: NDArray[np.int64]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    return free & (number % 2 == 0), free & (number % 2 == 1)


def _part(frequency: FloatArray, power: FloatArray, noise: FloatArray, reference: float, periods: int) -> Part | None:
    count = frequency.size
    if count < FEWEST:
        return None
    ratio = float(np.mean(power) / max(float(np.mean(noise)), 1e-300))
    spread = float(np.sqrt((1.0 + 1.0 / (periods - 1)) * np.mean(noise**2) / count)) / max(float(np.mean(noise)), 1e-300)
    groups = [part for part in np.array_split(np.arange(count), min(GROUPS, count)) if part.size]
    own = np.maximum(power - noise, 0.0)

    def level(values: FloatArray) -> float:
        return float(10.0 * np.log10(max(float(np.mean(values)) / max(reference, 1e-300), 1e-20)))

    return Part(
        lines=count,
        level=level(own),
        noise=level(noise),
        over_noise=ratio,
        seen=ratio > 1.0 + SURE * spread,
        frequency=np.array([float(np.exp(np.mean(np.log(frequency[part])))) for part in groups]),
        level_db=np.array([level(own[part]) for part in groups]),
        noise_db=np.array([level(noise[part]) for part in groups]),
    )
