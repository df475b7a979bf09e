"""Uneven time and outputs other than positions: correct handling, with notes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.bag_making import joint_state
from helpers.cli_tools import cli, refused
from helpers.real_data import data
from helpers.table_making import RATE, T, U, Y, csv_of
from scipy.integrate import solve_ivp

from xy_sysid.bags import BagWriter
from xy_sysid.bags.cdr import JOINT_TYPE
from xy_sysid.errors import BadRecording
from xy_sysid.imports import load
from xy_sysid.imports.motion import as_position
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording


def wandering(rows: int = 3000, part: float = 0.1) -> FloatArray:
    """Times about 1 ms apart, whose period wanders by up to ``part``."""
    steps = 1e-3 * (1 + part * np.sin(np.arange(rows) / 90.0) + 0.3 * part * np.random.default_rng(3).uniform(-1, 1, rows))
    return np.concatenate(([0.0], np.cumsum(steps)))[:rows]


def pushed(time: FloatArray, u: FloatArray) -> FloatArray:
    """Exact position of a mass of 1 kg with 30 N s/m, under the force ``u``, held between the times."""
    steps = np.diff(time)
    x, v, found = 0.0, 0.0, [0.0]
    for force, step in zip(u, steps, strict=False):
        decay, rest = np.exp(-30.0 * step), force / 30.0
        x, v = x + rest * step + (v - rest) * (1 - decay) / 30.0, rest + (v - rest) * decay
        found.append(x)
    return np.array(found)


def test_uneven_samples_are_resampled_and_it_is_said(tmp_path: Path) -> None:
    """All samples are used, there is no gap, the impulse of the input is kept, and a known mass is recovered."""
    time = wandering()
    u = np.repeat(np.random.default_rng(5).normal(size=600), 5)
    y = pushed(time, u)
    recording = load(csv_of(tmp_path, {"time": time, "x_force[N]": u, "x_position": y}), columns={"x.input": "x_force"})
    assert len(recording.runs()) == 1 and len(recording) >= len(time) - 3
    (note,) = [note for note in recording.notes if "uneven" in note]
    assert "ms" in note and "rms" in note and "resampled" in note
    at = recording.time
    np.testing.assert_allclose(np.diff(at), 1 / recording.sampling_rate, rtol=1e-6)
    np.testing.assert_allclose(recording.position[:, 0], np.interp(at, time, y), atol=2e-3 * np.ptp(y))
    whole = np.interp(at[-1] + 1 / recording.sampling_rate, time, np.concatenate(([0.0], np.cumsum(u[:-1] * np.diff(time)))))
    assert np.sum(recording.voltage) / recording.sampling_rate == pytest.approx(whole, rel=1e-6)
    again = pushed(at, recording.voltage[:, 0])
    counted = pushed(np.arange(len(time)) / recording.sampling_rate, u)[: len(at)]  # samples treated as evenly spaced
    error, naive = (float(np.std(np.diff(one - recording.position[:, 0]))) for one in (again, counted))
    assert error < 0.15 * naive


def test_gaps_stay_gaps_in_uneven_time(tmp_path: Path) -> None:
    """No interpolation over a gap."""
    time = wandering()
    time[1500:] += 0.2
    recording = load(csv_of(tmp_path, {"time": time, "u": U, "y": Y}))
    first, second = recording.runs()
    assert recording.time[second.start] - recording.time[first.stop - 1] > 0.19
    assert recording.time[first.stop - 1] <= time[1499] and recording.time[second.start] >= time[1500]


def test_jitter_of_stamps_is_not_taken_for_uneven_samples(tmp_path: Path) -> None:
    """Stamps in whole ms of samples every 2.5 ms: the samples are unchanged."""
    time = np.round(np.arange(3000) * 2.5e-3, 3)
    recording = load(csv_of(tmp_path, {"time": time, "u": U, "y": Y}))
    np.testing.assert_array_equal(recording.voltage[:, 0], U)
    assert recording.sampling_rate == pytest.approx(400.0, rel=1e-4) and len(recording.runs()) == 1


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: np.cumsum(np.tile([1e-5] * 4 + [0.0099, 0.0099, 0.0099, 0.0099], 375)), "come in bursts"),
        (lambda: np.cumsum(np.tile([1e-3] * 9 + [0.01], 300)) + wandering(), "of the time lies in gaps"),
    ],
)
def test_time_too_uneven_is_refused(tmp_path: Path, make: object, says: str) -> None:
    """Bursts and mostly gaps: the error gives the steps, and the option for samples that are actually even."""
    assert callable(make)
    path = csv_of(tmp_path, {"time": make(), "u": U, "y": Y})
    with pytest.raises(BadRecording) as caught:
        load(path)
    assert says in str(caught.value) and "uneven: steps from" in str(caught.value) and "--rate" in str(caught.value)
    assert len(load(path, rate=1000.0)) == len(U)


@pytest.mark.parametrize("name", ["bam_xl330_sin_time_square_kp800", "bam_xl330_up_and_down_kp100"])
def test_the_servo_as_it_was_recorded(name: str) -> None:
    """Uneven time of a real servo: nearly all samples are used, and the result agrees with the resampled file of the run."""
    found, even = load(data(f"bam_servo/{name}.csv")), load(data(f"bam_servo/{name}_even.npz"))
    rows = np.loadtxt(data(f"bam_servo/{name}.csv"), delimiter=",", skiprows=1)
    assert len(found.runs()) == 1 and len(found) >= len(rows) - 3
    assert any("uneven" in note for note in found.notes)
    other = np.interp(found.time, even.time + rows[0, 0], even.position[:, 0])
    assert float(np.std(found.position[:, 0] - other)) < 0.03 * float(np.std(other))


def test_a_measured_velocity_becomes_the_position_with_that_mean_velocity(tmp_path: Path) -> None:
    """By unit or by name; the mean velocity of each sample is the measured one; the unit is that of the integral, with a note."""
    v = np.gradient(Y, T)
    for head, factor, unit in (
        ("x_position[mm/s]", 1e3, "m"),
        ("Speed (rad/s)", 1.0, "rad"),
        ("vel", 1.0, "m"),
        ("Drehzahl [rpm]", 30 / np.pi, "rad"),
    ):
        recording = load(csv_of(tmp_path, {"time": T, "x_voltage" if "x_" in head else "Voltage": U, head: factor * v}))
        assert (recording.measured, recording.output_unit) == ("velocity", unit)
        np.testing.assert_allclose(np.diff(recording.position[:, 0]) * RATE, v[:-1], rtol=1e-9, atol=1e-12)
        assert any("is a velocity" in note and "half a sample (0.5 ms)" in note for note in recording.notes)
    path = csv_of(tmp_path, {"time": T, "u": U, "y": v})
    assert load(path, units={"output": "m/s"}).measured == "velocity" and load(path).measured == "position"


def test_a_velocity_gives_the_axis_that_its_position_gives(tmp_path: Path) -> None:
    """The fit of tachometer data, in m/s/V: same gain and pole as from the encoder, and no delay."""
    answer = solve_ivp(lambda t, s: [-100.0 * s[0] + 0.1 * U[min(int(t * RATE + 1e-9), 2999)]], (0, T[-1]), [0.0], t_eval=T, max_step=2e-4, rtol=1e-8)
    assert answer.success
    options = ("--set", "length=512", "--set", "numerator_order=0", "--set", "denominator_order=2", "--json")
    recorded = csv_of(tmp_path, {"time": T, "Voltage": U, "Velocity (m/s)": answer.y[0] + 1e-6 * np.random.default_rng(2).normal(size=len(T))})
    found = cli("fit", recorded, *options).json
    axis = found["axes"]["x"]
    assert found["recording"]["measured"] == "velocity" and axis["transfer_function"]["output_unit"] == "m/s"
    assert axis["transfer_function"]["delay"] == pytest.approx(0.0, abs=0.05e-3)
    assert axis["estimates"]["gain"]["value"] == pytest.approx(1e-3, rel=0.05)


def test_an_acceleration_is_integrated_twice(tmp_path: Path) -> None:
    """Without its mean and slow drift, the second difference of the position is the measured acceleration."""
    a = np.gradient(np.gradient(Y, T), T) + 0.3
    recording = load(csv_of(tmp_path, {"time": T, "Voltage": U, "acc (m/s^2)": a}))
    assert (recording.measured, recording.output_unit) == ("acceleration", "m")
    back = np.diff(recording.position[:, 0], 2) * RATE**2
    assert float(np.corrcoef(back, a[:-2])[0, 1]) > 0.999 and abs(back.mean()) < 0.05
    assert any("those of the acceleration" in note and "constant load cannot be seen" in note for note in recording.notes)


def test_a_gap_keeps_the_speed_right_on_both_sides() -> None:
    """Over a gap the velocity is held; within each run the mean velocity is the measured one."""
    keep = np.r_[0:100, 150:400]
    v = np.sin(T)[keep][:, None]
    made = Recording(RATE, ("x",), keep.astype(np.int64), T[keep], v, v, "V", "m/s", measured="velocity")
    moved = as_position(made)
    for run in moved.runs():
        np.testing.assert_allclose(np.diff(moved.position[run, 0]) * RATE, v[run][:-1, 0], rtol=1e-9, atol=1e-12)
    assert as_position(moved.__class__(RATE, ("x",), keep.astype(np.int64), T[keep], v, v)).position is v


def test_units_that_differ_between_axes_are_refused(tmp_path: Path) -> None:
    """mm and m are compatible units; a velocity and a position are not."""
    path = csv_of(tmp_path, {"time": T, "a_voltage": U, "b_voltage": U, "a_position[mm]": 1e3 * Y, "b_position[m]": Y})
    recording = load(path)
    np.testing.assert_allclose(recording.position[:, 0], recording.position[:, 1])
    path = csv_of(tmp_path, {"time": T, "a_voltage": U, "b_voltage": U, "a_position[mm]": Y, "b_position[mm/s]": Y})
    assert "different units (mm, mm/s)" in refused("fit", path)


def overloaded(random: np.random.Generator, rows: int) -> FloatArray:
    """Cycles that may begin up to ten periods late, and then catch up."""
    return np.maximum.accumulate(np.arange(rows) + np.where(random.random(rows) < 0.005, random.uniform(1.0, 10.0, rows), 0.0)) * 1e-3


def joint_states(path: Path, time: FloatArray, u: FloatArray, y: FloatArray, lag: int = 0) -> Path:
    """A bag of one joint with the effort of ``lag`` cycles before."""
    with BagWriter(path) as writer:
        for row, stamp in enumerate(np.round((1e9 + time) * 1e9).astype(np.int64).tolist()):
            message = joint_state(stamp, y[row : row + 1], u[max(row - lag, 0) :][:1], ("x",))
            writer.write_raw("/joint_states", JOINT_TYPE, message, stamp)
    return path


@pytest.mark.parametrize("lag", [0, 1])
def test_joint_states_of_a_machine_whose_period_drifts_are_placed_by_their_stamps(tmp_path: Path, lag: int) -> None:
    """As in a table of uneven time: resampled with a note, and a known mass is recovered; treated as even, it would be wrong by 10 %."""
    time = wandering()
    u = np.repeat(np.random.default_rng(5).normal(size=600), 5)
    y = pushed(time, u)
    found = load(joint_states(tmp_path / "bag", time, u, y, lag), effort_as_voltage=True, effort_lag=lag)
    (note,) = [note for note in found.notes if "uneven" in note]
    assert "resampled" in note and len(found.runs()) == 1 and len(found) >= len(time) - 3 - lag
    seconds = np.linspace(0.0, (len(found) - 1) / found.sampling_rate, len(found))
    error = np.diff(pushed(seconds, found.voltage[:, 0]) - found.position[:, 0])
    naive = np.diff(pushed(np.linspace(0.0, time[-1], len(time)), u) - y)
    assert float(np.std(error)) < 0.1 * float(np.std(naive)) and float(np.std(naive)) > 0.05 * float(np.std(np.diff(y)))


@pytest.mark.parametrize("kind", ["jitter", "lost", "late"])
def test_joint_states_of_a_steady_period_stay_as_they_are(tmp_path: Path, kind: str) -> None:
    """Stamps with jitter, lost samples, late cycles that catch up: no sample is changed."""
    random = np.random.default_rng(7)
    kept = np.delete(np.arange(3000), [400, 401, 1700]) if kind == "lost" else np.arange(3000)
    time = overloaded(random, 3000) if kind == "late" else (kept + random.uniform(-0.2, 0.2, len(kept))) * 1e-3
    u, y = random.normal(size=(2, len(kept)))
    found = load(joint_states(tmp_path / "bag", time, u, y), effort_as_voltage=True)
    np.testing.assert_array_equal(found.voltage[:, 0], u)
    np.testing.assert_array_equal(found.position[:, 0], y)
    assert not any("uneven" in note for note in found.notes)
