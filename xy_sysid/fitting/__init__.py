"""Estimators of transfer functions: one a file, all with the signature of ``identify``."""

from __future__ import annotations

from collections.abc import Callable

from xy_sysid.fitting import iwls, lls, ml, nlls, nllsfdi
from xy_sysid.fitting.identify import identify
from xy_sysid.fitting.result import Estimate, Fit
from xy_sysid.fitting.structure import FitOptions, Structure

ESTIMATORS: dict[str, Callable[..., Fit]] = {
    "lls": lls.fit,
    "iwls": iwls.fit,
    "nlls": nlls.fit,
    "ml": ml.fit,
    "nllsfdi": nllsfdi.fit,
}

__all__ = ["ESTIMATORS", "Estimate", "Fit", "FitOptions", "Structure", "identify"]
