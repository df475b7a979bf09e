"""The search with a judge that only looks numbers up: what is tried in which order, what is remembered, and what ends it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import exp, inf

import pytest

from xy_sysid.hypotheses.criteria import FEWEST
from xy_sysid.hypotheses.criteria import LEAST as SMALLEST
from xy_sysid.judge.contract import Move
from xy_sysid.search.best_first import Node, Search

Set = frozenset[str]
LEAST = 0.02  # of what is left, for an effect to be worth its name


def of(*names: str) -> Set:
    return frozenset(names)


@dataclass(frozen=True)
class Looked:
    """A fit that was looked up."""

    effects: Set
    excess: float


@dataclass
class Table:
    """A judge that knows what each set leaves (nats), and what each move from it promises; it writes down what it was asked.

    leaves: a set that is not there cannot be fitted; promises: from a set, (effects to add, gain)
    simpler: the set with a simpler relative, for a set that has one; astray: what a set leaves if it is fitted from this other one
    lost: what two sets have come to helps no fit of both
    slowly: from a set, (effects to add, gain) that only all data show; briefly: what a set leaves of the first stage's data, where that differs
    posed: an effect, and what it may have been taken for; begins: what a move to a set leaves before any fit
    """

    leaves: Mapping[Set, float]
    promises: Mapping[Set, Sequence[tuple[Set, float]]]
    refuses: Mapping[Set, str] = field(default_factory=dict)
    dry: Set = frozenset()
    parameters: Mapping[str, int] = field(default_factory=dict)
    simpler: Mapping[Set, Set] = field(default_factory=dict)
    astray: Mapping[tuple[Set, Set], float] = field(default_factory=dict)
    lost: bool = False
    slowly: Mapping[Set, Sequence[tuple[Set, float]]] = field(default_factory=dict)
    briefly: Mapping[Set, float] = field(default_factory=dict)
    posed: Mapping[str, str] = field(default_factory=dict)
    begins: Mapping[tuple[Set, Set], float] = field(default_factory=dict)
    briefs: list[Set] = field(default_factory=list)
    mergers: list[tuple[Set, Set]] = field(default_factory=list)
    wholes: list[Set] = field(default_factory=list)

    def moves(self, now: Looked, brief: Looked) -> list[Move]:
        return self.promised(now, self.promises)

    def slow_moves(self, now: Looked, brief: Looked) -> list[Move]:
        return self.promised(now, self.slowly)

    def promised(self, now: Looked, promises: Mapping[Set, Sequence[tuple[Set, float]]]) -> list[Move]:
        return [
            Move(
                effects=now.effects | added,
                gain=gain,
                rest=10.0,
                parameters=sum(self.parameters.get(name, 1) for name in added),
                starts=tuple((name, (1.0,)) for name in sorted(added)),
                expected=added <= self.dry,
                simpler=self.simpler.get(now.effects | added, frozenset()),
                begins=self.begins.get((now.effects, now.effects | added), inf),
            )
            for added, gain in promises.get(now.effects, ())
        ]

    def taken_for(self, now: Looked) -> list[Move]:
        there = [(name, other) for name, other in self.posed.items() if name in now.effects]
        return [
            Move(effects=now.effects - {name} | {other}, gain=0.0, rest=0.0, parameters=0, starts=((other, (1.0,)),), replaced=name)
            for name, other in there
        ]

    def brief(self, now: Looked, move: Move, hopeless: float = inf) -> Looked | None:
        if move.effects == now.effects:  # the first set once more, so that brief fits are compared with a brief one
            return now
        self.briefs.append(move.effects)
        if (now.effects, move.effects) in self.astray:
            return Looked(move.effects, self.astray[now.effects, move.effects])
        if move.effects not in self.leaves:
            return None
        return Looked(move.effects, self.briefly.get(move.effects, self.leaves[move.effects]))

    def merged(self, now: Looked, others: Looked) -> Looked | None:
        effects = now.effects | others.effects
        self.mergers.append((now.effects, others.effects))
        return Looked(effects, self.leaves[effects]) if effects in self.leaves and not self.lost else None

    def whole(self, found: Looked) -> Looked:
        self.wholes.append(found.effects)
        return Looked(found.effects, self.leaves[found.effects]) if found.effects in self.briefly else found

    def refusal(self, found: Looked) -> str:
        return self.refuses.get(found.effects, "")

    def size(self, found: Looked, before: Looked) -> float:
        return exp(before.excess - found.excess) - 1.0


def never() -> float:
    return 0.0


class Ticking:
    """A clock that goes on by one second whenever somebody looks."""

    def __init__(self) -> None:
        self.now = -1.0

    def __call__(self) -> float:
        self.now += 1.0
        return self.now


def searched(judge: Table, clock: object = None, budget: float = 10.0, most: int = 4, least: float = LEAST) -> tuple[Search[Looked], list[Set]]:
    """A search from the empty set, gone to its end, and what it said it would try."""
    search: Search[Looked] = Search(judge, clock if callable(clock) else never, budget, most, least)
    return search, list(search.steps(Looked(of(), judge.leaves[of()])))


def all_of(*moves: tuple[Iterable[str], float]) -> list[tuple[Set, float]]:
    return [(frozenset(names), gain) for names, gain in moves]


def test_the_most_promising_is_tried_first() -> None:
    """Whatever the order in which the judge names the moves."""
    promises = {of(): all_of(("a", 0.5), ("b", 1.5), ("c", 1.0))}
    leaves = {of(): 3.0, of("a"): 2.9, of("b"): 2.9, of("c"): 2.9}
    _, tried = searched(Table(leaves, promises))
    assert tried[:2] == [of("b"), of("c")]


def test_of_two_that_promise_the_same_the_simpler_is_tried_first() -> None:
    """Three parameters against one."""
    promises = {of(): all_of(("a", 0.3), ("b", 0.3))}
    leaves = {of(): 3.0, of("a"): 2.0, of("b"): 2.0}
    _, tried = searched(Table(leaves, promises, parameters={"a": 3}))
    assert tried == [of("b"), of("a")]


def test_what_is_known_of_a_start_weighs_as_much_as_what_is_promised() -> None:
    """A promise far beyond what is left is no more than a promise; a start that leaves little is certain."""
    judge = Table({of(): 9.0, of("a"): 8.9, of("b"): 2.0}, {of(): all_of(("a", 2.5), ("b", 0.2))}, begins={(of(), of("b")): 3.0}, parameters={"b": 4})
    assert searched(judge)[1][0] == of("b")


def test_of_a_set_that_all_data_show_anew_the_brief_fit_is_not_done_again() -> None:
    """What it left of the first stage's data is known; what it leaves of all is asked."""
    judge = Table(
        {of(): 3.0, of("a"): 1.5, of("a", "b"): 0.5},
        {of(): all_of(("a", 1.0)), of("a"): all_of(("b", 0.3))},
        slowly={of("a"): all_of(("b", 1.0))},
        briefly={of("a"): 1.0, of("a", "b"): 0.995},
    )
    search, _ = searched(judge)
    assert judge.briefs.count(of("a", "b")) == 1 and of("a", "b") in judge.wholes
    assert search.best.effects == of("a", "b")


