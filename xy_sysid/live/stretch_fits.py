"""Fits of stretches of data without common samples, each with the structure of the model that the axis is compared with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fitting import identify
from xy_sysid.fitting.result import Fit
from xy_sysid.fitting.structure import FitOptions, structure_from
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.live.identifier import AxisRequest
from xy_sysid.settings import IdentifierSettings


@dataclass(frozen=True, slots=True)
class FittedStretch:
    """Fit of the newest ``alarm_windows`` windows. begin, end: number of the first window, and of the first window without a common sample."""

    fit: Fit
    begin: int
    end: int


class StretchFits:
    """models: by axis, the transfer function in s for comparison with its stretches; other axes are not fitted."""

    def __init__(self, settings: IdentifierSettings, models: Mapping[str, TransferFunction], options: FitOptions) -> None:
        self._settings, self._models, self._options = settings, models, options
        self._shared = math.ceil(1.0 / (1.0 - settings.overlap))  # windows between two that share no sample
        self._ends: dict[str, int] = {}

    def fit(self, axis: str, asked: AxisRequest) -> FittedStretch | None:
        """The fit of the newest windows if all of them are later than those of the previous fit; None otherwise, or if it fails."""
        begin, end = asked.windows - self._settings.alarm_windows, asked.windows - 1 + self._shared
        model = self._models.get(axis)
        if model is None or asked.recent is None or begin < self._ends.get(axis, 0):
            return None
        structure = replace(
            structure_from(self._settings),
            numerator_order=model.numerator.size - 1,
            denominator_order=model.denominator.size - 1,
            integrators=int(np.argmax(model.denominator[::-1] != 0.0)),
            delay="free" if model.delay > 0.0 else 0.0,
        )
        try:
            found = identify(asked.recent, structure, model, self._options)
        except BadInput:
            return None
        if not found.converged:
            return None
        self._ends[axis] = end
        return FittedStretch(found, begin, end)
