"""Texts that must stay true: commands of the quick start run, quotations of the FAQ exist, names of topics and settings exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml
from helpers import ROOT
from helpers.cli_tools import cli

from xy_sysid.excitation.drive import Drive
from xy_sysid.files.ros_parameters import NODES
from xy_sysid.settings import AxisExcitation, ExcitationSettings, build, knobs

DOCS = ROOT / "docs"
WORDS = (DOCS / "faq.md", DOCS / "real-machine-safely.md", DOCS / "quick-start.md")


def text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def commands(page: str, heading: str) -> list[list[str]]:
    """The indented xy-sysid lines below a heading, without comments, as words."""
    part = page.split(heading)[1].split("\n## ")[0]
    return [line.split("#")[0].split()[1:] for line in part.splitlines() if line.startswith("    xy-sysid ")]


def test_the_first_five_minutes_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The CSV of the quick start is read; the commands of minute 3 are those of the README and of the report."""
    monkeypatch.chdir(tmp_path)
    page = text(DOCS / "quick-start.md")
    assert [words[0] for words in commands(page, "## Minute 3")] == ["simulate", "diagnose", "report"]
    rows = re.findall(r"^    ([\d.]+,.*|time,.*)$", page, re.MULTILINE)
    assert rows[0].startswith("time,") and len(rows) == 3
    more = [f"{k * 0.0005:.4f},{0.1 * (-1) ** k:.3f},{10 + 0.0001 * k + 0.0002 * (k // 7 % 2):.4f}" for k in range(2, 30_000)]
    (tmp_path / "mine.csv").write_text("\n".join([*rows, *more]) + "\n", encoding="utf-8")
    said = cli("frf", "mine.csv", "--json")
    assert said.code == 0 and said.json["axes"]["x"], said


@pytest.mark.parametrize("quote", re.findall(r"It says[^:]*: `([^`]+)`", text(DOCS / "faq.md")))
def test_what_the_faq_quotes_is_said(quote: str) -> None:
    """Each quotation is in the source, word for word."""
    sources = "\n".join(text(path) for path in (ROOT / "xy_sysid").rglob("*.py"))
    joined = re.sub(r'"\s*\n\s*f?"', "", sources)  # a sentence may span two lines
    assert quote in joined


@pytest.mark.parametrize("path", WORDS, ids=lambda path: path.name)
def test_settings_that_the_words_name_exist(path: Path) -> None:
    """--set NAME=, NAME: value of the identifier, x.NAME of the excitation."""
    page = text(path)
    known = {item.name for settings in NODES.values() for item in knobs(settings())}
    axis = {name.partition(".")[2] for name in known if "." in name} | {"clipped", "braked"}
    for name in re.findall(r"--set (\w+)=", page):
        assert name in known, name
    for name in re.findall(r"\b[xy]\.(\w+)", page):
        assert name in axis, name
    for name in re.findall(r"`(watchdog|patience|ramp|abort_ramp|alarm_\w+|hold|source|frozen)\b", page):
        assert name in known, name


def test_the_sign_test_of_the_safe_start_is_accepted_and_pushes_gently() -> None:
    """The settings to copy from the page are valid, and drive one axis with that voltage and without noise."""
    lines = re.findall(r'^    ("[xy]": \{.*\})$', text(DOCS / "real-machine-safely.md"), re.MULTILINE)
    axes = {axis: build(AxisExcitation, values, axis) for line in lines for axis, values in yaml.safe_load(line).items()}
    assert list(axes) == ["x", "y"]
    drive = Drive(ExcitationSettings(axes=axes))
    drive.start()
    drive.see(drive.zeros(20))
    applied = [drive.next(20).values for _ in range(200)]
    assert abs(applied[-1][:, 0] - 0.3).max() < 1e-9 and not any(block[:, 1].any() for block in applied)
    assert all((block[:, 0] >= 0).all() and (block[:, 0] <= 0.5).all() for block in applied)


def test_every_topic_of_the_nodes_is_in_the_table_of_topics() -> None:
    """The fixed topics of every node are in docs/topics.md."""
    page = text(DOCS / "topics.md")
    sources = "\n".join(text(path) for package in ("xy_sysid/nodes", "xy_sim") for path in (ROOT / package).rglob("*.py"))
    named = set(re.findall(r'(?:create_publisher|create_subscription|Ear)\((?:[\w.]+, )?\w+, f?"([^"]+)"', sources))
    assert {"voltage", "position", "metrics", "reference"} <= named
    for name in named:
        assert f"`{name.replace('{axis}', '<axis>')}`" in page, name


def test_every_topic_of_the_recorder_is_in_the_table_of_topics() -> None:
    """The default topics of the recorder are explained."""
    page = text(DOCS / "topics.md")
    topics = next(item.value for item in knobs(NODES["recorder"]()) if item.name == "topics")
    for name in topics:
        assert f"`{str(name).replace('.*', '<axis>')}`" in page, name