def test_of_two_that_promise_the_same_friction_is_tried_first() -> None:
    """Every machine has it."""
    promises = {of(): all_of(("a", 0.4), ("b", 0.4))}
    leaves = {of(): 3.0, of("a"): 2.0, of("b"): 2.0}
    _, tried = searched(Table(leaves, promises, dry=of("b")))
    assert tried[0] == of("b")


def test_a_simpler_relative_is_tried_before_a_richer_one_that_promises_more() -> None:
    """Its fit is a start for the richer one that nothing has led astray; once that start is known, the richer is not begun without it."""
    promises = {of(): all_of(("r", 2.5), ("s", 0.5)), of("s"): all_of(("r", 1.0))}
    leaves = {of(): 3.0, of("s"): 1.0, of("r"): 2.9, of("r", "s"): 0.01}
    _, tried = searched(Table(leaves, promises, simpler={of("r"): of("s")}))
    assert tried == [of("s"), of("r", "s")]


def test_a_richer_relative_is_tried_though_the_simpler_one_leads_nowhere() -> None:
    """Alone the simpler explains nothing, so nothing goes on from there."""
    promises = {of(): all_of(("r", 2.5), ("s", 0.5))}
    search, tried = searched(Table({of(): 3.0, of("s"): 3.0, of("r"): 0.5}, promises, simpler={of("r"): of("s")}))
    assert tried == [of("s"), of("r")]
    assert search.best.effects == of("r")


