"""The unmodelled position-dependent force: a table only if the recording shows one, validated on held-out data."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.simulated import recorded

import xy_sysid as xy
from xy_sysid.axis.model import AxisModel
from xy_sysid.control_design.inverse import feedforward
from xy_sysid.control_design.measured_table import measured_table
from xy_sysid.control_design.path import recorded as motion
from xy_sysid.control_design.use import use

BELOW, COGGING = 400.0, 0.2  # Hz, V


# the simulated table with dry friction only
RUBBING = xy.PhysicalModel(AxisModel(0.097, 1.29e-3, 246.0).with_effect("coulomb_friction", (0.3,)), "x")


def test_what_the_model_leaves_by_position_becomes_a_table() -> None:
    """Cogging without a law in the model: the table improves the prediction of another recording of the machine, and the command says so."""
    run, judge = (recorded(f"coulomb_friction=0.3+cogging={COGGING}", 12.0, seed=seed).run("x") for seed in (1, 2))
    table = measured_table(RUBBING, run, BELOW)
    assert table is not None and table.before**2 - table.after**2 > 0.5 * COGGING**2 / 2.0
    path = motion(judge.position, judge.sampling_rate, BELOW)
    left = judge.voltage - feedforward(RUBBING.model, path).voltage
    passed = (path.position > table.at[0]) & (path.position < table.at[-1])
    assert np.var(left[passed]) - np.var((left - table.along(path))[passed]) > 0.5 * COGGING**2 / 2.0
    used = use(RUBBING, run, limit=10.0)
    assert used.predicted is not None and used.predicted.tabled is not None and used.predicted.tabled < 0.9 * used.predicted.whole
    (own,) = (item for item in used.tables if item.name == "residual")
    assert own.csv().startswith("position_m,residual_V,low,high\n") and own.before > own.after


def test_a_model_that_leaves_nothing_by_position_gets_no_table() -> None:
    """Noise and reversals are not functions of the position."""
    run = recorded("coulomb_friction=0.3", 12.0).run("x")
    assert measured_table(RUBBING, run, BELOW) is None
    assert not use(RUBBING, run, limit=10.0).tables


def test_a_recording_that_stands_still_is_refused() -> None:
    """Without motion there is no table."""
    run = recorded("coulomb_friction=0.3", 12.0).run("x")
    still = xy.Recording.from_arrays(run.sampling_rate, np.zeros(2000), np.zeros(2000)).run("x")
    with pytest.raises(xy.BadInput, match="all the same"):
        measured_table(RUBBING, still, BELOW)
