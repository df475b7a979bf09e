"""An experiment from a file, on a machine with its own limits."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from xy_sysid.errors import BadInput
from xy_sysid.excitation.designed import Needs, document_of, of_an_experiment, with_experiment
from xy_sysid.excitation.drive import Drive
from xy_sysid.excitation.trajectory import Trajectory
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.of_run import NextExperiment
from xy_sysid.files.experiment import read_experiment, write_experiment
from xy_sysid.files.trajectories import as_csv, motion_of
from xy_sysid.samples.block import Block
from xy_sysid.settings import AxisExcitation, ExcitationSettings

OWN = ExcitationSettings(axes={"x": AxisExcitation(limit=3.0, max_speed=0.4, max_acceleration=9.0), "y": AxisExcitation(limit=3.0)})
SLOW = AxisExcitation(kind="off", rms=0.0, slow=2.0, slow_period=3.0, limit=5.0)
NEEDS = Needs(voltage=2.6666663, travel=(-0.05, 0.05), start=0.01, reach=(-0.05, 0.03), within=(-0.08, 0.05), speed=0.3, acceleration=8.0)
EXCITATION = document_of("x", 2000.0, Experiment(SLOW, 12.0), NEEDS)["experiment"]["excitation"]


def document(**changes: Any) -> dict[str, Any]:
    made = document_of("x", 2000.0, Experiment(SLOW, 12.0), NEEDS)
    made["experiment"] |= changes
    return made


def test_an_experiment_takes_the_place_of_the_signal_and_not_of_the_limits() -> None:
    """Kind, amplitude and time come from the experiment; limit, travel and guards from the machine; the other axis is held at rest."""
    held = OWN.axes["y"].model_copy(update={"kind": "noise", "offset": 1.0, "slow": 0.5})
    found = with_experiment(OWN.model_copy(update={"axes": {**OWN.axes, "y": held}}), document(rate=2000.04), "next.yaml").settings
    x, y = found.axes["x"], found.axes["y"]
    assert (x.kind, x.slow, x.slow_period, found.duration) == ("off", 2.0, 3.0, 12.0)
    assert (x.limit, x.travel_min, x.brake) == (3.0, OWN.axes["x"].travel_min, OWN.axes["x"].brake)
    assert (y.kind, y.offset, y.slow, found.rate) == ("off", 1.0, 0.0, OWN.rate)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"needs": {**asdict(NEEDS), "voltage": 3.5}}, "next.yaml: voltage of axis x is 3.5 V"),
        ({"needs": {**asdict(NEEDS), "travel": [-0.05, 0.2]}}, "next.yaml: travel of axis x is -0.05 to 0.2 m"),
        ({"needs": {**asdict(NEEDS), "speed": 0.5}}, "next.yaml: speed of axis x is 0.5 m/s; allowed: up to its max_speed of 0.4 m/s"),
        ({"needs": {**asdict(NEEDS), "acceleration": 9.5}}, "acceleration of axis x is 9.5 m/s^2; allowed: up to its max_acceleration of 9 m/s^2"),
        ({"ramp": 2.0}, "next.yaml: ramp is 2 s; allowed: 0.5 s, that of the excitation. Design it again with --params"),
        ({"ramp": None}, "ramp is None"),
        ({"needs": {**asdict(NEEDS), "start": 0.1}}, "motion of axis x is 0.05 to 0.13 m; allowed: within -0.12 to 0.12 m, where nothing brakes it"),
        ({"rate": 1000.0}, "rate is 1000 Hz"),
        ({"axis": "z"}, "axis is 'z'"),
        ({"excitation": {"kind": "noise", "limit": 50.0}}, "'limit'"),
        ({"excitation": {**EXCITATION, "rms": -1.0}}, "rms"),
        ({"excitation": {**EXCITATION, "slow": 1000.0}}, "excitation of axis x is 1000 V of offset, slow and rms together"),
        ({"excitation": {**EXCITATION, "kind": "noise", "rms": 1.5}}, "is 3.5 V of offset, slow and rms together; allowed: up to its limit of 3 V"),
        ({"excitation": {**EXCITATION, "offset": -2.5}}, "is 4.5 V of offset"),
        ({"excitation": {"kind": "off", "slow": 2.0}}, "excitation is without rms, low, high"),
        ({"needs": {**asdict(NEEDS), "voltage": True}}, "needs"),
        ({"needs": {"voltage": 2.0, "travel": [-0.05, 0.05]}}, "needs"),
        ({"needs": {**asdict(NEEDS), "start": [0.0, 0.1]}}, "needs.start"),
        ({"needs": {**asdict(NEEDS), "reach": [0.0]}}, "needs.reach"),
        ({"needs": {**asdict(NEEDS), "speeed": 1.0}}, "'speeed'"),
        ({"seconds": 0.0}, "seconds is 0"),
        ({"units": ["A", "rad"]}, "units is A and rad; allowed: V and m"),
        ({"units": "V"}, "units is 'V'"),
        ({"colour": "red"}, "'colour'"),
    ],
)
def test_a_file_that_asks_for_more_is_refused_in_one_line(changes: dict[str, Any], words: str) -> None:
    """The error gives the value, the allowed range and the next action."""
    with pytest.raises(BadInput) as refusal:
        with_experiment(OWN, document(**changes), "next.yaml")
    assert words in str(refusal.value) and "\n" not in str(refusal.value)


def test_a_robot_that_takes_positions_or_trajectories_is_refused_one() -> None:
    """Its controller holds the position; such an axis gets the same motion as a trajectory."""
    axis = AxisExcitation(kind="multisine", low=0.5, high=5.0, limit=0.05, rms=0.0, max_speed=0.2, max_acceleration=2.0)
    for command in ("forward", "joint_trajectory"):
        robot = ExcitationSettings(axes={"x": axis}, output="commands", interface="position", command=command)
        with pytest.raises(BadInput, match=r"next.yaml: interface is position; allowed: effort or velocity.*next --trajectory"):
            with_experiment(robot, document(units=["m", "m"]), "next.yaml")


def test_a_designed_experiment_is_written_and_read_again(tmp_path: Path) -> None:
    """The node loads the file of xy-sysid next."""
    limits = MachineLimits(voltage=5.0, travel=(-0.14, 0.14))
    narrow = OWN.model_copy(update={"axes": {"x": AxisExcitation(limit=2.6666663)}})
    made = NextExperiment(
        axis="x",
        sampling_rate=2000.0,
        sentence="After 12 s they are distinguished.",
        limits=limits,
        experiment=Experiment(SLOW, 12.0),
        sets=(("coulomb_friction",), ("stribeck_friction",)),
        needs=NEEDS,
    )
    place = tmp_path / "next.yaml"
    write_experiment(place, made)
    assert yaml.safe_load(place.read_text())["experiment"]["expects"] == made.sentence
    assert read_experiment(OWN, place).settings.axes["x"].slow == read_experiment(narrow, place).settings.axes["x"].slow == 2.0
    assert read_experiment(OWN, place).planned.starts == {"x": pytest.approx((-0.03, 0.02))}
    with pytest.raises(BadInput, match="Check the path"):
        read_experiment(OWN, tmp_path / "none.yaml")


@pytest.mark.parametrize(("place", "moves"), [(0.015, True), (-0.025, True), (0.021, False), (-0.04, False)])
def test_an_experiment_begins_only_where_it_was_designed_to(place: float, moves: bool) -> None:
    """An experiment designed around 0 could leave its limits from another start: it stops before any voltage, and says where to move."""
    taken = with_experiment(OWN, document(), "next.yaml")
    drive = Drive(taken.settings, starts=taken.planned.starts)
    drive.start()
    count = np.arange(2.0)
    drive.see(Block(("x", "y"), count, count / OWN.rate, np.array([[place, 0.1]] * 2)))
    drive.next(100)
    assert drive.next(100).values.any() == moves
    assert drive.state == ("active" if moves else "stopped") and drive.fault != moves
    assert moves or f"x stands at {place:g} m, and its experiment was designed to begin between -0.03 and 0.02 m" in drive.reason


def test_limits_travel_and_guards_are_no_settings_of_an_experiment() -> None:
    """A reset of the settings of experiments does not change those of the operator."""
    changed = {
        name
        for name in ("duration", "experiment", "ramp", "watchdog", "x.rms", "x.slow", "x.limit", "x.travel_max", "x.brake_voltage")
        if of_an_experiment(name)
    }
    assert changed == {"duration", "experiment", "x.rms", "x.slow"}


JOINT = AxisExcitation(kind="multisine", rms=0.0, limit=0.3, max_speed=1.0, max_acceleration=8.0, travel_min=-1.5, travel_max=1.5, brake=0.3)
ROBOT = ExcitationSettings(axes={"x": JOINT}, output="commands", interface="position", command="joint_trajectory", unit="rad", rate=200.0)
OF_A_JOINT = document(
    units=["N m", "rad"],
    rate=500.0,
    seconds=4.0,
    needs={**asdict(NEEDS), "travel": [-0.3, 0.3], "start": 0.1, "reach": [-0.25, 0.25], "within": [-1.5, 1.5]},
    motion="next.csv",
)


def motion(size: float = 0.2, rate: float = 200.0, end: float = 0.0) -> Trajectory:
    """Two smooth humps of this size, rad, about 0.1 rad, within 4 s; end: shift of the last point."""
    time = np.arange(round(4.0 * rate) + 1) / rate
    moved = size * np.sin(np.pi * time / 4.0) ** 2 * np.sin(2.0 * np.pi * time / 2.0)
    speed = np.gradient(moved) * rate
    moved[-1] += end
    return Trajectory(time=time, position=0.1 + moved, speed=speed, acceleration=np.gradient(speed) * rate, limited_by="the design")


def test_a_robot_that_takes_only_trajectories_gets_the_motion_and_keeps_its_limits() -> None:
    """The motion counts from its start; the rate and unit of the design may be those of the joint's effort. Others are driven with the signal."""
    settings, planned = with_experiment(ROBOT, OF_A_JOINT, "next.yaml", motion())
    assert planned.motions["x"].position[0] == 0.0 and np.max(np.abs(planned.motions["x"].position)) == pytest.approx(0.173, abs=0.03)
    low, high = planned.starts["x"]
    assert low == pytest.approx(-1.2 - planned.motions["x"].position.min()) and high == pytest.approx(1.2 - planned.motions["x"].position.max())
    assert settings.duration == 4.0 and settings.axes["x"] == JOINT
    assert with_experiment(OWN, document(motion="next.csv"), "next.yaml", motion()).planned.motions == {}