def test_a_fit_that_left_more_than_a_set_within_it_is_fitted_again_from_that() -> None:
    """From a it went astray: a and b together cannot explain less than b alone."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.5)), of("a"): all_of(("b", 1.3)), of("b"): all_of(("a", 0.8))}
    leaves = {of(): 3.0, of("a"): 2.0, of("b"): 1.0, of("a", "b"): 0.1}
    search, tried = searched(Table(leaves, promises, astray={(of("a"), of("a", "b")): 1.9}))
    assert tried == [of("a"), of("a", "b"), of("b"), of("a", "b")]
    assert search.best.fit.excess == 0.1


@pytest.mark.parametrize("gone_astray", [2.9, None])
def test_what_went_astray_is_fitted_again_though_little_is_promised_there(gone_astray: float | None) -> None:
    """Two effects with a threshold each show little beside one another to first order; the promise of both together still stands."""

    class Faint(Table):
        def moves(self, now: Looked, brief: Looked) -> list[Move]:
            return [replace(move, rest=move.gain) for move in super().moves(now, brief)]

    promises = {of(): all_of(("ab", 1.5), ("a", 1.0)), of("a"): all_of(("b", 0.1), ("c", 0.2))}
    leaves = {of(): 3.0, of("a"): 1.0, of("a", "b"): 0.1, of("a", "c"): 1.0}
    if gone_astray is None:
        promises[of()] = all_of(("a", 1.0))
    search, _ = searched(Faint(leaves, promises, astray={(of(), of("a", "b")): gone_astray or 0.0}), least=0.7)
    assert search.best.fit.excess == (1.0 if gone_astray is None else 0.1)


@pytest.mark.parametrize("lost", [False, True])
def test_a_fit_that_gains_little_of_its_promise_is_begun_again_from_where_the_new_effect_was_alone(lost: bool) -> None:
    """The base of the one, the values of both; where that helps no more, the first fit stays."""
    promises = {of(): all_of(("a", 1.5), ("b", 1.4)), of("b"): all_of(("a", 1.0)), of("a"): all_of(("b", 0.1))}
    leaves = {of(): 3.0, of("a"): 2.5, of("b"): 1.5, of("a", "b"): 0.1}
    judge = Table(leaves, promises, astray={(of("b"), of("a", "b")): 1.4}, lost=lost)
    search, _ = searched(judge)
    assert judge.mergers == [(of("a"), of("b"))]
    assert search.best.fit.excess == (1.4 if lost else 0.1)


def test_the_simpler_of_two_sets_that_leave_the_same_is_best() -> None:
    """A parameter has a price."""
    promises = {of(): all_of(("a", 1.0), ("b", 1.0))}
    leaves = {of(): 3.0, of("a"): 1.0, of("b"): 1.0}
    search, tried = searched(Table(leaves, promises, parameters={"a": 2}))
    assert set(tried) == {of("a"), of("b")}
    assert search.best.effects == of("b")
    assert search.best.score == pytest.approx(1.0 + SMALLEST)


def test_a_parameter_that_gains_less_than_its_price_is_not_taken() -> None:
    """It was tried, and the set without it stays best."""
    promises = {of(): all_of(("a", 1.0)), of("a"): all_of(("b", 0.3))}
    leaves = {of(): 3.0, of("a"): 1.0, of("a", "b"): 1.0 - 0.5 * SMALLEST}
    search, tried = searched(Table(leaves, promises))
    assert tried == [of("a"), of("a", "b")]
    assert search.best.effects == of("a")


def test_nothing_is_fitted_twice() -> None:
    """a then b is b then a: one set, one fit, by memory."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.9), ("ab", 0.8)), of("a"): all_of(("b", 0.9)), of("b"): all_of(("a", 0.9))}
    leaves = {of(): 4.0, of("a"): 3.0, of("b"): 2.0, of("a", "b"): 1.0}
    judge = Table(leaves, promises)
    search, tried = searched(judge)
    assert set(tried) == {of("a"), of("b"), of("a", "b")}
    assert len(judge.briefs) == len(set(judge.briefs)) == len(tried)
    assert set(search.nodes) == {of(), *tried}


