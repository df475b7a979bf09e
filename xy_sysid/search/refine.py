"""Add effects, refit everything together, and watch the error on held-out data fall: the search, and what it comes to.

First sets of effects by free simulation (``best_first``); then simpler sets where they do as well. What free simulation cannot judge, a
gap, is tried by one-step prediction against the best simulation with the same freedom: after the first sets, where a gap that explains the
axis ends the search, and else in the end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass

import numpy as np

from xy_sysid.axis.loop_source import undoable
from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.effects._contract import Limits
from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.greybox.one_step import error_without
from xy_sysid.greybox.whitened import whitened_rms
from xy_sysid.search.beside_one_step import Grown, Wanted, grown
from xy_sysid.search.best_first import Node, Search
from xy_sysid.search.criteria import AT_FLOOR, BUDGET, FEWEST, FILTERED, FREE, LEAST, MOST_EFFECTS, WORTH
from xy_sysid.search.judge import FreeRunJudge, joined
from xy_sysid.search.ladder import Candidate, Ladder, Rival, Step, contains, part_explained
from xy_sysid.search.simplify import Simplifying, whole

Filtered = tuple[tuple[tuple[str, GreyboxFit], ...], float]


@dataclass(frozen=True, slots=True)
class Trying:
    """A set of effects that is about to be fitted."""

    effects: tuple[str, ...]


def never() -> float:
    """A clock that stands still: no budget ever ends."""
    return 0.0


@dataclass(frozen=True, slots=True)
class Effort:
    """How far a search goes.

    most: effects, besides those given; budget: s of processor time as ``clock`` tells it, after which it says the best it has
    size: what an effect must explain to be added, over what is left unexplained, as powers
    """

    most: int = MOST_EFFECTS
    budget: float = BUDGET
    clock: Callable[[], float] = never
    size: float = WORTH


def refine(data: AxisData, library: Library = STANDARD, given: Iterable[str] = (), effort: Effort | None = None) -> Ladder:
    """Add effects until nothing promises more; ``given`` are added first, in their order, unasked. See ``refine_steps``."""
    steps = refine_steps(data, library, given, effort)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            ladder: Ladder = end.value
            return ladder


def refine_steps(
    data: AxisData, library: Library = STANDARD, given: Iterable[str] = (), effort: Effort | None = None
) -> Generator[Trying, None, Ladder]:
    """The same, step by step: yields what is being tried, returns what it came to."""
    kept, effort = tuple(given), effort or Effort()
    until = math.inf  # what is given is fitted wholly
    judge = FreeRunJudge(data, library, lambda: effort.clock() > until)
    begun = effort.clock()
    fixed = _Fixed.of(judge, kept)
    first = min(effort.clock() - begun, 0.1 * effort.budget)  # at most: on a fresh machine the laws have been compiled by now
    until = effort.clock() + effort.budget - 2.0 * first  # the first fit counts, and the one in hand when the time is up takes as long
    ahead = fixed.steps[-1].fit.model.ahead
    if ahead is not None or effort.most == 0:
        return _given_alone(data, judge, fixed)
    search: Search[GreyboxFit] = Search(judge=judge, clock=effort.clock, budget=FREE * effort.budget, most=effort.most + len(kept), least=effort.size)
    across = None if kept else _Ahead(judge, search)
    for names in search.steps(fixed.steps[-1].fit, frozenset(kept)):
        yield Trying(tuple(sorted(names)))
        if across is not None and across.due:
            yield Trying(across.names)
            if across.explains():
                break
    settled = Simplifying(judge, search, frozenset(kept))
    if across is not None and across.found is not None:
        search.stopped = judge.late()
        return _ladder(judge, search, settled, fixed, across.found)
    while True:
        while settled.step():
            yield Trying(tuple(sorted(settled.now.effects)))
        if not search.goes_on(settled.now):
            break
        for names in search.steps_from(settled.now):
            yield Trying(tuple(sorted(names)))
        settled = Simplifying(judge, search, frozenset(kept))
    final = settled.now
    for _ in range(FEWEST):  # along a valley that bends the first fit did not come to its end
        if not final.fit.converged and not judge.late():
            final.fit = judge.whole(final.fit)
    search.stopped = search.stopped or judge.late()
    if not judge.late() and final.effects > frozenset(kept):
        for names in search.rivals(final.effects):
            yield Trying(tuple(sorted(names)))
    if final.fit.excess >= LEAST and across is not None:
        for name in across.names:
            yield Trying((name,))
            across.look(name, final)
    return _ladder(judge, search, settled, fixed, across.found if across is not None else None)


def settle(data: AxisData, now: GreyboxFit) -> GreyboxFit:
    """Without what is no longer needed, with simpler relatives where they do as well, and one law for several that are the same."""
    if now.model.ahead is not None:
        return now
    judge = FreeRunJudge(data, now.model.library)
    search: Search[GreyboxFit] = Search(judge=judge, clock=never, budget=BUDGET, most=MOST_EFFECTS, least=WORTH)
    names = frozenset(name for name, _ in now.model.effects)
    search.nodes[names] = Node(effects=names, fit=now, brief=now, parameters=sum(len(values) for _, values in now.model.effects), whole=True)
    settling = Simplifying(judge, search, frozenset())
    while settling.step():
        pass
    return joined(data, settling.now.fit)


@dataclass(frozen=True, slots=True)
class _Fixed:
    """Effects that were given, and their rungs."""

    names: tuple[str, ...]
    steps: tuple[Step, ...]

    @staticmethod
    def of(judge: FreeRunJudge, names: tuple[str, ...]) -> _Fixed:
        steps = [Step(None, judge.begin())]
        for name in names:
            steps.append(Step(name, judge.added(steps[-1].fit, name)))
        return _Fixed(names, tuple(steps))


def _given_alone(data: AxisData, judge: FreeRunJudge, fixed: _Fixed) -> Ladder:
    final = fixed.steps[-1].fit
    base = fixed.steps[0].fit
    noise = data.noise_floor
    explained = part_explained(data, base, final)
    return Ladder(
        steps=fixed.steps,
        final=final,
        effects=tuple(name for name, _ in final.model.effects),
        explained=explained,
        noise=noise,
        discrepancy=math.sqrt(max(final.held_out_error**2 - final.noise_floor**2, 0.0)),
    )


class _Ahead:
    """Effects that only one-step prediction can judge. Each is fitted once, and taken if it beats the best simulation with an autoregressive error.

    found: rungs, and that simulation's error one sample ahead, m/s
    """

    def __init__(self, judge: FreeRunJudge, search: Search[GreyboxFit]) -> None:
        self.judge, self.search = judge, search
        whole_record = judge.data.longest() is judge.data
        self.names = tuple(effect.name for effect in judge.library.acting if effect.one_step is not None and whole_record)
        self.fitted: dict[tuple[str, frozenset[str]], Grown] = {}
        self.found: Filtered | None = None
        self.asked: list[frozenset[str]] = []

    @property
    def due(self) -> bool:
        """After the first simulations, where these leave something, once; and once more beside forces that are found later."""
        best = self.search.best
        if not self.names or len(self.search.nodes) <= FEWEST or best.fit.excess < AT_FLOOR:
            return False
        return not self.asked or (len(self.asked) == 1 and best.effects not in self.asked and self._forces(best))

    def _forces(self, node: Node[GreyboxFit]) -> bool:
        """A filter can have all effects of a set beside the gap, and there are some."""
        effects = [self.judge.library[name] for name in node.effects]
        return bool(effects) and all(undoable(effect) and effect.category != "motion" for effect in effects)

    def explains(self) -> bool:
        """Whether one of them explains the axis down to the noise: then no more simulations need to be tried."""
        self.asked.append(self.search.best.effects)
        for name in self.names:
            self.look(name, self.search.best)
        if self.found is not None and self.found[0][-1][1].excess > 0.0:
            self.found = None
        return self.found is not None

    def look(self, name: str, best: Node[GreyboxFit]) -> None:
        """Take it if it beats a set, and the best of all."""
        if self.found is not None:
            return
        data = self.judge.data
        whole(self.judge, self.search.best)
        later = np.arange(data.velocity.size) >= data.training
        try:
            bar = min(whitened_rms(node.fit.error, later) for node in (best, self.search.best))
        except BadInput:  # too little data for any prediction
            return
        if not FILTERED * bar > data.floor.encoder * data.sampling_rate:
            return
        for node in self._begins(best):
            fitted = self._fitted(name, node, FILTERED * bar)
            if fitted is None:
                return
            last, without = fitted.rungs[-1][1], error_without(data, fitted.found)
            if name in last.model and last.held_out_error < FILTERED * min(bar, without):
                self.found = (*self._up_to(node), *fitted.rungs), bar
                return

    def _up_to(self, node: Node[GreyboxFit]) -> list[tuple[str, GreyboxFit]]:
        """Rungs up to a set, of the fits that are known."""
        names = [name for name, _ in node.fit.model.effects]
        known = [(names[count], self.search.nodes.get(frozenset(names[: count + 1]))) for count in range(len(names))]
        return [(name, whole(self.judge, found)) for name, found in known if found is not None]

    def _begins(self, best: Node[GreyboxFit]) -> list[Node[GreyboxFit]]:
        """The rigid base, and the best set if a filter can have all of it: a large force beside a gap hides it."""
        rigid = self.search.nodes[frozenset()]
        return [rigid, best] if self._forces(best) else [rigid]

    def _fitted(self, name: str, node: Node[GreyboxFit], bar: float) -> Grown | None:
        """The effect and what is beside it, beginning from a set; each is fitted once. None if it is too late, or there is no fit."""
        key = name, node.effects
        if key not in self.fitted:
            if self.judge.late():
                self.search.stopped = True
                return None
            try:
                wanted = Wanted(Limits(bar, self.judge.late), self.search.least, self.judge.refusal)
                self.fitted[key] = grown(self.judge.data, whole(self.judge, node), self.judge.library[name], wanted)
            except np.linalg.LinAlgError:
                return None
        return self.fitted[key]


def _ladder(
    judge: FreeRunJudge,
    search: Search[GreyboxFit],
    settled: Simplifying,
    fixed: _Fixed,
    filtered: Filtered | None,
) -> Ladder:
    data, node = judge.data, settled.now
    base = fixed.steps[0].fit
    tried = sorted(
        (Candidate(next(iter(item.effects)), item.promised, item.fit) for item in search.nodes.values() if len(item.effects) == 1),
        key=lambda item: item.fit.excess if item.fit else math.inf,
    )
    refused = tuple((tuple(sorted(item.effects)), item.refused) for item in search.nodes.values() if item.refused)
    if filtered is not None:
        rungs, bar = filtered
        last = rungs[-1][1]
        names = tuple(name for name, _ in last.model.effects)
        noise = last.noise_floor
        explained = 1.0 - max(last.held_out_error**2 - noise**2, 0.0) / max(bar**2 - noise**2, 1e-300)
        return Ladder(
            steps=(Step(None, base), *(Step(name, fit) for name, fit in rungs)),
            final=last,
            effects=names,
            tried=(next(Candidate(name, 0.0, fit) for name, fit in rungs if fit.model.ahead is not None), *tried),
            rivals=(Rival(tuple(sorted(node.effects)), node.fit, 2.0 * math.log(bar / last.held_out_error)),),
            sizes=dict.fromkeys(names, (bar / last.held_out_error) ** 2 - 1.0),
            refused=refused,
            explained=explained,
            noise=noise,
            discrepancy=math.sqrt(max(last.held_out_error**2 - noise**2, 0.0)),
            stopped=search.stopped,
        )
    final, own = joined(data, node.fit, judge.late), settled.sizes()
    names = tuple(name for name, _ in final.model.effects)
    sizes = {name: [own[part] for part in _parts(judge.library, name) if part in own] for name in names}
    ordered = tuple(sorted(names, key=lambda name: -max(sizes[name], default=0.0)))
    ordered = (*fixed.names, *(name for name in ordered if name not in fixed.names))
    rivals = sorted(
        (
            Rival(tuple(sorted(item.effects)), item.fit, item.fit.excess - node.fit.excess)
            for item in search.nodes.values()
            if item is not node and 0 < len(item.effects) <= len(node.effects) and not item.refused and not item.effects < node.effects
            if not contains(judge.library, item.effects, node.effects)
        ),
        key=lambda item: item.behind,
    )
    return Ladder(
        steps=(*fixed.steps, *_rungs(judge, search, fixed, ordered, final)),
        final=final,
        effects=ordered,
        tried=tuple(tried),
        rivals=tuple(rivals),
        sizes={name: min(each) for name, each in sizes.items() if each},
        astray=max((_astray(data, settled, name) for name in node.effects if judge.library[name].category == "motion"), default=0.0),
        helps=1.0 - min(judge.rest(item.fit, base) for item in search.nodes.values() if item.whole and not item.refused),
        refused=refused,
        explained=part_explained(data, base, final),
        noise=data.noise_floor,
        discrepancy=math.sqrt(max(final.held_out_error**2 - data.noise_floor**2, 0.0)),
        stopped=search.stopped,
    )


def _parts(library: Library, name: str) -> tuple[str, ...]:
    """An effect, and what it is the sum of."""
    whole = library[name].sum_of
    return (name,) if whole is None else (name, *whole.parts)


def _astray(data: AxisData, settled: Simplifying, name: str) -> float:
    """Amplitude of what is left beyond the noise where a mode acts, over what it does there.

    A mode is linear and does not change: what it leaves just where it acts is of another law. What dirt leaves lies elsewhere.
    """
    with_it, without = settled.now.fit.power, settled.best_without(name).fit.power
    acts = np.maximum(without - with_it, 0.0)
    weight = data.layout.lines * acts
    left = float(np.sum(weight * np.maximum(with_it - data.floor.noise, 0.0)))
    return min(math.sqrt(left / max(float(np.sum(weight * acts)), 1e-300)), 1.0)


def _rungs(judge: FreeRunJudge, search: Search[GreyboxFit], fixed: _Fixed, names: tuple[str, ...], final: GreyboxFit) -> list[Step]:
    """One rung for each effect, in this order, the fits that are known already taken from memory."""
    steps: list[Step] = []
    now = fixed.steps[-1].fit
    for name in names[len(fixed.names) :]:
        so_far = frozenset(own for own, _ in now.model.effects) | {name}
        if so_far == frozenset(own for own, _ in final.model.effects):
            now = final
        else:
            known = search.nodes.get(so_far)
            now = judge.added(now, name) if known is None or known.refused else whole(judge, known)
        steps.append(Step(name, now))
    return steps
