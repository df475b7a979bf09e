"""The front door: ``import xy_sysid as xy`` from the outside."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import FrozenInstanceError, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import plotly.graph_objects as go
import plotly.io
import pytest

import xy_sysid as xy
from xy_sysid.report.offline import whole

ROOT = Path(__file__).parents[1]
RATE = 500.0


class Column:
    """A column that only has the numpy interface."""

    def __init__(self, values: list[float]) -> None:
        self._values = values

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        return np.array(self._values, dtype=dtype)


def moved(seconds: float, seed: int = 1) -> tuple[Any, Any]:
    """Held noise and the position of a rigid axis (gain 0.1 m/s/V, pole 60 rad/s), exactly stepped, with encoder noise."""
    random = np.random.default_rng(seed)
    u = np.repeat(random.normal(size=int(seconds * RATE / 5)), 5)
    decay, v, x, position = np.exp(-60.0 / RATE), 0.0, 0.0, []
    for volt in u:
        position.append(x)
        x += 0.1 * volt / RATE + (v - 0.1 * volt) * (1 - decay) / 60.0
        v = decay * v + (1 - decay) * 0.1 * volt
    return u, np.array(position) + 1e-6 * random.normal(size=u.size)


def notebook(result: Any) -> Any:
    """Its representation in a notebook."""
    return result._repr_html_()


@pytest.fixture(scope="module")
def run() -> xy.Run:
    return xy.Recording.from_arrays(RATE, *moved(60.0)).run("x")


@pytest.fixture(scope="module")
def model(run: xy.Run) -> xy.LinearModel:
    return xy.fit(xy.frf(run, length=1024, band_high=100.0), numerator_order=0, denominator_order=2, delay=False)


def test_importing_is_quick_quiet_and_needs_no_ros() -> None:
    """Under 0.3 s, without output, and no heavy imports: numpy, numba, plotly, rclpy are imported at first use."""
    code = (
        "import sys, time; begun = time.process_time(); import xy_sysid; took = time.process_time() - begun\n"
        "assert took < 0.3, took\n"
        "heavy = {'numpy', 'scipy', 'numba', 'plotly', 'rclpy', 'typer', 'nicegui', 'pydantic'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_every_public_name_is_there_and_has_a_docstring() -> None:
    """``__all__`` is complete; each item has a docstring; no other names are public."""
    for name in xy.__all__:
        assert getattr(xy, name) is not None, name
        if name != "__version__":
            assert (getattr(xy, name).__doc__ or "").strip(), name
    assert dir(xy) == sorted(xy.__all__)
    with pytest.raises(AttributeError, match="diagnose"):
        _ = xy.diagnos  # type checkers do not follow __getattr__, and people misspell


def test_the_public_names_are_those_of_the_reference() -> None:
    """docs/api.md has exactly one entry for each public name."""
    told = re.findall(r"^::: xy_sysid\.(\w+)$", (ROOT / "docs" / "api.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(told) == sorted(name for name in xy.__all__ if name not in ("__version__", "plot"))


def test_the_type_checker_sees_the_same_names() -> None:
    """For type checkers, every name is imported from the package from which it is loaded at first use."""
    text = (ROOT / "xy_sysid" / "__init__.py").read_text(encoding="utf-8")
    block = text.split("if TYPE_CHECKING:")[1].split("__all__")[0]
    for home, names in xy._HOMES.items():
        line = next(line for line in block.splitlines() if line.strip().startswith(f"from xy_sysid.{home} import "))
        assert sorted(line.split(" import ")[1].split(", ")) == sorted(names)


def test_arrays_become_a_recording_whatever_they_come_in() -> None:
    """Lists, numpy, columns, columns by axis; lengths in mm become m; names are kept."""
    u, y = [0.0, 1.0, 2.0, 1.0], [0.0, 1.0, 3.0, 2.0]
    plain = xy.Recording.from_arrays(RATE, u, y, units=("V", "mm"))
    assert plain.axes == ("x",) and plain.output_unit == "m"
    np.testing.assert_array_equal(plain.run("x").position, 1e-3 * np.array(y))
    column = xy.Recording.from_arrays(RATE, Column(u), Column(y), axes=["b"])
    np.testing.assert_array_equal(column.run("b").voltage, u)
    both = xy.Recording.from_arrays(RATE, {"x": u, "y": y}, {"x": y, "y": u})
    assert both.axes == ("x", "y")
    np.testing.assert_array_equal(both.run("y").voltage, y)
    assert xy.Recording.from_arrays(RATE, np.column_stack([u, y]), np.column_stack([y, u])).axes == ("x", "y")
    u[0] = 99.0
    assert plain.run("x").voltage[0] == 0.0, "what is changed later is not the recording's"


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ((0.0, [1.0], [1.0]), "sampling_rate of xy.Recording.from_arrays is 0.0; allowed: above 0, up to 1000000000 Hz"),
        (("fast", [1.0], [1.0]), "sampling_rate of xy.Recording.from_arrays is str 'fast'; allowed: a number"),
        ((RATE, [1.0, 2.0], [1.0]), r"\(2,\) and \(1,\)"),
        ((RATE, ["a"], [1.0]), "voltage is list that is not an array of numbers"),
        ((RATE, [1.0, float("nan")], [1.0, 2.0]), "voltage is not finite in 1 of 2 values"),
        ((RATE, [], []), "voltage is empty"),
        ((RATE, {"x": [1.0]}, [1.0]), "one by axis and one not"),
        ((RATE, {"x": [1.0]}, {"y": [1.0]}), "position is without axis 'x'"),
    ],
)
def test_arrays_that_are_no_recording_are_refused_in_one_line(values: tuple[Any, ...], words: str) -> None:
    """Value, allowed range, next action."""
    with pytest.raises(xy.BadInput, match=words) as caught:
        xy.Recording.from_arrays(*values)
    assert "\n" not in str(caught.value) and caught.value.act


def test_results_are_frozen_and_say_what_they_are_in_one_line(run: xy.Run, model: xy.LinearModel) -> None:
    """A notebook shows a line, not ten thousand numbers."""
    frf = xy.frf(run, length=1024)
    fails = xy.compare(run, model, length=1024)
    for item in (run, run.recording(), frf, model, fails, xy.validate(run, model, length=1024)):
        assert repr(item).startswith("<") and "\n" not in repr(item) and len(repr(item)) < 500, repr(item)
        field = next(iter(type(item).__dataclass_fields__))
        with pytest.raises(FrozenInstanceError):
            setattr(item, field, None)


def test_a_response_is_fitted_and_the_model_is_the_machine(run: xy.Run, model: xy.LinearModel) -> None:
    """True gain and pole; every check passed; the model has its axis and the hash of its data."""
    assert model.tf.gain == pytest.approx(0.1, rel=0.01)
    assert max(abs(model.tf.poles())) == pytest.approx(60.0, rel=0.02)
    assert model.ok and model.axis == "x" and model.data == (run.digest,)


def test_a_recording_of_several_axes_asks_which_one() -> None:
    """No silent choice."""
    two = xy.Recording.from_arrays(RATE, np.ones((10, 2)), np.ones((10, 2)))
    with pytest.raises(xy.BadInput, match=r"Choose one with .run\(name\): x, y"):
        xy.frf(two)
    with pytest.raises(xy.BadInput, match="ndarray"):
        untyped: Any = np.ones(10)
        xy.frf(untyped)


def test_an_unknown_setting_names_the_nearest(run: xy.Run) -> None:
    """As on the command line."""
    with pytest.raises(xy.BadInput, match="length"):
        xy.frf(run, lenght=1024)


def test_a_model_is_saved_whole_and_replaces_nothing_unasked(model: xy.LinearModel, tmp_path: Path) -> None:
    """The same data bit for bit; a second time only with force; no other files."""
    path = tmp_path / "model.yaml"
    xy.save(model, path)
    back = xy.load_model(path)
    assert isinstance(back, xy.LinearModel) and back.axis == "x" and back.data == model.data
    np.testing.assert_array_equal(back.tf.numerator, model.tf.numerator)
    before = path.read_bytes()
    with pytest.raises(xy.BadInput, match="force=True"):
        xy.save(model, path)
    xy.save(back, path, force=True)
    assert path.read_bytes() != before and xy.load_model(path).data == model.data
    assert [item.name for item in tmp_path.iterdir()] == ["model.yaml"]
    with pytest.raises(xy.BadRecording, match="cannot be written"):
        xy.save(model, tmp_path / "nowhere" / "model.yaml")


def test_a_file_with_several_axes_asks_which_one(model: xy.LinearModel, tmp_path: Path) -> None:
    """By name."""
    xy.save({"x": model, "y": model}, tmp_path / "both.yaml")
    with pytest.raises(xy.BadInput, match="x, y"):
        xy.load_model(tmp_path / "both.yaml")
    assert xy.load_model(tmp_path / "both.yaml", "y").axis == "y"


def test_models_go_to_control_and_scipy_with_the_same_response(model: xy.LinearModel) -> None:
    """The delay as a Pade form."""
    control = pytest.importorskip("control")
    late = replace(model.tf, delay=0.002)
    omega = 2 * np.pi * np.array([1.0, 10.0, 30.0])
    expected = late.response(omega / (2 * np.pi))
    _, theirs = xy.to_scipy(late).freqresp(omega)
    np.testing.assert_allclose(theirs, expected, rtol=1e-4)
    np.testing.assert_allclose(control.frequency_response(xy.to_control(late), omega).complex, expected, rtol=1e-4)
    np.testing.assert_array_equal(xy.to_scipy(model).num, xy.to_scipy(model.tf).num)


def test_a_model_is_made_smaller_with_its_error_said(model: xy.LinearModel) -> None:
    """The rigid axis without its pole: an integrator, within the stated bound of the larger model."""
    small = xy.balanced_truncation(model, 1)
    frequency = np.array([0.5, 2.0, 10.0, 50.0])
    assert small.tf.denominator.size == 2 and small.tf.integrators == 1 and "1 pole," in repr(small)
    assert np.max(np.abs(small.tf.response(frequency) - model.tf.response(frequency))) <= 1.001 * small.bound


def test_what_is_missing_is_added_saved_and_better_on_data_neither_has_seen(tmp_path: Path) -> None:
    """Dry friction: named, the error falls to the floor, the file restores the model, and the paired test says better."""
    first, second, third = (xy.simulate(20, effects=["x:coulomb_friction"], machine="rigid.yaml", seed=seed).run("x") for seed in (1, 2, 3))
    model = xy.fit(xy.frf(first))
    found = xy.diagnose([first, second])
    assert found.verdict == "missing_effect" and "friction" in found.sentence and len(found.runs) == 2
    steps = xy.refine(first)
    errors = [step.held_out_error for step in steps]
    assert steps[0].added is None and errors[-1] < 0.2 * errors[0] and steps[-1].model is steps.model
    assert steps.model.doubt == "" and "rigid" in repr(steps)
    xy.save(steps.model, tmp_path / "axis.yaml")
    back = xy.load_model(tmp_path / "axis.yaml")
    assert isinstance(back, xy.PhysicalModel) and back.model == steps.model.model and back.data == (first.digest,)
    assert xy.better(third, model, back).better is True
    assert xy.better(third, back, model).better is False
    figures = xy.plot.bode(xy.frf(third), model, back), xy.plot.ladder(found), xy.plot.ladder(steps), xy.plot.residual(third, model, back)
    for figure in figures:
        assert len(figure.data) >= 2
    for result, words in ((found, "friction"), (steps, "rigid"), (xy.frf(third), "frequency (Hz)"), (xy.compare(third, model), "noise floor")):
        html = notebook(result)
        assert html.startswith("<p>&lt;") and words in html and "<svg" in html, html[:200]
        assert not re.search(r"(src|href|import)\s*=?\s*[\"'](https?:)?//", html), "an exported notebook asks another host for its picture"
    assert notebook(xy.frf(third).select(slice(0, 0))) is None


def test_a_diagnosis_speaks_in_the_units_of_the_data() -> None:
    """Radians and amperes in texts and data; runs with different units are not combined."""
    u, y = moved(60.0)
    joint = xy.Recording.from_arrays(RATE, u, y, units=("A", "rad")).run("x")
    assert "mrad/s" in xy.diagnose(joint).sentence and "mm/s" not in xy.diagnose(joint).sentence
    with pytest.raises(xy.BadInput, match="units of the runs"):
        xy.diagnose([joint, xy.Recording.from_arrays(RATE, u, y).run("x")])


def test_too_little_data_is_an_answer_and_no_error() -> None:
    """The error names the missing part."""
    still = xy.Recording.from_arrays(RATE, np.ones(2000), np.zeros(2000)).run("x")
    assert xy.diagnose(still).verdict == "not_enough_data"


def test_a_picture_that_is_shown_in_a_notebook_is_kept_without_a_network(run: xy.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """As the last line of a cell and by show(): for the notebook as Plotly's figure, for its export as vectors."""
    kept: list[dict[str, str]] = []
    display = ModuleType("IPython.display")
    monkeypatch.setattr(display, "display", lambda bundle, raw: kept.append(bundle), raising=False)
    monkeypatch.setitem(sys.modules, "IPython", ModuleType("IPython"))
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    monkeypatch.setattr(plotly.io.renderers, "default", "plotly_mimetype")
    figure = xy.plot.coherence(xy.frf(run, length=1024))
    figure.show()
    figure._ipython_display_()
    for bundle in kept:
        assert set(bundle) == {"application/vnd.plotly.v1+json", "text/html"}
        assert "<svg" in bundle["text/html"] and "<script" not in bundle["text/html"]
    assert len(kept) == 2


def test_without_matplotlib_a_picture_of_a_notebook_brings_plotly_along(monkeypatch: pytest.MonkeyPatch) -> None:
    """The figure is drawn by a copy of plotly.js in the output, without a request to another host."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    html = whole(go.Figure(go.Scatter(x=[1.0], y=[1.0])))
    assert "cdn.plot.ly" not in re.sub(r"<script[^>]*>.{100000,}?</script>", "", html, flags=re.DOTALL) and len(html) > 1_000_000