def test_what_is_said_before_is_what_is_fitted_after() -> None:
    """Each yield comes before its fit, so that whoever looks sees what is being done."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.9))}
    judge = Table({of(): 3.0, of("a"): 2.0, of("b"): 2.5}, promises)
    search: Search[Looked] = Search(judge, never, 10.0, 4, LEAST)
    steps = search.steps(Looked(of(), 3.0))
    first = next(steps)
    assert judge.briefs == []
    second = next(steps)
    assert judge.briefs == [first] != [second]


def test_only_what_is_near_the_best_is_fitted_wholly() -> None:
    """A brief fit that leaves much more costs no more time."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.9))}
    judge = Table({of(): 3.0, of("a"): 1.0, of("b"): 2.5}, promises)
    search, _ = searched(judge)
    assert judge.briefs == [of("a"), of("b")]
    assert judge.wholes == [of("a")]
    assert search.nodes[of("a")].whole and not search.nodes[of("b")].whole


@pytest.mark.parametrize(("left", "wholes"), [(3.0, [of("a")]), (3.1, [])])
def test_what_acts_slowly_is_fitted_on_all_data_unless_it_went_astray(left: float, wholes: list[Set]) -> None:
    """A brief fit does not show it, though all data promise it; one that leaves more than the set which it contains is another matter."""
    judge = Table({of(): 3.0, of("a"): left}, {of(): all_of(("a", 1.0))})
    searched(judge)
    assert judge.wholes == wholes


def test_it_goes_on_from_the_best_only() -> None:
    """What leads away from a worse set is not asked for."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.9)), of("a"): all_of(("c", 0.5)), of("b"): all_of(("d", 5.0))}
    leaves = {of(): 3.0, of("a"): 1.0, of("b"): 2.5, of("a", "c"): 0.5, of("b", "d"): 0.0}
    _, tried = searched(Table(leaves, promises))
    assert set(tried) == {of("a"), of("b"), of("a", "c")}


def test_two_at_once_are_found_where_neither_helps_alone() -> None:
    """Each alone leaves all; together they leave nothing."""
    promises = {of(): all_of(("a", 0.3), ("b", 0.2), ("ab", 0.9))}
    judge = Table({of(): 2.0, of("a"): 2.0, of("b"): 2.0, of("a", "b"): 0.01}, promises)
    search, tried = searched(judge)
    assert of("a", "b") in tried
    assert search.best.effects == of("a", "b")


def test_two_are_found_one_after_the_other_where_the_first_shows_the_second() -> None:
    """The rigid base promised the second nothing."""
    promises = {of(): all_of(("a", 1.0)), of("a"): all_of(("b", 0.9))}
    search, tried = searched(Table({of(): 2.0, of("a"): 1.0, of("a", "b"): 0.0}, promises))
    assert tried == [of("a"), of("a", "b")]
    assert search.best.effects == of("a", "b") and not search.stopped


def test_it_ends_where_nothing_is_left() -> None:
    """Moves that wait are not tried any more."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.9))}
    search, tried = searched(Table({of(): 2.0, of("a"): 0.5 * SMALLEST, of("b"): 0.0}, promises))
    assert tried == [of("a")]
    assert not search.stopped


