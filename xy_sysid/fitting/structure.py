"""The structure of the transfer function to fit, and the options of the fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from xy_sysid.errors import BadInput
from xy_sysid.settings import IdentifierSettings

Weighting = Literal["sigma", "relative", "uniform"]
LARGEST_ORDER = 12


@dataclass(frozen=True, slots=True)
class Structure:
    """The family of models that a fit chooses from.

    numerator_order, denominator_order: orders; that of the denominator includes the integrators
    integrators: poles fixed at s = 0 (z = 1)
    delay:       "free" to estimate it, or its value in s; whole samples in the z domain
    delay_max:   largest delay of the search, s
    hold:        "zoh": the input is constant between samples; "none": it is band-limited (s domain only)
    domain:      "s" continuous or "z" discrete
    weighting:   of one line's error: "sigma" 1 / sigma, "relative" 1 / |FRF| (the paper's), "uniform" 1
    derivative:  0 for a response of position, 1 of velocity, 2 of acceleration; orders and integrators are those of the position
    Raises BadInput for values out of range.
    """

    numerator_order: int = 2
    denominator_order: int = 4
    integrators: int = 1
    delay: float | Literal["free"] = "free"
    delay_max: float = 0.01
    hold: Literal["zoh", "none"] = "zoh"
    domain: Literal["s", "z"] = "s"
    weighting: Weighting = "sigma"
    derivative: int = 0

    def __post_init__(self) -> None:
        if not 1 <= self.denominator_order <= LARGEST_ORDER:
            raise BadInput("denominator order", self.denominator_order, f"1 to {LARGEST_ORDER}", "Choose an order in this range.")
        if not 0 <= self.numerator_order <= self.denominator_order:
            raise BadInput(
                "numerator order", self.numerator_order, f"0 to the denominator's, {self.denominator_order}", "Lower it or raise the denominator's."
            )
        if not 0 <= self.integrators <= min(2, self.denominator_order):
            raise BadInput("number of integrators", self.integrators, f"0 to {min(2, self.denominator_order)}", "Choose a number in this range.")
        if not 0.0 <= self.delay_max < 1e3:
            raise BadInput("largest delay", f"{self.delay_max} s", "0 to 1000 s", "Give it in seconds.")
        if self.delay != "free" and not 0.0 <= self.delay < 1e3:
            raise BadInput("delay", f"{self.delay} s", "'free' or 0 to 1000 s", "Give it in seconds.")

    @property
    def free_order(self) -> int:
        """Poles to be estimated."""
        return self.denominator_order - self.integrators

    @property
    def power(self) -> int:
        """Poles at 0 of the response; negative: zeros."""
        return self.integrators - self.derivative

    @property
    def free_delay(self) -> bool:
        """True if the delay is a real-valued parameter; in the z domain it is a whole number of samples, found by a scan."""
        return self.delay == "free" and self.domain == "s"

    @property
    def parameters(self) -> int:
        """How many numbers are estimated."""
        return self.numerator_order + 1 + self.free_order + int(self.free_delay)


def structure_from(settings: IdentifierSettings) -> Structure:
    """The model family of the settings; orders that are left to the data are 2/4 until ``choose_orders`` chooses them."""
    return Structure(
        numerator_order=settings.orders[0],
        denominator_order=settings.orders[1],
        integrators=settings.integrators,
        delay="free" if settings.delay else 0.0,
        hold=settings.hold,
    )


@dataclass(frozen=True, slots=True)
class FitOptions:
    """How an estimator works.

    method:          of the non-linear estimators
    max_iterations:  of the non-linear estimators
    relative_change: they stop when the cost changes by less than this fraction
    damping:         first lambda of Levenberg-Marquardt; halved on success, multiplied by 10 on failure (nllsfdi's rule)
    reweightings:    re-weighted linear steps of IWLS
    refine_delay:    linear estimators find a free delay by a line search; off keeps the best delay of the scan
    delay_step:      of the scan over delays, in periods of the highest frequency
    """

    method: Literal["gauss_newton", "levenberg_marquardt"] = "levenberg_marquardt"
    max_iterations: int = 100
    relative_change: float = 1e-10
    damping: float = 0.01
    reweightings: int = 12
    refine_delay: bool = True
    delay_step: float = 0.2
