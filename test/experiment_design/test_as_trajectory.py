"""A designed experiment as a trajectory, for a robot that accepts only trajectories."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from xy_sysid.axis.model import AxisModel
from xy_sysid.errors import BadInput
from xy_sysid.experiment_design.as_trajectory import as_trajectory
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.of_run import NextExperiment
from xy_sysid.settings import AxisExcitation

MODEL = AxisModel(0.097, 1.3e-3, 240.0)
SINE = Experiment(AxisExcitation(kind="off", rms=0.0, slow=0.5, slow_period=2.0, centring=0.0, limit=5.0), 6.0)
LIMITS = MachineLimits(voltage=5.0, travel=(-0.1, 0.2), start=0.05, speed=0.2, acceleration=5.0)
FOUND = NextExperiment("x", 2000.0, "", LIMITS, SINE)


def test_the_trajectory_is_the_motion_that_the_model_expects_from_rest_to_rest() -> None:
    """It begins and ends at rest at the start; in between, its speed is the gain times the voltage; speed and position agree."""
    made = as_trajectory(FOUND, MODEL, 100.0)
    assert made.time[-1] == pytest.approx(6.0, abs=0.02) and made.time[1] == pytest.approx(0.01)
    assert made.position[[0, -1]] == pytest.approx([0.05, 0.05], abs=1e-5) and made.speed[[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-3)
    middle = slice(100, 500)
    assert np.max(made.speed[middle]) == pytest.approx(0.097 * 0.5, rel=0.02)
    assert np.gradient(made.position, 0.01)[middle] == pytest.approx(made.speed[middle], abs=1e-3)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        (replace(LIMITS, travel=(0.04, 0.06)), "travel of the trajectory"),
        (replace(LIMITS, speed=0.03), "speed of the trajectory"),
        (replace(LIMITS, acceleration=0.1), "acceleration of the trajectory"),
    ],
)
def test_a_motion_that_leaves_a_limit_is_refused_in_one_line(limits: MachineLimits, words: str) -> None:
    """An error instead of silent scaling: another experiment must be designed."""
    tight = replace(FOUND, limits=limits)
    with pytest.raises(BadInput, match=words):
        as_trajectory(tight, MODEL, 100.0)
    with pytest.raises(BadInput, match="points a second"):
        as_trajectory(FOUND, MODEL, 1e5)