def test_a_base_that_leaves_nothing_asks_for_no_fit() -> None:
    """A clean axis."""
    judge = Table({of(): 0.5 * SMALLEST, of("a"): 0.0}, {of(): all_of(("a", 1.0))})
    search, tried = searched(judge)
    assert tried == judge.briefs == []
    assert search.best.effects == of()


def test_it_ends_by_itself_where_nothing_promises_a_gain() -> None:
    """Less than the least gain and the price is not tried, and that is no stop."""
    little = 0.1 * SMALLEST
    search, tried = searched(Table({of(): 2.0, of("a"): 0.0}, {of(): all_of(("a", little))}))
    assert tried == []
    assert not search.stopped and search.best.effects == of()


def test_what_is_left_unexplained_could_feign_is_not_tried() -> None:
    """The gain is small against the whole error, though it is something in excess."""

    class Faint(Table):
        def moves(self, now: Looked, brief: Looked) -> list[Move]:
            return [Move(of("a"), 0.5, 0.01, 1, (("a", (1.0,)),))]

    judge = Faint({of(): 2.0, of("a"): 1.0}, {})
    search: Search[Looked] = Search(judge, never, 10.0, 4, 0.7)
    assert list(search.steps(Looked(of(), 2.0))) == []


def test_beside_what_explains_most_the_next_best_promise_is_tried_once_though_it_is_small() -> None:
    """First order sees a part of what an effect changes beside laws that bend; what promises less than that one stays."""

    class Bent(Table):
        def moves(self, now: Looked, brief: Looked) -> list[Move]:
            return [replace(move, rest=0.1) if now.effects else move for move in super().moves(now, brief)]

    promises = {of(): all_of(("a", 2.0)), of("a"): all_of(("b", 0.1), ("c", 0.2))}
    leaves = {of(): 4.0, of("a"): 2.0, of("a", "b"): 1.9, of("a", "c"): 0.0}
    search: Search[Looked] = Search(Bent(leaves, promises), never, 10.0, 4, 0.7)
    assert list(search.steps(Looked(of(), 4.0))) == [of("a"), of("a", "c")]
    search = Search(Bent(leaves | {of("a", "c"): 2.0}, promises), never, 10.0, 4, 0.7)
    assert list(search.steps(Looked(of(), 4.0))) == [of("a"), of("a", "c")]


def test_what_acts_slowly_is_looked_for_on_all_data_where_these_leave_more_than_their_beginning() -> None:
    """The first stage is explained and promises nothing more; the whole record is not."""
    slowly = {of("a"): all_of(("b", 1.0))}
    judge = Table({of(): 4.0, of("a"): 2.0, of("a", "b"): 0.0}, {of(): all_of(("a", 2.0))}, slowly=slowly, briefly={of("a"): 0.1})
    search, tried = searched(judge)
    assert tried == [of("a"), of("a", "b")] and search.best.effects == of("a", "b")
    alike = Table({of(): 4.0, of("a"): 2.0, of("a", "b"): 0.0}, {of(): all_of(("a", 2.0))}, slowly=slowly)
    assert searched(alike)[1] == [of("a")]


def test_it_goes_on_from_a_simpler_set_that_was_found_beside_it() -> None:
    """What a set promises that it never asked about is tried, and nothing is asked twice."""
    promises = {of(): all_of(("a", 2.0)), of("c"): all_of(("d", 1.5))}
    judge = Table({of(): 4.0, of("a"): 2.0, of("c"): 2.0, of("c", "d"): 0.0}, promises)
    search, _ = searched(judge)
    found = Looked(of("c"), 2.0)
    simpler = Node(effects=of("c"), fit=found, brief=found, parameters=1, whole=True)
    search.nodes[of("c")] = simpler
    assert list(search.steps_from(simpler)) == [of("c", "d")]
    assert list(search.steps_from(simpler)) == [] and search.best.effects == of("c", "d")
    assert simpler.led_on and not search.goes_on(simpler)
    search, _ = searched(judge, most=1)
    full = Node(effects=of("c"), fit=found, brief=found, parameters=1, whole=True)
    assert not search.goes_on(full) and list(search.steps_from(full)) == []


