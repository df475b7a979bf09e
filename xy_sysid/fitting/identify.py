"""The default estimate: maximum likelihood from a warm start; if in doubt, compared with a cold start."""

from __future__ import annotations

from dataclasses import replace

from xy_sysid.fitting.damped import minimise
from xy_sysid.fitting.nlls import cold, finished
from xy_sysid.fitting.problem import from_transfer_function, problem
from xy_sysid.fitting.result import Fit
from xy_sysid.fitting.structure import FitOptions, Structure
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import FrequencyResponse

DEFAULTS = FitOptions()
WARM_DAMPING = 1e-6  # fraction of the usual damping for a warm start: it is close, so that Gauss-Newton steps are accurate


def warm(options: FitOptions) -> FitOptions:
    """The options for a start that is close to the minimum."""
    return replace(options, damping=options.damping * WARM_DAMPING)


def identify(
    frf: FrequencyResponse, structure: Structure, start: TransferFunction | None = None, options: FitOptions = DEFAULTS, doubt: bool = True
) -> Fit:
    """Fit a structure to the trusted lines of a response.

    start: the last model, if there is one, which takes a few ms; if it does not converge, a cold start is tried too.
    doubt: True to try the slow cold start also if the cost is above the noise, as is usual on a real axis
    Raises BadInput for too few trusted lines. A fit that fails is a result with ``converged`` False and a reason.
    """
    task = problem(frf, structure)
    last = None
    point = from_transfer_function(task, start) if start is not None else None
    if point is not None:
        last = finished(task, minimise(task, point, warm(options)), "ml" if structure.weighting == "sigma" else "nlls", "the last model")
        if last.converged and (last.consistent or not doubt):
            return last
    minimum = cold(task, replace(options, refine_delay=False))
    if last is not None and last.cost <= minimum.cost * (1 + 1e-9):
        return last
    name = "ml" if structure.weighting == "sigma" else "nlls"
    return finished(task, minimum, name, "iterative weighted least squares at the best delays of a scan")
