"""Is the residual error noise? Its autocorrelation, and its cross-correlation with the input.

Ljung, System Identification, 2nd ed., sec. 16.6: the residual of a complete model does not correlate with past inputs.
The bounds are those of an unrelated residual and input, each with its own spectrum (Bartlett, J. R. Stat.
Soc. Suppl. 8, 1946). Therefore an encoder's noise, which alternates from sample to sample, does not count as a model fault.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from xy_sysid.errors import BadInput
from xy_sysid.response.frf import Z95
from xy_sysid.samples.block import FloatArray

LAGS = 100  # samples to each side
COLOUR = 20  # fraction of the record up to which lags count for the bounds


@dataclass(frozen=True, slots=True)
class ResidualCorrelation:
    """Correlations of a residual.

    lag:    (m,) samples, from 0; autocorrelation: (m,), 1 at lag 0; white: bound of 95 % of it for a white residual
    shift:  (2 m - 1,) samples of the residual's delay relative to the input (negative: only feedback can cause it)
    cross:  (2 m - 1,) correlation of input and residual, -1..1; unrelated: bound of 95 % of it for unrelated signals
    """

    lag: FloatArray
    autocorrelation: FloatArray
    white: float
    shift: FloatArray
    cross: FloatArray
    unrelated: float

    @property
    def outside(self) -> float:
        """Fraction of the shifts from 0 on at which the residual correlates with the input: 0.05 by chance."""
        return float(np.mean(np.abs(self.cross[self.shift >= 0]) > self.unrelated))


def residual_correlation(residual: FloatArray, voltage: FloatArray, lags: int = LAGS) -> ResidualCorrelation:
    """Correlations of a residual (n,) with itself and with the input (n,), to ``lags`` samples.

    Raises BadInput if the lengths differ, there are fewer than twenty samples per lag, or one of them is constant.
    """
    if residual.size != voltage.size:
        raise BadInput("residual", f"{residual.size} samples", f"{voltage.size}, as many as of the input", "Give both for the same samples.")
    if residual.size < COLOUR * lags:
        raise BadInput("samples", residual.size, f"at least {COLOUR * lags} for {lags} lags", "Record longer or ask for fewer lags.")
    far = residual.size // COLOUR
    error, drive = residual - residual.mean(), voltage - voltage.mean()
    ours, theirs = _covariance(error, error, far), _covariance(drive, drive, far)
    middle = far
    if not (ours[middle] > 0.0 and theirs[middle] > 0.0):
        raise BadInput("residual and input", "one that does not move", "two that move", "Excite the axis.")
    together = _covariance(drive, error, far) / np.sqrt(ours[middle] * theirs[middle])
    own, inputs = ours / ours[middle], theirs / theirs[middle]
    many = np.sqrt(residual.size)
    near = slice(middle - lags, middle + lags + 1)
    return ResidualCorrelation(
        lag=np.arange(lags + 1, dtype=np.float64),
        autocorrelation=own[middle : middle + lags + 1],
        white=float(Z95 / many),
        shift=np.arange(-lags, lags + 1, dtype=np.float64),
        cross=together[near],
        unrelated=float(Z95 * np.sqrt(max(float(own @ inputs), 1e-3)) / many),
    )


def _covariance(first: FloatArray, second: FloatArray, far: int) -> FloatArray:
    """(2 far + 1,) mean of first(t) second(t + k), k from -far to far."""
    size = scipy.fft.next_fast_len(first.size + far, real=True)
    product = scipy.fft.irfft(np.conj(scipy.fft.rfft(first, size)) * scipy.fft.rfft(second, size), size)
    return np.asarray(np.concatenate((product[-far:], product[: far + 1])) / first.size, dtype=np.float64)
