"""What a fit says: the model, how sure it is, and whether it can be believed."""

from __future__ import annotations

from dataclasses import dataclass

from xy_sysid.errors import BadInput
from xy_sysid.fitting.structure import Structure
from xy_sysid.frf import ComplexArray
from xy_sysid.stream import FloatArray
from xy_sysid.transfer_function import TransferFunction


@dataclass(frozen=True, slots=True)
class Estimate:
    """One number with its 95 % interval [low, high] and standard error, all in ``unit``."""

    name: str
    value: float
    sigma: float
    low: float
    high: float
    unit: str


@dataclass(frozen=True, slots=True)
class Fit:
    """A transfer function fitted to a frequency response.

    frequency, measured, response, weight: (m,) the trusted lines, Hz; the data; the prediction through the window; 1 / error
    cost:            half the sum of squared weighted errors
    expected_cost:   what the measured sigma lets expect of a model that misses nothing, and
    cost_deviation:  its standard deviation; NaN without a sigma
    consistent:      cost within 3 deviations (or below); None when it cannot be judged
    relative_error:  rms of |measured - response| / |measured|
    error_cost:      the paper's name for relative_error, per cent
    confidence:      what the paper calls "parameter confidence", 100 - error_cost; not a confidence interval
    parameters:      names of the free coefficients and the delay, and their (p, p) covariance
    jacobian:        (2 m, p) weighted derivatives of the real and imaginary parts of the prediction to the parameters
    poles, zeros:    rad/s (z in the z domain), integrators included
    intervals:       95 % intervals of coefficients, delay, gain, poles, zeros, resonances and antiresonances
    converged, reason: False when no trustworthy minimum was found, and why
    warnings:        what a user should know, one sentence each
    start:           where it began
    """

    tf: TransferFunction
    structure: Structure
    method: str
    frequency: FloatArray
    measured: ComplexArray
    response: ComplexArray
    weight: FloatArray
    cost: float
    expected_cost: float
    cost_deviation: float
    consistent: bool | None
    relative_error: float
    parameters: tuple[str, ...]
    covariance: FloatArray
    jacobian: FloatArray
    poles: ComplexArray
    zeros: ComplexArray
    intervals: tuple[Estimate, ...]
    iterations: int
    converged: bool
    reason: str
    warnings: tuple[str, ...]
    start: str

    @property
    def error_cost(self) -> float:
        """Per cent."""
        return 100.0 * self.relative_error

    @property
    def confidence(self) -> float:
        """Per cent."""
        return 100.0 - self.error_cost

    def interval(self, name: str) -> Estimate:
        """The estimate of that name; raises BadInput if there is none."""
        for item in self.intervals:
            if item.name == name:
                return item
        raise BadInput("estimate", repr(name), ", ".join(item.name for item in self.intervals), "Choose one of these.")
