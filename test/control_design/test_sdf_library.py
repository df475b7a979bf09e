"""SDF in an independent program: Drake, which reads it with the reference library of the format (libsdformat)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from helpers.known_models import axis

from xy_sysid.axis.model import STANDARD
from xy_sysid.control_design.sdf import sdf

parsing = pytest.importorskip("pydrake.multibody.parsing", reason="Drake is not installed: pip install drake")
plants = pytest.importorskip("pydrake.multibody.plant")
tree = pytest.importorskip("pydrake.multibody.tree")


def read(text: str) -> Any:
    """Drake's model of an SDF text. Strict: warnings are errors."""
    plant = plants.MultibodyPlant(1e-3)
    parser = parsing.Parser(plant)
    parser.SetStrictParsing()
    parser.AddModelsFromString(text, "sdf")
    plant.Finalize()
    return plant


def test_drake_reads_mass_damping_limits_and_spring() -> None:
    """The numbers of the model are recovered: kA, kV, travel, largest force and speed, and the spring."""
    model = replace(axis(), effects=(("return_spring", (10.0, 0.002, 0.0)),))
    text, _ = sdf(model, (-0.02, 0.03), 5.0, angular=False)
    plant = read(text)
    joint = plant.GetJointByName("axis_joint")
    assert plant.num_positions() == 1
    assert plant.GetBodyByName("axis").default_mass() == pytest.approx(1.0 / (0.097 * 236.0))
    assert joint.default_damping() == pytest.approx(1.0 / 0.097)
    assert (joint.position_lower_limit(), joint.position_upper_limit()) == (-0.02, 0.03)
    assert plant.get_joint_actuator(tree.JointActuatorIndex(0)).effort_limit() == 5.0
    assert joint.velocity_upper_limits()[0] == pytest.approx(0.485)
    spring = plant.get_force_element(tree.ForceElementIndex(1))
    assert (spring.stiffness(), spring.nominal_position()) == (10.0, 0.002)


@pytest.mark.parametrize("angular", [False, True])
def test_drake_reads_the_sdf_of_every_effect(angular: bool) -> None:
    """Comments about lost effects, and unusual numbers, keep the file valid; the joint type is that of the axis."""
    for effect in STANDARD.acting:
        text, lost = sdf(axis(effect.name), (-1.0, 1.0), 5.0, angular)
        joint = read(text).GetJointByName("axis_joint")
        assert joint.type_name() == ("revolute" if angular else "prismatic"), effect.name
        assert dict(lost).keys() <= {effect.name, "delay"}
