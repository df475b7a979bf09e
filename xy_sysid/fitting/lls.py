"""Linear least squares (Levy, 1959): one linear fit, biased towards high frequencies and by noise, but it needs no start."""

from __future__ import annotations

from dataclasses import replace

from xy_sysid.fitting.finish import finish
from xy_sysid.fitting.linear import searched
from xy_sysid.fitting.problem import problem
from xy_sysid.fitting.result import Ended, Fit
from xy_sysid.fitting.structure import FitOptions, Structure
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import FrequencyResponse

DEFAULTS = FitOptions()
FINER = 10  # factor for the scan over delays: one linear step is accurate only near the true delay (measured on the paper's machine)


def fit(frf: FrequencyResponse, structure: Structure, start: TransferFunction | None = None, options: FitOptions = DEFAULTS) -> Fit:
    """Fit by one linear step at the best delay; ``start`` is ignored. Raises BadInput for too few lines.

    Its bias can hide a free delay from order 4 on; IWLS finds it.
    """
    del start
    task = problem(frf, structure)
    point, _, steps = searched(task, 1, replace(options, delay_step=options.delay_step / FINER))
    return finish(task, point, "lls", Ended(steps, True, "Linear: solved at once for each delay tried."), "none needed")
