"""Transfer functions from frequency responses, with their uncertainty and verdicts.

structure, problem:           the model structure; the lines to be fitted
basis, linear, damped:        well-conditioned polynomials, least squares, damped steps
plan, prediction, leakage:    the expected spectra of a model
lls, iwls, nlls, ml, nllsfdi: estimators: one per file, all with the signature of ``identify``
identify:                     the default estimator
covariance, intervals:        uncertainty of a fit
model_band:                   uncertainty of a fitted model's response, line by line
finish, result:               the result of a fit
modes:                        poles only, a faster path
model_orders, choose_orders:  which orders the data support, and the default orders of a fit
choose_level:                 orders of a response that does not fall at its highest lines
verdicts:                     checks of a fit
check_on_data:                a given model compared with other data
of_recording:                 from a full recording to responses, axis by axis
of_run:                       the same for one run, one call per step: response, model
of_given_response:            fit of a response measured elsewhere
two_axes:                     coupling of the first two axes of a recording
"""

from __future__ import annotations

from collections.abc import Callable

from xy_sysid.fitting import iwls, lls, ml, nlls, nllsfdi
from xy_sysid.fitting.identify import identify
from xy_sysid.fitting.result import Fit
from xy_sysid.fitting.structure import FitOptions, Structure

ESTIMATORS: dict[str, Callable[..., Fit]] = {
    "lls": lls.fit,
    "iwls": iwls.fit,
    "nlls": nlls.fit,
    "ml": ml.fit,
    "nllsfdi": nllsfdi.fit,
}

__all__ = ["ESTIMATORS", "Fit", "FitOptions", "Structure", "identify"]
