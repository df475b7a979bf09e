"""Uncertainty of a fitted model's response, line by line.

The covariance of the parameters is carried through the derivatives of the response (first-order propagation; Pintelon & Schoukens,
System Identification, 2nd ed., sec. 9.3), and widened by ``Fit.misfit``, as its intervals are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from xy_sysid.fitting.result import Fit
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class ModelBand:
    """Standard deviations at the fit's lines: of the magnitude, relative (m,), and of the phase, rad (m,); NaN if unknown."""

    magnitude: FloatArray
    phase: FloatArray


def model_band(fit: Fit) -> ModelBand:
    """The band of a fit; NaN if its parameters have no covariance or its misfit is unknown."""
    lines = fit.frequency.size
    change = (fit.jacobian[:lines] + 1j * fit.jacobian[lines:]) / fit.weight[:, None]  # of the response, by each parameter
    with np.errstate(all="ignore"):  # what is not finite is NaN in the band
        relative = change / fit.response[:, None]
        return ModelBand(*(fit.misfit * _deviation(part, fit.covariance) for part in (relative.real, relative.imag)))


def _deviation(change: FloatArray, covariance: FloatArray) -> FloatArray:
    """(m,) standard deviation from derivatives ``change`` (m, p) and the parameters' covariance."""
    variance = np.einsum("ij,jk,ik->i", change, covariance, change)
    return np.asarray(np.sqrt(np.where(variance >= 0.0, variance, np.nan)), dtype=np.float64)
