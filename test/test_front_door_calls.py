"""The public functions as people call them: clear calls work, wrong ones give one line with the right call, and results are tables."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xy_sysid as xy
from xy_sysid import imports as xy_files
from xy_sysid.tables import Table

FUNCTIONS = [name for name in xy.__all__ if inspect.isfunction(getattr(xy, name))]
PICTURES = [name for name in vars(xy.plot) if not name.startswith("_")]
ERRORS = ("BadInput", "BadRecording", "MissingExtra")
CLASSES = [name for name in xy.__all__ if inspect.isclass(getattr(xy, name)) and name != "XySysidError"]
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


@pytest.fixture(scope="module")
def valid(recording: xy.Recording, run: xy.Run, model: xy.LinearModel, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A valid value for each argument that a public call needs, by name, or by owner and name."""
    frf, axis = xy.frf(run), xy.AxisModel(0.1, 1e-3, 50.0).with_effect("coulomb_friction")
    path, found = tmp_path_factory.mktemp("door"), xy.refine(run, add=["coulomb_friction"], auto=False)
    parts = {item.name: getattr(part, item.name) for part in (run, frf, run.recording(), model.tf) for item in fields(part)}
    words = dict.fromkeys(("what", "value", "allowed", "act", "problem", "extra"), "word")
    calls = {"data": run, "model": model, "before": model, "after": model, "response": frf, "frf": frf, "found": found, "path": path / "new"}
    more = {"paths": path, "table": path, "source": path / "frf.csv", "parameter": "gain", "width": 0.1, "order": 2, "tf": model.tf}
    numbers = {"gain": 0.1, "delay": 0.0, "pole": 10.0, "travel": (-1.0, 1.0), "start": 0.0, "number": 0, "where": 0.0, "low": 1.0, "high": 2.0}
    methods = {
        "name": "coulomb_friction",
        "rows": slice(9),
        "lines": slice(9),
        "seconds": 1.0,
        "sample": 1,
        "frequency": np.ones(2),
        "controller": 1.0,
    }
    owned = {
        "Recording.name": "x",
        "Recording.axis": "x",
        "FrequencyResponse.response": frf.response,
        "coupling.data": recording,
        "PhysicalModel.model": axis,
    }
    itself = {
        "Run": run,
        "FrequencyResponse": frf,
        "Recording": run.recording(),
        "TransferFunction": model.tf,
        "LinearModel": model,
        "AxisModel": axis,
    }
    itself |= {"PhysicalModel": xy.PhysicalModel(axis), "MachineLimits": xy.MachineLimits(1.0, (-1.0, 1.0))}
    two = {"Run.voltage": run.voltage, "Run.position": run.position, "MachineLimits.voltage": 10.0, "MachineLimits.motion": None, "itself": itself}
    wide = {f"{owner}.{name}": run.voltage for owner in ("LinearModel", "PhysicalModel") for name in ("voltage", "position")}
    return parts | words | calls | more | numbers | methods | owned | two | wide


def subjects(itself: dict[str, Any]) -> Iterator[tuple[str, str, Any]]:
    """Owner, name and callable of each public function, constructor and method."""
    for name in FUNCTIONS:
        yield name, f"xy.{name}", getattr(xy, name)
    for name in PICTURES:
        yield f"plot.{name}", f"xy.plot.{name}", getattr(xy.plot, name)
    for name in CLASSES:
        kind = getattr(xy, name)
        yield name, f"xy.{name}", kind
        for method, value in vars(kind).items():
            if not method.startswith("_") and (inspect.isfunction(value) or isinstance(value, classmethod)):
                of = (itself[name], name) if inspect.isfunction(value) else (kind, f"xy.{name}")
                yield name, f"{of[1]}.{method}", getattr(of[0], method)


ANYTHING = re.compile(r"Any|object|Callable|Tell|go\.|Client")  # hints of arguments that check themselves, or that no call needs
NO_MATTER_WHAT: list[Any] = [object(), b"bytes", {b"bytes"}, [None], [3, object()], type("Run", (), {})()]
NO_NUMBER: list[Any] = ["x", None, [1.0], np.ones(3), 1j, True, 10**400, np.nan, -1e300]


