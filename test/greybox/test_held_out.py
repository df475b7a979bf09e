"""Held-out data: not used by the fit, spread over the record, with motion; in each of several recordings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from helpers.simulated import recorded

from xy_sysid.diagnosis.diagnose import diagnose
from xy_sysid.diagnosis.of_run import diagnose as diagnose_runs
from xy_sysid.greybox.axis_data import SHIFTS, AxisData, _blocks, prepare, prepare_all
from xy_sysid.greybox.floor import Bands, Windows
from xy_sysid.samples.block import FloatArray


def noise(samples: int, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(samples)


def moved(samples: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """A rigid axis without friction, V and m."""
    u = noise(samples, seed)
    velocity = np.zeros(samples)
    for k in range(1, samples):
        velocity[k] = 0.9 * velocity[k - 1] + 0.01 * u[k - 1]
    return u, np.cumsum(velocity) / 2000.0 + 1e-7 * noise(samples, seed + 100)


def inside(data: AxisData, begins: np.ndarray) -> np.ndarray:
    """(n,) True for samples of ``velocity`` in a window."""
    held = np.zeros(data.velocity.size, dtype=bool)
    for begin in begins:
        held[begin : begin + data.layout.length] = True
    return held


@pytest.mark.parametrize("sizes", [(1200,), (5000,), (60_000,), (60_000, 40_000), (20_000, 20_000, 20_000)])
def test_windows_that_judge_share_no_sample_with_those_that_a_fit_sees(sizes: tuple[int, ...]) -> None:
    """Short, long, and several recordings; no window spans two recordings; the first stage uses no held-out data either."""
    data = prepare_all(2000.0, [moved(size, k) for k, size in enumerate(sizes)])
    fitted, held, screening = (inside(data, windows.begins) for windows in (data.fitted, data.held_out, data.screening_windows))
    assert fitted.any() and held.any() and screening.any()
    assert not (fitted & held).any()
    assert not (screening[: data.first] & (data.first_stage(held.astype(float)) > 0.0)).any() and not screening[data.first :].any()
    assert np.array_equal(data.held_samples(), held)
    for step in data.steps:
        for begin in (*data.fitted.begins, *data.held_out.begins):
            assert not begin < step.start < begin + data.layout.length


def test_what_is_held_out_is_spread_over_the_record() -> None:
    """Some of each quarter is held out, so that it contains similar motion."""
    data = prepare(2000.0, *moved(60_000))
    assert all(part.any() and not part.all() for part in np.array_split(inside(data, data.held_out.begins), 4))


def test_of_several_recordings_each_is_held_out_in_part() -> None:
    """Part of each is fitted."""
    data = prepare_all(2000.0, [moved(60_000, 1), moved(40_000, 2)])
    for windows in (data.fitted, data.held_out):
        assert all(inside(data, windows.begins)[step].any() for step in data.steps)


def test_an_axis_that_moves_a_tenth_of_the_time_is_not_judged() -> None:
    """9 %, at the start: no effect is named, and the answer says what is missing."""
    u, y = moved(60_000)
    still = 5400
    u[still:] = 0.0
    y[still:] = y[still]
    found = diagnose(2000.0, u, y)
    assert found.verdict == "not_enough_data" and found.effects == ()
    assert "stands most of the time" in found.sentence


def test_noise_that_does_not_follow_the_input_is_not_judged() -> None:
    """Two unrelated signals."""
    found = diagnose(2000.0, noise(40_000, 3), np.cumsum(noise(40_000, 4)))
    assert found.verdict == "not_enough_data" and "does not follow the input" in found.sentence


def test_two_recordings_of_one_machine_are_one_question() -> None:
    """A second excitation of the same axis: the same effect, fitted to both, with a smaller interval."""
    pair = [recorded("coulomb_friction", seconds=12.0, seed=seed).run("x") for seed in (21, 21)]
    both, one = diagnose_runs(pair), diagnose_runs(pair[0])
    assert (both.verdict, both.effects) == ("missing_effect", ("coulomb_friction",))
    widths = [(found.high - found.low) for found in (item.final.parameter("coulomb_friction.coulomb") for item in (both, one))]
    assert widths[0] < widths[1]
    assert both.final.parameter("coulomb_friction.coulomb").value == pytest.approx(0.2, rel=0.01)


def test_the_first_stage_is_short_where_windows_are_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """If the first fitted block is short, the first stage grows until it has two windows, not to the full record."""

    def half_shifted(layout: Bands, spans: Sequence[tuple[int, int]], velocity: FloatArray) -> tuple[Windows, Windows]:
        fitted, held = _blocks(layout.length, *spans[0], SHIFTS // 2)
        return Windows(layout, fitted), Windows(layout, held)

    monkeypatch.setattr("xy_sysid.greybox.axis_data._split", half_shifted)
    data = prepare(4000.0, *moved(200_000))
    assert data.screening_windows.begins.size >= 2
    assert data.first < 100_000
