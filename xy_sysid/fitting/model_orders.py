"""Which orders do the data support? Minimum description length over a small family of structures.

With sigma known, twice the maximum-likelihood cost is a chi-square, and MDL = cost + parameters / 2 * ln(number of
independent real data) (Rissanen 1978; Ljung, System Identification, 2nd ed., sec. 16.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from xy_sysid.errors import BadInput
from xy_sysid.fitting.identify import identify
from xy_sysid.fitting.result import Fit
from xy_sysid.fitting.structure import Structure
from xy_sysid.response.frf import FrequencyResponse

WIDER = 2  # orders tested above and below the requested one
CLEARLY = 10.0  # MDL difference from which another order is suggested: odds of e^10


@dataclass(frozen=True, slots=True)
class OrderTrial:
    """One tested structure: its orders, cost, and description length."""

    numerator_order: int
    denominator_order: int
    cost: float
    length: float

    @staticmethod
    def of(fit: Fit, data: float, scale: float = 1.0) -> OrderTrial:
        """The trial of a fit; data, scale: see ``description_length``."""
        return OrderTrial(fit.structure.numerator_order, fit.structure.denominator_order, fit.cost, description_length(fit, data, scale))


def independent_data(frf: FrequencyResponse, lines: int) -> float:
    """Equivalent number of independent real data in this many lines, whose errors are correlated."""
    return 2.0 * lines / float(1.0 + 2.0 * frf.line_correlation[1:].sum())


def try_orders(frf: FrequencyResponse, fit: Fit) -> tuple[OrderTrial, ...]:
    """Structures near that of ``fit``, best first, without those that do not converge.

    The relative degree is that of ``fit`` or one more.
    """
    asked = fit.structure
    data = independent_data(frf, len(fit.frequency))
    found = [OrderTrial.of(fit, data)]
    excess = asked.denominator_order - asked.numerator_order
    seen = {(asked.numerator_order, asked.denominator_order)}
    for order in range(max(asked.integrators + 1, asked.denominator_order - WIDER), min(12, asked.denominator_order + WIDER) + 1):
        for degree in (excess, excess + 1):
            orders = (order - degree, order)
            if orders in seen or not 0 <= orders[0] <= orders[1]:
                continue
            seen.add(orders)
            trial = _fitted(frf, replace(asked, numerator_order=orders[0], denominator_order=orders[1], weighting="sigma"))
            if trial is not None:
                found.append(OrderTrial.of(trial, data))
    return tuple(sorted(found, key=lambda item: item.length))


def _fitted(frf: FrequencyResponse, structure: Structure) -> Fit | None:
    try:
        fit = identify(frf, structure)
    except BadInput:
        return None
    return fit if fit.converged else None


def description_length(fit: Fit, data: float, scale: float = 1.0) -> float:
    """Description length, nats; data: number of independent real data; scale: least cost of any model relative to that of noise alone."""
    return length_of(fit.cost, fit.structure, data, scale)


def length_of(cost: float, structure: Structure, data: float, scale: float = 1.0) -> float:
    """Description length of a structure with this cost, nats; data, scale: see ``description_length``."""
    return cost / scale + 0.5 * structure.parameters * math.log(max(data, 2.0))
