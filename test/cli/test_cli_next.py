"""xy-sysid next: the experiment that distinguishes the effects that the recordings do not."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.cli_tools import cli, refused
from helpers.simulated import recorded

from campaigns.bench.settle_pairs import PAIRS, first_recording, machine
from xy_sysid.axis.model import AxisModel
from xy_sysid.excitation.trajectory import Trajectory
from xy_sysid.experiment_design.as_trajectory import as_trajectory
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.of_run import NextExperiment
from xy_sysid.files.experiment import read_experiment
from xy_sysid.settings import AxisExcitation, ExcitationSettings, build

LAG = next(pair for pair in PAIRS if "amplifier_lag" in pair.sets[1])


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording in a narrow band, in which lag and delay cannot be distinguished."""
    voltage, position = first_recording(LAG, machine(LAG, 1, 1), 1)
    place = tmp_path_factory.mktemp("next") / "narrow.npz"
    np.savez(place, fs=2000.0, u=voltage[:, None], y=position[:, None], axes=np.array(["x"]))
    return place


def test_it_says_what_to_run_and_what_to_expect_and_writes_the_file(recording: Path, tmp_path: Path) -> None:
    """A sentence with the seconds and the probability, a file for the excitation node, and a trajectory for a robot without voltage input."""
    out, motion = tmp_path / "next.yaml", tmp_path / "motion.yaml"
    sets = ("--between", "rigid", "--between", "amplifier_lag")
    said = cli("next", recording, *sets, "--voltage", 5, "--travel=-140:140", "-o", out, "--trajectory", motion)
    assert said.code == 0, said
    assert "the rigid model and amplifier_lag are distinguished with 95 % probability" in said.out
    told = yaml.safe_load(out.read_text())["experiment"]
    assert told["axis"] == "x" and told["needs"]["voltage"] <= 5.0
    assert told["excitation"]["high"] > 8.0  # beyond the band of the recording
    assert "not there yet" in refused("next", recording, *sets, "-o", out)
    message = yaml.safe_load(motion.read_text())
    assert message["joint_names"] == ["x"] and set(message["points"][5]) == {"positions", "velocities", "accelerations", "time_from_start"}
    rows = np.loadtxt(motion.with_suffix(".csv"), delimiter=",", skiprows=1)
    assert len(rows) == len(message["points"]) and np.max(np.abs(rows[:, 1])) < 0.14
    assert "a recording" in refused("next", "--for", "nothing", "--voltage", 5, "--travel=-140:140", "--trajectory", tmp_path / "no.yaml")


def test_a_robot_that_takes_only_trajectories_gets_an_experiment_that_its_node_accepts(recording: Path, tmp_path: Path) -> None:
    """With its run file the limits are those of its motion, the points are as dense as it sends them, and the file names them."""
    axis = {"kind": "multisine", "rms": 0.0, "limit": 0.05, "max_speed": 1.0, "max_acceleration": 40.0, "low": 1.0, "high": 20.0, "period": 4.0}
    told = {"output": "commands", "interface": "position", "command": "joint_trajectory", "unit": "m", "rate": 1000.0, "axes": ["x"]}
    ends = {"travel_min": -0.15, "travel_max": 0.15, "brake": 0.02}
    run_file = tmp_path / "robot.yaml"
    run_file.write_text(yaml.safe_dump({"nodes": [{"executable": "excitation", "parameters": {**told, "x": {**axis, **ends}}}]}))
    sets, out = ("--between", "rigid", "--between", "amplifier_lag"), tmp_path / "next.yaml"
    said = cli("next", recording, *sets, "--params", run_file, "--trajectory", tmp_path / "motion.yaml", "-o", out)
    assert said.code == 0, said
    experiment = yaml.safe_load(out.read_text())["experiment"]
    rows = np.loadtxt(tmp_path / experiment["motion"], delimiter=",", skiprows=1)
    assert experiment["motion"] == "motion.csv" and rows[1, 0] == pytest.approx(1e-3)
    assert np.abs(rows[:, 1] - rows[0, 1]).max() <= 0.05 and np.abs(rows[:, 3]).max() <= 40.0
    settings = build(ExcitationSettings, {**told, "axes": {"x": AxisExcitation(**{**axis, **ends})}})
    assert set(read_experiment(settings, out).planned.motions) == {"x"}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--between", "coulomb_friction"), "two sets"),
        (("--between", "rigid", "--between", "lag", "--for", "gain"), "--between"),
        (("--between", "rigid", "--between", "amplifier_lagg"), "amplifier_lag"),
        (("--between", "rigid", "--between", "backlash"), "backlash"),
        (("--between", "rigid", "--between", "rigid"), "sets that differ"),
        (("--between", "amplifier_lag+cogging", "--between", "cogging+amplifier_lag"), "sets that differ"),
        (("--between", "rigid", "--between", "cogging+cogging"), "each effect once"),
        (("--travel", "140"), "LOW:HIGH"),
        (("--voltage", "-1"), "voltage"),
    ],
)
def test_wrong_use_is_refused_in_one_line(recording: Path, options: tuple[str, ...], words: str) -> None:
    """The error, and the correct input."""
    assert words in refused("next", recording, *options)


