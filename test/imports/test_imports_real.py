"""Recordings of real machines load with their units, rates and gaps."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.real_data import data

from xy_sysid.bags import stream_blocks
from xy_sysid.errors import BadRecording
from xy_sysid.imports import load


def test_the_ur10_bag_gives_six_joints() -> None:
    """A bag of version 4 whose time begins near 0: six joints at 125 Hz, effort as the input."""
    recording = load(data("joint_state_bags/unisa_ur10_exciting"))
    assert recording.sampling_rate == 125.0 and len(recording) == 3441 and len(recording.runs()) == 1
    assert recording.axes[:2] == ("shoulder_pan_joint", "shoulder_lift_joint") and len(recording.axes) == 6
    assert recording.input_unit == "effort" and np.ptp(recording.position[:, 0]) > 0.1
    assert sum(len(block) for kind, block in stream_blocks(recording.source) if kind == "position") == 3441


def test_the_malformed_bag_is_one_line() -> None:
    """metadata.yaml names a missing file, and the existing one has no motion: the error names both."""
    with pytest.raises(BadRecording) as caught:
        load(data("joint_state_bags/roblab_hw4"))
    text = str(caught.value)
    assert "\n" not in text and "rosbag2_2024_12_16-11_24_20_0.db3" in text and "/pose" in text


@pytest.mark.parametrize(
    ("path", "rate", "units", "rows"),
    [
        ("emps/emps_train.npz", 1000.0, ("V", "m"), 24841),
        ("lsb250/lsb250_exp1.npz", 1000.0, ("V", "m"), 100610),
        ("lsb250/lsb250_exp2.npz", 1000.0, ("V", "m"), 103259),
        ("two_inertia_bench/multisineA.npz", 2500.0, ("A", "rad"), 50000),
    ],
)
def test_bench_recordings_load(path: str, rate: float, units: tuple[str, str], rows: int) -> None:
    """Rate from the stamps, units converted or kept, no gap."""
    recording = load(data(path))
    assert recording.sampling_rate == pytest.approx(rate, rel=2e-4)
    assert (recording.input_unit, recording.output_unit) == units
    assert len(recording) == rows and len(recording.runs()) == 1
    assert (recording.reference is not None) == path.startswith("emps")


def test_the_second_encoder_can_be_chosen() -> None:
    """Another output of the same file is an argument; its unit is its own."""
    recording = load(data("lsb250/lsb250_exp1.npz"), columns={"output": "y2"})
    assert recording.output_unit == "m" and recording.position[0, 0] == pytest.approx(9.343e-3)


def test_a_robot_whose_stamps_jitter_is_used_from_end_to_end() -> None:
    """120 s at about 30 Hz with steps from 15 to 271 ms: one stretch with every sample, and not the longest of many."""
    named = {"input": "tau_measured:3", "output": "q:3"}
    recording = load(data("rm_arm/joint_3.npz"), columns=named, units={"input": "N m", "output": "rad"})
    assert len(recording.runs()) == 1 and len(recording) >= 3146
    assert recording.time[-1] - recording.time[0] == pytest.approx(120.0, abs=0.5)
    assert any("3146 samples are resampled" in note for note in recording.notes)
