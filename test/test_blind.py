"""A short blind campaign: machines of the other physics code, with hidden base and hidden effects, and what is said of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from blind.cases import EFFECTS, OUTSIDE, Case, sets
from blind.judge import Judged, run
from blind.page import text, with_remarks
from blind.store import add, load

SHORT = 20.0


@cache
def judged(*truth: str, seconds: float = SHORT) -> Judged:
    return run(Case("test", truth, 1, "development", seconds=seconds))


@pytest.mark.parametrize("name", ["coulomb_friction", "dead_zone", "gain_drift", "cogging", "amplifier_lag"])
def test_a_hidden_effect_is_named(name: str) -> None:
    """Alone, first, with confidence, and its held-out error is that of a fit that began at the truth."""
    found = judged(name)
    assert found.right, found
    assert found.effects == (name,)
    assert found.ratio is not None
    assert found.ratio < 1.05


def test_hidden_backlash_is_named_by_one_step_prediction() -> None:
    """The innovation is at most 3.5 times the noise, the gap within 15 per cent."""
    found = judged("backlash")
    assert found.effects == ("backlash",)
    assert found.ratio is not None
    assert found.ratio < 3.5
    assert found.errors["backlash.gap"] < 0.15


def test_a_clean_axis_is_left_in_peace() -> None:
    """Nothing is missing, and that is said."""
    found = judged()
    assert found.verdict == "nothing_missing"
    assert found.right


@pytest.mark.parametrize("name", OUTSIDE[1:])
def test_what_no_hypothesis_describes_is_not_named(name: str) -> None:
    """Not in the library is an answer, too."""
    found = judged(name)
    assert not found.wrong, found


def test_two_effects_are_both_named() -> None:
    """Cogging first, and the amplifier's lag behind it."""
    found = judged("cogging", "amplifier_lag")
    assert set(found.effects) == {"cogging", "amplifier_lag"}, found


def test_development_and_reporting_draws_differ() -> None:
    """No reporting machine was ever seen while tuning."""
    development, reporting = (Case("standard", ("cogging",), 3, draws).machine() for draws in ("development", "reporting"))
    assert development.spec.axes[0].drive != reporting.spec.axes[0].drive
    assert development.spec.axes[0].parts != reporting.spec.axes[0].parts


def test_the_campaign_has_the_promised_cases() -> None:
    """15 effects x 10, none x 20, outside x 20."""
    cases = sets("reporting")["standard"]
    assert len(cases) == 15 * 10 + 20 + 20
    assert {case.truth for case in cases if case.known and case.truth} == {(name,) for name in EFFECTS}


def test_the_page_tells_hits_misses_and_goals() -> None:
    """One hit, one clean axis, one case that was called something else."""
    hit, clean = judged("coulomb_friction"), judged()
    miss = replace(hit, case=replace(hit.case, truth=("dead_zone",)), right=False, first=False, wrong=True)
    page = text({"standard": [hit, clean, miss]}, "development", "python -m blind", "")
    assert "| coulomb_friction | 1 of 1 |" in page
    assert "| dead_zone | 0 of 1 |" in page
    assert "false alarms on clean axes: 0 of 1" in page
    assert "test/dead_zone/1: missing_effect coulomb_friction" in page


def test_a_truth_that_is_named_second_is_not_right_in_the_hard_set() -> None:
    """It is counted beside: named, but not first."""
    hit = judged("coulomb_friction")
    second = replace(hit, case=replace(hit.case, group="hard"), effects=("backlash", "coulomb_friction"), right=True, first=False)
    page = text({"hard": [second, hit]}, "development", "python -m blind", "")
    assert "| 1 of 2 (50 %) | >= 95 % | 1 | 2 |" in page
    assert "hard/coulomb_friction/1: missing_effect backlash + coulomb_friction" in page


def test_a_campaign_can_be_stopped_and_gone_on_with(tmp_path: Path) -> None:
    """What was judged is read back the same; a line that a kill cut off is left out."""
    items = [judged("coulomb_friction"), judged()]
    for item in items:
        add(tmp_path / "kept", item)
    with (tmp_path / "kept").open("a") as file:
        file.write('{"case": {"gro')
    assert load(tmp_path / "kept") == {item.case: item for item in items}
    assert load(tmp_path / "none") == {}


def test_remarks_outlive_the_next_campaign() -> None:
    """What people wrote below the last heading stays."""
    old = "# Blind\n\nold\n\n## Remarks\n\nwritten\n"
    assert with_remarks("# Blind\n\nnew\n", old) == "# Blind\n\nnew\n\n## Remarks\n\nwritten\n"
    assert with_remarks("new\n", "old\n") == "new\n"
