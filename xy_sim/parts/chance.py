"""A random number for every sample, which depends only on a seed and the sample's number, not on the division into blocks.

Law: three rounds of shift and multiply over 32 bits (after C. Wellons, Prospecting for hash functions, 2018).
"""

from __future__ import annotations

from xy_sim.inlined import inlined

_WORD = 0xFFFFFFFF


@inlined
def centred(seed: float, number: int) -> float:
    """Uniform between -1 and 1."""
    word = (int(seed) * 7_919 + number + 1) & _WORD
    for _ in range(3):
        word = ((word ^ (word >> 16)) * 0x45D9F3B) & _WORD
    word ^= word >> 16
    return word / 2147483647.5 - 1.0
