"""Every command gives the notes of the reader: on stderr for people, in the document for programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.cli_tools import RIGID, cli, npz
from typer.utils import get_params_from_function

from xy_sysid.cli.app import app
from xy_sysid.samples.block import FloatArray

NOTE = "the samples are used as they are, 1000 Hz; the time 't' is not used"
LITTLE, BRIEF = ("--set", "length=512"), ("--budget", "0.3")
READING: dict[str, tuple[str, ...]] = {
    "compare": ("compare", "REC", *LITTLE),
    "compare two": ("compare", "REC", *LITTLE, "--before", "MODEL", "--after", "MODEL"),
    "coupling": ("coupling", "TWO", *LITTLE),
    "diagnose": ("diagnose", "REC", *BRIEF),
    "figures": ("figures", "REC", *BRIEF, "--kind", "csv", "-o", "OUT"),
    "fit": ("fit", "REC", *LITTLE, *RIGID),
    "frf": ("frf", "REC", *LITTLE),
    "next": ("next", "REC", *BRIEF),
    "refine": ("refine", "REC", "--add", "coulomb_friction"),
    "report": ("report", "REC", *LITTLE, *RIGID, *BRIEF, "-o", "OUT"),
    "servo": ("servo", "REC", "--unit", "input=rad", "--unit", "output=rad"),
    "steps": ("steps", "REC"),
    "study": ("study", "REC", *LITTLE, *RIGID, "-o", "OUT"),
    "use": ("use", "MODEL", "--limit", "5", "--on", "REC"),
    "validate": ("validate", "REC", "FIT", *LITTLE),
}


def _beside(values: FloatArray) -> FloatArray:
    """A second axis, which repeats the motion of the first later."""
    return np.column_stack((values, np.roll(values, 1000)))


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """A recording of one axis, one of two, and models of the first."""
    folder = tmp_path_factory.mktemp("noted")
    made = {name: str(folder / file) for name, file in (("MODEL", "model.yaml"), ("FIT", "fit.yaml"))}
    made["REC"] = str(npz(folder / "rec.npz", 6000))
    made["TWO"] = str(npz(folder / "two.npz", 6000, u=lambda one: _beside(one["u"]), y=lambda one: _beside(one["y"])))
    assert cli("refine", made["REC"], "--add", "coulomb_friction", "--model", made["MODEL"]).code == 0
    assert cli("fit", made["REC"], *LITTLE, *RIGID, "--model", made["FIT"]).code == 0
    return made


@pytest.mark.parametrize("name", READING)
def test_the_document_of_a_command_has_the_notes_of_the_reader(name: str, files: dict[str, str], tmp_path: Path) -> None:
    """Once, and without a second note that there is no time."""
    places = {**files, "OUT": str(tmp_path / "out")}
    words = [places.get(word, word) for word in READING[name]]
    said = cli(*words, "--rate", "1000", "--json")
    assert said.code in (0, 1), said.err
    assert "note: " not in said.err
    assert NOTE in str(said.json), said.out[:400]
    assert "there is no time" not in said.out


def test_every_command_that_reads_a_recording_is_looked_at_here() -> None:
    """A new command must be added to the table. The page shows notes itself, and a fleet has a row for each recording."""
    taking = {
        str(command.name)
        for command in app.registered_commands
        if command.callback is not None and "map_" in (options := get_params_from_function(command.callback)) and {"rec", "recs", "on"} & {*options}
    }
    assert taking - {"page"} == {row[0] for row in READING.values()}
