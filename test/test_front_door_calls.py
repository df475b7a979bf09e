"""The public functions as people call them: clear calls work, wrong ones give one line with the right call, and results are tables."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xy_sysid as xy
from xy_sysid.tables import Table

FUNCTIONS = [name for name in xy.__all__ if inspect.isfunction(getattr(xy, name))]
PICTURES = [name for name in vars(xy.plot) if not name.startswith("_")]
WRONG: list[Any] = [3, 2.5, True, b"bytes", {"a": 1}, {1, 2}, [None], [3, "x"], (1.0,), np.arange(4.0), np.array("word"), object(), len, int]


@pytest.fixture(scope="module")
def recording() -> xy.Recording:
    return xy.simulate(12.0, effects=["coulomb_friction"], seed=3)


@pytest.fixture(scope="module")
def run(recording: xy.Recording) -> xy.Run:
    return recording.run("x")


@pytest.fixture(scope="module")
def model(run: xy.Run) -> xy.LinearModel:
    return xy.fit(xy.frf(run), numerator_order=0, denominator_order=2)


def called(name: str) -> Any:
    return getattr(xy, name) if name in FUNCTIONS else getattr(xy.plot, name)


@given(name=st.sampled_from([name for name in [*FUNCTIONS, *PICTURES] if name not in ("simulate", "library")]), data=st.data())
@settings(max_examples=200, deadline=None)
def test_a_wrong_type_anywhere_is_one_line_that_says_the_right_call(name: str, data: Any) -> None:
    """No public function gives a traceback, for any argument: BadInput or another error of ours, in one line."""
    parameters = inspect.signature(called(name)).parameters
    positional = sum(item.kind in (item.POSITIONAL_ONLY, item.POSITIONAL_OR_KEYWORD) for item in parameters.values())
    arguments = data.draw(st.lists(st.sampled_from(WRONG), max_size=positional + 1))
    with pytest.raises(xy.XySysidError) as told:
        called(name)(*arguments)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("paths", [np.arange(4.0), np.array(1.0), {1, 2}, {3: "x.csv"}])
def test_paths_that_are_none_are_refused_in_one_line(paths: Any) -> None:
    """An array, a set or a dictionary of numbers instead of recordings."""
    with pytest.raises(xy.XySysidError, match=r"paths of xy\.fleet"):
        xy.fleet(paths)


def test_a_run_a_recording_or_a_file_is_fitted_as_its_frequency_response_is(run: xy.Run, model: xy.LinearModel, tmp_path: Path) -> None:
    """A clear intention is accepted, with the same numbers."""
    columns = np.column_stack((np.arange(run.voltage.size) / run.sampling_rate, run.voltage, run.position))
    np.savetxt(tmp_path / "rec.csv", columns, delimiter=",", header="time,x_voltage,x_position", comments="", fmt="%.17g")
    orders: dict[str, Any] = {"numerator_order": 0, "denominator_order": 2}
    door: Any = xy
    given: list[Any] = [run, str(tmp_path / "rec.csv"), tmp_path / "rec.csv"]
    for data in given:
        found = xy.fit(data, **orders)
        assert found.tf.denominator == pytest.approx(model.tf.denominator, rel=1e-9)
    frequencies = xy.frf(run)
    lines = np.column_stack((frequencies.frequency, frequencies.response.real, frequencies.response.imag))[frequencies.trusted]
    np.savetxt(tmp_path / "frf.csv", lines, delimiter=",", header="frequency [Hz],real,imag", comments="")
    half = 0.5 / run.sampling_rate  # a file does not say that the input was held: half a sample is delay
    assert door.fit(str(tmp_path / "frf.csv"), **orders).tf.delay == pytest.approx(model.tf.delay + half, abs=2e-5)
    assert door.plot.bode(run, model).data


def test_a_model_and_a_run_may_come_in_either_order_and_from_files(run: xy.Run, model: xy.LinearModel, tmp_path: Path) -> None:
    """compare(model, run) is compare(run, model); both may be paths."""
    xy.save(model, tmp_path / "model.yaml")
    swapped: Any = xy.compare
    told = xy.compare(run, model).sentence
    assert swapped(model, run).sentence == told
    assert swapped(run, str(tmp_path / "model.yaml")).sentence == told


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda door: door.fit(3), "response of xy.fit is int 3; allowed: a FrequencyResponse. Call it as xy.fit(response, ...)."),
        (lambda door: door.save(3), "missing a required argument: 'path'; allowed: xy.save(model, path, ...)"),
        (lambda door: door.diagnose([3]), "data of xy.diagnose is list [3]; allowed: a Run, a Recording or a list of a Run or a Recording."),
        (lambda door: door.plot.ladder("x"), "found of xy.plot.ladder is str 'x'; allowed: an Answer"),
        (lambda door: door.simulate("10"), "duration of xy.simulate is str '10'; allowed: a number."),
    ],
)
def test_the_line_names_argument_value_what_is_allowed_and_the_call(call: Any, words: str) -> None:
    """The message contains the next call."""
    with pytest.raises(xy.BadInput) as told:
        call(xy)
    assert words in str(told.value)


def test_a_model_prints_its_formula_and_its_parameters(model: xy.LinearModel) -> None:
    """Formula with delay, gain and poles with intervals."""
    lines = str(model).splitlines()
    assert any(line.startswith("G(s) = ---") and "exp(-" in line for line in lines)
    assert any(line.split()[:1] == ["gain"] and line.endswith("m/s/V") for line in lines)
    assert any(line.split()[:1] == ["pole_1"] for line in lines)


def test_an_answer_prints_its_sentence_the_falling_error_and_the_parameters(run: xy.Run) -> None:
    """The output of ``print(found)`` in a notebook; ``refine`` prints the same rows."""
    found, refined = xy.diagnose(run), xy.refine(run, add=["coulomb_friction"], auto=False)
    assert str(found).startswith(found.sentence)
    names = [str(row[0]) for row in found.parameters]
    assert [row[0] for row in found.table][:2] == ["rigid", "coulomb_friction"]
    assert any(name.startswith("coulomb_friction.") for name in names)
    assert [row[0] for row in refined.table] == ["rigid", "coulomb_friction"] and str(refined).startswith(str(refined.table))


def test_a_table_goes_to_pandas_markdown_and_latex() -> None:
    """Numbers are numbers in a frame; special characters of other formats are escaped."""
    table = Table(("name", "size (%)"), (("a_b|c", 12.5), ("d", None)))
    frame = table.to_frame()
    assert list(frame.columns) == ["name", "size (%)"] and frame["size (%)"].iloc[0] == 12.5
    assert table.to_markdown().splitlines() == ["| name | size (%) |", "| --- | --- |", "| a_b\\|c | 12.5 |", "| d | - |"]
    assert r"a\_b|c & 12.5 \\" in table.to_latex() and r"size (\%)" in table.to_latex() and r"\begin{tabular}{lr}" in table.to_latex()
    assert str(table).splitlines()[2].split() == ["d", "-"]
    assert "<th>size (%)</th>" in table._repr_html_()
