"""The band of a fitted response equals the scatter of responses of refitted data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from helpers.fitting_cases import held, paper_machine

from xy_sysid.fitting import Structure, identify
from xy_sysid.fitting.model_band import model_band

STRUCTURE = Structure(numerator_order=2, denominator_order=4, integrators=1)


def test_the_band_is_as_wide_as_refitted_responses_scatter() -> None:
    """Forty draws of noise: their responses scatter around the truth as one draw's band says, in magnitude and in phase."""
    fits = [identify(held(paper_machine(), 0.02, seed), STRUCTURE) for seed in range(40)]
    ratio = np.array([fit.response for fit in fits])
    mean = ratio.mean(axis=0)
    scatter = np.std(np.log(np.abs(ratio / mean)), axis=0), np.std(np.angle(ratio / mean), axis=0)
    bands = [model_band(fit) for fit in fits]
    for seen, told in zip(scatter, (np.mean([b.magnitude for b in bands], axis=0), np.mean([b.phase for b in bands], axis=0)), strict=True):
        assert 0.75 < float(np.median(told / seen)) < 1.33
        assert float(np.mean((told / seen > 0.5) & (told / seen < 2.0))) > 0.95


def test_a_fit_without_an_uncertainty_has_no_band() -> None:
    """An unknown band is not drawn."""
    fit = identify(held(paper_machine(), 0.02, 1), STRUCTURE)
    unknown = model_band(replace(fit, covariance=np.full_like(fit.covariance, np.nan)))
    assert np.isnan(unknown.magnitude).all()
    assert np.isnan(unknown.phase).all()
