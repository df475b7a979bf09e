"""Frequency response function with its coherence and its uncertainty.

H1 estimator: Bendat & Piersol, Random Data, 4th ed., eq. 6.37 (H = Gyx / Gxx) and table 9.6 (random error).
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Origin, check_mask
from xy_sysid.units import over

ComplexArray = NDArray[np.complex128]
Z95 = 1.959963984540054  # sigmas to each side of a 95 % interval: 97.5 % of the normal distribution


def _algebra(name: str) -> Callable[..., FrequencyResponse]:
    """The function of ``algebra`` with this name, imported on use because that module imports this one."""
    found: Callable[..., FrequencyResponse] = getattr(importlib.import_module("xy_sysid.response.algebra"), name)
    return found


_one, _zero, _none = partial(np.ones, 1), partial(np.zeros, 1), partial(np.zeros, 0)


@dataclass(frozen=True, slots=True)
class FrequencyResponse:
    """Measured response of one axis, output over input.

    frequency:        (m,) Hz, increasing, evenly spaced unless lines were left out
    response:         (m,) complex, output_unit / input_unit
    coherence:        (m,) ordinary coherence, 0..1
    sigma:            (m,) standard deviation of the complex error: E|measured - true|^2 = sigma^2
    trusted:          (m,) bool: excited and coherent enough to be used for a fit
    sampling_rate:    Hz; rate_error: its relative standard error, if the time stamps give one
    averages:         effective number of independent averages
    resolution:       spacing of the original lines, Hz
    line_correlation: (k,) correlation of the noise errors of lines that are 0..k-1 apart (1 at 0), from window and overlap
    kernel_offset:    (j,) Hz and
    kernel_weight:    (j,) smoothing by the window: the expected estimate at f is sum_j weight_j G(f + offset_j),
                      where G is the response of the quantity that was transformed (see ``differenced``)
    kernel_amplitude: (j,) transform of the window at kernel_offset; its square is kernel_weight; empty without leakage
    pairs:            (n,) share of the pairs of windows that are 0, 1, .. hops apart, counted both ways: sum of
                      weight_i weight_j / (sum of weights)^2; hop: from window to window, in lengths of the window
    smoothing:        lines over which the noise power was averaged for sigma
    differenced:      True if the window was applied to the difference y[n+1] - y[n] of the output, and the estimate divided by
                      exp(j w T) - 1, so that the smoothing acts on the response times (exp(j w T) - 1)
    noise, distortion: (m,) standard deviations of the response of one realisation due to noise and due to nonlinear distortion, if several
                      realisations of a periodic input separate them; otherwise (0,)
    origin:           axis, samples and notes, if they are known
    """

    frequency: FloatArray
    response: ComplexArray
    coherence: FloatArray
    sigma: FloatArray
    trusted: NDArray[np.bool_]
    sampling_rate: float
    averages: float
    resolution: float
    input_unit: str = "V"
    output_unit: str = "m"
    rate_error: float = 0.0
    line_correlation: FloatArray = field(default_factory=_one)
    kernel_offset: FloatArray = field(default_factory=_zero)
    kernel_weight: FloatArray = field(default_factory=_one)
    kernel_amplitude: FloatArray = field(default_factory=_none)
    pairs: FloatArray = field(default_factory=_one)
    hop: float = 1.0
    smoothing: int = 1
    differenced: bool = False
    noise: FloatArray = field(default_factory=_none)
    distortion: FloatArray = field(default_factory=_none)
    origin: Origin = field(default_factory=Origin)

    def __len__(self) -> int:
        return int(self.frequency.shape[0])

    def __repr__(self) -> str:
        if len(self) == 0:
            return "<FrequencyResponse: no line>"
        told = f" of axis {self.origin.axis}" if self.origin.axis else ""
        lines = f"{len(self)} lines from {self.frequency[0]:.4g} to {self.frequency[-1]:.4g} Hz, {int(self.trusted.sum())} trusted"
        return f"<FrequencyResponse{told}: {lines}, {self.averages:.1f} averages, {over(self.output_unit, self.input_unit)}>"

    def select(self, lines: NDArray[np.bool_] | slice) -> FrequencyResponse:
        """The response at some of its lines. Raises BadInput for a mask of another length."""
        check_mask(lines, len(self))
        return replace(
            self,
            frequency=self.frequency[lines],
            response=self.response[lines],
            coherence=self.coherence[lines],
            sigma=self.sigma[lines],
            trusted=self.trusted[lines],
            noise=self.noise[lines] if self.noise.size else self.noise,
            distortion=self.distortion[lines] if self.distortion.size else self.distortion,
        )

    def __add__(self, other: Any) -> FrequencyResponse:
        """Sum with a response, a transfer function or a number; errors are assumed to be independent. Raises BadInput if units differ."""
        return _algebra("added")(self, other)

    def __sub__(self, other: Any) -> FrequencyResponse:
        """Difference; see ``__add__``."""
        return _algebra("added")(self, other, -1.0)

    def __mul__(self, other: Any) -> FrequencyResponse:
        """Series connection ``plant * controller``. Raises BadInput if the controller's output is not the plant's input."""
        return _algebra("multiplied")(self, other)

    __rmul__ = __mul__

    def inverse(self) -> FrequencyResponse:
        """The inverse response: input over output."""
        return _algebra("inverted")(self)

    def closed_loop(self, controller: Any) -> FrequencyResponse:
        """From reference to output, P C / (1 + P C); controller: a response, a transfer function or a number, from output to input."""
        return _algebra("closed")(self, controller)

    def band(self, low: float, high: float) -> FrequencyResponse:
        """The lines from low to high, both included, Hz."""
        return self.select((self.frequency >= low) & (self.frequency <= high))
