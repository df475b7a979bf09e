"""Iterative weighted linear least squares (Sanathanan & Koerner, 1963): each step weighted by the last denominator."""

from __future__ import annotations

from xy_sysid.fitting.finish import finish
from xy_sysid.fitting.linear import searched
from xy_sysid.fitting.problem import problem
from xy_sysid.fitting.result import Ended, Fit
from xy_sysid.fitting.structure import FitOptions, Structure
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import FrequencyResponse

DEFAULTS = FitOptions()


def fit(frf: FrequencyResponse, structure: Structure, start: TransferFunction | None = None, options: FitOptions = DEFAULTS) -> Fit:
    """Fit by reweighted linear steps at the best delay; ``start`` is ignored. Raises BadInput for too few lines."""
    del start
    task = problem(frf, structure)
    point, _, steps = searched(task, options.reweightings, options)
    return finish(task, point, "iwls", Ended(steps, True, "The best of the re-weighted linear steps."), "scan over delays")
