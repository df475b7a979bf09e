"""A short blind campaign: machines of the independent physics code, with hidden base and effects, and their diagnosis."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from campaigns.blind import judge
from campaigns.blind.__main__ import main
from campaigns.blind.cases import EFFECTS, OUTSIDE, Case, _dirt, sets
from campaigns.blind.dirt import DIRT, FEWEST, MOST, change, moved
from campaigns.blind.foreign import foreign as foreign_sets
from campaigns.blind.judge import Judged, run
from campaigns.blind.page import hit, text, with_remarks
from campaigns.blind.recordings import Recorded, Seen, file_name, recorded
from campaigns.blind.store import add, load
from xy_sysid.axis.model import STANDARD

SHORT = 20.0
OLD_COGGING = {"amplitude": 0.391866894694146, "per_revolution": 6.0, "phase": 0.6869931843997854}
OLD_PAIRS = [("gain_drift", "base_resonance"), ("hardening_stiffness", "coulomb_friction"), ("stribeck_friction", "lead_error")]


@cache
def drawn(case: Case, folder: Path | None = None) -> Recorded:
    """Each recording once."""
    return recorded(case, folder)


@cache
def judged(*truth: str, seconds: float = SHORT) -> Judged:
    return run(Case("test", truth, 1, "development", seconds=seconds))


@pytest.mark.parametrize("name", ["coulomb_friction", "dead_zone", "gain_drift", "cogging", "amplifier_lag"])
def test_a_hidden_effect_is_named(name: str) -> None:
    """Alone, first, with confidence, and its held-out error is that of a fit started at the truth."""
    found = judged(name)
    assert found.right, found
    assert found.effects == (name,)
    assert found.ratio is not None
    assert found.ratio < 1.05


def test_hidden_backlash_is_named_by_one_step_prediction() -> None:
    """The innovation is at most 3.5 times the noise, the gap within 15 %."""
    found = judged("backlash")
    assert found.effects == ("backlash",)
    assert found.ratio is not None
    assert found.ratio < 3.5
    assert found.errors["backlash.gap"] < 0.15


def test_a_clean_axis_is_left_in_peace() -> None:
    """Nothing is missing, and the answer says so."""
    found = judged()
    assert found.verdict == "nothing_missing"
    assert found.right


@pytest.mark.parametrize("name", OUTSIDE[1:])
def test_what_no_hypothesis_describes_is_not_named(name: str) -> None:
    """Not in the library is a valid answer."""
    found = judged(name, seconds=10.0)
    assert not found.wrong, found


def test_two_effects_are_both_named() -> None:
    """In either order."""
    found = judged("cogging", "coulomb_friction", seconds=10.0)
    assert set(found.effects) == {"cogging", "coulomb_friction"} and found.right, found


def test_development_and_reporting_draws_differ() -> None:
    """Reporting draws are different from development draws."""
    development, reporting = (Case("standard", ("cogging",), 3, draws).machine() for draws in ("development", "reporting"))
    assert development.spec.axes[0].drive != reporting.spec.axes[0].drive
    assert development.spec.axes[0].parts != reporting.spec.axes[0].parts


def test_the_campaign_has_the_promised_cases() -> None:
    """Exact: 15 effects x 10, none x 20, outside x 20; each amount of dirt 15 x 10; 30 with dirt alone; 30 outside; 90 coarse."""
    found = sets("reporting")
    assert len(found["exact"]) == 15 * 10 + 20 + 20
    assert {case.truth for case in found["exact"] if case.known and case.truth} == {(name,) for name in EFFECTS}
    for name, amount in (("imperfect 0.2 %", 0.002), ("imperfect 1 %", 0.01), ("imperfect 3 %", 0.03)):
        assert [case.truth for case in found[name]] == [(effect,) for effect in EFFECTS for _ in range(10)]
        assert {case.dirt for case in found[name]} == {amount}
    assert Counter(case.dirt for case in found["clean dirt"]) == {0.002: 10, 0.01: 10, 0.03: 10}
    assert len(found["outside"]) == 30 and not any(case.known for case in found["outside"])
    assert {case.dirt for case in found["outside"]} == {0.0, 0.002, 0.01, 0.03}
    assert len(found["first order"]) == 90 and all(case.coarse and not case.dirt for case in found["first order"])
    assert {len(case.truth) for case in found["1 % two effects"]} == {2} and {case.dirt for case in found["1 % two effects"]} == {0.01}


def test_draws_of_the_exact_sets_are_those_of_earlier_campaigns() -> None:
    """Truth, sizes and excitation come from the same random numbers as before there was dirt."""
    parts = Case("standard", ("cogging",), 3, "development").machine().spec.axes[0].parts
    assert parts["cogging"] == pytest.approx(OLD_COGGING)
    assert [case.truth for case in sets("reporting")["two effects"]][:3] == OLD_PAIRS


@pytest.mark.parametrize("amount", [0.002, 0.01, 0.03])
@pytest.mark.parametrize("number", [0, 1, 2, 3])
def test_dirt_changes_the_motion_by_what_was_asked_for(amount: float, number: int) -> None:
    """Within a tenth, on the axis without the effect, with its fine steps and the voltage of the case."""
    case = Case("test dirt", ("coulomb_friction",), number, "development", seconds=6.0, dirt=amount)
    machine = case.machine()
    assert FEWEST <= len(case.kinds) <= MOST and set(case.kinds) <= set(DIRT)
    voltage = case.record()[1].voltage[:, 0]
    without = machine.with_parts({"coulomb_friction": False})
    clean = without.with_parts(dict.fromkeys(case.kinds, False))
    assert change(moved(clean, voltage), moved(without, voltage), case.rate) == pytest.approx(amount, rel=0.1)
    assert case.dirt_reached == pytest.approx(amount, rel=0.1)


def test_dirt_is_the_same_again_and_another_on_every_axis() -> None:
    """Determined by the case alone; development and reporting draws differ; without the dirt the axis is the same."""
    case = Case("test dirt", (), 1, "development", seconds=5.0, dirt=0.01)
    again, other = (replace(case, number=number).machine().spec.axes[0].parts for number in (1, 2))
    first = case.machine().spec.axes[0].parts
    _dirt.cache_clear()
    assert case.machine().spec.axes[0].parts == again == first
    assert first != other
    assert replace(case, draws="reporting").kinds != case.kinds or replace(case, draws="reporting").machine().spec != case.machine().spec
    assert replace(case, dirt=0.0).machine().spec == case.exact().spec


def test_a_recording_is_simulated_once(tmp_path: Path) -> None:
    """The second time it is read from the folder, bit for bit, with its visibility; a damaged file is replaced."""
    case = Case("test dirt", ("constant_load",), 1, "development", seconds=5.0, dirt=0.01)
    first = recorded(case, tmp_path)
    path = tmp_path / file_name(case)
    stamp = path.stat().st_mtime_ns
    second = recorded(case, tmp_path)
    assert path.stat().st_mtime_ns == stamp
    assert np.array_equal(first.voltage, second.voltage) and np.array_equal(first.position, second.position)
    assert first.seen == second.seen and first.rate == second.rate == 2000.0
    assert np.array_equal(first.position[:, None], case.record()[1].position)
    path.write_bytes(path.read_bytes()[:1000])
    assert np.array_equal(recorded(case, tmp_path).position, first.position)
    assert path.stat().st_size > 1000
    assert file_name(replace(case, number=2)) != file_name(case) != file_name(replace(case, dirt=0.03))


def test_it_is_known_how_much_of_the_motion_is_due_to_what() -> None:
    """An effect at a tenth of its size changes the motion by about a tenth; without dirt and effect there is only noise."""
    whole, tenth = (recorded(Case("test", ("constant_load",), 1, "development", seconds=5.0, size=size)).seen for size in (1.0, 0.1))
    assert tenth.change["constant_load"] == pytest.approx(0.1 * whole.change["constant_load"], rel=0.05)
    assert (whole.dirt, whole.kinds) == (0.0, ())
    assert 1e-3 < whole.noise < 0.1
    hit = judged("coulomb_friction")
    assert hit.change["coulomb_friction"] > 0.05 and not hit.hidden
    assert replace(hit, change={"coulomb_friction": 1e-5}).hidden


def verdict(*effects: str, confidence: float = 1.0, kind: str = "missing_effect", could_hide: float = 0.0) -> SimpleNamespace:
    """A diagnosis without its evidence."""
    return SimpleNamespace(verdict=kind, effects=effects, confidence=confidence, rungs=(), could_hide=could_hide)


@pytest.mark.parametrize(
    ("truth", "said", "phantoms", "right"),
    [
        (("coulomb_friction",), ("coulomb_friction",), (), True),
        (("coulomb_friction",), ("coulomb_friction", "backlash"), ("backlash",), False),
        (("coulomb_friction",), ("stribeck_friction",), ("stribeck_friction",), False),
        (("stribeck_friction",), ("coulomb_friction",), (), False),
        (("coulomb_friction",), ("asymmetric_friction",), ("asymmetric_friction",), False),
        (("asymmetric_friction",), ("coulomb_friction", "constant_load"), (), True),
        (("coulomb_friction", "constant_load"), ("asymmetric_friction",), (), True),
        (("coulomb_friction", "constant_load"), ("asymmetric_friction", "dead_zone"), ("dead_zone",), True),
        (("cogging", "saturation"), ("cogging",), (), False),
        (("thermal_viscosity",), ("coulomb_friction",), ("coulomb_friction",), False),
        ((), ("cogging",), ("cogging",), False),
    ],
)
def test_a_phantom_is_a_name_of_what_is_not_on_the_axis(
    truth: tuple[str, ...], said: tuple[str, ...], phantoms: tuple[str, ...], right: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By law, at any place, also together with the truth; it counts from a confidence of 0.9 on."""
    monkeypatch.setattr(judge, "recorded", drawn)
    monkeypatch.setattr(judge, "diagnose", lambda *_, **__: verdict(*said))
    found = run(Case("test", truth, 1, "development", seconds=5.0))
    assert (found.phantoms, found.right) == (phantoms, right)
    assert found.phantom == bool(phantoms)
    monkeypatch.setattr(judge, "diagnose", lambda *_, **__: verdict(*said, confidence=0.89))
    assert not run(Case("test", truth, 1, "development", seconds=5.0)).phantom
    monkeypatch.setattr(judge, "diagnose", lambda *_, **__: verdict(*said, kind="not_in_library"))
    assert run(Case("test", truth, 1, "development", seconds=5.0)).phantoms == ()