def test_what_every_machine_has_is_tried_though_the_whole_error_promises_little() -> None:
    """Friction that bends shows little to first order, and may explain much."""

    class Rough(Table):
        def moves(self, now: Looked, brief: Looked) -> list[Move]:
            return [Move(of("a"), 0.5, 0.01, 1, (("a", (1.0,)),), expected=True)] if not now.effects else []

    search: Search[Looked] = Search(Rough({of(): 2.0, of("a"): 1.0}, {}), never, 10.0, 4, 0.7)
    assert list(search.steps(Looked(of(), 2.0))) == [of("a")]


def test_from_a_set_whose_last_effect_is_not_worth_its_name_it_does_not_go_on() -> None:
    """It explains less than was asked of it over what is left; two at once must explain as much each."""
    promises = {
        of(): all_of(("a", 1.0)),
        of("a"): all_of(("b", 0.9), ("bc", 0.9)),
        of("a", "b"): all_of(("d", 2.0)),
        of("a", "b", "c"): all_of(("d", 2.0)),
    }
    leaves = {of(): 4.0, of("a"): 3.0, of("a", "b"): 2.7, of("a", "b", "c"): 2.3, of("a", "b", "d"): 0.5, of("a", "b", "c", "d"): 0.5}
    judge = Table(leaves, promises)
    search: Search[Looked] = Search(judge, never, 10.0, 4, 0.5)
    assert set(search.steps(Looked(of(), 4.0))) == {of("a"), of("a", "b"), of("a", "b", "c")}


def test_promises_that_are_not_kept_are_believed_less() -> None:
    """After a few tries from a set that brought nothing, moves of small promise are left alone; they are tried where tries bring much."""
    moves = [(of(name), 0.03) for name in "abcdefgh"]
    _, tried = searched(Table({of(): 2.0, **{names: 2.0 for names, _ in moves}}, {of(): moves}))
    assert len(tried) == FEWEST
    _, tried = searched(Table({of(): 2.0, **{names: 1.9 for names, _ in moves}}, {of(): moves}))
    assert len(tried) > FEWEST


def test_the_budget_stops_it_and_that_is_said() -> None:
    """One second for each try, three seconds: the best so far is the answer, and it was stopped."""
    names = "abcdefgh"
    promises = {of(): all_of(*((name, 3.0 - 0.1 * k) for k, name in enumerate(names)))}
    leaves = {of(): 3.0, **{of(name): 2.0 - 0.1 * k for k, name in enumerate(names)}}
    judge = Table(leaves, promises)
    search, tried = searched(judge, Ticking(), budget=3.0)
    assert search.stopped
    assert len(tried) == len(judge.briefs) == 3
    assert search.best.effects == min(tried, key=lambda names: leaves[names])
    endless, every = searched(Table(leaves, promises))
    assert not endless.stopped and len(every) > len(tried)


def test_a_search_that_ended_in_time_was_not_stopped() -> None:
    """Nothing promised anything any more before the time was up: that is an end, whatever the clock says then."""
    promises = {of(): all_of(("a", 1.0))}
    search, tried = searched(Table({of(): 2.0, of("a"): 1.0}, promises), Ticking(), budget=1.0)
    assert tried == [of("a")]
    assert not search.stopped


def test_it_can_be_left_at_any_time() -> None:
    """Whoever stops asking has the best so far."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.9))}
    search: Search[Looked] = Search(Table({of(): 3.0, of("a"): 2.0, of("b"): 1.0}, promises), never, 10.0, 4, LEAST)
    steps = search.steps(Looked(of(), 3.0))
    next(steps)
    assert search.best.effects == of()
    next(steps)
    assert search.best.effects == of("a")


def test_a_refused_set_is_never_best() -> None:
    """Though it leaves least; it is remembered with its reason, and nothing is built upon it."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.9)), of("a"): all_of(("c", 1.0))}
    judge = Table({of(): 2.0, of("a"): 0.5, of("b"): 1.0, of("a", "c"): 0.0}, promises, refuses={of("a"): "a: size is at its bound"})
    search, tried = searched(judge)
    assert of("a") in tried and of("a", "c") not in tried
    assert search.best.effects == of("b")
    assert search.nodes[of("a")].refused == "a: size is at its bound"


