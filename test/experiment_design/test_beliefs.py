"""Parameter uncertainty of an effect that the data do not show."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from xy_sysid.axis.model import AxisModel
from xy_sysid.experiment_design.beliefs import _settled
from xy_sysid.greybox.axis_data import prepare


@pytest.mark.parametrize("slope", [0.0, np.nan, 1.0])
def test_parameters_that_the_data_do_not_show_or_show_alike_are_no_error(slope: float) -> None:
    """Derivatives that are all zero, NaN, or all equal give a model with finite parameters."""
    random = np.random.default_rng(2)
    voltage = random.normal(size=2000)
    data = prepare(500.0, voltage, np.cumsum(voltage) * 1e-4)
    model = AxisModel(0.1, 1e-3, 50.0)
    evidence: Any = SimpleNamespace(data=data, nats=lambda model: 1.0, whitened=lambda model, scale: (np.full((3, 40), slope), np.ones(40)))
    assert np.all(np.isfinite(_settled(evidence, model, set()).row))
