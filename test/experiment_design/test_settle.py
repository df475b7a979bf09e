"""From a short, ambiguous recording to the experiments that settle it, on the simulated machine."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers.simulated import recorded as recorded_machine

from campaigns.bench.settle import settle, table
from campaigns.bench.settle_pairs import PAIRS, carry_out, first_recording, left_limits, limits, machine
from xy_sysid.axis.model import STANDARD
from xy_sysid.diagnosis.answer import Answer
from xy_sysid.diagnosis.of_run import diagnose
from xy_sysid.errors import BadInput
from xy_sysid.experiment_design.beliefs import Evidence, believed
from xy_sysid.experiment_design.criteria import ODDS, ROUNDS
from xy_sysid.experiment_design.design import Design, Judged, _timed, best_first, expects
from xy_sysid.experiment_design.evidence import Power, nats, seconds_needed, settled
from xy_sysid.experiment_design.experiment import RAMP, Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.loop import Budget, Decision, NextChoice, Question, Signals
from xy_sysid.experiment_design.of_run import next_experiment
from xy_sysid.experiment_design.precision import Precision, sharpest
from xy_sysid.experiment_design.prediction import Setting, recorded, seen
from xy_sysid.experiment_design.proposals import proposals
from xy_sysid.experiment_design.rivals import beliefs_of, possible, standing
from xy_sysid.greybox.axis_data import AxisData, prepare_all
from xy_sysid.greybox.free_run import fit
from xy_sysid.hypotheses.moves import is_twice
from xy_sysid.settings import AxisExcitation

LAG = next(pair for pair in PAIRS if "amplifier_lag" in pair.sets[1])
LOUD = Experiment(AxisExcitation(kind="noise", rms=1.0), 4.0)
FEW = Budget(experiments=2, seconds=30.0, draws=2)


@pytest.fixture(scope="module")
def short() -> Signals:
    """A recording in a narrow band of a machine with an amplifier lag."""
    return first_recording(LAG, machine(LAG, 1, 1), 1)


@pytest.fixture(scope="module")
def data(short: Signals) -> AxisData:
    return prepare_all(2000.0, [short])


def test_what_one_recording_leaves_open_is_settled_by_an_experiment_within_the_limits(short: Signals) -> None:
    """The recording gives the wrong set, with two possible; after the experiment only the right one remains. A replay gives the same."""
    made = machine(LAG, 1, 1)
    asked: list[Experiment] = []

    def run(experiment: Experiment) -> Signals:
        asked.append(experiment)
        return carry_out(made, experiment)

    question = Question(2000.0, [short], LAG.sets, STANDARD)
    found = settle(question, limits(LAG), run, FEW)
    assert found.steps[0].standing.chosen == 0
    assert set(found.steps[0].left) == set(LAG.sets)
    assert found.ended == "settled"
    assert found.effects == ("amplifier_lag",)
    assert left_limits(LAG, found.recordings) == 0
    kept = iter(found.recordings)
    again = settle(question, limits(LAG), lambda experiment: next(kept), FEW)
    assert [step.then for step in again.steps] == [step.then for step in found.steps]
    assert again.effects == found.effects


def test_it_ends_when_somebody_stops_it(short: Signals) -> None:
    """STOP is a normal end, without a result."""
    found = settle(Question(2000.0, [short], LAG.sets, STANDARD), limits(LAG), lambda experiment: None, FEW, lambda *_: NextChoice(LOUD))
    assert found.ended == "stopped"
    assert found.seconds == 0.0


def test_sets_with_the_same_equations_are_told_by_no_experiment(data: AxisData) -> None:
    """A set that predicts the same motion has no evidence against it, for any strength of the experiment."""
    fits = standing(data, STANDARD, [("constant_load",)]).fits
    evidence = Evidence(data)
    own, other = (believed(evidence, fits[0], 1, seed) for seed in (0, 1))
    item = recorded(Setting.of(data), LOUD, own.model, 0.0, 4.0)
    assert nats((own, other), own.model, item)[0] < 1e-6


def test_a_rival_that_can_be_refitted_to_an_experiment_is_no_evidence() -> None:
    """In fast noise a drag along the travel is refitted to a gain along it, in more than one step; a motion over the whole travel shows both."""
    pair = next(pair for pair in PAIRS if "position_dependent_gain" in pair.sets[0])
    data = prepare_all(2000.0, [first_recording(pair, machine(pair, 0, 3), 3)])
    gain, drag = sorted(
        beliefs_of(data, STANDARD, standing(data, STANDARD, pair.sets), limits(pair).travel, 1), key=lambda item: item.effects[0], reverse=True
    )
    assert gain.effects == ("position_dependent_gain",)

    def evidence(told: AxisExcitation, rounds: int) -> float:
        return nats((gain, drag), gain.model, recorded(Setting.of(data), Experiment(told, 8.0), gain.model, 0.0, 8.0), rounds)[0]

    noise = AxisExcitation(kind="noise", low=20.0, high=300.0, rms=1.0)
    steps = AxisExcitation(kind="step", period=0.1, rms=4.75)
    assert evidence(noise, 1) > 50.0 * evidence(noise, ROUNDS)
    assert evidence(steps, ROUNDS) > 10.0 * evidence(noise, ROUNDS)


def test_the_best_experiment_is_exact_and_the_hopeless_ones_stay_rough() -> None:
    """An early evaluation is optimistic; what is worse even so is not evaluated again, and broken ones never are."""
    seconds = {"a": (2.0, 9.0, 9.0), "b": (4.0, 5.0, 6.0), "c": (20.0, 21.0, 22.0), "d": (1.0, 1.0, 1.0)}
    asked: list[str] = []

    def closer(draws: int | None, rounds: int, experiment: Experiment) -> Judged:
        name = "abcd"[int(experiment.seconds)]
        asked.append(name)
        return Judged(experiment, seconds=seconds[name][asked.count(name)], probability=1.0)

    judged = [
        Judged(Experiment(LOUD.excitation, float(k)), seconds=seconds[name][0], broken="travel" * (name == "d")) for k, name in enumerate("abcd")
    ]
    order = best_first(judged, closer)
    assert [int(next(order).experiment.seconds) for _ in range(2)] == [1, 0]
    assert sorted(asked) == ["a", "a", "b", "b"]


def test_probability_follows_from_the_evidence_and_needs_seconds() -> None:
    """Zero evidence never settles; ten times the odds do; the needed seconds are those at which 95 % is reached."""
    one = Power(truth=0, rate=1.0, price=0.0)
    assert Power(0, 0.0, 0.0).probability(60.0) == 0.0
    assert one.probability(30.0 * ODDS) > 0.999
    needed = seconds_needed([[one]], 1000.0)
    assert settled([[one]], needed) == pytest.approx(0.95, abs=1e-6)
    assert seconds_needed([[one]], 0.5 * needed) == np.inf


def test_the_present_data_count_once_and_not_for_every_second() -> None:
    """Of 12 nats in 4 s the rival loses 8 on the present data; of a longer experiment only the other 4 grow."""
    one = Power(truth=0, rate=1.0, price=0.0, nats=12.0, seen=4.0)
    assert [one.after(seconds) for seconds in (-1.0, 0.0, 2.0, 4.0, 10.0)] == [0.0, 0.0, 6.0, 12.0, 18.0]


def test_what_an_experiment_shows_once_on_the_way_is_no_evidence_for_its_whole_duration() -> None:
    """A joint that is pulled to another place and held there by a quiet signal: gravity and a spring differ on the way only."""
    pair = next(pair for pair in PAIRS if pair.sets[0] == ("gravity",))
    data = prepare_all(1000.0, [first_recording(pair, machine(pair, 0, 3), 3)])
    beliefs = beliefs_of(data, STANDARD, standing(data, STANDARD, pair.sets), limits(pair).travel, 1)
    setting = Setting.of(data)
    held = next(item for item in proposals(limits(pair), 1000.0) if item.excitation.offset > 0.0 and item.excitation.rms < 0.01)
    gravity = next(belief for belief in beliefs if belief.effects == ("gravity",))
    spring = next(belief for belief in beliefs if belief.effects == ("return_spring",))
    motion = recorded(setting, held, gravity.model, 0.0).motion
    whole, steady = (nats((gravity, spring), gravity.model, seen(setting, motion, since))[0] for since in (0.0, 0.5 * setting.looked))
    assert whole > 4.0 * steady


def test_base_or_screw_is_asked_of_a_person() -> None:
    """One motor encoder sees the same equations: no experiment is proposed, and the answer asks for another payload."""
    found = diagnose([recorded_machine("base_resonance", seconds=20.0).run("x")])
    asked = next_experiment(found, MachineLimits(voltage=5.0, travel=(-0.14, 0.14)))
    assert asked.experiment is None and asked.sets == (("base_resonance",), ("screw_compliance",))
    assert "are the same: no experiment can favour one of them" in asked.sentence and "Change the payload" in asked.ask


def test_an_experiment_that_the_budget_makes_shorter_promises_less() -> None:
    """The stated probability is that of its actual length."""
    one = Power(truth=0, rate=1.0, price=0.0)
    needed = seconds_needed([[one]], 1000.0)
    best = Judged(Experiment(AxisExcitation(kind="noise"), 60.0), seconds=needed, probability=1.0, each=((one,),))
    two: Any = (SimpleNamespace(name="drag"), SimpleNamespace(name="lag"))
    made = Design(beliefs=two, limits=MachineLimits(voltage=5.0, travel=(-0.1, 0.1)), best=best, tried=(best,), rate=2000.0)
    whole, short = made.lasting(needed + RAMP + 1.0), made.lasting(0.7 * needed)
    assert whole.possible and expects(whole) == f"After {needed + RAMP + 1.0:.0f} s, drag and lag are distinguished with 95 % probability."
    assert not short.possible and short.best is not None and 0.5 < short.best.probability < 0.95
    assert expects(short).startswith("No experiment within the limits is sure to distinguish drag and lag")
    chance = f"{100.0 * short.best.probability:.0f} %"
    left = f"In the {0.7 * needed:.0f} s that the budget leaves, drag and lag are distinguished with {chance} probability"
    assert expects(short, 60.0) == f"{left}; 60 s were designed."
    assert expects(made.lasting(1.5), 60.0).startswith("In the 2 s that the budget leaves"), "whatever little it promises"


def test_an_experiment_that_ends_early_promises_what_its_own_seconds_bring() -> None:
    """If no experiment settles, it ends when more time gains little; the stated probability is that at its end, not for all seconds."""
    one = Power(truth=0, rate=0.01, price=3.0)
    whole = 400.0
    item = Judged(Experiment(AxisExcitation(kind="noise")), probability=settled([[one]], whole - RAMP), each=((one,),))
    timed = _timed(item, MachineLimits(voltage=5.0, travel=(-0.1, 0.1), seconds=whole))
    assert timed.experiment.seconds < whole and not np.isfinite(timed.seconds)
    assert timed.probability == settled([[one]], timed.experiment.seconds - RAMP) < item.probability


def test_a_set_with_one_law_twice_is_refused(data: AxisData) -> None:
    """Coulomb friction is a special case of asymmetric friction."""
    with pytest.raises(BadInput, match="each law once"):
        standing(data, STANDARD, [("coulomb_friction", "asymmetric_friction")])


def test_no_set_that_may_be_true_has_a_law_twice(data: AxisData) -> None:
    """A load with Coulomb friction equals asymmetric friction, which replaces both."""
    sets = possible(data, STANDARD, Answer(rungs=(), best=("constant_load", "coulomb_friction")))
    assert len(sets) > 1 and not any(is_twice(STANDARD, each) for each in sets)


def test_where_backlash_is_named_nothing_is_settled_among_what_looks_like_it(data: AxisData) -> None:
    """Otherwise it would be left out of the sets, and another one called settled."""
    with pytest.raises(BadInput, match=r"effect that is named is backlash; allowed: effects that free simulation can predict.*Its own experiment"):
        possible(data, STANDARD, Answer(rungs=(), best=("backlash",)))


def test_look_alikes_stand_where_what_they_look_like_stands(data: AxisData) -> None:
    """Sets keep the order of the named effects, and none is repeated in another order."""
    sets = possible(data, STANDARD, Answer(rungs=(), best=("saturation", "cogging")))
    assert ("saturation", "lead_error") in sets and len({frozenset(each) for each in sets}) == len(sets)


def test_sets_with_the_same_equations_are_not_settled_by_their_names() -> None:
    """A flexible base and a flexible screw: no data distinguish the two, so both remain, and nothing is called settled."""
    one = recorded_machine("base_resonance", seconds=8.0)
    run = one.run("x")
    data = prepare_all(run.sampling_rate, [(run.voltage, run.position)])
    sets = [("base_resonance",), ("screw_compliance",)]
    found = standing(data, STANDARD, sets)
    left = [belief.effects for belief in beliefs_of(data, STANDARD, found, draws=1)]
    assert sorted(left) == sorted(sets)
    assert Decision(found, tuple(left), NextChoice(None)).over() == "impossible"


def test_an_effect_that_no_simulation_follows_is_refused(data: AxisData) -> None:
    """Backlash needs one-step prediction: an error of one line says so."""
    with pytest.raises(BadInput, match="backlash"):
        standing(data, STANDARD, [(), ("backlash",)])


def test_an_interval_is_as_narrow_as_was_predicted(data: AxisData) -> None:
    """The experiment for the pole of the rigid model: the interval of a fit of both recordings is within a quarter of
    what was expected. For what is known well enough, none is proposed.
    """
    made = machine(LAG, 0, 3)
    first = prepare_all(2000.0, [first_recording(LAG, made, 3)])
    rigid = standing(first, STANDARD, [()]).fits[0]
    assert sharpest(first, rigid, limits(LAG), Precision("gain", 0.2)).experiment is None
    best = sharpest(first, rigid, limits(LAG), Precision("pole", 0.005))
    assert best.possible and best.experiment is not None and best.width < best.before
    both = prepare_all(2000.0, [first_recording(LAG, made, 3), carry_out(made, best.experiment)])
    pole = fit(both, rigid.model).parameter("pole")
    assert 0.5 * (pole.high - pole.low) / pole.value == pytest.approx(best.width, rel=0.25)


def test_the_campaign_makes_a_table_of_its_lines() -> None:
    """A line of a case is counted once for its pair, and once for all."""
    line = {"pair": "lag", "first_settled": False, "first_right": True, "right": True, "ended": "settled", "seconds": 4.0, "runs": 1, "outside": 0}
    said = table([line, {**line, "right": False, "ended": "experiments"}])
    assert "| lag | 0 of 2 | 2 of 2 | 1 of 2 | 1 of 2 | 4 |" in said
    assert "that left a limit: 0" in said
