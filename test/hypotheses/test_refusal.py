"""Refused fits, with any residual error."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers.simulated import recorded

from xy_sysid.axis.model import STANDARD
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import GreyboxFit, fit_base, fit_with
from xy_sysid.hypotheses.refusal import at_bound, refusal


@pytest.fixture(scope="module")
def data() -> AxisData:
    return prepare(2000.0, *recorded("gain_drift=-0.01", seconds=10.0).axis("x"))


def ending(data: AxisData, rate: float) -> GreyboxFit:
    """A fit that ends at this rate of change, 1/s."""
    found = fit_with(data, fit_base(data), ["gain_drift"])
    return replace(found, model=found.model.with_effect("gain_drift", (rate,)))


@pytest.mark.parametrize(("side", "refused"), [("low", True), ("high", True), ("middle", False)])
def test_a_size_with_a_sign_has_two_bounds(side: str, refused: bool, data: AxisData) -> None:
    """A gain that falls at its bound is as undetermined as one that rises at it."""
    item = STANDARD["gain_drift"].on(data.similar)[0]
    rate = {"low": item.low, "high": item.high, "middle": -0.01}[side]
    assert at_bound(item, rate) is refused
    why = "gain_drift: rate is at its bound" if refused else ""
    assert refusal(data, STANDARD, ending(data, rate)) == why