def test_every_argument_of_every_public_name_is_checked_by_position_and_by_keyword(valid: dict[str, Any]) -> None:
    """Functions, constructors and methods: a wrong type, not a number, or a number out of range is one line that names the argument."""
    walked = set()
    for owner, name, call in subjects(valid["itself"]):
        walked.add(owner)
        signature = inspect.signature(call)
        needed = {item.name for item in signature.parameters.values() if item.default is item.empty and item.kind is item.POSITIONAL_OR_KEYWORD}
        good = {key: valid.get(f"{owner}.{key}", valid.get(key)) for key in signature.parameters if key in needed}
        for key, item in signature.parameters.items():
            hint = str(item.annotation)
            if item.kind in (item.VAR_KEYWORD, item.VAR_POSITIONAL) or ANYTHING.search(hint):
                continue
            wrong = NO_MATTER_WHAT + (
                [one for one in NO_NUMBER if one is not None or "None" not in hint] if hint.split(" |")[0] in ("float", "int") else []
            )
            for value in wrong:
                with pytest.raises(xy.XySysidError) as told:
                    call(**{**good, key: value})
                assert "\n" not in str(told.value) and (isinstance(value, float) or f"{key} of {name}" in str(told.value)), (name, key, value)
                if item.kind is item.POSITIONAL_OR_KEYWORD and key in needed:
                    with pytest.raises(xy.XySysidError):
                        call(*({**good, key: value}[each] for each in good))
        with pytest.raises(xy.XySysidError, match=r"missing|name is|too many"):
            call(**good, no_such_argument=1) if owner not in ERRORS else call()
    assert walked == {*FUNCTIONS, *CLASSES, *(f"plot.{name}" for name in PICTURES)}


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
    xy_files.save(run.recording(), tmp_path / "rec.npz")
    for pair in ((model, tmp_path / "rec.npz"), (tmp_path / "model.yaml", tmp_path / "rec.npz"), (tmp_path / "rec.npz", tmp_path / "model.yaml")):
        assert swapped(*(item if item is model else str(item) for item in pair)).sentence == told


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda door: door.fit(3), "allowed: a FrequencyResponse, a Run, a Recording or a path. Call it as xy.fit(response, ...)."),
        (lambda door: door.save(3), "missing a required argument: 'path'; allowed: xy.save(model, path, ...)"),
        (lambda door: door.diagnose([3]), "data of xy.diagnose is list [3]; allowed: a Run, a Recording, a list of a Run or a Recording or a path."),
        (lambda door: door.plot.ladder("x"), "found of xy.plot.ladder is str 'x'; allowed: an Answer"),
        (lambda door: door.simulate("10"), "duration of xy.simulate is str '10'; allowed: a number."),
        (lambda door: door.fit(np.ones(9), np.ones(9)), "Make a recording of arrays with xy.Recording.from_arrays("),
        (lambda door: door.refine([], "coulomb_friction"), 'Write add=["coulomb_friction"].'),
        (lambda door: door.load("rec.csv", fs=2000), "Did you mean 'rate'?"),
        (lambda door: door.Recording.from_arrays(fs=2000.0, u=[1.0], y=[1.0]), "Did you mean 'sampling_rate'?"),
        (lambda door: door.Recording.from_arrays(2000.0, [1.0], [1.0], units="mm"), "allowed: 2 values (text, text)."),
        (lambda door: door.simulate(bogus=1), "simulate: name is 'bogus'"),
        (lambda door: door.to_control(door.TransferFunction([1.0], [1.0, 2.0]), 10**30), "allowed: 1 to 10."),
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


def test_every_result_prints_a_sentence_and_a_short_table(run: xy.Run, model: xy.LinearModel) -> None:
    """The output of ``print`` for comparisons, checks, paired tests and controllers."""
    axis = xy.PhysicalModel(xy.AxisModel(0.1, 1e-3, 50.0))
    results: list[Any] = [xy.compare(run, axis), xy.validate(run, axis), xy.better(run, axis, model), xy.use(axis, run)]
    for result, head in zip(results, ("place", "quantity", "quantity", "gain"), strict=True):
        sentence, _, table = str(result).partition("\n\n")
        assert sentence in repr(result) and table.startswith(head) and table == str(result.table) and 2 <= len(result.table) <= 20


def test_a_table_goes_to_pandas_markdown_and_latex() -> None:
    """Numbers are numbers in a frame; special characters of other formats are escaped."""
    table = Table(("name", "size (%)"), (("a_b|c", 12.5), ("d", None)))
    frame = table.to_frame()
    assert list(frame.columns) == ["name", "size (%)"] and frame["size (%)"].iloc[0] == 12.5
    assert table.to_markdown().splitlines() == ["| name | size (%) |", "| --- | --- |", "| a_b\\|c | 12.5 |", "| d | - |"]
    assert r"a\_b|c & 12.5 \\" in table.to_latex() and r"size (\%)" in table.to_latex() and r"\begin{tabular}{lr}" in table.to_latex()
    assert str(table).splitlines()[2].split() == ["d", "-"]
    assert "<th>size (%)</th>" in table._repr_html_()
