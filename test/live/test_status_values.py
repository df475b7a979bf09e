"""The named values of a status: what the nodes write, the page reads back."""

from __future__ import annotations

import math

import pytest

from xy_sysid.live.status_values import estimate_of, number, units_of, written
from xy_sysid.response.estimate import Estimate
from xy_sysid.units import USUAL, Units


@pytest.mark.parametrize(("name", "unit"), [("delay", "s"), ("gain", "rad/s/(N m)"), ("resonance_1.frequency", "Hz"), ("resonance_1.damping", "1")])
def test_an_estimate_reads_back(name: str, unit: str) -> None:
    """Value, unit and interval, also if the unit has brackets and other estimates have names that begin alike."""
    item = Estimate(name=name, value=0.00129, unit=unit, low=0.00128, high=0.0013)
    other = Estimate(name=f"{name}_2", value=5.0, unit="V", low=4.0, high=6.0)
    assert estimate_of({**written(other), **written(item)}, name) == item


def test_what_is_missing_is_no_number() -> None:
    """Another program may leave out values, or write none."""
    assert estimate_of({"gain 95 % low": "1"}, "gain") is None
    found = estimate_of({"gain (m/s/V)": "x"}, "gain")
    assert found is not None and all(math.isnan(value) for value in (found.value, found.low, found.high))
    assert number({}, "windows", 0.0) == 0.0


def test_units_are_the_usual_ones_if_none_are_named() -> None:
    """A status of an older version names no unit."""
    assert units_of({}) == USUAL and units_of({"input unit": "N m", "output unit": "rad"}) == Units("N m", "rad")
