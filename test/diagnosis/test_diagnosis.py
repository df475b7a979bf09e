"""The missing effect is named on the simulated machine, which has other physics code and numerics; if none fits, the answer says so."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache, partial
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.signal
import yaml
from helpers import simulated

from xy_sim.parts import PARTS
from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.cli import run
from xy_sysid.diagnosis import of_run, rungs
from xy_sysid.diagnosis.answer import Answer, Rung, Tried
from xy_sysid.diagnosis.diagnose import diagnose, judged
from xy_sysid.diagnosis.equal_laws import likelihood
from xy_sysid.diagnosis.refine import Effort, refine
from xy_sysid.diagnosis.sets import is_mistaken_for
from xy_sysid.effects import EFFECTS, Effect
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import GreyboxFit, fit_base, fit_with
from xy_sysid.hypotheses import one_step
from xy_sysid.hypotheses.companions import extended
from xy_sysid.hypotheses.criteria import AT_FLOOR, FEWEST
from xy_sysid.imports import save
from xy_sysid.samples.recording import Recording

recorded = partial(simulated.recorded, block=100)


@cache
def diagnosed(effect: str, seconds: float = 20.0) -> Answer:
    """The answer for an axis with these effects."""
    return diagnose(2000.0, *recorded(effect, seconds=seconds).axis("x"))


@pytest.mark.parametrize(
    "effect", ["coulomb_friction", "cogging", "dead_zone", "constant_load", "saturation", "lead_error", "load_dependent_friction"]
)
def test_the_missing_effect_is_named_and_the_error_falls_to_the_floor(effect: str) -> None:
    """The first name is right and confident, the held-out error within 5 % of the noise, and nearly all of the error's power is explained."""
    found = diagnosed(effect, 30.0)
    assert (found.verdict, found.effects) == ("missing_effect", (effect,))
    assert found.final.held_out_error < 1.05 * found.final.noise_floor
    assert found.base.excess > 0.3
    assert found.confidence > 0.5
    assert found.explained > 0.9
    assert found.discrepancy < 0.35 * found.noise
    assert not found.stopped
    assert effect in found.sentence and "The residual error is at the noise floor" in found.sentence


@cache
def two_effects() -> tuple[Answer, int]:
    """The answer for an axis with two effects, and how often the search read its clock."""
    ticks = count()
    found = diagnose(2000.0, *recorded("coulomb_friction+cogging", seconds=20.0).axis("x"), clock=partial(next, ticks))
    return found, next(ticks)


def test_two_effects_are_both_named() -> None:
    """One after the other, the larger one first."""
    found, _ = two_effects()
    assert found.verdict == "missing_effect"
    assert set(found.effects) == {"coulomb_friction", "cogging"}


def test_friction_of_the_gear_is_named_beside_friction_of_the_guide() -> None:
    """Both levels add up; the one grows with the input, the other stays."""
    found = diagnosed("coulomb_friction+load_dependent_friction")
    assert set(found.effects) == {"coulomb_friction", "load_dependent_friction"}, found.sentence
    assert found.final.parameter("load_dependent_friction.share").value == pytest.approx(0.15, rel=0.02)
    assert found.final.parameter("coulomb_friction.coulomb").value == pytest.approx(0.2, rel=0.02)


def test_what_was_found_comes_first_and_what_is_left_is_said() -> None:
    """For an axis with one effect and an unknown disturbance: the effect, and the explained and residual error."""
    found = diagnosed("coulomb_friction+thermal_viscosity")
    assert (found.verdict, found.effects[0]) == ("missing_effect", "coulomb_friction")
    assert found.sentence.startswith("Missing: coulomb_friction") and " of the error's power (" in found.sentence
    assert 0.9 < found.explained < 1.0
    assert found.discrepancy > 0.0
    assert "Residual error above the encoder noise of " in found.sentence and "of the motion" in found.sentence


@pytest.mark.parametrize("effect", ["coulomb_friction", "backlash"])
def test_words_for_people_steer_no_search(effect: str) -> None:
    """A library whose effects have no look-alikes gives the same result, with the same confidence and in the same words."""
    u, y = recorded(effect, seconds=20.0).axis("x")
    found, told = diagnosed(effect), diagnose(2000.0, u, y, Library([replace(item, look_alikes=()) for item in EFFECTS.values()]))
    assert (found.verdict, found.effects) == ("missing_effect", (effect,))
    assert (told.verdict, told.effects, told.confidence, told.sentence) == (found.verdict, found.effects, found.confidence, found.sentence)


