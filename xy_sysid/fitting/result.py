"""The result of a fit: the model, its uncertainty, and whether it is trustworthy."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from xy_sysid.errors import BadInput
from xy_sysid.fitting.structure import Structure
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import Units, units_of

GOOD_ERROR, POOR_ERROR = 0.02, 0.05  # relative errors: a model up to the first is good; above the second something is missing


@dataclass(frozen=True, slots=True)
class Ended:
    """The end of an estimator; converged: whether it is a minimum."""

    iterations: int
    converged: bool
    reason: str


@dataclass(frozen=True, slots=True)
class Fit:
    """A transfer function fitted to a frequency response.

    frequency, measured, response, weight: (m,) the trusted lines, Hz; the data; the prediction through the window; 1 / error
    cost:            half the sum of squared weighted errors
    expected_cost:   the cost due to noise of the measured sigma alone
    cost_deviation:  its standard deviation; both are NaN without a sigma
    consistent:      cost at most 3 deviations above the expected one; None if that is unknown
    relative_error:  rms of |measured - response| / |measured|
    error_cost:      the paper's name for relative_error, per cent
    confidence:      the paper's "parameter confidence", 100 - error_cost; not a confidence interval
    parameters:      names of the free coefficients and the delay, and their (p, p) covariance
    jacobian:        (2 m, p) weighted derivatives of the real and imaginary parts of the prediction to the parameters
    poles, zeros:    rad/s (z in the z domain), integrators included
    intervals:       95 % intervals of coefficients, delay, gain, poles, zeros, resonances and antiresonances, for noise alone;
                     see ``intervals_with_misfit``
    converged, reason: False if no minimum was found, and why
    warnings:        what a user should know, one sentence each
    start:           origin of the start value, in words
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

    @property
    def misfit(self) -> float:
        """Factor by which the intervals for noise alone are too narrow: root of cost over expected cost (Birge, Phys. Rev. 40, 1932).

        1 if noise explains the cost, NaN if that is unknown. If the factor is far above 1, the model fails, and even the widened intervals
        are only an order of magnitude.
        """
        if self.consistent is None or not self.expected_cost > 0.0:
            return float("nan")
        return 1.0 if self.consistent else math.sqrt(max(self.cost / self.expected_cost, 1.0))

    @property
    def intervals_with_misfit(self) -> tuple[Estimate, ...]:
        """The intervals, widened by ``misfit``; NaN bounds if it is unknown."""
        factor = self.misfit
        return tuple(
            replace(
                item,
                low=item.value - factor * (item.value - item.low),
                high=item.value + factor * (item.high - item.value),
            )
            for item in self.intervals
        )

    @property
    def units(self) -> Units:
        """Of the input and of the position, whichever of its derivatives was measured."""
        return units_of(self.tf.input_unit, self.tf.output_unit)

    @property
    def rigid(self) -> tuple[Estimate, ...]:
        """Gain and pole of the rigid body, from which inertia and damping follow; none if the gain is not that of a velocity."""
        ours = tuple(item for item in self.intervals_with_misfit if item.name in ("gain", "pole_1"))
        return ours if any(item.name == "gain" and item.unit == self.units.of("m/s/V") for item in ours) else ()

    def interval(self, name: str) -> Estimate:
        """The estimate of that name; raises BadInput if there is none."""
        for item in self.intervals:
            if item.name == name:
                return item
        raise BadInput("estimate", repr(name), ", ".join(item.name for item in self.intervals), "Choose one of these.")