@pytest.mark.parametrize("refuses", [{}, {of("a", "spring"): "spring: it would give way"}], ids=["stands", "refused"])
@pytest.mark.parametrize("left", [1.0, 0.0])
def test_what_an_effect_may_have_been_taken_for_is_tried_in_its_place(refuses: Mapping[Set, str], left: float) -> None:
    """Where the effect leads, or would if it were not refused; once; and what stands and leaves nothing does not ask for it."""
    promises = {of(): all_of((("a", "spring"), 1.5)), of("a", "wave"): all_of(("b", 0.2))}
    leaves = {of(): 4.0, of("a", "spring"): left, of("a", "wave"): 0.2 * left, of("a", "b", "wave"): 0.0}
    search, tried = searched(Table(leaves, promises, refuses=refuses, posed={"spring": "wave"}))
    if left:
        assert tried == [of("a", "spring"), of("a", "wave"), of("a", "b", "wave")]
        assert search.best.effects == of("a", "b", "wave")
    else:
        assert tried == [of("a", "spring"), *([of("a", "wave")] if refuses else [])]
        assert search.best.effects == (of("a", "wave") if refuses else of("a", "spring"))


def test_what_does_not_lead_asks_for_nothing_in_its_place() -> None:
    """One brief fit for each that leads, and none for all others."""
    promises = {of(): all_of(("a", 1.0), (("spring",), 0.9))}
    judge = Table({of(): 4.0, of("a"): 3.0, of("spring"): 3.2, of("wave"): 3.1}, promises, posed={"spring": "wave"})
    assert searched(judge)[1] == [of("a"), of("spring")]


def test_what_leaves_as_much_as_the_refused_one_that_it_was_taken_for_stands() -> None:
    """It explains what that explained, and is not asked to explain more."""
    refuses = {of("spring"): "spring: it would give way"}
    judge = Table({of(): 4.0, of("spring"): 1.0, of("wave"): 1.0}, {of(): all_of((("spring",), 1.0))}, refuses=refuses, posed={"spring": "wave"})
    search, _ = searched(judge)
    assert search.best.effects == of("wave")


def test_where_all_are_refused_the_start_is_best() -> None:
    """And the search ends."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.9))}
    refuses = {of("a"): "no", of("b"): "no"}
    search, _ = searched(Table({of(): 2.0, of("a"): 0.0, of("b"): 0.0}, promises, refuses=refuses))
    assert search.best.effects == of()


def test_a_set_that_cannot_be_fitted_is_passed_over() -> None:
    """No fit is no answer, no node and no end of the search; it is not tried again."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.9))}
    judge = Table({of(): 2.0, of("b"): 1.0}, promises)
    search, tried = searched(judge)
    assert tried == [of("a"), of("b")]
    assert of("a") not in search.nodes and search.best.effects == of("b")


@pytest.mark.parametrize("most", [0, 1, 2])
def test_no_set_has_more_effects_than_were_asked_for(most: int) -> None:
    """Not even by two at once."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.9), ("ab", 1.2)), of("a"): all_of(("b", 0.9), ("c", 0.8)), of("a", "b"): all_of(("c", 0.8))}
    leaves = {of(): 5.0, of("a"): 3.0, of("b"): 4.0, of("a", "b"): 2.0, of("a", "c"): 2.5, of("a", "b", "c"): 1.0}
    search, tried = searched(Table(leaves, promises), most=most)
    assert all(len(names) <= most for names in tried)
    assert len(search.best.effects) == most


def test_a_rival_that_promised_as_much_is_fitted_in_the_end() -> None:
    """What was not tried, as the first did well at once, so that the runner-up is the true second; what promised little is not."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.95), ("c", 0.1))}
    judge = Table({of(): 2.0, of("a"): 0.0, of("b"): 0.5, of("c"): 1.9}, promises)
    search, tried = searched(judge)
    assert tried == [of("a")]
    assert list(search.rivals(of("a"))) == [of("b")]
    assert search.best.effects == of("a") and of("b") in search.nodes


