"""No rung raises the held-out error, neither in a search nor in its verdict, on simulated and on real axes."""

from __future__ import annotations

from itertools import pairwise

import pytest
from helpers.real_data import data
from helpers.simulated import recorded

import xy_sysid as xy
from campaigns.bench.recordings import axes
from campaigns.faults.shared import RECORDINGS
from xy_sysid.diagnosis.answer import Answer


def falls(found: Answer) -> bool:
    """The error falls from rung to rung with the same kind of error; that of one-step prediction is another kind."""
    return all(after.held_out_error < before.held_out_error for before, after in pairwise(found.rungs) if before.one_step == after.one_step)


SIMULATED = (
    "coulomb_friction+cogging",
    "backlash",
    "stribeck_friction+constant_load",
    "screw_compliance+coulomb_friction+cogging",
    "loose_mode",
    "gain_drift+lead_error",
)


@pytest.mark.parametrize("effects", SIMULATED)
def test_the_ladder_of_a_simulated_axis_falls(effects: str) -> None:
    run = recorded(effects, seconds=15.0).run("x")
    for found in (xy.diagnose(run), xy.refine(run)):
        assert found.rungs and falls(found), str(found)


@pytest.mark.parametrize("path", ["ur10e/ur-20_01_22-joint_6.csv", "ball_plate/motor1.npz", "two_inertia_bench/multisineA.npz"])
def test_the_ladder_of_a_real_axis_falls(path: str) -> None:
    data(path)
    """By ``refine``, which adds more effects than ``diagnose`` names."""
    found = xy.refine(next(axes(next(row for row in RECORDINGS if row.path == path))).runs)
    assert found.rungs and falls(found), str(found)
