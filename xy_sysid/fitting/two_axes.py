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
LONGEST = LONGER * USUAL  # samples of a window, as of the live machine: beyond it more windows say more than longer ones


def coupling_in(recording: Recording, settings: IdentifierSettings, combine: str = "") -> Coupling:
    """The coupling. combine: see ``coupling``; raises BadInput as it does.

    Windows are the longest power of two of which SIDE_BY_SIDE fit, LONGEST at most, unless the settings say otherwise: bands average lines
    here, so the longer a window is, the less the response of the own axis leaks into the coupling. Of inputs that repeat themselves only one period
    counts: the others tell the two axes apart no further.
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
    """How many samples of two inputs (n, 2) come before they repeat themselves."""
    periods = [find_period(one) or len(inputs) for one in inputs.T]
    return max(min(math.lcm(*periods), len(inputs)) - 1, 0)


def _needed(found: Coupling, longer: float) -> float:
    """Seconds with which the limit would come down to SUFFICES, where a longer recording has longer windows first, up to so many times.

    As windows grow, each band averages the powers of more lines, and the limit falls with the fourth root of the time; then with the root.
    """
    above = max(found.largest / SUFFICES, 1.0)
    return found.seconds * above**4 if above < longer**0.25 else found.seconds * longer * (above / longer**0.25) ** 2
