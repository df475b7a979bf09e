"""Identification in closed loop: the reference as instrument, because feedback biases output over input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.cli_tools import cli
from helpers.servo import H1, JOINT, Servo, multisine
from scipy import signal

from xy_sysid.errors import BadInput
from xy_sysid.fitting import identify
from xy_sysid.fitting.of_recording import estimate
from xy_sysid.fitting.structure import structure_from
from xy_sysid.imports import save
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording

SERVO = Servo()


def noise(rows: int) -> FloatArray:
    """A reference of noise below 60 Hz, 10 mrad rms."""
    made = signal.lfilter(*signal.butter(4, 60.0, fs=SERVO.rate), np.random.default_rng(555).standard_normal(rows))
    return np.asarray(made * 0.01 / np.std(made))


REFERENCES = {"multisine": multisine(SERVO.rate, 1000, 30, 60.0, 0.01), "noise": noise(30_000)}


@pytest.fixture(scope="module", params=sorted(REFERENCES))
def recordings(request: pytest.FixtureRequest) -> list[Recording]:
    """Ten minutes apart, the same reference: loads and encoder noise differ."""
    return [SERVO.run(REFERENCES[request.param], seed) for seed in range(6)]


def test_the_reference_as_instrument_is_right_where_output_over_input_is_not(recordings: list[Recording]) -> None:
    """On a simulated servo H1 is wrong by more than 10 %; joint input-output agrees with the truth within its sigma."""
    plain = estimate(recordings[0], "x", H1).frf
    true = SERVO.response(plain.frequency)[plain.trusted]
    assert abs(np.mean(plain.response[plain.trusted] / true) - 1.0) > 0.1
    for recording in recordings:
        found = estimate(recording, "x", JOINT)
        frf = found.frf
        assert frf.trusted.sum() > 60 and any("reference as instrument" in note for note in found.notes)
        true = SERVO.response(frf.frequency)
        assert abs(np.mean(frf.response[frf.trusted] / true[frf.trusted]) - 1.0) < 0.05
        distance = np.abs(frf.response - true) / frf.sigma
        assert 0.8 < np.sqrt(np.mean(distance[frf.trusted] ** 2)) < 1.25


def test_the_intervals_of_the_fit_hold_the_truth_in_closed_loop(recordings: list[Recording]) -> None:
    """95 % intervals of inertia and drag: nearly all contain the truth; those of H1 never do."""
    held: list[bool] = []
    biased: list[bool] = []
    for recording in recordings:
        for settings, kept in ((JOINT, held), (H1, biased)):
            fit = identify(estimate(recording, "x", settings).frf, structure_from(settings))
            named = {item.name: item for item in fit.intervals}
            kept += [
                named["numerator_0"].low <= 1 / SERVO.inertia <= named["numerator_0"].high,
                named["denominator_1"].low <= SERVO.drag / SERVO.inertia <= named["denominator_1"].high,
            ]
    assert np.mean(held) >= 10 / 12 and np.mean(biased) <= 4 / 12


def test_a_recording_without_a_moving_reference_is_refused() -> None:
    """response joint_input_output without a reference, or with a constant one: one sentence with the next action."""
    recording = SERVO.run(REFERENCES["noise"][:5000])
    for reference, words in ((None, "has no reference"), (np.zeros((5000, 1)), "reference of axis x")):
        changed = Recording(
            sampling_rate=recording.sampling_rate,
            axes=recording.axes,
            seq=recording.seq,
            time=recording.time,
            voltage=recording.voltage,
            position=recording.position,
            reference=reference,
        )
        with pytest.raises(BadInput, match=words):
            estimate(changed, "x", JOINT)


def test_frf_and_fit_take_the_reference_of_a_file(tmp_path: Path) -> None:
    """A CSV with x_reference: frf and fit identify in closed loop if requested, with a note; otherwise a note says that H1 is biased."""
    path = tmp_path / "servo.csv"
    save(SERVO.run(REFERENCES["multisine"]), path)
    told = [
        f"--set={name}={getattr(JOINT, name)}"
        for name in ("response", "length", "min_coherence", "band_high", "numerator_order", "denominator_order")
    ]
    said = cli("fit", path, *told)
    assert "joint input-output" in said.out + said.err
    answer = cli("fit", path, "--json", *told).json["axes"]["x"]
    low, high = answer["estimates"]["numerator_0"]["ci95"]
    assert low < 1 / SERVO.inertia < high
    plain = cli("frf", path)
    assert "--set response=joint_input_output" in plain.err
