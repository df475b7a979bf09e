"""A joint in rad with an input in N m: no answer of any command contains a unit of the XY table."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from helpers.cli_tools import cli
from helpers.html_pages import parsed

from xy_sysid.front_door.simulated_recording import simulate
from xy_sysid.imports import save

LENGTHS = re.compile(r"(?<![A-Za-z])(?:[munµ]?m|[mk]?V|N|volts?|(?:milli|micro)?met(?:re|er)s?)(?![A-Za-z])")
SECONDS, SAMPLES = 12.0, ("--set", "length=1024")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A joint with dry friction as CSV and as a bag, and models of it."""
    made = tmp_path_factory.mktemp("joint")
    recording = replace(simulate(SECONDS, effects=["coulomb_friction"], machine="joint.yaml", rms=2.0), input_unit="N m")
    assert recording.units == ("N m", "rad")
    save(recording, made / "joint.csv")
    save(recording, made / "bag")
    cli("fit", made / "joint.csv", *SAMPLES, "--model", made / "linear.yaml")
    cli("refine", made / "joint.csv", "--add", "coulomb_friction", "--model", made / "axis.yaml", "--mat", made / "axis.mat")
    return made


COMMANDS: dict[str, tuple[Any, ...]] = {
    "columns": ("columns", "joint.csv"),
    "frf": ("frf", "joint.csv", *SAMPLES),
    "fit": ("fit", "joint.csv", *SAMPLES),
    "validate a transfer function": ("validate", "joint.csv", "linear.yaml", *SAMPLES),
    "validate an axis": ("validate", "joint.csv", "axis.yaml", *SAMPLES),
    "compare": ("compare", "joint.csv", *SAMPLES),
    "compare an axis": ("compare", "joint.csv", "axis.yaml", *SAMPLES),
    "compare two": ("compare", "joint.csv", "--before", "linear.yaml", "--after", "axis.yaml"),
    "diagnose": ("diagnose", "joint.csv"),
    "refine": ("refine", "joint.csv", "--auto", "--open-loop"),
    "replay": ("replay", "bag", "--diagnose", *SAMPLES),
}


def wrong(text: str) -> list[str]:
    """Each occurrence of a unit of the table, with its context."""
    rest = re.sub(r"\bkg m\^2", "inertia", re.sub(r"\bN[ \u00a0]m\b", "torque", text))
    return [rest[max(found.start() - 40, 0) : found.end() + 20] for found in LENGTHS.finditer(rest)]


def strings(value: Any) -> list[str]:
    """All text of a document that is not a key."""
    if isinstance(value, dict):
        return [text for item in value.values() for text in strings(item)]
    if isinstance(value, list):
        return [text for item in value for text in strings(item)]
    return [value] if isinstance(value, str) else []


def named(folder: Path, arguments: tuple[Any, ...]) -> list[Any]:
    return [folder / item if (folder / str(item)).exists() else item for item in arguments]


@pytest.mark.parametrize("arguments", COMMANDS.values(), ids=COMMANDS.keys())
def test_no_command_names_a_unit_that_is_not_the_joints(folder: Path, arguments: tuple[Any, ...]) -> None:
    """As text and as a document; both contain the joint's own unit."""
    said = cli(*named(folder, arguments))
    document = cli(*named(folder, arguments), "--json")
    assert said.code in (0, 1) and document.code == said.code, said.err
    told = [text.replace(str(folder), "") for text in (said.out, said.err, " | ".join(strings(document.json)))]
    assert [wrong(text) for text in told] == [[], [], []]
    assert "rad" in told[0] and "rad" in told[2]


def test_models_in_files_keep_the_units(folder: Path) -> None:
    """Of both kinds, and again after loading."""
    from xy_sysid import load_model

    for name in ("linear.yaml", "axis.yaml"):
        text = (folder / name).read_text(encoding="utf-8")
        assert wrong(text) == [] and "N m" in text
    assert load_model(folder / "axis.yaml").tf.input_unit == "N m" and load_model(folder / "axis.yaml").tf.output_unit == "rad"


@pytest.mark.parametrize("command", ["report", "study"])
def test_no_page_names_a_unit_that_is_not_the_joints(folder: Path, command: str) -> None:
    """In its text, and in the titles of the axes of its figures."""
    out = folder / f"{command}.html"
    assert cli(command, folder / "joint.csv", *SAMPLES, "-o", out).code == 0
    page = out.read_text(encoding="utf-8")
    titles = re.findall(r'"title":\{"text":"((?:[^"\\]|\\.)*)"', page)
    assert titles and wrong(" ".join(parsed(page).text)) == [] and wrong(" | ".join(titles)) == []


def test_no_figure_names_a_unit_that_is_not_the_joints(folder: Path) -> None:
    """The numbers of every figure, with their column heads."""
    assert cli("figures", folder / "joint.csv", "-o", folder / "figures", "--kind", "csv").code == 0
    heads = {path.name: path.read_text(encoding="utf-8").splitlines()[0] for path in sorted((folder / "figures").glob("*.csv"))}
    assert len(heads) > 5 and {name: wrong(head) for name, head in heads.items() if wrong(head)} == {}


def test_a_unit_that_is_wrong_would_be_seen() -> None:
    """The pattern finds units of the table, and accepts correct ones."""
    assert all(wrong(text) for text in ("3 mm/s", "0.2 V", "m/s/V", "dB re 1 mm/V", "5 um", "2 N", "in volts", "micrometre loops"))
    assert not any(wrong(text) for text in ("3 mrad/s", "0.2 N m", "rad/s/(N m)", "2.3 ms", "12 Hz", "N m/rad"))
