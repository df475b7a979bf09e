"""An axis model with effects is loaded from its file, compared, validated, paired and exported, also by the commands."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.simulated import recorded
from scipy.io import loadmat

from xy_sysid.axis.linear_part import linear_part
from xy_sysid.axis.model import STANDARD
from xy_sysid.cli import run
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.files.models import axis_document, read_models, write_axis_mat, write_axis_models
from xy_sysid.greybox.free_run import GreyboxFit, fit_base, fit_with, prepare
from xy_sysid.imports import save
from xy_sysid.linear.to_others import to_control


@pytest.fixture(scope="module")
def fitted() -> GreyboxFit:
    """Friction and a resonance."""
    data = prepare(2000.0, *recorded("coulomb_friction+screw_compliance", seconds=15.0).axis("x"))
    return fit_with(data, fit_base(data), ["screw_compliance", "coulomb_friction"])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two recordings of an axis with friction; a rigid and a right model of the first, and a linear one."""
    where = tmp_path_factory.mktemp("models")
    save(recorded("x:coulomb_friction", seconds=30.0), where / "rec.npz")
    save(recorded("x:coulomb_friction", seconds=20.0, seed=5, axes=("x", "y")), where / "other.npz")
    rec = str(where / "rec.npz")
    assert run(["refine", rec, "-a", "x", "--add", "coulomb_friction", "--model", str(where / "right.yaml"), "--mat", str(where / "right.mat")]) == 0
    assert run(["refine", rec, "-a", "x", "--add", "constant_load", "--model", str(where / "wrong.yaml")]) == 0
    assert run(["fit", rec, "-a", "x", "--set", "numerator_order=0", "--set", "denominator_order=2", "--model", str(where / "linear.yaml")]) == 0
    return where


def answer(capsys: pytest.CaptureFixture[str], *words: object) -> Any:
    capsys.readouterr()
    assert run([*map(str, words), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_an_axis_model_reloads_bit_for_bit(fitted: GreyboxFit, tmp_path: Path) -> None:
    """Every parameter, the order of effects, and the hash of its data."""
    write_axis_models(tmp_path / "m.yaml", {"y": fitted}, {"data_sha256": {"y": "abc"}})
    back = read_models(tmp_path / "m.yaml", STANDARD)["y"]
    assert isinstance(back, PhysicalModel) and back.model == fitted.model and back.data == ("abc",)
    u, y = recorded("", seconds=5.0, axes=("x", "y")).axis("y")
    assert back.velocity(2000.0, u, y).shape == (len(u) - 1,)


def test_the_linear_part_goes_to_matlab_and_python_control(fitted: GreyboxFit, tmp_path: Path) -> None:
    """Same response, with the parameters."""
    write_axis_mat(tmp_path / "m.mat", {"x": fitted})
    told = loadmat(tmp_path / "m.mat", squeeze_me=True)
    s = 2j * np.pi * 30.0
    response = np.polyval(told["x_num"], s) / np.polyval(told["x_den"], s) * np.exp(-s * float(told["x_delay"]))
    tf = linear_part(fitted.model)
    assert response == pytest.approx(tf.response(np.array([30.0]))[0])
    assert float(told["x_parameters"]["coulomb_friction_coulomb"]) == fitted.parameter("coulomb_friction.coulomb").value
    assert sorted(told["x_effects"].tolist()) == ["coulomb_friction", "screw_compliance"]
    control = pytest.importorskip("control")
    assert control.evalfr(to_control(tf), s) == pytest.approx(tf.response(np.array([30.0]))[0], rel=1e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda part: part.pop("parameters"), "effects as a list and parameters"),
        (lambda part: part["effects"].append("cogging"), "no value of cogging"),
        (lambda part: part["effects"].append("coging"), "cogging"),
        (lambda part: part["parameters"]["coulomb_friction.coulomb"].update(value=-1.0), "coulomb_friction.coulomb is -1.0; allowed: above 0 V"),
    ],
)
def test_a_damaged_file_is_refused_in_one_line(fitted: GreyboxFit, tmp_path: Path, change: Any, words: str) -> None:
    """Missing parameters, unknown effects, impossible values."""
    document = axis_document({"x": fitted}, {})
    change(document["axes"]["x"])
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    with pytest.raises((BadInput, BadRecording), match=words) as caught:
        read_models(tmp_path / "m.yaml", STANDARD)
    assert "\n" not in str(caught.value)


def test_compare_and_validate_take_axis_models(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The right one is at the floor on a held-out recording, the wrong one is not."""
    right = answer(capsys, "compare", folder / "other.npz", folder / "right.yaml", "-a", "x")["axes"]["x"]
    wrong = answer(capsys, "compare", folder / "other.npz", folder / "wrong.yaml", "-a", "x")["axes"]["x"]
    assert right["where"] == [] and right["error"]["now"] < 1.5 * right["error"]["noise_floor"]
    assert wrong["where"] and wrong["error"]["now"] > 5 * wrong["error"]["noise_floor"]
    assert len(right["lines"]["frequency"]) == len(right["lines"]["residual_sigma"]) > 100
    assert right["lines"]["rms_sigma"] < 1.0 and "sigma rms" in right["lines"]["sentence"]
    checked = answer(capsys, "validate", folder / "other.npz", folder / "right.yaml", "-a", "x")
    assert checked["same_data_as_the_fit"] == []
    assert checked["axes"]["x"]["rms_sigma"] < 1.0 and checked["axes"]["x"]["simulation"]["nrmse"] > 98.0
    assert answer(capsys, "validate", folder / "rec.npz", folder / "right.yaml", "-a", "x")["same_data_as_the_fit"] == ["x"]


def test_before_and_after_are_compared_in_pairs(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A linear and an axis model; on the recording of the fit only the last third counts."""
    found = answer(capsys, "compare", folder / "other.npz", "--before", folder / "linear.yaml", "--after", folder / "right.yaml", "-a", "x")["axes"][
        "x"
    ]
    assert found["better"] is True and found["ratio"]["ci95"][1] < 0.3 and found["windows"] >= 9
    assert found["changes"][0]["better"] and found["p"] < 1e-4
    seen = answer(capsys, "compare", folder / "rec.npz", "--before", folder / "linear.yaml", "--after", folder / "right.yaml", "-a", "x")["axes"]["x"]
    assert seen["better"] is True and seen["windows"] >= 5
    assert run(["compare", str(folder / "other.npz"), "--before", str(folder / "linear.yaml")]) == 2
    assert "--before MODEL --after MODEL" in capsys.readouterr().err
    assert run(["compare", str(folder / "other.npz"), str(folder / "right.yaml")]) == 2
    assert "model of axis y is not in" in capsys.readouterr().err
