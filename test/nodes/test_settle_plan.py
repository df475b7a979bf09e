"""Limits of a series of experiments on a machine: those of its excitation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from helpers.ros_tools import needs_ros, new_domain

from xy_sysid.errors import BadInput
from xy_sysid.settings import AxisExcitation, ExcitationSettings

pytestmark = needs_ros


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The output of a series of experiments in a separate domain."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(new_domain()))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    return []


def test_every_limit_of_the_excitation_is_one_of_the_experiments() -> None:
    """Voltage, travel, speed and acceleration; 0 is no limit."""
    from xy_sysid.nodes.settle import Wishes, plan_of

    axis = AxisExcitation(limit=3.0, travel_min=-0.05, travel_max=0.07, max_speed=0.3, max_acceleration=4.0)
    settings = ExcitationSettings(axes={"x": axis, "y": AxisExcitation(limit=2.0)})
    limits = plan_of(Wishes("x", Path("new")), settings).limits
    assert (limits.voltage, limits.travel, limits.speed, limits.acceleration) == (3.0, (-0.05, 0.07), 0.3, 4.0)
    free = plan_of(Wishes("y", Path("new")), settings).limits
    assert free.speed == free.acceleration == float("inf")


class Excitation:
    """Answers like an unconfigured excitation; End is pressed after one of its transitions."""

    def __init__(self, ended_after: str) -> None:
        self.asked: list[str] = []
        self._after = ended_after

    def settings(self) -> ExcitationSettings:
        return ExcitationSettings()

    def state(self) -> str:
        return {"configure": "inactive", "activate": "active"}.get(self.asked[-1] if self.asked else "", "unconfigured")

    def transition(self, label: str) -> None:
        self.asked.append(label)

    def ended(self) -> bool:
        return self._after in self.asked


@pytest.mark.parametrize(("press", "asked"), [("configure", ["configure"]), ("activate", ["configure", "activate", "deactivate"])])
def test_end_here_ends_it_before_anything_moves_and_says_so(
    press: str, asked: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: list[str]
) -> None:
    """During configure it is not activated; during the drive it is deactivated. In both cases a sentence reports the end."""
    from xy_sysid.nodes.settle import Settler, Wishes

    machine = Excitation(press)
    for name in ("settings", "state", "transition"):
        monkeypatch.setattr(Settler, name, lambda _, *words, name=name: getattr(machine, name)(*words))
    settler = Settler(Wishes("x", tmp_path / "walk", alone=True), said.append, machine.ended, lambda: True)
    try:
        assert settler.run()
    finally:
        settler.close()
    assert machine.asked == asked
    assert settler.ending == "stopped" and said == ["Stopped before the first recording was diagnosed."]


def test_what_is_still_possible_is_told_where_somebody_ends_it(said: list[str]) -> None:
    """The message does not repeat the prediction of the last experiment."""
    from xy_sysid.nodes.settle import Settler, Wishes

    settler = Settler(Wishes("x", Path("new")), said.append, lambda: True, lambda: False)
    settler.close()
    settler.steps = (
        {"sentence": "After 8 s they are distinguished.", "ending": None, "left": [["gravity"], ["return_spring"]], "chosen": ["gravity"]},
    )
    settler.ending = "stopped"
    assert settler.outcome == "Stopped: gravity, return_spring are still possible, gravity is the most probable."


def test_a_joint_whose_controller_holds_its_position_is_refused() -> None:
    """An experiment of pull and release would not move it, and would waste the budget on recordings at rest."""
    from xy_sysid.nodes.settle import Wishes, plan_of

    settings = ExcitationSettings(axes={"x": AxisExcitation(limit=0.05, rms=0.01)}, output="commands", interface="position")
    with pytest.raises(BadInput, match=r"interface is position; allowed: effort or velocity.*next --trajectory"):
        plan_of(Wishes("x", Path("new")), settings)
    with pytest.raises(BadInput, match="axis is 'z'"):
        plan_of(Wishes("z", Path("new")), settings)


def test_a_joint_that_takes_trajectories_has_the_limits_of_its_motion() -> None:
    """``limit`` is the reach and not a voltage; points as the excitation sends them; the effort is that of the joint, in the diagnoser's unit."""
    from xy_sysid.nodes.settle import Effort, Wishes, plan_of

    joint = AxisExcitation(kind="multisine", rms=0.0, limit=0.3, max_speed=1.0, max_acceleration=8.0, travel_min=-1.5, travel_max=1.5)
    ways: dict[str, Any] = {"output": "commands", "interface": "position", "command": "joint_trajectory", "unit": "rad", "rate": 200.0}
    settings = ExcitationSettings(axes={"x": joint}, joints=["x=elbow"], joint_topic="/joint_states", **ways)
    plan = plan_of(Wishes("x", Path("new")), settings, Effort(2, "A"))
    assert (plan.limits.reach, plan.limits.highest, plan.limits.units) == (0.3, 25.0, ("A", "rad"))
    assert plan.robot is not None and (plan.robot.joint, plan.robot.topic, plan.robot.points, plan.robot.effort_lag) == (
        "elbow",
        "/joint_states",
        200.0,
        2,
    )
    assert plan_of(Wishes("x", Path("new")), settings).limits.units == ("N m", "rad")


def test_an_effort_that_no_node_reads_is_not_guessed(said: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Its unit and age would be wrong without a word: nothing moves, and one line says what to start."""
    from xy_sysid.nodes.settle import Settler, Wishes

    joint = AxisExcitation(kind="multisine", rms=0.0, limit=0.3, max_speed=1.0, max_acceleration=8.0, travel_min=-1.5, travel_max=1.5)
    ways: dict[str, Any] = {"output": "commands", "interface": "position", "command": "joint_trajectory", "unit": "rad", "rate": 200.0}
    monkeypatch.setattr(Settler, "settings", lambda _: ExcitationSettings(axes={"x": joint}, **ways))
    monkeypatch.setattr(Settler, "state", lambda _: "unconfigured")
    monkeypatch.setattr(Settler, "parameters", lambda *_: {"effort_as_voltage": False})
    settler = Settler(Wishes("x", tmp_path / "walk", alone=True), said.append, lambda: False, lambda: True)
    try:
        assert not settler.run()
    finally:
        settler.close()
    assert len(said) == 1 and "read by neither diagnoser nor identifier" in said[0] and "effort_lag" in said[0]
