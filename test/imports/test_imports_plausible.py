"""Suspicious data give notes with the next action; a good recording gives none."""

from __future__ import annotations

import re
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.cli_tools import cli, refused
from helpers.real_data import data
from helpers.table_making import RATE, T, U, Y, csv_of

from xy_sysid.imports import load

HALF = np.arange(len(T)) > len(T) // 2


def notes_of(path: Path, **columns: Any) -> str:
    """All notes about an axis with these columns changed."""
    content = {"time": T, "x_voltage": U, "x_position": Y} | columns
    return " | ".join(load(csv_of(path, content)).notes)


def test_nothing_is_said_of_a_good_recording(tmp_path: Path) -> None:
    """No note at all."""
    assert notes_of(tmp_path) == ""


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ({"time": T * 1000}, "1 s apart (1 Hz): is time in ms"),
        ({"time": T * 1e-6}, "is this the right unit of time?"),
        ({"x_voltage": Y * 1e3, "x_position": U * 1e-3}, "are input and output swapped?"),
        ({"x_position": Y * 3e7}, "is it in mm or counts? Give --unit output=mm"),
        ({"x_position": np.where(HALF, Y[len(T) // 2], Y)}, "dead from 1.5 s to the end (50 % of the samples) although the input moves as elsewhere"),
        ({"x_position": np.where(HALF, Y[len(T) // 2], Y), "x_voltage": np.where(HALF, 0.3 * U, U)}, "stands still from 1.5 s to the end"),
        ({"x_position": Y + 1e9}, "where numbers are 1.2e-07 apart"),
        ({"x_position": Y * 1e-12}, "m in all: is this the right unit?"),
        ({"x_voltage": U * 1e-12}, "V in all: is this the right unit?"),
        ({"x_position": np.clip(Y, None, np.quantile(Y, 0.7))}, "lies at its highest value"),
        ({"x_voltage": np.clip(U, -0.5, 0.5)}, "the input lies at its highest value, 0.5 V, in 31 % of the samples: is it saturated?"),
        ({"x_position": 0 * Y}, "the output never changes"),
        ({"x_voltage": 0 * U + 3}, "the input never changes"),
        ({"x_position": np.round(Y / np.ptp(Y)) * 1e-3}, "the axis stands, or its encoder is too coarse"),
        ({"time": np.where(HALF, T + 0.25, T)}, "1 gap in the samples, the longest of 250 (0.25 s) after 1.5 s"),
    ],
)
def test_what_looks_wrong_is_said(tmp_path: Path, columns: dict[str, Any], says: str) -> None:
    """Swapped columns, units, gaps, constant, at rest, stuck, saturated, duplicates: with times in s and the next action."""
    begun = time.process_time()
    assert says in notes_of(tmp_path, **columns)
    assert time.process_time() - begun < 5.0


def test_an_angle_that_wraps_is_unwrapped_and_that_is_said(tmp_path: Path) -> None:
    """An angle wrapped to one turn jumps and is unwrapped; an angle without wrapping does not jump."""
    angle = 20 * Y / np.ptp(Y)
    turns = int(np.sum(np.abs(np.diff((angle + np.pi) % (2 * np.pi))) > 3.0))
    path = csv_of(tmp_path, {"time": T, "x_voltage": U, "x_position[rad]": (angle + np.pi) % (2 * np.pi) - np.pi})
    found = load(path)
    (said,) = [note for note in found.notes if "wraps" in note]
    assert f"leaps by a whole turn {turns} times" in said and "unwrapped" in said
    assert np.allclose(np.diff(found.position[:, 0]), np.diff(angle), atol=1e-9)
    assert not any("wraps" in note for note in load(csv_of(tmp_path, {"time": T, "x_voltage": U, "x_position[rad]": angle})).notes)


def test_a_reference_is_unwrapped_by_itself(tmp_path: Path) -> None:
    """The reference jumps a few samples before the output; one without jumps is unchanged."""
    angle = 30.0 * T - np.pi
    for reference, wrapped in ((angle + 0.1, True), (angle + 0.1, False)):
        columns = {"time": T, "u": U, "y[rad]": np.angle(np.exp(1j * angle)), "r[rad]": np.angle(np.exp(1j * reference)) if wrapped else reference}
        found = load(csv_of(tmp_path, columns))
        assert found.reference is not None
        np.testing.assert_allclose(found.reference - found.position, 0.1, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "turn", "says"),
    [
        ("y[counts]", 65536, "leaps by 65536 .* as a counter that wraps: unwrap it first"),
        ("y[counts]", 4096, "leaps by 4096 .* as a counter that wraps: unwrap it first"),
        ("y", 360, "leaps by 360 .* as an angle that wraps: give --unit output=deg"),
    ],
)
def test_counts_and_degrees_that_wrap_are_said(tmp_path: Path, name: str, turn: int, says: str) -> None:
    """The note gives size and number of the jumps; there is none without jumps, or for an axis with rare, fast moves."""
    counts = np.rint(5.3 * turn * T / T[-1])
    (said,) = [note for note in load(csv_of(tmp_path, {"time": T, "u": U, name: counts % turn})).notes if "wraps" in note]
    assert re.search(says, said) and " 5 times" in said
    fast = np.cumsum(np.where(np.arange(len(T)) % 300 < 20, float(turn), 0.0))
    for same in (counts, fast):
        assert not any("wraps" in note for note in load(csv_of(tmp_path, {"time": T, "u": U, name: same})).notes)


@pytest.mark.parametrize(
    ("head", "says"),
    [
        ({"x_voltage[rad]": U, "x_position": Y}, "the input is in rad, which is not a drive signal"),
        ({"x_voltage": U, "x_position[V]": Y}, "the output is in V, which is not a motion"),
        ({"Measured Voltage": U, "x_position": Y}, "the input 'Measured Voltage' was measured, so it is probably not held"),
        ({"x_voltage[A]": U, "x_position": Y}, "if it was measured and not commanded, it is not held"),
    ],
)
def test_units_that_do_not_fit_are_said(tmp_path: Path, head: dict[str, Any], says: str) -> None:
    """A drive in rad, a motion in V; a current is rarely held."""
    assert says in " | ".join(load(csv_of(tmp_path, {"time": T} | head)).notes)


def test_one_column_for_both_is_refused(tmp_path: Path) -> None:
    """Voltage equal to position: no meaningful answer. With another axis only this one is left out."""
    said = refused("diagnose", csv_of(tmp_path, {"time": T, "x_voltage": U, "x_position": U}))
    assert "input and output of axis x are the same numbers" in said and "--map" in said
    recording = load(csv_of(tmp_path, {"time": T, "x_voltage": U, "x_position": U, "z_voltage": U, "z_position": Y}))
    assert recording.axes == ("z",) and any("same numbers" in note for note in recording.notes)


def test_a_dead_part_becomes_a_gap(tmp_path: Path) -> None:
    """An encoder that stops half-way: the rest is read, so the model is that of the rest, without a false effect."""
    middle = (np.arange(len(T)) > 1000) & (np.arange(len(T)) < 2200)
    recording = load(csv_of(tmp_path, {"time": T, "x_voltage": U, "x_position": np.where(middle, Y[1001], Y)}))
    assert len(recording) == int(np.sum(~middle)) and len(recording.runs()) == 2


def test_a_joint_that_waits_takes_no_part_from_the_others(tmp_path: Path) -> None:
    """A joint with a short motion between two rests is held, not dead: the other keeps all of its samples."""
    moment = (np.arange(len(T)) > 1000) & (np.arange(len(T)) < 1100)
    waiting = np.where(moment, Y - Y[1001], 0.0)
    recording = load(csv_of(tmp_path, {"time": T, "x_voltage": U, "x_position": Y, "z_voltage": U[::-1], "z_position": waiting}))
    assert len(recording) == len(T) and len(recording.runs()) == 1
    assert any("z: the output stands still" in note for note in recording.notes)


def test_a_robots_q_is_an_angle(tmp_path: Path) -> None:
    """The coordinate of a joint with a torque input is in rad, the position of an axis in m."""
    recording = load(csv_of(tmp_path, {"time": T, "tau": U, "q": Y}))
    assert (recording.input_unit, recording.output_unit) == ("N m", "rad")
    assert load(csv_of(tmp_path, {"time": T, "x_torque": U, "x_position": Y})).output_unit == "m"


def test_switching_inputs_are_no_saturation(tmp_path: Path) -> None:
    """Two levels of a PRBS, three levels of a relay: no note."""
    assert "saturated" not in notes_of(tmp_path, x_voltage=np.sign(U))


def test_answers_with_json_carry_the_notes(tmp_path: Path) -> None:
    """The notes are also in the JSON document."""
    path = csv_of(tmp_path, {"time": T, "x_voltage": np.clip(U, -0.5, 0.5), "x_position": Y})
    short = ("--set", "length=512", "--json")
    assert any("saturated" in note for note in cli("frf", path, *short).json["recording"]["notes"])
    twice = cli("compare", path, path, path, *short).json
    assert any("saturated" in note for note in twice["notes"]) and any("3 recordings, one after the other" in note for note in twice["notes"])


@pytest.mark.parametrize("path", ["emps/emps_train.npz", "lsb250/lsb250_exp1.npz", "hsm150/hsm_pos_0.06_1.npz"])
def test_good_real_recordings_are_not_doubted(path: str) -> None:
    """Real machines with friction and saturation: only notes about conversions."""
    recording = load(data(path))
    assert [note for note in recording.notes if "converted" not in note] == []
    assert recording.sampling_rate == pytest.approx(RATE, rel=1e-3)
