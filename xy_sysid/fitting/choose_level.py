"""Orders of a response that does not fall at its highest lines: a controller or a filter, not a machine from input to motion.

These have as many zeros as poles. Orders are tested from the simplest upward, with and without delay. An order is accepted if it shortens the
description by more than ``CLEARLY``, with the cost scaled as in ``choose_orders``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fitting.choose_orders import Choice, excess
from xy_sysid.fitting.identify import identify
from xy_sysid.fitting.model_orders import CLEARLY, OrderTrial, description_length, independent_data
from xy_sysid.fitting.result import Fit
from xy_sysid.fitting.structure import Structure
from xy_sysid.response.frf import FrequencyResponse

MOST = 6  # poles
TOP = 10  # lines at the high end for the slope
FALLS = -0.5  # slope of magnitude over frequency, both logarithmic: between a response that is level and one that falls with a pole


def is_level(frf: FrequencyResponse) -> bool:
    """True if the magnitude falls by less than half a pole at the highest trusted lines."""
    lines = frf.select(frf.trusted) if bool(np.any(frf.trusted)) else frf
    if len(lines) < TOP:
        return False
    top = slice(-max(TOP, len(lines) // 10), None)
    slope = np.polyfit(np.log(lines.frequency[top]), np.log(np.maximum(np.abs(lines.response[top]), 1e-300)), 1)[0]
    return bool(slope > FALLS)


def choose_level(frf: FrequencyResponse, family: Structure) -> Choice:
    """The orders for a level response; everything but orders and delay is kept from ``family``. Raises BadInput if no stable model is found."""
    family = replace(family, weighting="sigma", domain="s")
    tried = []
    for order in range(max(family.integrators, 1), MOST + 1):
        for delay in (0.0, family.delay) if family.free_delay else (family.delay,):
            fit = _fitted(frf, replace(family, numerator_order=order, denominator_order=order, delay=delay))
            if fit is not None:
                tried.append(fit)
    if not tried:
        raise BadInput("orders of the response", f"1 to {MOST}", "a stable model among them", "Give orders with --set numerator_order= and others.")
    data = independent_data(frf, len(tried[0].frequency))
    scale = max(1.0, min(excess(fit) for fit in tried))
    now = tried[0]
    for fit in tried[1:]:
        if description_length(fit, data, scale) < description_length(now, data, scale) - CLEARLY:
            now = fit
    best: dict[int, Fit] = {}
    for fit in sorted(tried, key=lambda one: description_length(one, data, scale)):
        best.setdefault(fit.structure.denominator_order, fit)
    trials = tuple(OrderTrial(order, order, fit.cost, description_length(fit, data, scale)) for order, fit in best.items())
    orders = f"{now.structure.numerator_order}/{now.structure.denominator_order}"
    late = "with delay" if now.structure.free_delay else "without delay"
    reason = (
        f"Orders {orders} {late}, chosen from the data: the response does not fall at its highest lines, so that it has as many zeros as poles; "
        f"its cost is {excess(now):.3g} times that of noise alone; "
        f"of {len(tried) - 1} other orders tried, none with more parameters is clearly better."
    )
    return Choice(now, trials, reason)


def _fitted(frf: FrequencyResponse, structure: Structure) -> Fit | None:
    try:
        fit = identify(frf, structure)
    except (BadInput, ZeroDivisionError, np.linalg.LinAlgError):
        return None
    return fit if fit.converged and fit.tf.is_stable else None
