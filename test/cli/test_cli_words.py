"""The text of commands: lines that fit, nothing twice, significant digits by the interval, option names as typed."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.cli_tools import cli, refused

from xy_sysid.cli.output import aside, estimate, people
from xy_sysid.report.words import possible


@pytest.fixture(scope="module")
def dry(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("words") / "dry.npz"
    said = cli("simulate", made, "--machine", "rigid.yaml", "--effect", "coulomb_friction", "--duration", "8")
    assert said.code == 0, said.err
    return made


@pytest.mark.parametrize(
    "words", [("frf",), ("fit",), ("compare",), ("diagnose", "--axis", "x"), ("refine", "--axis", "x", "--auto"), ("columns",), ("effects",)]
)
def test_lines_fit_in_80_columns(dry: Path, words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Sentences are wrapped between words and tables in cells; only the long path of a file may exceed the width."""
    for console in (people, aside):
        monkeypatch.setattr(console, "width", 80)
    command, *options = words
    said = cli(command, *([dry] if command != "effects" else []), *options)
    assert said.code == 0, said.err
    lines = [line for line in (said.out + said.err).splitlines() if str(dry) not in line]
    assert lines and max(len(line) for line in lines) <= 80, [line for line in lines if len(line) > 80]


def test_compare_says_each_place_once(dry: Path) -> None:
    """The places are in the table, and not repeated in the sentence above it."""
    said = cli("compare", dry, "--axis", "x").out
    assert said.count("times the noise floor") == 1 and " ".join(said.split()).count("above twice the floor") == 1


def test_candidates_are_ranked_by_what_each_leaves(dry: Path) -> None:
    """The named effect is first among those with an equal error."""
    lines = cli("diagnose", dry, "--axis", "x").out.splitlines()
    begin = next(k for k, line in enumerate(lines) if line.startswith("effect "))
    rows = [line.split() for line in lines[begin + 1 :]]
    rows = rows[: next(k for k, row in enumerate(rows) if row[0] == "parameter")]
    left = [float(f"{float(row[1]):.2g}") for row in rows]
    assert rows[0][0] == "coulomb_friction" and left == sorted(left)


def test_what_is_judged_one_sample_ahead_takes_no_part_of_a_simulations_error(tmp_path: Path) -> None:
    """Its column has a dash, not 0 %, which would contradict the sentence."""
    made = tmp_path / "gap.npz"
    assert cli("simulate", made, "--machine", "rigid.yaml", "--effect", "backlash", "--duration", "8").code == 0
    said = cli("diagnose", made, "--axis", "x").out
    rows = [line.split() for line in said.splitlines() if "one sample ahead)" in line]
    assert [row[0] for row in rows] == ["backlash"] and rows[0][-1] == "-", said


def test_an_interval_shows_what_it_is_worth() -> None:
    """Two ends are never the same number, and never impossible: a delay or a friction below zero."""
    assert estimate("delay", (0.0016667, 0.00166665, 0.00166675), "s") == ("delay", "1.666700", "1.666650 .. 1.666750", "ms")
    assert estimate("delay", (0.0, -0.153, 0.153), "s")[2].startswith("0 .. 15")
    assert possible("coulomb_friction.coulomb", (0.1, -0.2, 0.4)) == (0.1, 0.0, 0.4)
    assert possible("constant_load.load", (0.1, -0.2, 0.4)) == (0.1, -0.2, 0.4) and possible("pole_1", (1.0, -2.0, 4.0))[1] == -2.0
    assert estimate("gain", (1.0, float("nan"), float("nan")), "V")[1:3] == ("1", "-")
    name, value, span, unit = estimate("numerator_0", (1.57e7, -4.2e6, 3.55e7), "")
    assert (name, unit) == ("numerator_0", "") and value == "1.6e7" and span == "-0.4e7 .. 3.5e7"
    assert estimate("hardening_stiffness.cubic", (2.1e7, 0.0, 4.4e7), "V/m3")[2] == "0 .. 4.4e7"


@pytest.mark.parametrize(("typed", "kind"), [("chirp", "sweep"), ("sine", "stepped_sine"), ("white", "noise"), ("binary", "prbs")])
def test_signals_may_be_called_as_people_call_them(typed: str, kind: str) -> None:
    """The setting keeps the one name."""
    from xy_sysid.settings import AxisExcitation, build

    assert build(AxisExcitation, {"kind": typed}).kind == kind


def test_a_misspelt_choice_names_the_nearest(tmp_path: Path) -> None:
    """As a misspelt name does."""
    assert "Did you mean 'multisine'?" in refused("simulate", tmp_path / "x.npz", "-e", "kind=multsine")