@pytest.mark.parametrize(
    ("made", "changes", "words"),
    [
        (motion(size=0.4), {}, "next.yaml: motion of axis x is up to 0.3.* rad; allowed: up to 0.2975 rad, by its limit"),
        (motion(rate=100.0), {}, "next.yaml: points a second is 100; allowed: 200"),
        (motion(end=0.05), {}, "one that does not end at rest where it began"),
        (motion(), {"units": ["N", "m"]}, "next.yaml: units is m; allowed: rad, that of the excitation"),
        (None, {}, "interface is position"),
    ],
)
def test_a_motion_that_asks_for_more_is_refused_in_one_line(made: Trajectory | None, changes: dict[str, Any], words: str) -> None:
    """Reach, points, rest at both ends and unit; a document without its motion, too."""
    told = {"experiment": {**OF_A_JOINT["experiment"], **changes}}
    with pytest.raises(BadInput, match=words) as problem:
        with_experiment(ROBOT, told, "next.yaml", made)
    assert "\n" not in str(problem.value)
    quick = ROBOT.model_copy(update={"axes": {"x": JOINT.model_copy(update={"max_speed": 0.4})}})
    with pytest.raises(BadInput, match=r"up to 0\.4 rad/s, by its max_speed"):
        with_experiment(quick, OF_A_JOINT, "next.yaml", motion())