@pytest.mark.parametrize("effect", ["coulomb_friction=0.001", "dead_zone=0.002"])
def test_an_effect_in_the_noise_is_not_named_with_confidence(effect: str) -> None:
    """The base is at the floor; if the right name is given, then without certainty, and no other name is given."""
    found = diagnose(2000.0, *recorded(effect).axis("x"))
    assert found.base.excess < AT_FLOOR
    if found.verdict == "nothing_missing":
        assert found.effects == () and found.explained == 0.0
    else:
        assert (found.verdict, found.effects) == ("missing_effect", (effect.partition("=")[0],))
        assert found.confidence < 0.5


def nothing_left(data: AxisData) -> Answer:
    """The verdict if excess and discrepancy are exactly 0."""
    ladder = refine(data)
    base = replace(ladder.base, excess=0.0)
    return judged(data, replace(ladder, rungs=(Rung.of(base),), best=(), discrepancy=0.0), STANDARD)


def test_a_base_without_any_excess_is_no_division_by_zero() -> None:
    """Nothing is missing, and the answer states what the noise could hide."""
    found = nothing_left(prepare(2000.0, *recorded("").axis("x")))
    assert (found.verdict, found.tolerance) == ("nothing_missing", 0.0)
    assert "An effect that changes the motion by less than 0." in found.sentence


def test_that_nothing_is_missing_is_as_sure_as_the_noise_lets_one_see() -> None:
    """With less encoder noise, only smaller effects can be hidden; the tolerated part of the motion is not an effect."""
    voltage, position = recorded("").axis("x")
    rng = np.random.default_rng(1)
    noises = (3e-6, 1e-6, 0.0)
    sure = [nothing_left(prepare(2000.0, voltage, position + noise * rng.standard_normal(position.size))).confidence for noise in noises]
    assert sure == sorted(sure)
    assert 0.2 < sure[0] < 0.8 < sure[-1] <= 1.0
    quiet = prepare(2000.0, voltage, position)
    quiet = replace(quiet, floor=replace(quiet.floor, power=1e-6 * quiet.floor.power))
    assert nothing_left(quiet).confidence == 1.0


def test_a_clean_axis_misses_nothing() -> None:
    """No false alarm on either axis."""
    recording = recorded("", axes=("x", "y"))
    for axis in recording.axes:
        assert diagnose(2000.0, *recording.axis(axis)).verdict == "nothing_missing"


def test_what_is_not_in_the_library_is_not_named() -> None:
    """Never a name with confidence for an effect that no hypothesis knows."""
    found = diagnosed("thermal_viscosity")
    assert found.verdict == "not_in_library"
    assert found.effect is None or found.confidence <= 0.5


@pytest.mark.parametrize(
    ("u", "y", "words"),
    [
        (np.sin(np.arange(200.0)), np.cos(np.arange(200.0)), "Record for longer"),
        (np.sin(np.arange(40_000.0) ** 1.3), np.cumsum(np.sin(np.arange(40_000.0) ** 1.7)), "does not follow the input"),
        (np.ones(40_000), np.arange(40_000.0), "the input does not move"),
        (np.sin(np.arange(40_000.0)), np.ones(40_000), "the output does not move"),
    ],
)
def test_what_is_lacking_in_the_data_is_said(u: np.ndarray, y: np.ndarray, words: str) -> None:
    """Too short, not excited, at rest: each with its reason."""
    found = diagnose(2000.0, u, y)
    assert found.verdict == "not_enough_data"
    assert words in found.sentence


@pytest.mark.parametrize("samples", [300, 40_000])
def test_one_sine_is_too_little_to_name_anything(samples: int) -> None:
    """Any law can fit size and phase with two parameters."""
    found = diagnose(2000.0, np.sin(np.arange(samples)), np.cos(np.arange(samples)))
    assert found.verdict == "not_enough_data"


@pytest.fixture(scope="module")
def rec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rec") / "rec.npz"
    save(recorded("x:coulomb_friction", seconds=20.0, axes=("x", "y")), path)
    return path


