"""Random-phase multisine with a flat amplitude spectrum: full, odd, and odd with random detection lines.

The period is a whole number of samples, so a transform over it has no leakage. Odd multisines leave the even lines free: output
there is even distortion. If one odd line of each group of four is left out at random, output on these lines is odd distortion.

Source: R. Pintelon, J. Schoukens, "System Identification: A Frequency Domain Approach", 2nd ed., sections 4.3 and 5.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadInput
from xy_sysid.excitation.contract import Periodic, below_nyquist, crest, samples
from xy_sysid.settings import AxisExcitation

Lines = NDArray[np.int64]
GROUP = 4  # odd lines of which one is left out


@dataclass(frozen=True, slots=True)
class MultisineLines:
    """The lines of the period's transform; line k is at k * rate / period, Hz.

    period: samples; excited: (n,) lines with power; even, odd: lines in the band left free to detect distortion;
    crest: largest magnitude over rms
    """

    period: int
    excited: Lines
    even: Lines
    odd: Lines
    crest: float


@dataclass(slots=True)
class Multisine(Periodic):
    """One period in a table, and its lines."""

    plan: MultisineLines | None = None

    def lines(self) -> MultisineLines:
        """The lines excited and those kept free."""
        assert self.plan is not None
        return self.plan


def _pick(settings: AxisExcitation, rate: float, period: int, random: np.random.Generator) -> tuple[Lines, Lines, Lines]:
    """Excited, free even and free odd lines in the band."""
    first = max(1, int(np.ceil(settings.low * period / rate - 1e-9)))
    last = min((period - 1) // 2, int(np.floor(settings.high * period / rate + 1e-9)))
    band = np.arange(first, last + 1, dtype=np.int64)
    none, even, odd = band[:0], band[band % 2 == 0], band[band % 2 == 1]
    if settings.kind == "multisine":
        return band, none, none
    if settings.kind == "multisine_odd":
        return odd, even, none
    groups = odd.size // GROUP
    out = np.arange(groups) * GROUP + random.integers(0, GROUP, groups)
    return np.delete(odd, out), even, odd[out]


def multisine(settings: AxisExcitation, rate: float) -> Multisine:
    """Multisine of the set rms with lines from low to high; raises BadInput if no line fits in the band."""
    below_nyquist(settings, rate)
    period = samples(settings.period, rate, 4, "period")
    random = np.random.Generator(np.random.Philox(settings.seed))
    excited, even, odd = _pick(settings, rate, period, random)
    if excited.size == 0:
        spacing = f"{rate / period:g} Hz apart"
        raise BadInput(
            "lines of the multisine", 0, f"at least 1 from {settings.low:g} to {settings.high:g} Hz, {spacing}", "Lengthen period or widen the band."
        )
    spectrum = np.zeros(period // 2 + 1, dtype=np.complex128)
    amplitude = settings.rms * np.sqrt(2 / excited.size)
    spectrum[excited] = period / 2 * amplitude * np.exp(2j * np.pi * random.random(excited.size))
    table = np.fft.irfft(spectrum, period)
    return Multisine(table, plan=MultisineLines(period=period, excited=excited, even=even, odd=odd, crest=crest(table)))