@pytest.mark.parametrize("left", [0.1, None], ids=["explains", "no fit"])
def test_richer_relatives_of_the_best_are_tried_once_though_they_promise_nothing(left: float | None) -> None:
    """How a law bends is nothing to first order."""
    rich = Move(effects=of("rich"), gain=0.0, rest=0.0, parameters=2, starts=(("rich", (1.0,)),), replaced="a")

    class Related(Table):
        def moves(self, now: Looked, brief: Looked) -> list[Move]:
            return [rich] if now.effects == of("a") else super().moves(now, brief)

    leaves = {of(): 4.0, of("a"): 0.6} | ({} if left is None else {of("rich"): left})
    judge = Related(leaves, {of(): all_of(("a", 1.0))})
    search, tried = searched(judge)
    assert tried == [of("a"), of("rich")] and judge.briefs == tried
    assert search.best.effects == of("a" if left is None else "rich")


@pytest.mark.parametrize(("begins", "fits"), [(1.0, 2), (2.0, 1), (inf, 1)])
def test_a_set_that_left_more_than_another_way_to_it_begins_with_is_fitted_again(begins: float, fits: int) -> None:
    """Two at once went astray from nothing; beside the first, the second begins with less than that fit ended with."""
    promises = {of(): all_of(("ab", 3.9), ("a", 1.0)), of("a"): all_of(("b", 0.1))}
    judge = Table(
        {of(): 4.0, of("a"): 2.97, of("a", "b"): 0.0},
        promises,
        astray={(of(), of("a", "b")): 2.99},
        begins={(of("a"), of("a", "b")): begins, (of(), of("a", "b")): 0.5},
        lost=True,
    )
    search, tried = searched(judge)
    assert tried[0] == of("a", "b")
    assert judge.briefs.count(of("a", "b")) == fits
    assert search.best.effects == (of("a", "b") if fits == 2 else of("a"))


def test_a_rival_may_turn_out_to_be_better() -> None:
    """Then it is the best."""
    promises = {of(): all_of(("a", 1.0), ("b", 0.95))}
    search, _ = searched(Table({of(): 2.0, of("a"): 0.02, of("b"): 0.0}, promises))
    list(search.rivals(of("a")))
    assert search.best.effects == of("b")


def test_a_set_that_does_the_same_with_more_parameters_is_behind() -> None:
    """By their price, be it as rich as it may; what leaves less is ahead if that pays for them."""
    load, spring, better = (
        Node(of(name), Looked(of(name), left), Looked(of(name), left), count, whole=True)
        for name, left, count in (("load", 0.5, 1), ("spring", 0.5, 3), ("better", 0.4, 3))
    )
    assert spring.behind(load) == pytest.approx(2.0 * SMALLEST) == -load.behind(spring)
    assert better.behind(load) < 0.0


def test_the_same_search_twice_is_the_same() -> None:
    """Sets have no order, tries have."""
    promises = {of(): all_of(("a", 1.0), ("b", 1.0), ("c", 1.0), ("ab", 1.0), ("bc", 1.0)), of("b"): all_of(("a", 0.5), ("c", 0.5))}
    leaves = {of(): 3.0, of("a"): 2.5, of("b"): 1.5, of("c"): 2.5, of("a", "b"): 1.0, of("b", "c"): 1.0}
    assert searched(Table(leaves, promises))[1] == searched(Table(leaves, promises))[1]


def test_it_begins_from_what_is_given() -> None:
    """The given effects are in the first set, and moves add to them."""
    judge = Table({of("g"): 2.0, of("g", "a"): 1.0}, {of("g"): all_of(("a", 1.0))})
    search: Search[Looked] = Search(judge, never, 10.0, 4, LEAST)
    assert list(search.steps(Looked(of("g"), 2.0), of("g"))) == [of("g", "a")]
    assert search.best.effects == of("g", "a")
