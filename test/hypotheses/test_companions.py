"""Companions of an effect that only one-step prediction can judge."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers.foreign import across_gap

from xy_sysid.axis.model import STANDARD
from xy_sysid.effects._contract import Limits
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import GreyboxFit, fit_base
from xy_sysid.hypotheses.companions import Demand, Extended, extended

BAR = 5e-3  # m/s, one-step error: more than that of any filter with this gap


@pytest.fixture(scope="module")
def data() -> AxisData:
    """A motor with friction before a gap of 0.1 mm, behind an amplifier lag of 2 ms."""
    return prepare(2000.0, *across_gap(1e-4, 0.1, 0.15, 1, lag=2e-3))


def followed(data: AxisData, base: GreyboxFit, bar: float, masked: bool = False) -> Extended:
    """Backlash and what acts with it."""
    return extended(data, base, STANDARD["backlash"], Demand(Limits(bar), masked=masked))


def test_what_a_simulation_had_and_is_of_no_use_beside_a_gap_goes(data: AxisData) -> None:
    """Cogging that is not present, with a lag that is."""
    base = fit_base(data)
    crowded = replace(base, model=base.model.with_effect("amplifier_lag", (1e-3,)).with_effect("cogging", (0.02, 0.01, 0.0)))
    found = followed(data, crowded, BAR)
    assert set(dict(found.rungs[-1][1].model.effects)) == {"backlash", "coulomb_friction", "amplifier_lag"}


@pytest.mark.parametrize("masked", [False, True])
def test_without_what_a_gap_hides_no_filter_follows_the_motor(data: AxisData, masked: bool) -> None:
    """A count of 1 um is a one-step error of 0.6 mm/s."""
    last = followed(data, fit_base(data), 2e-3, masked).rungs[-1][1]
    assert ("amplifier_lag" in last.model) is masked
    assert (last.held_out_error < 1e-3) is masked
