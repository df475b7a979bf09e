"""Coupling of the first two axes of a recording, with windows that fit the record."""

from __future__ import annotations

import math
from dataclasses import replace

from xy_sysid.response.coupling import LONGER, SUFFICES, Coupling, coupling
from xy_sysid.response.period import find_period
from xy_sysid.response.windows import WindowShape
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings

SIDE_BY_SIDE = 6  # windows that the record holds at least
SHORTEST = 64  # samples
USUAL = IdentifierSettings().length
LONGEST = LONGER * USUAL  # samples of a window, as in live operation: beyond it more windows are better than longer ones


def coupling_in(recording: Recording, settings: IdentifierSettings, combine: str = "") -> Coupling:
    """The coupling. combine: see ``coupling``; raises BadInput as it does.

    Unless the settings give a length, it is the largest power of two of which SIDE_BY_SIDE windows fit, LONGEST at most: a longer window reduces
    the leakage of each axis' own response into the coupling. Only one period of periodic inputs counts, because the others add nothing that
    distinguishes the two axes.
    """
    length = settings.length
    if length == USUAL:
        runs = [_distinct(recording.voltage[run, :2]) for run in recording.runs()]
        length = min(1 << max(sum(runs) // SIDE_BY_SIDE, SHORTEST).bit_length() - 1, LONGEST)
        while length > SHORTEST and sum(run // length for run in runs) < SIDE_BY_SIDE:
            length //= 2
    found = coupling(recording, WindowShape.of(settings.window, length, settings.overlap), (settings.band_low, settings.band_high), combine)
    return replace(found, needed=_needed(found, LONGEST / length)) if length < LONGEST and settings.length == USUAL else found


def _distinct(inputs: FloatArray) -> int:
    """Number of samples of two inputs (n, 2) before both repeat, minus 1."""
    periods = [find_period(one) or len(inputs) for one in inputs.T]
    return max(min(math.lcm(*periods), len(inputs)) - 1, 0)


def _needed(found: Coupling, longer: float) -> float:
    """Duration of a recording, s, that lowers the limit of the coupling to SUFFICES; longer: factor by which windows can still grow.

    While windows grow, each band averages the powers of more lines, and the limit falls with the fourth root of the time; then with the root.
    """
    above = max(found.largest / SUFFICES, 1.0)
    return found.seconds * above**4 if above < longer**0.25 else found.seconds * longer * (above / longer**0.25) ** 2