def test_the_trajectory_for_a_parameter_is_that_of_the_diagnosed_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The motion is not that of a rigid axis: with friction the same voltage moves the axis less far."""
    place, models = tmp_path / "friction.npz", list[AxisModel]()
    one = recorded("coulomb_friction=0.4", seconds=10.0)
    np.savez(place, fs=one.sampling_rate, u=one.voltage, y=one.position, axes=np.array(one.axes))
    slow = Experiment(AxisExcitation(kind="off", rms=0.0, slow=1.0, slow_period=2.0), 6.0)
    made = NextExperiment("x", one.sampling_rate, "", MachineLimits(voltage=5.0, travel=(-0.14, 0.14)), slow)

    def kept(found: NextExperiment, model: AxisModel, rate: float) -> Trajectory:
        models.append(model)
        return as_trajectory(found, model, rate)

    monkeypatch.setattr("xy_sysid.experiment_design.of_run.sharpen", lambda *_: made)
    monkeypatch.setattr("xy_sysid.experiment_design.as_trajectory.as_trajectory", kept)
    said = cli("next", place, "--axis", "x", "--for", "coulomb_friction.coulomb", "--trajectory", tmp_path / "motion.yaml")
    assert said.code == 0, said
    assert [dict(model.effects)["coulomb_friction"] for model in models] == [pytest.approx((0.4,), rel=0.05)]


def test_a_first_experiment_is_in_the_units_of_what_the_run_file_drives(tmp_path: Path) -> None:
    """Effort and angle of a joint, without --unit; the excitation accepts the file."""
    run_file, out = tmp_path / "run.yaml", tmp_path / "next.yaml"
    joint = {"x.limit": 2.0, "x.travel_min": -1.5, "x.travel_max": 1.5, "unit": "rad", "output": "commands", "interface": "effort", "rate": 500.0}
    run_file.write_text(yaml.safe_dump({"excitation": {"ros__parameters": joint}}))
    said = cli("next", "--for", "nothing", "--params", run_file, "-o", out)
    assert said.code == 0 and re.search(r"up to [\d.]+ N m and the travel from \S+ to \S+ rad", said.out), said
    told = yaml.safe_load(out.read_text())["experiment"]
    assert told["units"] == ["N m", "rad"] and told["rate"] == 500.0


def test_a_run_file_gives_all_limits_of_the_machine(tmp_path: Path) -> None:
    """Voltage, travel, speed and acceleration: the file needs no more of any, and the excitation refuses no file that was designed for it."""
    run_file, out = tmp_path / "run.yaml", tmp_path / "next.yaml"
    own = {"x.limit": 5.0, "x.travel_min": -0.14, "x.travel_max": 0.14, "x.max_speed": 0.3, "x.max_acceleration": 12.0}
    run_file.write_text(yaml.safe_dump({"excitation": {"ros__parameters": own}}))
    said = cli("next", "--for", "nothing", "--params", run_file, "-o", out)
    assert said.code == 0, said
    needs = yaml.safe_load(out.read_text())["experiment"]["needs"]
    assert 0.0 < needs["speed"] <= 0.3 and 0.0 < needs["acceleration"] <= 12.0


def test_without_a_recording_it_asks_for_one() -> None:
    """Or for --for nothing, with the limits of the machine."""
    assert "--for nothing" in refused("next")
    assert "travel" in refused("next", "--for", "nothing", "--voltage", "3")


def test_every_sentence_is_in_the_units_of_the_recording(recording: Path, tmp_path: Path) -> None:
    """A rotary axis with an input in A: its own units are in the answer, in the file and in an error, those of a table nowhere."""
    out = tmp_path / "next.yaml"
    read = (recording, "--unit", "input=A", "--unit", "output=rad")
    said = cli("next", *read, "--between", "rigid", "--between", "amplifier_lag", "--voltage", 5, "--travel=-0.14:0.14", "-o", out)
    assert said.code == 0, said
    assert re.search(r"\d A rms|\d A, each|\d A with", said.out) and re.search(r"up to [\d.]+ A and the travel from \S+ to \S+ rad,", said.out)
    assert not re.search(r"\d m?(V|m)\b", said.out), said.out
    text = out.read_text()
    assert "are in A, other needs are in rad" in text and yaml.safe_load(text)["experiment"]["units"] == ["A", "rad"]
    assert "to -100 rad; allowed: where the axis stands" in refused("next", *read, "--voltage", 5, "--travel=-140:-100")