def test_diagnose_answers_with_the_contracts_document(rec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Verdict, error, places, candidates with parameters, next experiment; nothing missing on the other axis."""
    assert run(["diagnose", str(rec), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    x = told["axes"]["x"]
    assert (x["verdict"], x["effect"]) == ("missing_effect", "coulomb_friction")
    assert x["error"]["unit"] == "m/s" and x["error"]["now"] > 5 * x["error"]["held_out"]
    assert {place["kind"] for place in x["where"]} <= {"frequency", "speed", "position", "amplitude", "direction", "time"}
    best = next(item for item in x["candidates"] if item["effect"] == "coulomb_friction")
    size = PARTS["coulomb_friction"].parameters[0].default
    assert best["parameters"]["coulomb_friction.coulomb"]["value"] == pytest.approx(size, rel=0.01)
    assert best["share"] > 0.97 and x["explained"] > 0.97
    assert 0.0 <= x["discrepancy"] < 0.35 * x["noise"]
    assert x["stopped"] is None
    assert all(set(item) == {"effect", "reason"} for item in x["refused"])
    assert x["next_experiment"]
    assert told["axes"]["y"]["verdict"] == "nothing_missing"


def test_refine_writes_the_ladder_and_the_model(rec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The error falls from rung to rung; the YAML holds physical parameters with intervals."""
    model = tmp_path / "model.yaml"
    assert run(["refine", str(rec), "--auto", "-a", "x", "--model", str(model), "--json"]) == 0
    x = json.loads(capsys.readouterr().out)["axes"]["x"]
    assert [rung["added"] for rung in x["ladder"]] == [None, "coulomb_friction"]
    assert x["ladder"][1]["held_out_error"] < 0.2 * x["ladder"][0]["held_out_error"]
    assert x["verdict"] == "explained"
    written = yaml.safe_load(model.read_text(encoding="utf-8"))
    assert written["axes"]["x"]["parameters"]["coulomb_friction.coulomb"]["unit"] == "V"


def test_an_effect_can_be_added_by_name(rec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A right or a wrong effect: the errors show it; an unknown name is refused with the nearest spelling."""
    assert run(["refine", str(rec), "--add", "cogging", "-a", "x", "--json"]) == 0
    x = json.loads(capsys.readouterr().out)["axes"]["x"]
    assert [rung["added"] for rung in x["ladder"]] == [None, "cogging"]
    assert x["ladder"][1]["held_out_error"] > 0.5 * x["ladder"][0]["held_out_error"]
    assert x["verdict"] != "explained"
    assert run(["refine", str(rec), "--add", "coulomb", "-a", "x"]) == 2
    assert "coulomb_friction" in capsys.readouterr().err


def test_what_is_compiled_at_first_use_costs_no_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a new computer the first fit compiles the laws for longer than the budget: the search still gets its time."""
    now = [0.0]

    def slow(data: AxisData, library: Library) -> GreyboxFit:
        now[0] += 100.0
        return fit_base(data, library)

    monkeypatch.setattr(rungs, "fit_base", slow)
    found = diagnose(2000.0, *recorded("coulomb_friction", seconds=20.0).axis("x"), budget=10.0, clock=lambda: now[0])
    assert found.effects == ("coulomb_friction",) and not found.stopped


def test_a_part_that_rattles_is_no_mode_with_confidence() -> None:
    """The mode explains most of the error, but not all; a true mode of the same strength explains all."""
    rattles, rings = (diagnosed(name) for name in ("loose_mode", "base_resonance"))
    assert rattles.effect is None or rattles.confidence < 0.9
    assert rings.effects == ("base_resonance",)
    likely = likelihood(STANDARD, "base_resonance", dict(rings.final.model.effects)["base_resonance"])
    assert 0.9 < rings.confidence <= likely < 1.0  # a motor encoder cannot distinguish it from a flexible screw


def test_not_in_the_library_is_said_less_surely_the_more_is_left() -> None:
    """An effect may be hidden in it, or in the noise; an error that some set explains is not unexplained."""
    data, ladder = prepare(2000.0, *recorded("quadratic_drag", seconds=20.0).axis("x")), diagnosed("quadratic_drag")
    nothing = replace(ladder, best=(), explained=0.0, helps=0.0)
    motion = data.layout.rms(data.floor.motion)
    sure = [judged(data, replace(nothing, discrepancy=part * motion), STANDARD).confidence for part in (0.0, 5e-4, 0.03, 0.3)]
    assert 1.0 > sure[0] == sure[1] > sure[2] > sure[3] > 0.0
    helped = judged(data, replace(nothing, discrepancy=0.0, helps=0.3), STANDARD)
    assert helped.verdict == "not_in_library" and helped.confidence == pytest.approx(0.7 * sure[0])


def test_what_two_sets_share_is_named_and_what_they_differ_in_is_not() -> None:
    """A tie between a load and cogging, with friction: only friction is named, and the load as possible; a rival of friction itself counts."""
    data, alone = prepare(2000.0, *recorded("coulomb_friction", seconds=20.0).axis("x")), diagnosed("coulomb_friction")
    both = fit_with(data, alone.final, ["constant_load"])
    tie = Tried(Rung.of(both, ("coulomb_friction", "cogging")), doubt=0.5)
    ladder = replace(
        alone,
        rungs=(*alone.rungs, Rung.of(both, ("constant_load",))),
        best=("coulomb_friction", "constant_load"),
        rivals=(tie, *alone.rivals),
        sizes={"coulomb_friction": 100.0, "constant_load": 5.0},
    )
    found = judged(data, ladder, STANDARD)
    assert found.effects == ("coulomb_friction",)
    assert found.confidence > 0.9
    assert "constant_load may also be present; with it the confidence is 0.42." in found.sentence
    assert found.final is alone.final
    assert tie not in found.rivals
    unsure = judged(data, replace(ladder, rivals=(Tried(Rung.of(both, ("cogging",)), doubt=0.5),)), STANDARD)
    assert unsure.effects == ("coulomb_friction",)  # below 50 %, but the load explains nothing in addition
    assert unsure.confidence < 0.5


def ending(fit: GreyboxFit, value: float, low: float, high: float) -> GreyboxFit:
    """A fit with this load, V."""
    load = replace(fit.parameter("constant_load.load"), value=value, low=low, high=high)
    parameters = tuple(load if item.name == load.name else item for item in fit.parameters)
    return replace(fit, model=fit.model.with_effect("constant_load", (value,)), parameters=parameters)


@pytest.mark.parametrize(
    ("value", "low", "high", "half"),
    [(-0.2, -0.25, -0.15, False), (0.2, -0.1, 0.5, True), (0.2, 0.05, 0.35, True), (-1.0, -1.1, -0.9, True), (1.0, 0.9, 1.1, True)],
)
def test_a_size_that_is_not_known_or_ends_at_a_bound_is_half_sure_at_most(value: float, low: float, high: float, half: bool) -> None:
    """In the reported fit, or in a candidate; a signed size has two bounds. A value of 1 represents its bound."""
    data, alone = prepare(2000.0, *recorded("constant_load", seconds=20.0).axis("x")), diagnosed("constant_load")
    bound = STANDARD["constant_load"].on(data.similar)[0].high
    size = (value, low, high) if abs(value) < 1.0 else (value * bound, low * bound, high * bound)
    told, more = ending(alone.final, *size), fit_with(data, alone.final, ["coulomb_friction"])
    last = replace(alone, rungs=(alone.rungs[0], Rung.of(told, ("constant_load",))), rivals=(), sizes={"constant_load": 100.0}, settled=None)
    names, sizes = ("constant_load", "coulomb_friction"), {"constant_load": 100.0, "coulomb_friction": 0.01}
    for rungs_of_it in (
        (*last.rungs, Rung.of(more, ("coulomb_friction",))),
        (*alone.rungs, Rung.of(ending(more, *size), ("coulomb_friction",))),
    ):
        both = judged(data, replace(last, rungs=rungs_of_it, best=names, sizes=sizes), STANDARD)
        assert both.effects == ("constant_load",) and (both.confidence <= 0.5) is half
    assert (judged(data, last, STANDARD).confidence <= 0.5) is half


def test_a_refused_spring_that_leaves_as_little_as_a_wave_makes_the_wave_unsure() -> None:
    """It is not a spring, but not certainly that wave either; other refused sets, and related effects, are no rivals."""
    wave, spring, stiff = (frozenset({"coulomb_friction", name}) for name in ("cogging", "return_spring", "hardening_stiffness"))
    assert is_mistaken_for(STANDARD, spring, wave)
    assert not is_mistaken_for(STANDARD, wave, spring)
    assert not is_mistaken_for(STANDARD, stiff, spring)
    assert not is_mistaken_for(STANDARD, frozenset({"cogging"}), wave)
    data, ladder = prepare(2000.0, *recorded("cogging", seconds=20.0).axis("x")), diagnosed("cogging")
    rival = Tried(Rung.of(ladder.final, ("return_spring",)), doubt=0.5, refused="return_spring: it would give way")
    found = judged(data, replace(ladder, rivals=(rival,)), STANDARD)
    assert found.effects == ("cogging",) and found.confidence <= 0.5
    assert "Runner-up return_spring" in found.sentence and "(refused, return_spring: it would give way)" in found.sentence


def test_effects_come_in_the_order_of_what_each_would_cost() -> None:
    """Compared with the best known set without it, so that there is an answer even if time allowed no fit without it."""
    data = prepare(2000.0, *recorded("coulomb_friction+cogging", seconds=20.0).axis("x"))
    found, ticks = two_effects()
    ladders = (found, refine(data, effort=Effort(budget=0.3 * ticks, clock=partial(next, count()))))
    for ladder in ladders:
        assert ladder.effects and set(ladder.effects) == set(ladder.sizes)
        assert min(ladder.sizes.values()) > 0.0
        first, *others = ladder.effects  # the largest, or dry friction that is almost as large
        assert STANDARD[first].is_dry or all(ladder.sizes[first] >= ladder.sizes[other] for other in others)
    assert [ladder.stopped for ladder in ladders] == [False, True]


def test_a_spring_beside_friction_is_not_taken_for_a_pendulum_and_bumps() -> None:
    """A machine with Euler steps: an effect equivalent to another law is left out, and the true law stays."""
    rate, sub = 1000.0, 10
    rng = np.random.default_rng(8)
    voltage = scipy.signal.sosfilt(scipy.signal.butter(4, [0.3, 80.0], "band", fs=rate, output="sos"), rng.normal(size=40_000))
    voltage /= voltage.std()
    place = speed = 0.0
    position = np.empty(voltage.size)
    for k, volts in enumerate(voltage.tolist()):
        position[k] = place
        for _ in range(sub):
            pull = volts - 0.05 * speed - 0.8 * place
            if speed != 0.0 or abs(pull) > 0.05:
                sign = np.sign(speed) if speed != 0.0 else np.sign(pull)
                after = speed + (pull - 0.05 * sign) / (0.01 * rate * sub)
                speed = 0.0 if speed != 0.0 and after * speed < 0.0 else after
            place += speed / (rate * sub)
    found = diagnose(rate, voltage, np.round(position / 1e-4) * 1e-4)
    assert found.verdict == "missing_effect"
    assert len(found.effects) == 2 and "coulomb_friction" in found.effects, found.sentence
    assert {EFFECTS[name].family for name in found.effects} == {"spring", "dry_friction"}, found.sentence


@pytest.mark.parametrize("effect", ["backlash", "base_resonance+thermal_viscosity"])
def test_a_gap_is_asked_for_early_and_once(effect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A one-step fit that explains the axis ends the simulations; one that does not is not repeated with the same effects."""
    asked: list[tuple[str, ...]] = []
    fitted = extended

    def counted(data: AxisData, base: GreyboxFit, gap: Effect, *others: Any) -> Any:
        asked.append((gap.name, str(others[0].masked), *sorted(name for name, _ in base.model.effects)))
        return fitted(data, base, gap, *others)

    monkeypatch.setattr(one_step, "extended", counted)
    data = prepare(2000.0, *recorded(effect, seconds=20.0).axis("x"))
    tried: list[frozenset[str]] = []
    found = refine(data, trying=tried.append)
    assert len(set(asked)) == len(asked) and {beside[0] for beside in asked} == {"backlash"}
    assert ("backlash" in found.effects) == (effect == "backlash")
    if effect == "backlash":
        assert len(asked) == 1
        assert tried.index(frozenset({"backlash"})) == len(tried) - 1 <= FEWEST + 1


def test_a_gap_that_is_too_small_to_be_one_is_not_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even if the filter predicts well with it."""
    fitted = extended

    def too_small(data: AxisData, base: GreyboxFit, gap: Effect, *others: Any) -> Any:
        found = fitted(data, base, gap, *others)
        return replace(found, found=replace(found.found, too_small=True))

    monkeypatch.setattr(one_step, "extended", too_small)
    found = diagnose(2000.0, *recorded("backlash", seconds=20.0).axis("x"))
    assert "backlash" not in found.effects and "backlash" not in found.sentence


def test_a_gap_of_little_more_than_a_count_is_no_soft_screw() -> None:
    """Free simulation suggests a compliance; above the noise, the filter with the gap has half the error of that without."""
    found = diagnose(2000.0, *recorded("coulomb_friction=0.03+backlash=1.2e-6", seconds=20.0, counts=5000.0).axis("x"))
    assert set(found.effects) == {"backlash", "coulomb_friction"}
    gap, load = (found.final.parameter(name) for name in ("backlash.gap", "coulomb_friction.coulomb"))
    assert gap.low < 1.2e-6 < gap.high and 0.9 < gap.value / 1.2e-6 < 1.1
    assert 0.95 < load.value / 0.03 < 1.05


def test_what_acts_beside_a_gap_is_asked_for_though_it_was_known_beside_a_screw_only() -> None:
    """A compliance is the best simulation: the gap is tested together with the lag that it masks."""
    found = diagnose(2000.0, *recorded("amplifier_lag=0.002+coulomb_friction=0.02+backlash=2e-6", seconds=20.0, counts=5000.0).axis("x"))
    assert set(found.effects) == {"backlash", "coulomb_friction", "amplifier_lag"}
    assert found.final.one_step


def test_what_a_simulation_had_taken_a_gap_for_goes() -> None:
    """A lag whose size is zero with the gap is removed from the filter's companions."""
    data = prepare(2000.0, *recorded("coulomb_friction=0.03+backlash=6e-6", seconds=10.0).axis("x"))
    base = fit_with(data, fit_base(data), ["amplifier_lag"])
    fit = extended(data, base, EFFECTS["backlash"]).rungs[-1][1]
    assert "amplifier_lag" not in fit.model and {"backlash", "coulomb_friction"} <= {name for name, _ in fit.model.effects}


def test_a_gap_beside_a_large_force_is_asked_for_with_that_force() -> None:
    """Cogging found by a simulation without the gap is kept: alone, the gap is not better."""
    found = refine(prepare(2000.0, *recorded("backlash=14e-6+coulomb_friction=0.08+cogging=0.5,per_revolution=4").axis("x")))
    assert set(found.effects) == {"backlash", "coulomb_friction", "cogging"}
    assert [rung.added for rung in found.rungs][:2] == [None, "cogging"] and found.final.excess == 0.0
    assert [one.name for one in found.candidates].count("cogging") == 1 and found.candidates[0].name == "backlash"


def with_gaps(effect: str, every: int, lost: int) -> Recording:
    """20 s of an axis of which some samples are lost after every so many."""
    whole = recorded(effect, seconds=20.0)
    return whole.only(np.arange(len(whole)) % (every + lost) < every)


@pytest.mark.parametrize("effect", ["backlash", "presliding_hysteresis"])
def test_what_needs_one_stretch_is_found_in_the_longest(effect: str) -> None:
    """Backlash is predicted one sample ahead, which a gap would break: the answer is about the longest stretch, and says so."""
    found = of_run.diagnose(with_gaps(effect, 22_000, 100))
    alone = effect == "backlash"
    assert found.effects == (effect,) and found.confidence > 0.9 and not found.untried
    assert ("This is about the longest stretch alone, 11 s, as backlash needs one without a gap." in found.sentence) == alone
    assert [run.seconds for run in found.runs] == ([11.0] if alone else [11.0, 8.95])
    if alone:
        assert found.final.parameter("backlash.gap").value == pytest.approx(EFFECTS["backlash"].parameters[0].typical, rel=0.1)


def test_where_every_stretch_is_too_short_backlash_is_not_tried_and_leaves_doubt() -> None:
    """Of stretches of 75 ms: an effect that backlash is mistaken for gets 0.5 at most, and it is said."""
    found = of_run.diagnose(with_gaps("backlash", 150, 10))
    assert found.untried == ("backlash",) and found.effects and found.confidence <= 0.5
    assert "Not tried: backlash, which needs a longer stretch without a gap (the longest is 0.075 s)." in found.sentence


@pytest.mark.parametrize("effect", ["thermal_viscosity", "coulomb_friction+cogging"])
def test_refine_by_itself_takes_the_steps_of_diagnose(effect: str) -> None:
    """Both need the same size of an effect: for a law outside the library neither adds one that merely resembles it."""
    run = recorded(effect, seconds=10.0)
    steps = [rung.values for rung in of_run.refine(run)]
    assert steps == [rung.values for rung in of_run.diagnose(run)]
    assert len(steps) == (1 if effect == "thermal_viscosity" else 3)
