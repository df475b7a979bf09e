"""Trajectories that excite a robot within limits of position, speed and acceleration, and identification from them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import yaml
from helpers.cli_tools import cli, refused

import xy_sysid as xy
from xy_sysid.errors import BadInput
from xy_sysid.excitation.trajectory import MotionLimits, trajectory
from xy_sysid.samples.recording import Recording

LIMITS, BAND, RATE = MotionLimits(0.5, 1.0, 8.0), (0.3, 8.0), 200.0


@pytest.mark.parametrize("kind", ["multisine", "sweep"])
@pytest.mark.parametrize("limits", [LIMITS, MotionLimits(0.01, 1.0, 100.0), MotionLimits(5.0, 0.2, 100.0)])
def test_it_is_as_large_as_the_tightest_limit_allows(kind: Literal["multisine", "sweep"], limits: MotionLimits) -> None:
    """It reaches one limit and stays within the others, from rest to rest at the start; speed and acceleration are the derivatives."""
    made = trajectory(kind, BAND, 20.0, RATE, replace(limits, start=1.5))
    largest = [float(np.max(np.abs(values))) for values in (made.position - 1.5, made.speed, made.acceleration)]
    parts = [size / limit for size, limit in zip(largest, (limits.position, limits.speed, limits.acceleration), strict=True)]
    assert max(parts) == pytest.approx(1.0) and min(parts) > 0.0
    for values, rest in ((made.position, 1.5), (made.speed, 0.0), (made.acceleration, 0.0)):
        assert values[[0, -1]] == pytest.approx([rest, rest], abs=1e-9 * max(largest))
    slope, bend = np.gradient(made.position, made.time), np.gradient(made.speed, made.time)
    assert float(np.max(np.abs(slope - made.speed))) < 0.05 * largest[1]
    assert float(np.max(np.abs(bend - made.acceleration))) < 0.05 * largest[2]


def test_what_cannot_be_held_is_refused() -> None:
    """A band too slow for the time, too few points for it, invalid limits."""
    with pytest.raises(BadInput, match="cycles of the lowest"):
        trajectory("multisine", (0.05, 8.0), 20.0, RATE, LIMITS)
    with pytest.raises(BadInput, match="points a second"):
        trajectory("sweep", BAND, 20.0, 50.0, LIMITS)
    with pytest.raises(BadInput, match="limit of speed"):
        trajectory("sweep", BAND, 20.0, RATE, replace(LIMITS, speed=0.0))


def test_a_joint_behind_its_controller_is_identified_with_the_reference_as_instrument() -> None:
    """A stiff position loop, noise on the encoder: effort to position by the joint input-output method gives inertia and damping."""
    made = trajectory("multisine", BAND, 60.0, RATE, LIMITS)
    random, steps, q, v, rows = np.random.default_rng(2), 20, 0.0, 0.0, []
    for wanted in made.position:
        seen = q + 1e-5 * random.normal()
        effort = 400.0 * (wanted - seen) - 20.0 * v
        rows.append((effort, seen))
        for _ in range(steps):
            v += (effort - 3.0 * v) / 0.5 / RATE / steps
            q += v / RATE / steps
    u, y = np.array(rows).T
    recording = replace(Recording.from_arrays(RATE, u, y, units=("N m", "rad")), reference=made.position[:, None])
    found = xy.frf(recording, response="joint_input_output", band_low=0.5, band_high=7.0, period=None, length=1024)
    model = xy.fit(found, numerator_order=0, denominator_order=2)
    gain, pole = model.tf.gain, abs(model.tf.poles()[0])
    assert 1.0 / gain == pytest.approx(3.0, rel=0.05) and 1.0 / (gain * pole) == pytest.approx(0.5, rel=0.05)


def test_the_command_writes_the_message_and_the_reference(tmp_path: Path) -> None:
    """trajectory_msgs/JointTrajectory for ros2 topic pub; the limiting quantity is named; existing files are not replaced."""
    options = ("--joint", "pan", "--position", "0.5", "--speed", "1", "--acceleration", "8", "--high", "5", "--start", "0.2")
    said = cli("trajectory", tmp_path / "excite.yaml", *options)
    assert said.code == 0 and "limit of" in said.out
    message = yaml.safe_load((tmp_path / "excite.yaml").read_text())
    assert message["joint_names"] == ["pan"] and len(message["points"]) == 3001
    assert message["points"][0]["positions"] == pytest.approx([0.2]) and message["points"][1]["time_from_start"] == {"sec": 0, "nanosec": 10_000_000}
    table = np.genfromtxt(tmp_path / "excite.csv", delimiter=",", names=True)
    assert np.max(np.abs(table["speed"])) <= 1.0 + 1e-9
    assert "--force" in refused("trajectory", tmp_path / "excite.yaml", *options)
