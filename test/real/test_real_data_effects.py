"""Recordings of real machines and their effects: the numbers of docs/real-machines.md, by its commands."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.cli_tools import cli
from helpers.real_data import data

from xy_sysid.greybox.free_run import GreyboxFit, fit_base, fit_with, prepare
from xy_sysid.greybox.open_loop import open_loop, settled
from xy_sysid.imports import load

FORCE = 35.15065  # N/V of EMPS
EMPS = "emps/emps_train.npz"
NAMES = ("coulomb_friction", "asymmetric_viscous_friction", "cogging")
ADDED = tuple(word for name in NAMES for word in ("--add", name))


def refined(path: str, *options: str) -> Any:
    """The answer of ``refine --json`` for axis x."""
    said = cli("refine", data(path), *options, "--json")
    assert said.code == 0, said.err
    return said.json["axes"]["x"]


def value(found: Any, name: str) -> float:
    """One parameter of the final model."""
    return float(found["model"]["parameters"][name]["value"])


def power_gone(found: Any, rung: int = -1) -> float:
    """Explained fraction of the rigid model's held-out error power."""
    return 1.0 - float(found["ladder"][rung]["held_out_error"] / found["ladder"][0]["held_out_error"]) ** 2


def test_emps_falls_rung_by_rung_to_friction_direction_and_cogging() -> None:
    """Mass within 2 %, Coulomb within 10 %, at least 95 % of the held-out error power explained, cogging at 2.5 mm; not called explained."""
    found = refined(EMPS, *ADDED)
    assert [rung["added"] for rung in found["ladder"]] == [None, *NAMES]
    assert FORCE / (value(found, "gain") * value(found, "pole")) == pytest.approx(95.1089, rel=0.02)
    assert FORCE * value(found, "coulomb_friction.coulomb") == pytest.approx(20.3935, rel=0.10)
    assert power_gone(found, 2) > 0.95
    assert power_gone(found) > 0.95
    assert value(found, "cogging.period") == pytest.approx(2.5e-3, rel=0.005)
    assert FORCE * value(found, "cogging.amplitude") == pytest.approx(1.0, abs=0.2)
    forth, back = (1.0 + sign * value(found, "asymmetric_viscous_friction.asymmetry") for sign in (1.0, -1.0))
    assert forth / back == pytest.approx(166.7 / 240.4, abs=0.05)
    assert found["verdict"] == "partly"
    assert found["open_loop"]["unit"] == "m" and found["open_loop"]["rms"] < 4e-3


def test_the_position_of_emps_is_simulated_from_the_voltage_alone() -> None:
    """At most 2.5 mm rms error over the full record with --open-loop; mass and friction still near the published ones."""
    found = refined(EMPS, *ADDED, "--open-loop")
    assert found["open_loop"]["rms"] <= 2.5e-3
    assert FORCE / (value(found, "gain") * value(found, "pole")) == pytest.approx(95.1089, rel=0.03)
    assert FORCE * value(found, "coulomb_friction.coulomb") == pytest.approx(20.3935, rel=0.05)
    assert power_gone(found) > 0.95


def test_settling_keeps_what_the_fast_motion_knows_better() -> None:
    """Delay and cogging are kept; the position error is smaller; the held-out error remains that of the original fit."""
    recording = load(data(EMPS))
    u, y = recording.axis("x")
    axis = prepare(recording.sampling_rate, u, y)
    before = fit_with(axis, fit_base(axis), NAMES)
    after = settled(axis, before)
    assert after.model.delay == before.model.delay
    assert dict(after.model.effects)["cogging"] == dict(before.model.effects)["cogging"]
    assert after.held_out_error == before.held_out_error
    assert np.isinf(after.parameter("gain").high) and np.isfinite(after.parameter("cogging.period").high)
    far = [open_loop(recording.sampling_rate, y, fit.simulated, fit.model.pole) for fit in (before, after)]
    assert far[1].rms < far[0].rms and far[1].worst >= far[1].rms


def test_the_linear_guide_shows_its_mode_its_spring_and_its_friction(tmp_path: Any) -> None:
    """Zeros near 11.7 Hz, poles near 13.4 Hz, 0.77 Hz by the spring; of the second recording it simulates less than half."""
    model = tmp_path / "guide.yaml"
    effects = ("base_resonance", "hardening_stiffness", "coulomb_friction", "constant_load")
    added = [word for name in effects for word in ("--add", name)]
    found = refined("lsb250/lsb250_exp1.npz", *added, "--tolerance", "0.03", "--model", str(model))
    zeros = value(found, "base_resonance.frequency")
    assert zeros == pytest.approx(11.6, abs=0.15)
    assert zeros * (1.0 + value(found, "base_resonance.split")) == pytest.approx(13.4, abs=0.2)
    spring = value(found, "gain") * value(found, "pole") * value(found, "hardening_stiffness.linear")
    assert np.sqrt(spring) / (2.0 * np.pi) == pytest.approx(0.77, abs=0.02)
    assert 0.01 < value(found, "coulomb_friction.coulomb") < 0.05
    assert power_gone(found) > 0.9
    seen = cli("validate", data("lsb250/lsb250_exp2.npz"), model, "--json").json["axes"]["x"]
    assert seen["simulation"]["nrmse"] == pytest.approx(48, abs=5)


def test_a_servo_with_a_pendulum_carries_its_weight() -> None:
    """Friction alone explains less; with gravity 95 % of the held-out motion is simulated from the voltage, and the arm hangs at 0."""
    recording = load(data("bam_servo/bam_xl330_sin_time_square_kp800_even.npz"))
    axis = prepare(recording.sampling_rate, *recording.axis(recording.axes[0]))
    base = fit_base(axis)

    def explained(names: tuple[str, ...]) -> tuple[float, GreyboxFit]:
        found = fit_with(axis, base, names)
        return 1.0 - float(np.var(found.error[axis.training :]) / np.var(axis.velocity[axis.training :])), found

    with_weight, found = explained(("coulomb_friction", "gravity"))
    assert with_weight > 0.95 > explained(("coulomb_friction",))[0]
    assert found.parameter("gravity.phase").value == pytest.approx(0.0, abs=0.1)


def test_the_robot_is_not_given_a_wrong_name() -> None:
    """Each joint: no effect, as its effort carries the other joints and gravity."""
    said = cli("diagnose", data("joint_state_bags/unisa_ur10_exciting"), "--axis", "wrist_3_joint", "--json")
    assert said.code == 0
    assert all(found["verdict"] in ("not_in_library", "not_enough_data") for found in said.json["axes"].values())
