"""What a series of experiments may do on a machine: the limits of its excitation."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.ros_tools import needs_ros

from xy_sysid.errors import BadInput
from xy_sysid.settings import AxisExcitation, ExcitationSettings

pytestmark = needs_ros


def test_every_limit_of_the_excitation_is_one_of_the_experiments() -> None:
    """Voltage, travel, speed and acceleration; 0 is no limit."""
    from xy_sysid.nodes.settle import Wishes, plan_of

    axis = AxisExcitation(limit=3.0, travel_min=-0.05, travel_max=0.07, max_speed=0.3, max_acceleration=4.0)
    settings = ExcitationSettings(axes={"x": axis, "y": AxisExcitation(limit=2.0)})
    limits = plan_of(Wishes("x", Path("new")), settings).limits
    assert (limits.voltage, limits.travel, limits.speed, limits.acceleration) == (3.0, (-0.05, 0.07), 0.3, 4.0)
    free = plan_of(Wishes("y", Path("new")), settings).limits
    assert free.speed == free.acceleration == float("inf")


def test_a_joint_whose_controller_holds_its_position_is_refused() -> None:
    """An experiment that pulls and lets go would not move it, and the budget would be spent on recordings of an axis at rest."""
    from xy_sysid.nodes.settle import Wishes, plan_of

    settings = ExcitationSettings(axes={"x": AxisExcitation(limit=0.05, rms=0.01)}, output="commands", interface="position")
    with pytest.raises(BadInput, match=r"interface is position; allowed: effort or velocity.*next --trajectory"):
        plan_of(Wishes("x", Path("new")), settings)
    with pytest.raises(BadInput, match="axis is 'z'"):
        plan_of(Wishes("z", Path("new")), settings)
