"""Fit of a response measured elsewhere: no hold between samples; the low end of the response shows whether it integrates."""

from __future__ import annotations

import numpy as np

from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.settings import IdentifierSettings
from xy_sysid.units import derivative_of

LOW = 10  # lines at the low end for the slope
USUAL = IdentifierSettings()


def is_given(response: FrequencyResponse) -> bool:
    """True if a response was not estimated from windows of samples."""
    return response.resolution == 0.0


def settings_for(response: FrequencyResponse, settings: IdentifierSettings) -> IdentifierSettings:
    """The settings; those of hold and integrators that have default values are replaced for a response measured elsewhere."""
    if not is_given(response):
        return settings
    hold = "none" if settings.hold == USUAL.hold else settings.hold
    integrators = (
        min(_integrators(response) + derivative_of(response.output_unit), 2) if settings.integrators == USUAL.integrators else settings.integrators
    )
    return settings.model_copy(update={"hold": hold, "integrators": integrators})


def band_of(response: FrequencyResponse, settings: IdentifierSettings) -> FrequencyResponse:
    """All lines of a response measured elsewhere, or those of a band that the user chose."""
    low = settings.band_low if settings.band_low != USUAL.band_low else 0.0
    high = settings.band_high if settings.band_high != USUAL.band_high else np.inf
    return response.band(low, high)


def _integrators(response: FrequencyResponse) -> int:
    """0, 1 or 2 integrators: the smaller of the numbers that magnitude slope and phase of the lowest lines show."""
    lines = slice(0, LOW)
    slope = float(np.polyfit(np.log(response.frequency[lines]), np.log(np.abs(response.response[lines])), 1)[0])
    phase = float(np.angle(np.sum(response.response[lines] / np.abs(response.response[lines]))))
    return int(np.clip(np.rint(min(-slope, abs(phase) / (0.5 * np.pi))), 0, 2))
