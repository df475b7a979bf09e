"""Maximum likelihood: non-linear least squares with the measured standard deviation as the weight.

Pintelon & Schoukens, System Identification, 2nd ed., ch. 9, with an input known exactly.
"""

from __future__ import annotations

from dataclasses import replace

from xy_sysid.fitting.nlls import solve
from xy_sysid.fitting.problem import problem
from xy_sysid.fitting.result import Fit
from xy_sysid.fitting.structure import FitOptions, Structure
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import FrequencyResponse

DEFAULTS = FitOptions()


def fit(frf: FrequencyResponse, structure: Structure, start: TransferFunction | None = None, options: FitOptions = DEFAULTS) -> Fit:
    """The most likely model, with weights of 1 / sigma instead of those of the structure. Raises BadInput for too few lines or no sigma."""
    return solve(problem(frf, replace(structure, weighting="sigma")), start, options, "ml")
