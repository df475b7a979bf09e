"""Transfer functions from frequency responses, with their uncertainty and verdicts.

structure, problem:           what to look for; the lines to be fitted
basis, linear, damped:        polynomials that stay well conditioned, least squares, steps
plan, prediction, leakage:    what the spectra are expected to show
lls, iwls, nlls, ml, nllsfdi: estimators: one a file, all with the signature of ``identify``
identify:                     the one to trust by default
covariance, intervals:        how sure a fit is
finish, result:               what a fit says
modes:                        poles only, the short way
model_orders, choose_orders:  which orders the data support, and the default orders of a fit
verdicts:                     what to believe
check_on_data:                a given model against other data
of_recording:                 the whole way of a recording, axis by axis
of_run:                       the same of one run, one call each: response, model
"""

from __future__ import annotations

from collections.abc import Callable

from xy_sysid.fitting import iwls, lls, ml, nlls, nllsfdi
from xy_sysid.fitting.identify import identify
from xy_sysid.fitting.result import Fit, Interval
from xy_sysid.fitting.structure import FitOptions, Structure

ESTIMATORS: dict[str, Callable[..., Fit]] = {
    "lls": lls.fit,
    "iwls": iwls.fit,
    "nlls": nlls.fit,
    "ml": ml.fit,
    "nllsfdi": nllsfdi.fit,
}

__all__ = ["ESTIMATORS", "Fit", "FitOptions", "Interval", "Structure", "identify"]