def test_what_is_really_there_beside_the_truth_is_no_phantom(monkeypatch: pytest.MonkeyPatch) -> None:
    """The hard set's mild friction and its tenth of another effect may be named; dirt may not."""
    case = Case("test", ("cogging",), 1, "development", seconds=5.0, nuisance=True)
    beside = tuple(name for name in case.exact().spec.axes[0].parts if name in EFFECTS)
    monkeypatch.setattr(judge, "diagnose", lambda *_, **__: verdict(*beside))
    assert len(beside) == 3
    assert run(case).phantoms == ()
    monkeypatch.setattr(judge, "diagnose", lambda *_, **__: verdict("cogging", "base_resonance"))
    assert run(Case("test", ("cogging",), 1, "development", seconds=5.0, dirt=0.03)).phantoms == ("base_resonance",)


@pytest.mark.parametrize(
    ("truth", "said", "changes", "could_hide", "right"),
    [
        (("hardening_stiffness",), (), 0.0005, 0.001, True),
        (("hardening_stiffness",), (), 0.0005, 0.0004, False),  # the answer does not say that so much could be hidden
        (("hardening_stiffness",), (), 0.002, 0.01, False),  # more than a tenth of the noise
        (("hardening_stiffness",), ("cogging",), 0.0005, 0.001, False),
        (("hardening_stiffness",), ("hardening_stiffness",), 0.0005, 0.001, True),
        (("hardening_stiffness", "cogging"), ("cogging",), 0.0005, 0.001, True),
        (("hardening_stiffness", "cogging"), (), 0.0005, 0.001, False),
        (("hardening_stiffness", "cogging"), ("cogging", "backlash"), 0.0005, 0.001, False),
    ],
)
def test_an_effect_that_cannot_be_seen_need_not_be_named_if_the_answer_says_so(
    truth: tuple[str, ...], said: tuple[str, ...], changes: float, could_hide: float, right: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Below a tenth of noise and dirt, and below what the answer says could be hidden; all others must be named, and nothing else."""
    seen = Seen(change=dict.fromkeys(truth, 0.3) | {"hardening_stiffness": changes}, noise=0.01, dirt=0.0, kinds=())
    monkeypatch.setattr(judge, "recorded", lambda *_: Recorded(2000.0, np.zeros(0), np.zeros(0), seen))
    kind = "missing_effect" if said else "nothing_missing"
    monkeypatch.setattr(judge, "diagnose", lambda *_, **__: verdict(*said, kind=kind, could_hide=could_hide))
    found = run(Case("test", truth, 1, "development", seconds=5.0))
    assert found.right is right
    assert hit(found) is right


@pytest.mark.parametrize(("kinds", "phantoms"), [(("quadratic_drag", "mains_hum"), ()), (("mains_hum",), ("quadratic_drag",))])
def test_an_effect_that_the_dirt_really_has_is_no_phantom(kinds: tuple[str, ...], phantoms: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """It is not wrong as the first name either, because it is on the axis."""
    case = Case("test", ("cogging",), 1, "development", seconds=5.0, dirt=0.03)
    seen = Seen(change={"cogging": 0.1}, noise=1e-4, dirt=0.03, kinds=kinds)
    monkeypatch.setattr(judge, "recorded", lambda *_: Recorded(2000.0, np.zeros(0), np.zeros(0), seen))
    monkeypatch.setattr(judge, "diagnose", lambda *_, **__: verdict("quadratic_drag", "cogging"))
    found = run(case)
    assert found.phantoms == phantoms and found.wrong is bool(phantoms) and not found.right


def test_every_law_is_drawn_by_some_set() -> None:
    """Except for the base, which every axis has."""
    own = {name for cases in sets("reporting").values() for case in cases for name in case.truth}
    others = {name for cases in foreign_sets("reporting").values() for case in cases for name in case.truth}
    assert {effect.name for effect in STANDARD.acting} <= own | others
    assert {effect.name for effect in STANDARD.acting} - own == {"gravity"}


@pytest.mark.parametrize("name", ["load_side_resonance", "position_dependent_gain"])
def test_a_law_that_came_later_is_named(name: str) -> None:
    """With the parameters of the machine."""
    found = run(Case("further laws", (name,), 2, "development", seconds=SHORT))
    assert found.effects == (name,) and found.right and not found.phantoms, found
    assert found.errors and max(found.errors.values()) < 0.05


def test_dirt_alone_may_be_called_not_in_the_library(monkeypatch: pytest.MonkeyPatch) -> None:
    """Or nothing missing; without dirt only nothing missing is right."""
    monkeypatch.setattr(judge, "diagnose", lambda *_, **__: verdict(kind="not_in_library"))
    case = Case("test", (), 1, "development", seconds=5.0)
    assert not run(case).right
    assert run(replace(case, dirt=0.01)).right


def test_the_page_tells_hits_misses_and_goals() -> None:
    """One hit, one clean axis, one wrong name."""
    hit, clean = judged("coulomb_friction"), judged()
    miss = replace(hit, case=replace(hit.case, truth=("dead_zone",)), right=False, first=False, wrong=True, phantoms=("coulomb_friction",))
    items = [replace(item, case=replace(item.case, group="standard"), confidence=1.0) for item in (hit, clean, miss)]
    page = text({"exact": items}, "development", "python -m campaigns.blind", "")
    assert "| coulomb_friction | 1 of 1 |" in page
    assert "| dead_zone | 0 of 1 |" in page
    assert "| exact: one effect | 1 of 2 (50 %) | 0 | >= 149 of 150 | 1 | 1 (50.0 %) | 1 (50.0 %) | 0 |" in page
    assert "| exact: no effect | 1 of 1 (100 %) | 0 | all | 0 | 0 | 0 | 0 |" in page
    assert page.count("standard/dead_zone/1: missing_effect coulomb_friction (confidence 1.00); of the motion: coulomb_friction ") == 2
    assert "not there: coulomb_friction" in page


def test_the_page_tells_whether_a_confidence_is_what_it_says() -> None:
    """Verdicts by confidence, over all sets; a right name together with a phantom is not right."""
    hit = judged("coulomb_friction")
    items = [replace(hit, confidence=0.95), replace(hit, confidence=0.95, phantoms=("backlash",)), replace(hit, confidence=0.6)]
    page = text({"imperfect 1 %": items, "10 s": [replace(hit, confidence=1.0)]}, "development", "python -m campaigns.blind", "")
    assert "| 0.5 to 0.7 | 1 | 1 (100 %) | 0.60 |" in page
    assert "| 0.9 to 0.99 | 2 | 1 (50 %) | 0.95 |" in page
    assert "| 0.9 to 1 | 3 | 2 (67 %) | 0.97 |" in page


def test_each_set_counts_as_right_what_its_goal_asks_for() -> None:
    """Alone: named first; in the hard set: named; several: all named; dirt alone and outside: nothing named with confidence."""
    found = judged("coulomb_friction")
    second = replace(found, effects=("backlash", "coulomb_friction"), right=True, first=False, confidence=1.0)
    assert hit(replace(second, case=replace(found.case, group="hard", nuisance=True)))
    assert not hit(replace(second, case=replace(found.case, group="half")))
    assert hit(replace(second, first=True, right=False, case=replace(found.case, group="half")))
    assert not hit(replace(second, first=True, right=False, case=replace(found.case, truth=("coulomb_friction", "cogging"))))
    for truth, dirt in (((), 0.01), (("thermal_viscosity",), 0.0)):
        case = replace(found.case, truth=truth, dirt=dirt)
        assert not hit(replace(found, case=case, confidence=0.9))
        assert hit(replace(found, case=case, confidence=0.89))


def test_a_campaign_can_be_stopped_and_gone_on_with(tmp_path: Path) -> None:
    """Results are read back unchanged; a line truncated by a kill is left out."""
    items = [judged("coulomb_friction"), judged()]
    for item in items:
        add(tmp_path / "kept", item)
    with (tmp_path / "kept").open("a") as file:
        file.write('{"case": {"gro')
    assert load(tmp_path / "kept") == {item.case: item for item in items}
    assert load(tmp_path / "none") == {}


def test_remarks_outlive_the_next_campaign() -> None:
    """The text by people below the last heading is kept."""
    old = "# Blind\n\nold\n\n## Remarks\n\nwritten\n"
    assert with_remarks("# Blind\n\nnew\n", old) == "# Blind\n\nnew\n\n## Remarks\n\nwritten\n"
    assert with_remarks("new\n", "old\n") == "new\n"


@pytest.mark.parametrize("wrong", [["--part", "0"], ["--part", "4", "--first", "-1"], ["exakt"]])
def test_a_part_or_a_set_that_is_none_is_refused(wrong: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Before anything is driven."""
    monkeypatch.setattr("sys.argv", ["blind", *wrong])
    with pytest.raises(SystemExit) as end:
        main()
    said = capsys.readouterr().err
    assert end.value.code == 2 and ("at least" in said or "'exakt' is not a set; there are exact" in said)
