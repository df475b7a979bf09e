"""The search over sets of effects: tested and kept sets, and its end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.simulated import recorded

from xy_sim.machine import Machine
from xy_sysid.axis.model import STANDARD
from xy_sysid.diagnosis.refine import Effort, refine
from xy_sysid.diagnosis.rungs import with_one_more
from xy_sysid.diagnosis.sets import contains
from xy_sysid.excitation.lockstep import drive
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import GreyboxFit, fit, fit_base
from xy_sysid.hypotheses.compare import Gain, gain, size
from xy_sysid.hypotheses.criteria import AT_FLOOR, MOST_EFFECTS
from xy_sysid.hypotheses.moves import is_twice, moves
from xy_sysid.hypotheses.pool import Pool
from xy_sysid.settings import AxisExcitation, ExcitationSettings
from xy_sysid.units import Units


def data_of(effect: str, seconds: float = 20.0) -> AxisData:
    return prepare(2000.0, *recorded(effect, seconds=seconds).axis("x"))


def searched(data: AxisData, most: int = MOST_EFFECTS) -> tuple[Pool, list[frozenset[str]]]:
    """The pool after a search, and the sets that were said to be tried."""
    pool = Pool(data, STANDARD, most=most)
    pool.add_first(fit_base(data))
    return pool, [*pool.search(), *pool.simplified()]


@pytest.fixture(scope="module")
def both() -> tuple[Pool, list[frozenset[str]]]:
    """Of friction and cogging."""
    return searched(data_of("coulomb_friction+cogging"))


def test_both_effects_are_found(both: tuple[Pool, list[frozenset[str]]]) -> None:
    """One after the other or at once; the residual error is at the floor."""
    pool, _ = both
    assert pool.best.effects == {"coulomb_friction", "cogging"}
    assert pool.best.fit.excess < AT_FLOOR


def test_no_set_is_tried_twice(both: tuple[Pool, list[frozenset[str]]]) -> None:
    """Each announced set is fitted afterwards, once."""
    pool, tried = both
    assert len(set(tried)) == len(tried)
    assert {*tried, frozenset()} >= set(pool.nodes)


def test_the_same_data_give_the_same_search(both: tuple[Pool, list[frozenset[str]]]) -> None:
    """Equal bit for bit."""
    pool, tried = both
    again, same = searched(data_of("coulomb_friction+cogging"))
    assert same == tried
    assert again.best.fit.model == pool.best.fit.model
    assert np.array_equal(again.best.fit.error, pool.best.fit.error)


def test_an_axis_at_the_floor_asks_for_no_fit() -> None:
    """Nothing is missing, so no set is tested."""
    pool, tried = searched(data_of(""))
    assert tried == []
    assert pool.best.effects == frozenset()


def test_no_set_has_more_effects_than_were_asked_for() -> None:
    """At most one set is tested then."""
    pool, tried = searched(data_of("coulomb_friction+cogging"), most=1)
    assert all(len(effects) == 1 for effects in tried)
    assert len(pool.best.effects) <= 1


def test_every_set_has_what_is_given() -> None:
    """And the second missing effect."""
    data = data_of("coulomb_friction+cogging")
    pool = Pool(data, STANDARD, frozenset({"cogging"}))
    base = fit_base(data)
    pool.add_first(with_one_more(data, STANDARD, base, base, "cogging"))
    assert all("cogging" in effects for effects in [*pool.search(), *pool.simplified()])
    assert pool.best.effects == {"cogging", "coulomb_friction"}


def test_what_is_of_no_use_is_left_out_again() -> None:
    """A set with one effect too many becomes the set without it."""
    data = data_of("coulomb_friction")
    pool, _ = searched(data)
    crowded = frozenset({"coulomb_friction", "constant_load"})
    node = pool.with_screening_fit(crowded, lambda: [pool.best.fit.model.with_effect("constant_load", (0.001,))])
    assert node is not None
    pool.with_full_fit(node)
    pool.nodes[frozenset({"coulomb_friction"})].is_better = False
    pool.nodes[crowded].is_better = True
    assert pool.best.effects == crowded
    list(pool.simplified())
    assert pool.best.effects == {"coulomb_friction"}


def test_a_search_that_is_late_ends_with_the_best_so_far() -> None:
    """It ends after the current fit, and the answer says so."""
    ticks = iter(range(10_000))
    ladder = refine(data_of("coulomb_friction+cogging"), effort=Effort(budget=3.0, clock=lambda: float(next(ticks))))
    assert ladder.stopped
    assert np.isfinite(ladder.final.held_out_error)


def test_a_refused_set_is_never_best(both: tuple[Pool, list[frozenset[str]]]) -> None:
    """With any residual error."""
    pool, _ = both
    best = pool.best
    try:
        best.refused = "coulomb_friction: at its bound"
        assert pool.best is not best
    finally:
        best.refused = ""


def test_moves_hold_no_law_twice() -> None:
    """No set has two effects of a family, or a sum with one of its parts."""
    data = data_of("coulomb_friction+cogging")
    base = fit_base(data)
    assert is_twice(STANDARD, ["asymmetric_friction", "constant_load"])
    assert is_twice(STANDARD, ["coulomb_friction", "stribeck_friction"])
    assert not is_twice(STANDARD, ["coulomb_friction", "constant_load"])
    assert not any(is_twice(STANDARD, move.effects) for move in moves(data, STANDARD, base, base))


def test_the_better_of_two_fits_gains_and_a_fit_gains_nothing_over_itself(both: tuple[Pool, list[frozenset[str]]]) -> None:
    """Paired over the held-out windows, with its probability."""
    pool, _ = both
    rigid, best = pool.nodes[frozenset()], pool.best
    assert gain(best.fit, rigid.fit).is_sure and not gain(rigid.fit, best.fit).is_sure
    assert gain(best.fit, rigid.fit).probability > 0.999
    same = gain(best.fit, best.fit)
    assert same.nats == 0.0 and same.probability == 0.5 and not same.is_sure
    assert size(best.fit, rigid.fit) > 100.0
    assert size(best.fit, best.fit) == 0.0


def test_a_gain_in_every_window_is_sure_however_much_it_differs_and_one_in_a_single_window_is_not() -> None:
    """As of a spring, which acts most where the axis is far out."""

    def of(*each: float) -> Gain:
        return Gain(np.array(each), np.zeros(len(each), dtype=np.int64))

    assert of(147.0, 150.0, 286.0, 165.0, 145.0, 144.0, 152.0, 158.0, 150.0, 150.0, 149.0, 1413.0).is_sure
    assert not of(0.1, -0.1, 0.1, -0.1, 0.1, -0.1, 0.1, -0.1, 0.1, -0.1, 0.1, 1413.0).is_sure


def test_a_quick_fit_never_takes_the_place_of_one_on_all_data() -> None:
    """A better screening fit of a known set gets a full fit, too; if the time is up, the known fit is kept, and stays first."""
    pool, effects = Pool(data_of("coulomb_friction", seconds=5.0), STANDARD), frozenset({"coulomb_friction"})
    base = pool.add_first(fit_base(pool.data))
    whole = with_one_more(pool.data, STANDARD, base.fit, base.fit, "coulomb_friction")
    quick = fit(pool.data, whole.model, screening=True)
    known = pool.remember(effects, replace(quick, excess=quick.excess + 1.0), whole)
    pool.late = lambda: True
    assert pool.remember(effects, quick, quick, is_better=False) is known
    pool.late = lambda: False
    assert (
        pool.remember(effects, quick, quick, is_better=False).has_full_fit and pool.nodes[effects].has_full_fit and pool.best is pool.nodes[effects]
    )


def test_the_first_set_stays_as_it_was_given() -> None:
    """Answers are compared with its error, so no other fit replaces it."""
    pool = Pool(data_of("coulomb_friction", seconds=5.0), STANDARD)
    first = pool.add_first(fit_base(pool.data))
    first.fit = replace(first.fit, model=replace(first.fit.model, gain=2.0 * first.fit.model.gain))  # a refit of it would be better
    assert pool.with_screening_fit(frozenset(), lambda: [first.screening.model]) is first and pool.nodes[frozenset()] is first


def test_what_pulls_back_with_the_sine_of_an_angle_is_a_weight_and_no_wave() -> None:
    """A wave with a period of one turn is replaced by gravity, its special case with one parameter less."""
    machine = Machine.from_file("hanging.yaml")
    axis = AxisExcitation(rms=1.5, low=0.1, high=5.0, limit=8.0, centring=0.0, travel_min=-9.0, travel_max=9.0, brake=0.5, seed=3)
    made = drive(machine, ExcitationSettings(lockstep=True, speed=0.0, rate=1000.0, block=50, unit="rad", axes={"x": axis}), 30.0)
    data = prepare(1000.0, *made.axis("x"), units=Units("V", "rad"))
    pool = Pool(data, STANDARD)
    base = pool.add_first(fit_base(data)).fit
    weight = with_one_more(data, STANDARD, base, base, "gravity").model
    amplitude, phase = dict(weight.effects)["gravity"]
    wave = fit(data, weight.without("gravity").with_effect("cogging", (amplitude, 6.2, phase)))
    pool.remember(frozenset({"cogging"}), wave, wave)
    assert pool.best.effects == {"cogging"}
    assert frozenset({"gravity"}) in list(pool.simplified())
    assert pool.best.effects == {"gravity"}
    assert contains(STANDARD, frozenset({"cogging"}), frozenset({"gravity"}))
    assert not contains(STANDARD, frozenset({"gravity"}), frozenset({"cogging"}))


def test_friction_stays_the_answer_where_noise_keeps_the_error_above_the_floor() -> None:
    """Noise on the input is no gap: one is looked for, and not found."""
    voltage, position = recorded("coulomb_friction", seconds=20.0).axis("x")
    noisy = voltage + 0.05 * float(np.std(voltage)) * np.random.default_rng(4).normal(size=voltage.size)
    tried: list[frozenset[str]] = []
    found = refine(prepare(2000.0, noisy, position), trying=tried.append)
    assert found.effects == ("coulomb_friction",)
    assert found.final is not None and found.final.excess > AT_FLOOR
    assert any("backlash" in names for names in tried)


def test_a_quick_fit_tells_how_near_a_set_comes_by_the_first_set() -> None:
    """A set that is worse than the first does not lead to more screening fits."""
    pool = Pool(data_of("coulomb_friction", seconds=5.0), STANDARD)
    base = pool.add_first(fit_base(pool.data))
    near = pool._full_fit_limit()
    worse = replace(base.fit, scores=base.fit.scores + 1e4)
    pool.remember(frozenset({"gain_drift"}), worse, worse, is_better=False)
    assert pool._full_fit_limit() == near


@pytest.mark.parametrize("refused_at_first", [True, False])
def test_all_data_tell_whether_a_simpler_set_is_refused(refused_at_first: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A refused screening fit of a simpler set does not keep a set, and a set is not replaced by one that is refused with all data."""
    data, simple, crowded = data_of("coulomb_friction"), frozenset({"coulomb_friction"}), frozenset({"coulomb_friction", "constant_load"})
    pool = Pool(data, STANDARD)
    pool.add_first(fit_base(data))
    rigid = pool.best.fit
    both = with_one_more(data, STANDARD, rigid, with_one_more(data, STANDARD, rigid, rigid, "coulomb_friction"), "constant_load")
    pool.remember(crowded, fit(data, both.model, screening=True), both)

    def refusal(effects: frozenset[str], found: GreyboxFit) -> str:
        return "coulomb_friction: refused" if effects == simple and found.is_screening is refused_at_first else ""

    monkeypatch.setattr(pool, "_refusal", refusal)
    assert pool.best.effects == crowded
    list(pool.simplified())
    assert pool.best.effects == (simple if refused_at_first else crowded)
