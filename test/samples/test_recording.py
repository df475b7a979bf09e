"""The longest stretch of a recording without a gap."""

from __future__ import annotations

import numpy as np
import pytest
from helpers import ROOT

from xy_sysid.errors import BadInput
from xy_sysid.samples.recording import Recording

RATE = 1000.0


def recording(seq: list[int]) -> Recording:
    """Two axes, whose samples are identified by their counter."""
    count = np.array(seq, dtype=np.int64)
    values = np.column_stack((count, -count)).astype(np.float64)
    return Recording(RATE, ("x", "y"), count, count / RATE, values, 0.001 * values, input_unit="A")


def test_the_run_of_an_axis_is_its_longest_stretch_without_a_gap() -> None:
    """Samples, instants, rate and units of one axis; of equally long stretches the first."""
    run = recording([0, 1, 5, 6, 7, 20, 21, 22]).run("y")
    assert run.axis == "y" and run.sampling_rate == RATE and run.rows == slice(2, 5)
    assert run.voltage.tolist() == [-5.0, -6.0, -7.0]
    assert run.position.tolist() == [-0.005, -0.006, -0.007]
    assert (run.input_unit, run.output_unit) == ("A", "m")
    assert len(run) == 3 and run.seconds == pytest.approx(0.003)
    assert len(run.until(0.002)) == 2 and run.until(1.0).rows == run.rows
    assert run.signals[0] is run.voltage and run.signals[1] is run.position and run.signals[2] == RATE


def test_ends_at_which_an_axis_is_not_driven_and_stands_are_left_out() -> None:
    """Long rests at the ends of a bag are removed except for a second; motion, and rests in between, are kept."""
    rest, noise = np.zeros(4000), np.random.default_rng(0)
    drive = noise.standard_normal(3000)
    u = np.concatenate((rest, drive, rest, drive, rest))
    y = 1e-6 * noise.standard_normal(u.size) + np.cumsum(u) / RATE
    found = Recording.from_arrays(RATE, u, y)
    assert found.run("x").rows == slice(3000, 15000)
    moving = Recording.from_arrays(RATE, u, y + np.where(np.arange(u.size) > 14000, np.arange(u.size) - 14000.0, 0.0) / RATE)
    assert moving.run("x").rows == slice(3000, u.size)
    still = Recording.from_arrays(RATE, rest, rest + 1.0)
    assert still.run("x").rows == slice(0, rest.size)


def test_an_axis_that_is_not_there_and_a_recording_without_samples_are_told() -> None:
    """One line with the allowed values; no empty answer."""
    with pytest.raises(BadInput, match="x, y"):
        recording([0, 1]).run("z")
    with pytest.raises(BadInput, match="1 or more"):
        recording([]).run("x")


def test_nobody_else_looks_for_the_longest_stretch() -> None:
    """Commands and page use the method of the recording."""
    for path in (ROOT / "xy_sysid").rglob("*.py"):
        if path.parts[-2:] != ("samples", "recording.py"):
            assert "max(recording.runs()" not in path.read_text(encoding="utf-8").replace("self._", ""), path
