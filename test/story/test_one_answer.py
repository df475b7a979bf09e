"""One recording, one answer: command, report and page agree, also for a recording with a gap."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.cli_tools import cli, refused
from helpers.simulated import recorded

from xy_sysid.errors import BadInput
from xy_sysid.page.orders import Order, OrderKind, Reading, WorkerNews
from xy_sysid.page.worker import Desk

SAID = ("verdict", "effects", "sentence", "runner_up", "look_alikes", "next_experiment", "stopped", "refused")


@cache
def gapped() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, voltage and position of an axis with friction and cogging; three quarters of a second are lost after 11 s."""
    whole = recorded("coulomb_friction+cogging", seconds=24.0)
    voltage, position = whole.axis("x")
    kept = np.ones(voltage.size, dtype=np.bool_)
    kept[22_000:23_500] = False
    return np.arange(voltage.size)[kept] / whole.sampling_rate, voltage[kept], position[kept]


@pytest.fixture(scope="module")
def rec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("gap") / "gap.npz"
    time, voltage, position = gapped()
    np.savez(path, time=time, voltage=voltage, position=position)
    return path


@pytest.fixture(scope="module")
def command(rec: Path) -> dict[str, Any]:
    """The document of ``diagnose --json``."""
    found: dict[str, Any] = cli("diagnose", rec, "--json").json["axes"]["x"]
    return found


def of_page(rec: Path, *acts: OrderKind) -> list[dict[str, Any]]:
    """The stories of a page, in sequence."""
    news: list[WorkerNews] = []
    desk = Desk(rec, Reading(), news.append)
    for number, act in enumerate(acts):
        desk.do(Order(number, act, "x"))
    return [item.content for item in news if item.kind == "story"]


def says_the_same(story: dict[str, Any], command: dict[str, Any]) -> bool:
    """Assert equal words, and equal numbers to the digits of a story."""
    assert {name: story[name] for name in SAID} == {name: command[name] for name in SAID}
    for item, other in zip((story, *story["candidates"], *story["where"]), (command, *command["candidates"], *command["where"]), strict=True):
        numbers = {name: value for name, value in other.items() if isinstance(value, float) and name != "tolerance"}
        assert numbers and {name: item[name] for name in numbers} == pytest.approx(numbers, rel=1e-3)
    return True


def test_the_command_uses_both_stretches(command: dict[str, Any]) -> None:
    assert set(command["effects"]) == {"coulomb_friction", "cogging"}


def test_the_page_says_what_the_command_says(rec: Path, command: dict[str, Any]) -> None:
    """The diagnosis and the final model use all stretches; the ladder never rises, and is that of ``refine --auto``."""
    story = of_page(rec, "diagnose", "auto")[-1]
    assert says_the_same(story, command)
    assert story["seconds"] == pytest.approx(24.0 - 0.75, abs=0.01)
    assert story["error"]["held_out"] == pytest.approx(command["error"]["held_out"], rel=1e-4)
    ladder = cli("refine", rec, "--auto", "--json").json["axes"]["x"]["ladder"]
    errors = [row["held_out_error"] for row in story["ladder"]]
    assert errors == pytest.approx([row["held_out_error"] for row in ladder], rel=1e-4)
    assert errors == sorted(errors, reverse=True) and len(errors) >= 2


def test_the_report_says_what_the_command_says(rec: Path, command: dict[str, Any], tmp_path: Path) -> None:
    """The story has the same number of seconds."""
    story = cli("report", rec, "-o", tmp_path / "report.html", "--json").json["axes"]["x"]["story"]
    assert says_the_same(story, command)
    assert story["seconds"] == pytest.approx(24.0 - 0.75, abs=0.01)


def test_what_is_left_out_is_said_everywhere(tmp_path: Path) -> None:
    """Rests without a drive at both ends, and a stretch between gaps that is far shorter than the others."""
    whole = recorded("coulomb_friction", seconds=12.0)
    voltage, position = (
        np.concatenate([values, np.full(8000, last)]) for values, last in zip(whole.axis("x"), (0.0, whole.position[-1, 0]), strict=True)
    )
    kept = np.ones(voltage.size, dtype=np.bool_)
    kept[[*range(3000, 3200), *range(4200, 4400)]] = False
    path = tmp_path / "rests.npz"
    np.savez(path, time=np.arange(voltage.size)[kept] / 2000.0, voltage=voltage[kept], position=position[kept])
    said = r"left out (3|3\.\d+|2\.\d+) s at the ends, where it is not driven and stands and 2 short stretches between gaps, 2 s"
    assert re.search(f"axis x: {said}", cli("diagnose", path).out.replace("\n", " "))
    for command in (["diagnose", path], ["refine", path, "--auto"]):
        assert any(re.search(f"axis x: {said}", note) for note in cli(*command, "--json").json["notes"])
    news: list[WorkerNews] = []
    Desk(path, Reading(), news.append)
    opened = next(item.content for item in news if item.kind == "opened")
    assert any(re.search(f"axis x: {said}", note) for note in opened["notes"])
    cli("report", path, "-o", tmp_path / "rests.html")
    assert re.search(f"Axis x: {said}", (tmp_path / "rests.html").read_text(encoding="utf-8"))


