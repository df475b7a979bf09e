"""No command replaces a file without --force, directly or through a link."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from helpers.cli_tools import RIGID, cli, npz, refused, rigid
from typer.models import ArgumentInfo, OptionInfo
from typer.utils import get_params_from_function

from xy_sysid.cli.app import app
from xy_sysid.imports import save
from xy_sysid.samples.recording import Recording

OLD = b"what was there before"
WRITES = r"write |the page to write|folder of the new bag|new bag|output folder|folder for the files|folder of Parquet files|trajectory_msgs"
QUICK = (*RIGID, "--set", "length=1024")


@pytest.fixture(scope="module")
def rec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """12 s of a rigid axis."""
    return npz(tmp_path_factory.mktemp("rec") / "rec.npz", 12_000)


FILES: dict[str, tuple[str, ...]] = {
    "fit --model": ("fit", "REC", *QUICK, "--model", "OUT"),
    "fit --mat": ("fit", "REC", *QUICK, "--mat", "OUT"),
    "frf --csv": ("frf", "REC", "--csv", "OUT"),
    "refine --model": ("refine", "REC", "--add", "coulomb_friction", "--model", "OUT"),
    "refine --mat": ("refine", "REC", "--add", "coulomb_friction", "--mat", "OUT"),
    "report -o": ("report", "REC", *QUICK, "-o", "OUT"),
    "study -o": ("study", "REC", *QUICK, "-o", "OUT"),
    "simulate --truth": ("simulate", "NEW", "--duration", "1", "--truth", "OUT"),
    "trajectory": ("trajectory", "OUT", "--joint", "pan", "--position", "1", "--speed", "1", "--acceleration", "10", "--seconds", "12"),
    "next -o": ("next", "--for", "nothing", "--voltage", "5", "--travel=-100:100", "-o", "OUT"),
}
REFUSED_AT_ONCE: dict[str, tuple[str, ...]] = {  # the error comes before the work
    "trend -o": ("trend", "NONE", "-o", "OUT"),
    "fleet --one -o": ("fleet", "--one", "NONE", "-o", "OUT"),
}
BAGS: dict[str, tuple[str, ...]] = {
    "simulate": ("simulate", "OUT", "--duration", "1"),
    "simulate, CSV": ("simulate", "OUT.csv", "--duration", "1"),
    "replay --out": ("replay", "NONE", "--out", "OUT"),
    "record": ("record", "OUT"),
}


def words(row: tuple[str, ...], rec: Path, out: Path) -> list[str]:
    """The words of a command with its paths in them."""
    places = {"REC": str(rec), "NEW": str(out.with_name("new.npz")), "NONE": str(rec)}
    return [str(out) + word[3:] if word.startswith("OUT") else places.get(word, word) for word in row]


@pytest.mark.parametrize("name", FILES)
def test_a_file_is_replaced_with_force_only(name: str, rec: Path, tmp_path: Path) -> None:
    """An error before any work, in a line that names --force; with it the file is replaced."""
    out = tmp_path / "out"
    out.write_bytes(OLD)
    assert "add --force to replace it" in refused(*words(FILES[name], rec, out))
    assert out.read_bytes() == OLD and list(tmp_path.iterdir()) == [out]
    assert cli(*words(FILES[name], rec, out), "--force").code == 0
    assert out.read_bytes() != OLD


@pytest.mark.parametrize("name", [*FILES, *REFUSED_AT_ONCE])
def test_a_link_is_followed_with_force_only(name: str, rec: Path, tmp_path: Path) -> None:
    """The error names the target of the link, whether it exists or not."""
    other, link = tmp_path / "elsewhere" / "precious", tmp_path / "out"
    other.parent.mkdir()
    link.symlink_to(other)
    row = (FILES | REFUSED_AT_ONCE)[name]
    assert str(other) in refused(*words(row, rec, link)) and not other.exists()
    other.write_bytes(OLD)
    assert str(other) in refused(*words(row, rec, link)) and other.read_bytes() == OLD


def test_the_files_of_a_model_in_use_do_not_follow_links(rec: Path, tmp_path: Path) -> None:
    """The folder holds many files: each name is checked before any is written."""
    model, out = tmp_path / "model.yaml", tmp_path / "out"
    assert cli("refine", rec, "--add", "coulomb_friction", "--model", model).code == 0
    assert cli("use", model, "--limit", "5", "--to", "c", "-o", out).code == 0
    name, other = sorted(out.iterdir())[0], tmp_path / "precious"
    other.write_bytes(OLD)
    for made in out.iterdir():
        made.unlink()
    name.symlink_to(other)
    assert str(other) in refused("use", model, "--limit", "5", "--to", "c", "-o", out) and other.read_bytes() == OLD


def test_every_option_that_writes_a_file_is_looked_at_here() -> None:
    """A new command must be added to these tables if its help says that an option or argument writes a file."""
    writing = {
        f"{command.name} {parameter.name}"
        for command in app.registered_commands
        for parameter in (get_params_from_function(command.callback) if command.callback is not None else {}).values()
        if isinstance(parameter.default, (OptionInfo, ArgumentInfo)) and re.match(WRITES, parameter.default.help or "") and parameter.name != "to"
    }
    assert writing == {
        *(
            "figures out",
            "fit mat",
            "fit model",
            "fleet out",
            "frf csv",
            "next output",
            "next trajectory",
            "record out",
            "refine mat",
            "refine model",
            "replay out",
        ),
        *("report out", "simulate out", "simulate truth", "study out", "trajectory out", "trend out", "use out"),
    }


@pytest.mark.parametrize("name", BAGS)
def test_a_recording_never_replaces_anything(name: str, rec: Path, tmp_path: Path) -> None:
    """Neither a file nor a broken link."""
    given = words(BAGS[name], rec, tmp_path / "out")
    place = Path(next(word for word in given if word.startswith(str(tmp_path))))
    place.symlink_to(tmp_path / "elsewhere")
    assert "Choose another name" in refused(*given)
    assert place.is_symlink() and not (tmp_path / "elsewhere").exists()


def test_pictures_are_replaced_with_force_only_and_an_axis_leads_into_no_other_folder(tmp_path: Path) -> None:
    """Only files of the drawn axes are checked, not others in the folder. The name of an axis comes from the recording."""
    t, u, y = rigid(12_000).values()
    axis, out = "../../left/wrist", tmp_path / "a" / "b" / "pictures"
    save(Recording(1000.0, (axis,), np.arange(12_000), t, u[:, None], y[:, None]), tmp_path / "bag")
    given = ("figures", tmp_path / "bag", "-o", out, "--kind", "csv")
    out.mkdir(parents=True)
    (out / "notes.csv").write_bytes(OLD)
    assert cli(*given).code == 0
    assert list(out.glob("axis_.._.._left_wrist_*.csv")) and {item.name for item in tmp_path.iterdir()} == {"bag", "a"}
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    assert len(before) > 1 and "add --force to replace it" in refused(*given)
    assert cli(*given, "--force").code == 0
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    picture, other = next(out.glob("axis_*.csv")), tmp_path / "precious"
    picture.unlink()
    picture.symlink_to(other)
    for left in set(out.glob("axis_*.csv")) - {picture}:
        left.unlink()
    assert str(other) in refused(*given) and not other.exists()


def test_what_goes_into_a_pipe_replaces_nothing(rec: Path) -> None:
    """A device always exists, and accepts any output."""
    assert cli("frf", rec, "--csv", "/dev/null").code == 0
