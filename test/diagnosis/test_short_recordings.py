"""Many recordings, each too short for a fit, are used together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.foreign import Joint, driven

import xy_sysid as xy
from xy_sysid.hypotheses.enough_data import prepared
from xy_sysid.samples.recording import Recording

ARM = Joint(fs=100.0, seconds=1.8, count=1e-5, mass=0.1, drag=1.0, coulomb=0.5, shake=1.0, band=(0.5, 15.0))


@pytest.fixture(scope="module")
def parts() -> list[Recording]:
    """21 recordings of 180 samples."""
    return [Recording.from_arrays(ARM.fs, *driven(ARM, seed)) for seed in range(21)]


def test_short_recordings_together_name_the_friction(parts: list[Recording]) -> None:
    """Each has fewer samples than a fit needs; together they show the effect and its size."""
    found = xy.diagnose(parts)
    assert found.effects == ("coulomb_friction",), found.sentence
    assert found.final.parameter("coulomb_friction.coulomb").value == pytest.approx(0.5, rel=0.05)
    assert xy.diagnose(parts[0]).verdict == "not_enough_data"


def test_a_recording_with_gaps_is_used_with_all_its_stretches(parts: list[Recording]) -> None:
    """The same as separate recordings: no stretch is left out because another is longer."""
    whole = replace(
        parts[0],
        seq=np.concatenate([part.seq + 200 * k for k, part in enumerate(parts)]),
        time=np.concatenate([part.time + 2.0 * k for k, part in enumerate(parts)]),
        voltage=np.concatenate([part.voltage for part in parts]),
        position=np.concatenate([part.position for part in parts]),
    )
    found = xy.diagnose(whole)
    assert len(found.runs) == 21 and found.effects == ("coulomb_friction",)


def test_an_axis_at_constant_speed_is_not_said_to_stand() -> None:
    """It moves all the time; a change of speed is missing, and the error names a command for such tests."""
    n = 3000
    u = np.where(np.arange(n) < 1500, 1.0, 2.0)
    position = np.cumsum(u) * 0.01 + 1e-4 * np.random.default_rng(1).normal(size=n)
    said = prepared(100.0, [(u + 1e-3 * np.random.default_rng(2).normal(size=n), position)])
    assert not isinstance(said, str) or "stands" not in said


def test_refine_refuses_what_diagnose_calls_not_enough_data(parts: list[Recording]) -> None:
    """A constant output, one that does not follow the input, and too few windows: one line with the reason, since no fit is meaningful."""
    rng = np.random.default_rng(3)
    drive = rng.normal(size=3000)
    for position in (np.full(3000, 0.2), np.cumsum(rng.normal(size=3000)) * 1e-3):
        run = Recording.from_arrays(100.0, drive, position).run("x")
        found = xy.diagnose(run)
        assert found.verdict == "not_enough_data"
        with pytest.raises(xy.BadInput, match=found.next_experiment.split(";")[0].split("(")[0].strip()):
            xy.refine(run)
    with pytest.raises(xy.BadInput):
        xy.refine(parts[0])