def test_one_move_tells_nothing_anywhere(tmp_path: Path) -> None:
    """The command refuses it; page and report give the same reason, and name no effect."""
    time = np.arange(3000) / 500.0
    way = 0.05 * np.clip((time - 2.0) / 2.0, 0.0, 1.0)
    position = way - 0.05 / (2.0 * np.pi) * np.sin(2.0 * np.pi * way / 0.05)
    voltage = np.gradient(position, time) / 0.1 + 1e-2 * np.random.default_rng(1).normal(size=time.size)
    path = tmp_path / "move.npz"
    np.savez(path, time=time, voltage=voltage, position=position)
    why = "one move in one direction, from rest to rest"
    assert why in refused("diagnose", path)
    with pytest.raises(BadInput, match=why):
        of_page(path, "diagnose")
    said = cli("report", path, "-o", tmp_path / "report.html", "--json").json["axes"]["x"]
    assert said["story"] is None and why in str(said)


@pytest.fixture(scope="module")
def loose(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """12 s of an axis with backlash, of which half a second is lost."""
    voltage, position = recorded("backlash", seconds=12.0).axis("x")
    kept = np.ones(voltage.size, dtype=np.bool_)
    kept[10_000:11_000] = False
    path = tmp_path_factory.mktemp("loose") / "loose.npz"
    np.savez(path, time=np.arange(voltage.size)[kept] / 2000.0, voltage=voltage[kept], position=position[kept])
    return path


ALONE = "This is about the longest stretch alone, 6.5 s, as backlash needs one without a gap."


def test_backlash_beside_a_gap_is_one_answer_too(loose: Path, tmp_path: Path) -> None:
    """All are about the longest stretch, and say so; on the page the story is told again of that stretch."""
    command = cli("diagnose", loose, "--json").json["axes"]["x"]
    assert command["effects"] == ["backlash"] and ALONE in command["sentence"]
    refined = cli("refine", loose, "--auto", "--json").json
    assert refined["axes"]["x"]["effects"] == ["backlash"] and f"axis x: {ALONE}" in refined["notes"]
    first, last = (of_page(loose, "begin", "diagnose", "auto")[k] for k in (0, -1))
    assert says_the_same(last, command) and (first["seconds"], last["seconds"]) == (11.5, 6.5)
    assert last["model"]["effects"] == ["backlash"] and last["explained"] and not first["explained"]
    written = cli("report", loose, "-o", tmp_path / "loose.html", "--json").json["axes"]["x"]
    assert written["story"]["sentence"] == command["sentence"] and written["story"]["ladder"] == last["ladder"]


def test_backlash_that_is_asked_for_is_fitted_to_the_longest_stretch(loose: Path, rec: Path) -> None:
    """By the command and on the page, where the effects that the model has are fitted to that stretch again."""
    found = cli("refine", loose, "--add", "backlash", "--json").json
    assert [rung["added"] for rung in found["axes"]["x"]["ladder"]] == [None, "backlash"] and f"axis x: {ALONE}" in found["notes"]
    news: list[WorkerNews] = []
    desk = Desk(rec, Reading(), news.append)
    for number, name in enumerate(("coulomb_friction", "backlash")):
        desk.do(Order(number, "add", "x", name))
    story = [item.content for item in news if item.kind == "story"][-1]
    assert [row["added"] for row in story["ladder"]] == [None, "coulomb_friction", "backlash"]
    assert story["seconds"] == pytest.approx(12.25) and "longest stretch alone, 12.2 s, as backlash" in story["note"]


def test_where_nothing_is_left_no_backlash_is_missed(command: dict[str, Any]) -> None:
    """With the two effects the error is at the noise floor."""
    assert "not tried" not in command["sentence"]
