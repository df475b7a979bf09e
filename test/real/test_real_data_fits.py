"""Recordings of real machines: the numbers of docs/real-data.md, by its commands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from helpers.cli_tools import RIGID, cli, refused
from helpers.real_data import data

BENCH = ("--set", "band_low=10", "--set", "band_high=255")
GUIDE_BAND = ("--set", "band_low=0.1", "--set", "band_high=20.1")
GUIDE = ("--set", "integrators=0", *GUIDE_BAND)


def fitted(path: str, *options: str, axis: str = "x") -> Any:
    """The answer of ``fit --json`` for one axis."""
    said = cli("fit", data(path), *options, "--json")
    assert said.code == 0, said.err
    return said.json["axes"][axis]


def value(found: Any, name: str) -> float:
    """One estimate."""
    return float(found["estimates"][name]["value"])


def failed(found: Any) -> set[str]:
    """Names of the verdicts that did not pass."""
    return {verdict["name"] for verdict in found["validation"]["verdicts"] if not verdict["ok"]}


@pytest.mark.parametrize(
    ("options", "relative_error"),
    [
        (("--weighting", "relative"), 0.114),
        (("--weighting", "relative", "--set", "hold=none"), 0.091),
        ((), 0.119),
        (("--set", "hold=none"), 0.096),
        (("--weighting", "relative", "--method", "nllsfdi"), 0.135),
    ],
)
def test_the_two_inertia_bench_shows_its_pair(options: tuple[str, ...], relative_error: float) -> None:
    """Antiresonance 53.9 Hz and resonance 76.2 Hz within 0.3 Hz by every method; the error is reported as larger than noise."""
    found = fitted("two_inertia_bench/multisineA.npz", *BENCH, *options)
    assert found["period"] == 2500 and found["lines"] == 240
    assert value(found, "antiresonance_1.frequency") == pytest.approx(53.9, abs=0.3)
    resonances = [value(found, name) for name in found["estimates"] if name.startswith("resonance") and name.endswith("frequency")]
    assert min(abs(one - 76.2) for one in resonances) < 0.3
    assert found["relative_error"] == pytest.approx(relative_error, abs=0.01)
    assert {"cost", "residual"} <= failed(found)
    assert found["transfer_function"]["input_unit"] == "A" and found["transfer_function"]["output_unit"] == "rad"


def test_the_bench_is_asked_whether_its_input_is_held() -> None:
    """With the hold the delay is at its bound 0 and a verdict says so; without it, 0.12 ms."""
    held = fitted("two_inertia_bench/multisineA.npz", *BENCH, "--weighting", "relative")
    assert "delay" in failed(held) and value(held, "delay") == 0.0
    free = fitted("two_inertia_bench/multisineA.npz", *BENCH, "--weighting", "relative", "--set", "hold=none")
    assert "delay" not in failed(free) and value(free, "delay") == pytest.approx(0.12e-3, abs=0.02e-3)


@pytest.mark.parametrize(
    ("name", "options", "zero", "pole", "slow", "relative_error"),
    [
        ("exp1", ("--weighting", "relative"), 11.72, 13.43, 0.750, 0.205),
        ("exp2", ("--weighting", "relative"), 11.82, 13.61, 0.733, 0.168),
        ("exp1", (), 11.53, 13.33, 0.750, 0.218),
    ],
)
def test_the_linear_guide_shows_its_zeros_and_poles(
    name: str, options: tuple[str, ...], zero: float, pole: float, slow: float, relative_error: float
) -> None:
    """Near 11.8, 13.5 and 0.8 Hz; the period of 4999 samples is found; negative gain and friction distortion are reported."""
    found = fitted(f"lsb250/lsb250_{name}.npz", *GUIDE, *options)
    assert found["period"] == 4999 and found["lines"] == 100
    assert value(found, "antiresonance_1.frequency") == pytest.approx(zero, abs=0.05)
    assert value(found, "resonance_2.frequency") == pytest.approx(pole, abs=0.05)
    assert value(found, "resonance_1.frequency") == pytest.approx(slow, abs=0.01)
    assert found["relative_error"] == pytest.approx(relative_error, abs=0.01)
    assert {"cost", "residual"} <= failed(found)
    feasible = next(verdict for verdict in found["validation"]["verdicts"] if verdict["name"] == "feasible")
    assert feasible["ok"] and "wired against each other" in feasible["sentence"]


def test_the_second_recording_of_the_guide_shows_what_the_model_is_worth(tmp_path: Path) -> None:
    """An error of 18 % with noise of 0.3 %, and half of the position explained: the machine is not linear, and the answer says so."""
    model = tmp_path / "lsb.yaml"
    assert cli("fit", data("lsb250/lsb250_exp1.npz"), *GUIDE, "--weighting", "relative", "--model", model).code == 0
    said = cli("validate", data("lsb250/lsb250_exp2.npz"), model, *GUIDE_BAND, "--json").json
    found = said["axes"]["x"]
    assert said["same_data_as_the_fit"] == []
    assert found["relative_error"] == pytest.approx(0.183, abs=0.01) and found["noise_floor"] < 0.005
    assert found["simulation"]["nrmse"] == pytest.approx(52.4, abs=3) and found["sentence"].startswith("the model is off by 18 %")
    own = cli("validate", data("lsb250/lsb250_exp1.npz"), model, *GUIDE_BAND, "--json").json
    assert own["same_data_as_the_fit"] == ["x"]


def test_emps_gives_its_mass_and_warns_of_feedback_and_friction() -> None:
    """Mass within 3 % of the published 95.1 kg; the two notes; a cost that noise does not explain."""
    found = fitted("emps/emps_train.npz", *RIGID)
    mass = 35.15065 / value(found, "numerator_0")
    assert mass == pytest.approx(97.1, abs=1.0) and mass == pytest.approx(95.1089, rel=0.03)
    assert found["relative_error"] == pytest.approx(0.218, abs=0.02)
    assert any(note.startswith("Closed loop: the input follows the tracking error (correlation 0.71)") for note in found["warnings"])
    assert any(note.startswith("Friction: part of the input") for note in found["warnings"])
    assert not any("hardly follows" in note for note in found["warnings"])
    assert "cost" in failed(found) and found["validation"]["simulation"]["nrmse"] == pytest.approx(81.8, abs=2)
    narrow = fitted("emps/emps_train.npz", *RIGID, "--set", "band_high=40")
    assert narrow["relative_error"] == pytest.approx(0.156, abs=0.01)
    assert 35.15065 / value(narrow, "numerator_0") == pytest.approx(97.4, abs=1.0)


def test_the_robot_reads_and_says_for_each_joint_why_not() -> None:
    """The window is adapted to the 27 s; no joint has more coherent lines than by chance, and fit says that none can be trusted."""
    bag = data("joint_state_bags/unisa_ur10_exciting")
    said = cli("frf", bag, "--json")
    axes = said.json["axes"]
    assert said.code == 0 and len(axes) == 6
    for name, found in axes.items():
        assert any("the output hardly follows the input" in note for note in found["notes"]), name
        assert (found["frf"]["input_unit"], found["frf"]["output_unit"]) == ("effort", "position")
    line = refused("fit", bag)
    assert "number of trusted lines is 0" in line and "length" not in line


def test_the_malformed_bag_is_one_line() -> None:
    """The missing and the existing columns, for every reading command."""
    bag = data("joint_state_bags/roblab_hw4")
    for command in ("fit", "frf", "replay"):
        line = refused(command, bag)
        assert "metadata.yaml names rosbag2_2024_12_16-11_24_20_0.db3, not there" in line and "no block topic /xy/voltage" in line
