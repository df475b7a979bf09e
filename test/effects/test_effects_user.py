"""A user's own effect, and the pages about effects."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
import typer
from helpers import ROOT
from scipy.signal import butter, sosfilt
from typer.testing import CliRunner

from campaigns.documents.effects import document
from xy_sysid.axis.model import STANDARD, simulate
from xy_sysid.cli.effects import effects as command
from xy_sysid.effects import EFFECTS
from xy_sysid.effects._binding import law_texts
from xy_sysid.effects._contract import WORDS
from xy_sysid.errors import BadInput
from xy_sysid.files.effects import from_file, library
from xy_sysid.greybox.free_run import fit_base, fit_with, look, prepare

DOCS = ROOT / "docs"
GUIDE = (DOCS / "your-own-effect.md").read_text(encoding="utf-8")
RATE = 2000.0


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of the guide."""
    path = tmp_path_factory.mktemp("own") / "mains_hum.py"
    path.write_text(re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL)[0], encoding="utf-8")
    return path


@pytest.fixture
def app() -> typer.Typer:
    """The command alone."""
    made = typer.Typer()
    made.command()(command)
    return made


def test_the_page_of_effects_is_made_from_the_folder() -> None:
    """python -m campaigns.documents.effects > docs/effects.md"""
    assert (DOCS / "effects.md").read_text(encoding="utf-8") == document()


def test_the_guide_names_every_word_that_a_law_can_use() -> None:
    """The table of the guide is that of the contract."""
    for word, meaning in WORDS.items():
        assert f"| `{word}` | {meaning} |" in GUIDE


def test_the_guides_example_is_simulated_screened_and_fitted(example: Path) -> None:
    """An effect from a file is found among all others and its size recovered to 2 per cent."""
    known = library([example])
    assert set(known.effects) == {*EFFECTS, "mains_hum"}
    random = np.random.default_rng(4)
    n = 40_001
    voltage = sosfilt(butter(4, 300, fs=RATE, output="sos"), random.standard_normal(n)) * 3.0
    still = prepare(RATE, voltage, np.cumsum(random.standard_normal(n)) * 1e-6)
    model = fit_base(still, known).model.__class__(0.097, 1.29e-3, 246.0, library=known).with_effect("mains_hum", (0.5, 0.3))
    velocity = simulate(model, RATE, voltage, np.zeros(n))
    position = np.concatenate(([0.0], np.cumsum(velocity) / RATE)) + 1e-7 * random.standard_normal(n)
    data = prepare(RATE, voltage, position)
    base = fit_base(data, known)
    assert look(data, base, known.acting)[0].effect == "mains_hum"
    better = fit_with(data, base, ["mains_hum"])
    assert base.excess > 0.5
    assert better.excess < 0.05
    assert better.parameter("mains_hum.amplitude").value == pytest.approx(0.5, rel=0.02)


def test_a_file_that_changes_changes_no_effect_that_was_loaded_before(example: Path, tmp_path: Path) -> None:
    """The name of a cached loop depends on the loaded text of the effect file, not on the file's present content."""
    text, files = example.read_text(encoding="utf-8"), [tmp_path / "own.py", tmp_path / "other" / "own.py"]
    files[1].parent.mkdir()
    effects = []
    for file, factor in ((files[0], 1.0), (files[0], 2.0), (files[1], 3.0)):
        file.write_text(text.replace("return amplitude *", f"return {factor} * amplitude *"), encoding="utf-8")
        effects.append(library([file]).effects["mains_hum"])
    for effect, factor in zip(effects, (1.0, 2.0, 3.0), strict=True):
        assert effect.functions["force"](2.0, math.pi / 2.0, 0.0) == 2.0 * factor
        assert [f"return {factor} * amplitude" in source for source in law_texts([effect])] == [True]


def test_a_file_without_an_effect_is_refused_in_one_line(tmp_path: Path) -> None:
    """The error says what to write."""
    empty, broken = tmp_path / "empty.py", tmp_path / "broken.py"
    empty.write_text("x = 1\n", encoding="utf-8")
    broken.write_text("def f(:\n", encoding="utf-8")
    for path, words in ((empty, "EFFECT = Effect"), (broken, "SyntaxError"), (tmp_path / "none.py", "a .py file")):
        with pytest.raises(BadInput, match=words) as caught:
            from_file(path)
        assert "\n" not in str(caught.value)


def test_the_command_lists_every_effect_and_shows_one_in_full(app: typer.Typer, example: Path) -> None:
    """As a table, in full, and as JSON with units; also for the effect of a file."""
    run = CliRunner()
    listed = run.invoke(app, [])
    assert listed.exit_code == 0
    for name in STANDARD.effects:
        assert name in listed.output
    one = run.invoke(app, ["mains_hum", "--effect-file", str(example)])
    assert "amplitude sin(2 pi 50 t + phase)" in one.output
    assert "size of the ripple" in one.output
    told = json.loads(run.invoke(app, ["--json"]).output)["effects"]
    assert told["cogging"]["parameters"]["period"]["unit"] == "m"
    assert told["cogging"]["look_alikes"]