def test_the_motion_is_read_from_the_file_that_the_experiment_names(tmp_path: Path) -> None:
    """As it was written. A name of another folder, a file that lacks, and a file with other columns or uneven times are refused in one line."""
    (tmp_path / "next.yaml").write_text(yaml.safe_dump(OF_A_JOINT))
    with pytest.raises(BadInput, match=r"next\.csv"):
        read_experiment(ROBOT, tmp_path / "next.yaml")
    (tmp_path / "next.csv").write_text(as_csv(motion()))
    assert np.array_equal(motion_of(tmp_path / "next.csv").position, motion().position)
    assert set(read_experiment(ROBOT, tmp_path / "next.yaml").planned.motions) == {"x"}
    for text in ("", "a,b\n", "time,reference,speed,acceleration\n0,0,0\n", "time,reference,speed,acceleration\n0,0,0,0\n1,0,0,0\n3,0,0,0\n"):
        (tmp_path / "next.csv").write_text(text)
        with pytest.raises(BadInput, match=r"motion next\.csv"):
            read_experiment(ROBOT, tmp_path / "next.yaml")
    away = {"experiment": {**OF_A_JOINT["experiment"], "motion": "../next.csv"}}
    (tmp_path / "next.yaml").write_text(yaml.safe_dump(away))
    with pytest.raises(BadInput, match="the name of a file beside it"):
        read_experiment(ROBOT, tmp_path / "next.yaml")
