"""Pseudo-random binary sequence of maximal length: plus or minus rms, switched by a clock.

The clock is the slowest rate / whole number at or above 2.5 ``high`` (or the rate itself), which leaves the power at
``high`` 2.4 dB down (3.9 dB at a rate of only 2 ``high``); the sequence is the longest of 2^n - 1 chips that fits in
``period``. The seed selects the start within the sequence.

Source: S. W. Golomb, "Shift Register Sequences", 1967; clock rule: L. Ljung, "System Identification", 2nd ed., section 13.3.
"""

from __future__ import annotations

import numpy as np
import scipy

from xy_sysid.errors import BadInput
from xy_sysid.excitation.contract import Periodic, below_nyquist, samples
from xy_sysid.settings import AxisExcitation

CLOCK = 2.5  # chips per cycle of ``high``: sinc^2 falls to half at 0.44 of the clock
SHORTEST, LONGEST = 2, 24  # bits of the shift register


def layout(settings: AxisExcitation, rate: float) -> tuple[int, int]:
    """Bits of the register and samples of a chip; raises BadInput if three chips do not fit in the period."""
    below_nyquist(settings, rate)
    chip = max(1, int(rate / (CLOCK * settings.high) + 1e-9))
    bits = int(np.log2(samples(settings.period, rate, 1, "period") / chip + 1) + 1e-12)
    if bits < SHORTEST:
        raise BadInput(
            "period of the PRBS", f"{settings.period:g} s", f"at least {3 * chip / rate:g} s, three chips", "Lengthen period or raise high."
        )
    return min(bits, LONGEST), chip


def prbs(settings: AxisExcitation, rate: float) -> Periodic:
    """Two-level signal of the set rms with a white spectrum up to about high."""
    bits, chip = layout(settings, rate)
    register = settings.seed % (2**bits - 1) + 1
    state = np.array([register >> k & 1 for k in range(bits)], dtype=np.int8)
    sequence = np.asarray(scipy.signal.max_len_seq(bits, state=state)[0], dtype=np.float64)
    return Periodic(np.repeat(settings.rms * (2 * sequence - 1), chip))
