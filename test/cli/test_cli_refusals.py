"""Every mistake a user can make ends with exit code 2 and one line on stderr that says what to do: never a traceback."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.cli_tools import RIGID, cli, npz, refused, rigid, with_one

from xy_sysid.imports import save
from xy_sysid.samples.recording import Recording


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """30 s of a rigid axis."""
    return npz(tmp_path_factory.mktemp("good") / "good.npz")


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """15 s of a rigid axis x as a bag."""
    path = tmp_path_factory.mktemp("bag") / "bag"
    t, u, y = rigid(15_000).values()
    save(Recording(1000.0, ("x",), np.arange(15_000), t, u[:, None], y[:, None]), path)
    return path


@pytest.fixture(scope="module")
def model(good: Path) -> Path:
    """A model file of the recording."""
    path = good.with_name("model.yaml")
    assert cli("fit", good, *RIGID, "--model", path).code == 0
    return path


def test_a_command_that_is_not_there_is_named_with_the_nearest() -> None:
    """No command: the help, and a line. A misspelt one: the nearest spelling."""
    said = cli()
    assert said.code == 2 and "Commands:" in said.out and said.err == "xy-sysid: Give a command, for example xy-sysid demo.\n"
    assert "Did you mean 'simulate'?" in refused("simulat")
    assert "--help" in refused("nonsense")
    assert "Missing argument 'REC'" in refused("fit")
    assert "--model" in refused("fit", "x.npz", "--modle", "m")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--axis q", "q; allowed: x"),
        ("--set lenght=2048", "Did you mean 'length'?"),
        ("--set length", "NAME=VALUE"),
        ("--set length=abc", "valid integer"),
        ("--set length=-4", ">= 16"),
        ("--set length=[1", "valid integer"),
        ("--set length=", "valid integer"),
        ("--set =3", "--set: name"),
        ("--set band_low=nan", "finite"),
        ("--set band_high=inf", "finite"),
        ("--set band_low=400", "below band_high"),
        ("--set window=hahn", "'hann'"),
        ("--set denominator_order=13", "<= 12"),
        ("--set numerator_order=6", "up to denominator_order"),
        ("--set length=1048576", "Record for longer, or shorten the window with --set length="),
        ("--set band_low=600 --set band_high=700", "band is 600 to 700 Hz"),
        ("--span x", "FROM:TO"),
        ("--span 5:1", "FROM < TO"),
        ("--span 1e9:", "within 0 to 29.999 s"),
        ("--span nan:nan", "0 <= start < stop"),
        ("--period abc", "auto, none or a number"),
        ("--period 1", ">= 2"),
        ("--period 99999999", "the longest gap-free run"),
        ("--topic voltage=/v", "A table has columns"),
        ("--effort", "A table has columns"),
        ("--params missing.yaml", "No such file"),
    ],
)
@pytest.mark.parametrize("command", ["fit", "frf"])
def test_a_wrong_option_is_one_line(command: str, options: str, words: str, good: Path) -> None:
    """The value, the allowed values, and the next action, at once, even for huge numbers."""
    assert words in refused(command, good, *options.split(" "))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--method newton", "best, lls, iwls, nlls, ml, nllsfdi"),
        ("--weighting x", "sigma, relative, uniform"),
        ("--domain w", "s, z"),
        ("--held-out 1", "0 to 0.9"),
        ("--held-out -1", "0 to 0.9"),
        ("--held-out nan", "0 to 0.9"),
        ("--held-out x", "valid number"),
        ("--model /no/such/folder/m.yaml", "Make /no/such/folder first"),
        ("--model /", "not a folder"),
        ("--mat /no/such/folder/m.mat", "Make /no/such/folder first"),
    ],
)
def test_a_wrong_option_of_fit_is_one_line(options: str, words: str, good: Path) -> None:
    """The output path is checked before any work."""
    assert words in refused("fit", good, *options.split(" "))
    assert "Make /no/such first" in refused("frf", good, "--csv", "/no/such/x.csv")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"u": lambda d: np.ones_like(d["u"])}, "input of axis x is constant at 1 V"),
        ({"y": lambda d: np.ones_like(d["u"])}, "output of axis x is constant"),
        ({"u": lambda d: np.full_like(d["u"], np.nan)}, "0 samples"),
        ({"t": lambda d: np.full_like(d["u"], np.nan)}, "0 samples"),
        ({"rows": 0}, "0 samples"),
        ({"rows": 1}, "1 samples"),
        ({"rows": 2}, "2 samples"),
        ({"rows": 16}, "17 or more"),
        ({"u": lambda d: with_one(d["u"], np.arange(0, 30_000, 10), np.nan)}, "longest gap-free run is 9 samples"),
        ({"u": lambda d: 1e300 * d["u"]}, "unit"),
        ({"u": lambda d: 1e-300 * d["u"]}, "unit"),
        ({"y": lambda d: 1e300 * d["y"]}, "unit"),
        ({"rate": 0.1}, "some of 2.441e-05 to 0.05 Hz"),
        ({"rate": 1e9}, "some of 2.441e+05 to 5e+08 Hz"),
        ({"u": lambda d: np.array(["a"] * 30_000)}, "not real numbers"),
        ({"u": lambda d: d["u"] + 1j}, "not real numbers"),
        ({"u": lambda d: np.column_stack((d["u"], d["u"]))}, "one column per axis"),
        ({"u": lambda d: d["u"][:-5]}, "one row per sample"),
        ({"t": None}, "fs"),
        ({"t": lambda d: d["t"][::-1]}, "Sort the rows by time"),
        ({"t": lambda d: 0 * d["t"]}, "median time step"),
    ],
)
def test_data_that_carry_no_answer_are_one_line(changes: dict[str, Any], words: str, tmp_path: Path) -> None:
    """No motion, too few data, or impossible numbers: the error names the axis and the reason."""
    assert words in refused("frf", npz(tmp_path / "r.npz", **changes))


def test_a_file_that_is_no_recording_is_one_line(tmp_path: Path) -> None:
    """Missing, empty, garbage, a folder without a bag: each error says so."""
    garbage = np.random.default_rng(1).bytes(2000)
    assert "cannot be read" in refused("fit", tmp_path / "missing.npz")
    assert "not a bag" in refused("fit", tmp_path)
    for ending in ("npz", "mat", "csv", "db3", "mcap"):
        (tmp_path / f"empty.{ending}").touch()
        assert "empty" in refused("fit", tmp_path / f"empty.{ending}")
        (tmp_path / f"garbage.{ending}").write_bytes(garbage)
        assert str(tmp_path / f"garbage.{ending}") in refused("fit", tmp_path / f"garbage.{ending}")
    assert "not a bag" in refused("replay", tmp_path / "garbage.csv")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no parameter file"),
        ("- [\n", "not YAML"),
        ("a: 1\n", "ros__parameters"),
        ("/**/identifier:\n  ros__parameters:\n    lenght: 3\n", "Did you mean 'length'?"),
        ("/**/identifer:\n  ros__parameters:\n    length: 512\n", "Did you mean 'identifier'?"),
        ("/**/identifier:\n  ros__parameters:\n    length: 3\n", ">= 16"),
    ],
)
def test_a_wrong_parameter_file_is_one_line(text: str, words: str, good: Path, tmp_path: Path) -> None:
    """The error in the file, and its place."""
    (tmp_path / "p.yaml").write_text(text)
    assert words in refused("fit", good, "--params", tmp_path / "p.yaml")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"numerator": "abc"}, "lists of numbers"),
        ({"numerator": None}, "plain lists"),
        ({"numerator": 5}, "plain lists"),
        ({"denominator": 5}, "plain lists"),
        ({"numerator": [[1, 2], [3, 4]]}, "plain lists"),
        ({"denominator": [[1, 2], [3, 4]]}, "plain lists"),
        ({"numerator": []}, "not 0"),
        ({"numerator": [0, 0]}, "not 0"),
        ({"denominator": []}, "not begin with 0"),
        ({"denominator": [0, 1]}, "not begin with 0"),
        ({"denominator": [1, float("nan")]}, "finite"),
        ({"numerator": [1, 2, 3, 4, 5, 6]}, "at most as many"),
        ({"numerator": [1e305, 1e305, 1e305]}, "finite in the band"),
        ({"delay_s": -1}, "0 to 1000 s"),
        ({"delay_s": float("inf")}, "0 to 1000 s"),
        ({"delay_s": float("nan")}, "0 to 1000 s"),
        ({"sampling_time_s": 0}, "variable"),
        ({"sampling_time_s": 0, "variable": "z"}, "above 0 s"),
        ({"sampling_time_s": "a"}, "lists of numbers"),
        ({"sampling_time_s": 0.0005, "variable": "z"}, "sampling time of the model is 0.0005 s; allowed: 0.001 s"),
        ({"variable": "z"}, "variable s without a sampling time"),
        ({"input_unit": "A"}, "unit of the model is m/A; allowed: m/V"),
    ],
)
def test_a_wrong_model_file_is_one_line(change: dict[str, Any], words: str, good: Path, model: Path, tmp_path: Path) -> None:
    """Bad numbers, other units and another rate give an error and no comparison."""
    document = yaml.safe_load(model.read_text())
    document["axes"]["x"]["transfer_function"] |= change
    (tmp_path / "m.yaml").write_text(yaml.safe_dump(document))
    assert words in refused("validate", good, tmp_path / "m.yaml")


def test_a_model_file_is_replaced_only_by_force(good: Path, tmp_path: Path) -> None:
    """An error before any work; with --force the file is replaced."""
    path = tmp_path / "mine.yaml"
    path.write_text("of somebody else")
    said = refused("fit", good, *RIGID, "--model", path)
    assert "a name that is not there yet" in said and "--force" in said and path.read_text() == "of somebody else"
    assert cli("fit", good, *RIGID, "--model", path, "--force").code == 0
    assert path.read_text() != "of somebody else"


def test_what_is_no_model_file_is_one_line(good: Path, model: Path, tmp_path: Path) -> None:
    """Another file, other axes, nothing at all."""
    document = yaml.safe_load(model.read_text())
    assert "Missing argument 'MODEL'" in refused("validate", good)
    assert "No such file" in refused("validate", good, tmp_path / "missing.yaml")
    assert "a socket or a folder" in refused("validate", good, tmp_path)
    assert "is not text in UTF-8" in refused("validate", good, good)
    for change in ([1, 2], {**document, "format": "other"}, {**document, "axes": {}}, {**document, "axes": None}, {**document, "axes": {"x": None}}):
        (tmp_path / "m.yaml").write_text(yaml.safe_dump(change))
        assert "xy-sysid fit --model" in refused("validate", good, tmp_path / "m.yaml")
    (tmp_path / "m.yaml").write_text(yaml.safe_dump({**document, "axes": {"q": document["axes"]["x"]}}))
    assert "model of axis x is not in" in refused("validate", good, tmp_path / "m.yaml")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--duration -1", "greater than or equal to 0.01"),
        ("--duration nan", "less than or equal"),
        ("--effect backlsh", "Did you mean 'backlash'?"),
        ("--effect backlash=abc", "a number"),
        ("--effect backlash=-5", "1e-09 to 0.1 m"),
        ("--effect z:backlash=1e-5", "x, y"),
        ("--machine papr", "paper.yaml"),
        ("--hidden 3 --effect backlash", "one of them"),
        ("--hidden -3", "greater than or equal to 0"),
        ("-e rms", "NAME=VALUE"),
        ("-e rmz=2", "Did you mean 'rms'?"),
        ("-e rms=1000", "<= 100"),
        ("-e rms=[1", "valid number"),
        ("-e kind=tone", "'multisine'"),
        ("--truth /no/such/t.json", "Make /no/such first"),
    ],
)
def test_a_wrong_simulation_is_one_line(options: str, words: str, tmp_path: Path) -> None:
    """Nothing is simulated and nothing is written when an option is wrong."""
    assert words in refused("simulate", tmp_path / "out", *options.split(" "))
    assert not list(tmp_path.iterdir())


def test_an_output_that_cannot_be_is_refused_before_the_work(tmp_path: Path) -> None:
    """Existing files are not changed; no folders are created by accident."""
    (tmp_path / "there").write_text("mine")
    assert "a name that is not there yet" in refused("simulate", tmp_path / "there")
    assert "a name that is not there yet" in refused("simulate", tmp_path)
    assert "Make" in refused("simulate", tmp_path / "no" / "such")
    assert "none for a rosbag2 folder" in refused("simulate", tmp_path / "out.txt")
    assert "too long" in refused("simulate", tmp_path / ("n" * 300))
    assert "exists already" in refused("record", tmp_path / "there")
    assert "sqlite3, mcap" in refused("record", tmp_path / "new", "--storage", "csv")
    assert (tmp_path / "there").read_text() == "mine" and len(list(tmp_path.iterdir())) == 1


def test_a_wrong_replay_is_one_line_and_leaves_nothing(bag: Path, tmp_path: Path) -> None:
    """Unknown axis or topic, too little data: no empty bag is left behind."""
    out = tmp_path / "out"
    assert "'q'; allowed: x" in refused("replay", bag, "--axis", "q", "--out", out)
    assert "--topic voltage=NAME" in refused("replay", bag, "--topic", "voltage=/nope", "--out", out)
    assert "not enough samples for one window (15000 paired samples, 16385 needed" in refused("replay", bag, "--set", "length=16384", "--out", out)
    assert "Did you mean 'length'?" in refused("replay", bag, "--set", "lenght=3", "--out", out)
    assert not out.exists()
    assert "exists already" in refused("replay", bag, "--out", tmp_path)


def test_a_whole_file_given_as_a_value_does_not_flood_the_terminal(tmp_path: Path) -> None:
    """An error is one readable line."""
    (tmp_path / "machine.yaml").write_text("words " * 2000)
    assert len(refused("simulate", tmp_path / "out", "--machine", tmp_path / "machine.yaml")) < 900


def test_files_that_cannot_be_written_at_the_last_moment_are_one_line(good: Path) -> None:
    """The message of the system is passed on."""
    said = cli("frf", good, "--csv", "/dev/full")
    assert said.code == 2 and said.err.count("\n") == 1 and "No space left" in said.err
