"""Exports to other tools are equivalent: YAML that reloads, .mat for tf(), python-control with the same response."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.fitting_cases import LINES, RATE, held, paper_machine
from helpers.sampled import discrete
from scipy.io import loadmat

from xy_sysid.errors import BadInput, MissingExtra
from xy_sysid.files import linear_models
from xy_sysid.fitting import Fit, Structure, identify
from xy_sysid.linear.to_others import to_control
from xy_sysid.linear.transfer_function import TransferFunction


@pytest.fixture(scope="module")
def fit() -> Fit:
    """The paper's machine, fitted."""
    return identify(held(paper_machine(), 0.005, seed=1), Structure())


def test_a_model_file_gives_back_the_same_numbers(fit: Fit, tmp_path: Path) -> None:
    """Every bit of every coefficient, the hold, the units, and the hash of its data; y is quoted."""
    path = tmp_path / "m.yaml"
    linear_models.write_model(path, {"x": fit, "y": fit}, {"source": "rec", "data_sha256": {"y": "abc"}})
    assert '"y":' in path.read_text() and "\n  y:" not in path.read_text()
    saved = linear_models.read_saved(path)
    assert set(saved) == {"x", "y"}
    for tf in (saved["x"].tf, saved["y"].tf):
        np.testing.assert_array_equal(tf.numerator, fit.tf.numerator)
        np.testing.assert_array_equal(tf.denominator, fit.tf.denominator)
        assert (tf.delay, tf.sampling_time, tf.input_unit, tf.output_unit) == (fit.tf.delay, None, "V", "m")
    assert (saved["x"].data, saved["y"].data, saved["x"].hold) == ((), ("abc",), "zoh")
    told = yaml.safe_load(path.read_text())["axes"]["x"]
    assert told["estimates"]["delay"]["ci95"][0] < 1.29e-3 < told["estimates"]["delay"]["ci95"][1]
    assert told["band_hz"] == [LINES[0], LINES[-1]] and told["transfer_function"]["variable"] == "s"


def test_a_discrete_model_keeps_its_sampling_time(fit: Fit, tmp_path: Path) -> None:
    """A discrete function is marked as a function of z."""
    z = replace(fit, tf=discrete(fit.tf, RATE))
    linear_models.write_model(tmp_path / "m.yaml", {"x": z}, {})
    back = linear_models.read_saved(tmp_path / "m.yaml")["x"].tf
    assert back.sampling_time == 1 / RATE and "variable: z" in (tmp_path / "m.yaml").read_text().replace('"', "")
    np.testing.assert_allclose(back.response(LINES), z.tf.response(LINES), rtol=1e-12)


def test_a_hold_that_nobody_knows_is_refused(fit: Fit, tmp_path: Path) -> None:
    """Only zoh and none."""
    linear_models.write_model(tmp_path / "m.yaml", {"x": fit}, {})
    told = (tmp_path / "m.yaml").read_text().partition("\n")[2]  # without the checksum: changed on purpose
    (tmp_path / "m.yaml").write_text(told.replace("hold: zoh", "hold: foh"))
    with pytest.raises(BadInput, match="hold is 'foh'; allowed: zoh, none"):
        linear_models.read_saved(tmp_path / "m.yaml")


def test_a_mat_file_is_ready_for_tf(fit: Fit, tmp_path: Path) -> None:
    """tf(x_num, x_den, 'InputDelay', x_delay): rows of falling powers; names valid in MATLAB; with the measured lines."""
    linear_models.write_mat(tmp_path / "m.mat", {"x": fit, "elbow joint": fit, "2": replace(fit, tf=discrete(fit.tf, RATE))})
    content = loadmat(str(tmp_path / "m.mat"))
    for name in ("x", "elbow_joint"):
        assert content[f"{name}_num"].shape == (1, 3) and content[f"{name}_den"].shape == (1, 5)
        np.testing.assert_array_equal(content[f"{name}_den"].ravel(), fit.tf.denominator)
        assert content[f"{name}_delay"].item() == fit.tf.delay and content[f"{name}_Ts"].item() == 0.0
        assert content[f"{name}_units"][0] == "m/V"
    assert content["axis_2_Ts"].item() == 1 / RATE
    np.testing.assert_array_equal(content["x_frf"].ravel(), fit.measured)
    np.testing.assert_array_equal(content["x_freq_hz"].ravel(), fit.frequency)


def control_response(system: Any, frequency: Any) -> Any:
    """The response by python-control."""
    omega = 2 * np.pi * frequency
    return system(np.exp(1j * omega * system.dt)) if system.dt else system(1j * omega)


def test_python_control_computes_the_same_response() -> None:
    """Exact without delay; with a delay as accurate as its Pade form; exact in z with integer samples."""
    pytest.importorskip("control")
    plain, late = paper_machine(0.0), paper_machine()
    np.testing.assert_allclose(control_response(to_control(plain), LINES), plain.response(LINES), rtol=1e-9)
    np.testing.assert_allclose(control_response(to_control(late), LINES), late.response(LINES), rtol=1e-4)
    np.testing.assert_allclose(control_response(to_control(late, 8), LINES), late.response(LINES), rtol=1e-8)
    sampled = discrete(paper_machine(3.2 / RATE), RATE)
    assert sampled.delay == pytest.approx(3 / RATE)
    system = to_control(sampled)
    assert system.dt == 1 / RATE
    np.testing.assert_allclose(control_response(system, LINES), sampled.response(LINES), rtol=1e-6)


def test_python_control_simulates_the_same_step() -> None:
    """The step response of the exported object is that of our own simulation."""
    control = pytest.importorskip("control")
    from xy_sysid.linear.simulate import simulate

    tf = TransferFunction(np.array([3000.0]), np.array([1.0, 12.0, 3000.0]))
    time = np.arange(1000) / RATE
    _, theirs = control.step_response(to_control(tf), time)
    np.testing.assert_allclose(theirs, simulate(tf, RATE, np.ones(1000)), atol=1e-9)


def test_without_python_control_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """The error names the extra to install."""
    monkeypatch.setitem(__import__("sys").modules, "control", None)
    with pytest.raises(MissingExtra, match=r"xy_sysid\[control\]"):
        to_control(paper_machine())
