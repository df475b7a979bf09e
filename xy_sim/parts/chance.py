"""A random number for every sample, that depends on nothing but a seed and the sample's number, so that blocks do not matter.

Law: two rounds of multiply and shift (C. Wellons, Prospecting for hash functions, 2018) over 32 bits.
"""

from __future__ import annotations

from xy_sim.inlined import inlined

_WORD = 0xFFFFFFFF


@inlined
def centred(seed: float, number: int) -> float:
    """Between -1 and 1, uniform."""
    word = (int(seed) * 7_919 + number + 1) & _WORD
    for _ in range(3):
        word = ((word ^ (word >> 16)) * 0x45D9F3B) & _WORD
    word ^= word >> 16
    return word / 2147483647.5 - 1.0
