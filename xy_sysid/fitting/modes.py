"""A fast fit for the poles only, to monitor a resonance."""

from __future__ import annotations

from xy_sysid.fitting.covariance import covariance
from xy_sysid.fitting.damped import minimise
from xy_sysid.fitting.identify import warm
from xy_sysid.fitting.intervals import root_estimates
from xy_sysid.fitting.problem import from_transfer_function, problem
from xy_sysid.fitting.structure import FitOptions, Structure
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import FrequencyResponse

DEFAULTS = FitOptions()


def pole_estimates(frf: FrequencyResponse, structure: Structure, start: TransferFunction, options: FitOptions = DEFAULTS) -> tuple[Estimate, ...]:
    """Poles and resonances with intervals, as from ``identify`` with this start; empty if the fit fails.

    Raises BadInput for too few trusted lines.
    """
    task = problem(frf, structure)
    point = from_transfer_function(task, start)
    found = minimise(task, point, warm(options)) if point is not None else None
    if found is None or not found.converged:
        return ()
    at = found.point
    inner, _, _ = covariance(task, at, found.table)
    return tuple(root_estimates(task, at, at.denominator.roots(at.a), inner, "pole"))
