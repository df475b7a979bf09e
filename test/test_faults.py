"""The short fault campaign, and the judgement and report of outcomes."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers import ROOT

from campaigns.faults.__main__ import main
from campaigns.faults.attack import GOOD, Attack, Found, Row, attacked, judged
from campaigns.faults.groups import GROUPS
from campaigns.faults.report import section, text
from xy_sysid.errors import BadInput

ROWS = [(group, attack) for group in GROUPS for attack in importlib.import_module(f"campaigns.faults.{group}").ATTACKS]
QUICK = [(group, attack) for group, attack in ROWS if attack.short]


@pytest.mark.parametrize(("group", "attack"), QUICK, ids=[f"{group}: {attack.name}" for group, attack in QUICK])
def test_no_attack_finds_a_hole(group: str, attack: Attack, tmp_path: Path) -> None:
    """A few tries of every attack: full, part-and-said, one line, or zero volts within its bound."""
    row = attacked(attack, tmp_path / "attack", short=True)
    if row.counts["skipped"]:
        pytest.skip(row.notes[0])
    assert row.holds, row.bad
    assert sum(row.counts.values()) == sum(row.counts[name] for name in GOOD)


def test_every_row_of_the_page_holds() -> None:
    """docs/faults.md is from a full campaign: it has every attack of every group, and none found a fault."""
    page = (ROOT / "docs" / "faults.md").read_text(encoding="utf-8")
    there = [(group, attack) for group, attack in ROWS if f"\n## {GROUPS[group]}\n" in page]
    assert there
    for group, attack in there:
        assert f"\n| {attack.name} | " in page, f"{group}: {attack.name} is not in docs/faults.md: run make faults"
    for hole in ("\\d silent", "\\d traceback", "\\d too late", "\\d stump", "\\d not told", "nothing tried"):
        assert not re.search(hole, page.partition("\n| attack |")[2]), hole


def test_what_an_attack_finds_is_judged_by_how_it_ends(tmp_path: Path) -> None:
    """One line with an error of the project is acceptable; two lines, another error, silence and an endless try are not."""

    def refused() -> Found:
        raise BadInput("a", 1, "2", "Change it.")

    def broken() -> Found:
        raise KeyError("a")

    def endless() -> Found:
        while True:
            pass

    assert judged(refused, "x").outcome == "one line"
    assert judged(broken, "x").outcome == "traceback" and "KeyError" in judged(broken, "x").note
    assert judged(endless, "x", 0.1).outcome == "too late"
    for outcome in ("silent", "traceback", "too late", "stump", "not told"):
        row = Row("a")
        row.add(Found("full"))
        row.add(Found(outcome, note="seed 3"))
        assert not row.holds and "seed 3" in row.bad[0]
    assert not Row("nothing was tried").holds
    assert attacked(Attack("a", lambda count, folder: [Found("full", seconds=0.5)] * count, 9, 2), tmp_path, True).counts == {"full": 2}


def test_an_attack_that_breaks_is_a_hole_of_its_own_and_ends_no_campaign(tmp_path: Path) -> None:
    """Earlier outcomes are kept, and the row names the failure."""

    def breaks(count: int, folder: Path) -> Iterator[Found]:
        yield Found("full")
        raise OSError("no browser\nanswers")

    row = attacked(Attack("a", breaks, 1, 1), tmp_path, False)
    assert not row.holds and row.counts == {"full": 1, "traceback": 1}
    assert row.bad == [f"traceback: the attack itself: OSError: no browser answers (test_faults.py:{breaks.__code__.co_firstlineno + 2})"]


def test_a_group_that_was_not_run_keeps_its_table() -> None:
    """The other sections of the page are unchanged, in their order."""
    row = Row("jump", bound="60 ms")
    row.add(Found("zero volts", seconds=0.04, travel=0.002))
    page = text({"B": section("B", "words", [row])}, "# old\n\n## A\n\nkept\n\n## B\n\ngone\n", ["A", "B"], "")
    assert page.index("## A\n\nkept") < page.index("| jump | 1 | 1 zero volts | 0.04 s | 2.0 mm | 60 ms |") and "gone" not in page


def test_a_hole_ends_the_campaign_with_an_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 1, and the row says how to repeat it; without a fault: 0."""
    module = importlib.import_module("campaigns.faults.motion")
    for outcome, code in (("silent", 1), ("full", 0)):
        monkeypatch.setattr(module, "ATTACKS", (Attack("a", lambda *_, o=outcome: [Found(o, note="seed 9")], 1, 1),))
        monkeypatch.setattr("sys.argv", ["faults", "motion", "-o", str(tmp_path / "page.md")])
        assert main() == code
        said = capsys.readouterr().err
        assert ("HOLE" in said and "seed 9" in said) == bool(code)
    assert "| a | 1 | 1 full |" in (tmp_path / "page.md").read_text()
