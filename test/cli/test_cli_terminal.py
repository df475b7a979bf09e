"""No text from a file or another program can control the user's terminal."""

from __future__ import annotations

import re
import unicodedata
from pathlib import Path

import numpy as np
import pytest
from helpers import ROOT
from helpers.cli_tools import RIGID, Said, cli, npz, rigid

from xy_sysid.imports import save
from xy_sysid.samples.recording import Recording

TITLE, RED, RING, BACK, CSI, TURNED = "\x1b]0;mine\x07", "\x1b[31m", "\x07", "\x08\x08\x08", "\x9b2J", "\u202e"
HOSTILE = f"{TITLE}{RED}{RING}{BACK}\x7f{CSI}{TURNED}"


def steers(text: str) -> set[str]:
    """The control characters of a text."""
    return {sign for sign in text if sign != "\n" and unicodedata.category(sign) in ("Cc", "Cf", "Zl", "Zp")}


def shown(said: Said) -> str:
    """All output, without control characters."""
    assert not steers(said.out + said.err), repr(said.out + said.err)
    return said.out + said.err


@pytest.fixture(scope="module")
def sheet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """30 s of a rigid axis in a table with control characters in the names of its columns."""
    path = tmp_path_factory.mktemp("sheet") / "sheet.csv"
    names = ",".join(["time", f"u{HOSTILE}", f"y{HOSTILE} [m]", f"note{HOSTILE}"])
    rows = np.column_stack((*rigid(30_000).values(), np.ones(30_000)))
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=names, comments="")
    return path


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """15 s of a bag with such a name of its axis."""
    path = tmp_path_factory.mktemp("bag") / "bag"
    t, u, y = rigid(15_000).values()
    save(Recording(1000.0, (f"x{HOSTILE}",), np.arange(15_000), t, u[:, None], y[:, None]), path)
    return path


@pytest.mark.parametrize(
    "options",
    [
        ("columns",),
        ("frf",),
        ("frf", "--axis", "none"),
        ("frf", "--map", "time=time,input=2,output=3"),
        ("frf", "--map", f"time=time,input={HOSTILE},output=3"),
        ("fit", *RIGID, "--map", "time=time,input=2,output=3"),
    ],
    ids=" ".join,
)
def test_the_name_of_a_column_cannot_steer_the_terminal(sheet: Path, options: tuple[str, ...]) -> None:
    """Tables, notes, sentences and errors show each character visibly."""
    assert shown(cli(options[0], sheet, *options[1:]))


def test_the_name_of_an_axis_in_a_bag_cannot_steer_the_terminal(bag: Path) -> None:
    """Also for a recording from the network: each answer shows the name of the axis visibly."""
    for command in (("columns", bag), ("frf", bag), ("fit", bag, *RIGID), ("replay", bag, *RIGID), ("replay", bag, "--axis", "none")):
        assert "␛]0;mine" in shown(cli(*command)), command


def test_the_name_of_a_file_cannot_steer_the_terminal(tmp_path: Path) -> None:
    """Names of existing and of missing files."""
    path = npz(tmp_path / f"a{HOSTILE}.npz", 8_000)
    assert "␛]0;mine" in shown(cli("columns", path))
    assert "␛]0;mine" in shown(cli("fit", path.with_name(f"none{HOSTILE}.npz")))


def test_a_model_file_cannot_steer_the_terminal(tmp_path: Path) -> None:
    """Its text is repeated in errors."""
    model = tmp_path / "model.yaml"
    model.write_text('format: "xy_sysid \\e[31m"\naxes: {"x\\e[31m": {}}\n', encoding="utf-8")
    good = npz(tmp_path / "good.npz", 8_000)
    shown(cli("validate", good, model))
    model.write_text('format: "xy_sysid linear model 1"\naxes: {"x\\e[31m": {"hold": "\\e[31m"}}\n', encoding="utf-8")
    shown(cli("validate", good, model))


def test_every_text_for_a_terminal_is_made_harmless() -> None:
    """Each direct write to stdout or stderr uses ``printable``, or is in this table: JSON, or a text of the project's own."""
    bold = {
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for path in (ROOT / "xy_sysid").rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if re.search(r"sys\.(stdout|stderr)\.write\(|^\s+print\(", line) and "printable(" not in line
    }
    assert bold == {
        "xy_sysid/__init__.py: print(step.added, step.held_out_error)",  # an example in a docstring
        'xy_sysid/cli/output.py: sys.stdout.write(json.dumps(plain(document), allow_nan=False) + "\\n")',
    }
