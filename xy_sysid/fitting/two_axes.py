"""Coupling of the first two axes of a recording, with windows that fit the record."""

from __future__ import annotations

from xy_sysid.response.coupling import Coupling, coupling
from xy_sysid.response.windows import WindowShape
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings

SIDE_BY_SIDE = 6  # windows that the record holds at least
SHORTEST = 64  # samples
USUAL = IdentifierSettings().length


def coupling_in(recording: Recording, settings: IdentifierSettings, combine: str = "") -> Coupling:
    """The coupling. combine: see ``coupling``; raises BadInput as it does.

    Windows are the longest power of two of which SIDE_BY_SIDE fit, unless the settings say otherwise: bands average lines here, so the
    longer a window is, the less the response of the own axis leaks into the coupling.
    """
    length = settings.length
    if length == USUAL:
        runs = [max(run.stop - run.start - 1, 0) for run in recording.runs()]
        length = 1 << max(sum(runs) // SIDE_BY_SIDE, SHORTEST).bit_length() - 1
        while length > SHORTEST and sum(run // length for run in runs) < SIDE_BY_SIDE:
            length //= 2
    return coupling(recording, WindowShape.of(settings.window, length, settings.overlap), (settings.band_low, settings.band_high), combine)
