"""Several recordings of one machine: its payload may differ between days, everything else is the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.foreign import Joint, driven

import xy_sysid as xy
from xy_sysid.axis.model import AxisModel
from xy_sysid.cli.diagnose import parameter_table
from xy_sysid.greybox.axis_data import FIRST, prepare_all
from xy_sysid.samples.recording import Run

SLIDE = Joint(fs=1000.0, seconds=25.0, count=1e-6, mass=0.1, drag=10.0, coulomb=0.5, shake=1.0, band=(0.5, 60.0))


def recorded(*loads: float) -> list[Run]:
    """A recording for each load, each with its own noise."""
    every = enumerate(loads, 1)
    return [xy.Recording.from_arrays(SLIDE.fs, *driven(replace(SLIDE, load=load), seed)).run("x") for seed, load in every]


@pytest.mark.parametrize("loads", [(0.3, -0.1, 0.6), (0.0, 0.3), (0.25, -0.25)])
def test_each_recording_has_its_own_load(loads: tuple[float, ...]) -> None:
    """Also if the first load is zero, and if their mean is zero; friction and mass are common to all."""
    found = xy.diagnose(recorded(*loads))
    assert set(found.effects) == {"constant_load", "coulomb_friction"}, found.sentence
    assert found.confidence > 0.9
    fit = found.final
    load = fit.parameter("constant_load.load")
    assert [one.value for one in load.recordings] == pytest.approx(loads, abs=2e-3)
    assert all(one.low <= true <= one.high for one, true in zip(load.recordings, loads, strict=True))
    assert load.low <= np.mean(loads) <= load.high
    assert load.value == pytest.approx(np.mean([one.value for one in load.recordings]))
    for name, true in (("coulomb_friction.coulomb", 0.5), ("gain", 0.1), ("pole", 100.0)):
        assert fit.parameter(name).value == pytest.approx(true, rel=5e-3)


def test_where_the_load_is_one_and_the_same_friction_is_one_law() -> None:
    """Friction with a load equals asymmetric friction, for several recordings as for one."""
    found = xy.diagnose(recorded(0.2, 0.2))
    assert found.effects == ("asymmetric_friction",), found.sentence


def test_a_model_says_what_each_recording_carried(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The values are in its file and in the table of parameters; other recordings are predicted with the mean."""
    found = xy.refine(recorded(0.3, 0.1), add=("coulomb_friction", "constant_load"), auto=False)
    xy.save(found.model, tmp_path / "model.yaml")
    written = yaml.safe_load((tmp_path / "model.yaml").read_text())["axes"]["x"]["parameters"]["constant_load.load"]
    assert [one["value"] for one in written["recordings"]] == pytest.approx([0.3, 0.1], abs=2e-3)
    assert all(one["ci95"][0] < one["value"] < one["ci95"][1] for one in written["recordings"])
    back = xy.load_model(tmp_path / "model.yaml")
    assert isinstance(back, xy.PhysicalModel)
    assert dict(back.model.effects)["constant_load"] == pytest.approx((0.2,), abs=2e-3)
    parameter_table(found.rungs[-1].parameters)
    assert "in recording 2" in capsys.readouterr().out


def test_a_load_of_each_recording_goes_where_its_effect_goes() -> None:
    """If the effect is removed or changed, its values are dropped; with added effects they are kept; in a recording each is the effect's value."""
    model = AxisModel(0.1, 1e-3, 100.0).with_effect("constant_load", (0.2,))
    model = replace(model, per_recording=(("constant_load.load", (0.1, 0.3)),))
    assert [dict(model.in_recording(k).effects)["constant_load"] for k in (0, 1)] == [(0.1,), (0.3,)]
    assert model.with_effect("coulomb_friction").per_recording == model.per_recording
    assert model.with_effect("constant_load", (0.5,)).per_recording == ()
    assert model.without("constant_load").per_recording == ()


def test_the_first_stage_holds_the_beginning_of_every_recording() -> None:
    """An effect that only one of them shows is visible from the start; each window lies within one recording."""
    runs = recorded(0.0, 0.3, 0.1)
    data = prepare_all(SLIDE.fs, [run.signals[:2] for run in runs])
    assert all(0 < count < step.stop - step.start for count, step in zip(data.early, data.steps, strict=True))
    assert data.first <= FIRST
    parts = [data.velocity[step][:count] for count, step in zip(data.early, data.steps, strict=True)]
    assert np.array_equal(data.first_stage(data.velocity), np.concatenate(parts))
    edges = np.cumsum(data.early)
    for begin in data.first_windows().begins:
        assert np.searchsorted(edges, begin, side="right") == np.searchsorted(edges, begin + data.layout.length - 1, side="right")
