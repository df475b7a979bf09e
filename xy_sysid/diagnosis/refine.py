"""Add effects, refit everything together, and watch the error on held-out data fall: the search, and what it comes to.

First sets of effects by free simulation (``best_first``); then simpler sets where they do as well. What free simulation cannot judge, a
gap, is tried by one-step prediction against the best simulation with the same freedom: after the first sets, where a gap that explains the
axis ends the search, and else in the end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.criteria import BUDGET, FEWEST, FREE, IN_HAND, LEAST, MOST_EFFECTS, WORTH
from xy_sysid.diagnosis.ladder import Ladder, part_explained
from xy_sysid.diagnosis.rungs import Given, ladder_of_given, ladder_of_search
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.jit import spent_compiling
from xy_sysid.judge.axis_judge import AxisJudge, joined
from xy_sysid.search.best_first import Node, Search
from xy_sysid.search.one_step_trials import OneStepTrials
from xy_sysid.search.simplify import Simplifying


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

    most: effects, besides those given; budget: s of processor time as ``clock`` tells it, after which it says the best it has; the time
        in which laws are compiled, once on a machine, does not count
    size: what an effect must explain to be added, over what is left unexplained, as powers
    """

    most: int = MOST_EFFECTS
    budget: float = BUDGET
    clock: Callable[[], float] = never
    size: float = WORTH

    def now(self) -> float:
        """s of the clock without what compiling took."""
        return self.clock() - spent_compiling()


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
    judge = AxisJudge(data, library, lambda: effort.now() > until)
    begun = effort.now()
    fixed = Given.of(judge, kept)
    first = min(effort.now() - begun, 0.1 * effort.budget)  # at most: code is read from the disk at its first use
    until = effort.now() + IN_HAND * effort.budget - first
    if fixed.steps[-1].fit.one_step or effort.most == 0:
        return ladder_of_given(data, judge, fixed)
    search: Search[GreyboxFit] = Search(judge=judge, clock=effort.now, budget=FREE * effort.budget, most=effort.most + len(kept), least=effort.size)
    return (yield from _Way(judge, search, fixed, None if kept else OneStepTrials(judge, search)).steps())


@dataclass(frozen=True, slots=True)
class _Way:
    """From a search that is made ready to what it comes to. Each part yields what is about to be fitted.

    fixed: what is given; across: what only one-step prediction can judge, or None where that is not asked for
    """

    judge: AxisJudge
    search: Search[GreyboxFit]
    fixed: Given
    across: OneStepTrials | None

    def steps(self) -> Generator[Trying, None, Ladder]:
        """Sets by simulation, the simplest that does the same, what helps most if that does little, and what no simulation can judge."""
        yield from self._sets()
        settled = self._settling()
        if self.across is not None and self.across.found is not None:
            self.search.stopped = self.judge.late()
        else:
            settled = yield from self._simplest(settled)
            yield from self._most_of_use(settled)
            yield from self._one_step(settled.now)
        return ladder_of_search(self.judge, self.search, settled, self.fixed, self.across.found if self.across is not None else None)

    def _settling(self) -> Simplifying:
        return Simplifying(self.judge, self.search, frozenset(self.fixed.names))

    def _sets(self) -> Iterator[Trying]:
        """The search, until a gap explains the axis."""
        for names in self.search.steps(self.fixed.steps[-1].fit, frozenset(self.fixed.names)):
            yield Trying(tuple(sorted(names)))
            if self.across is not None and self.across.due:
                yield Trying(self.across.names)
                if self.across.explains():
                    return

    def _simplest(self, settled: Simplifying) -> Generator[Trying, None, Simplifying]:
        """The simplest set that does the same, until neither what is beside it nor a rival of it is better."""
        while True:
            yield from _simpler(settled)
            final = settled.now
            if self.search.goes_on(final):
                for names in self.search.steps_from(final):
                    yield Trying(tuple(sorted(names)))
            else:
                self._converge(final)
                best, self.search.stopped = self.search.best, self.search.stopped or self.judge.late()
                if not self.judge.late() and final.effects > frozenset(self.fixed.names):
                    for names in self.search.rivals(final.effects):
                        yield Trying(tuple(sorted(names)))
                if self.search.best is best or self.search.best.score >= final.score - LEAST:
                    return settled
            settled = self._settling()

    def _converge(self, node: Node[GreyboxFit]) -> None:
        """Along a valley that bends the first fit did not come to its end."""
        for _ in range(FEWEST):
            if not node.fit.converged and not self.judge.late():
                node.fit = self.judge.whole(node.fit)

    def _most_of_use(self, settled: Simplifying) -> Iterator[Trying]:
        """Instead of a set that takes away less than it leaves, what takes away most of all that may be named, if that is more."""
        given, every = frozenset(self.fixed.names), self.search.nodes.values()
        nodes = [node for node in every if node.whole and node.leads and not node.refused and node.effects >= given]
        helps = max(nodes, key=self._explained)
        if not self._explains(settled.now) and self._explains(helps):
            settled.now = helps
            yield from _simpler(settled)

    def _one_step(self, final: Node[GreyboxFit]) -> Iterator[Trying]:
        """What no simulation can judge, where something is left; and with what it hides, where most is left."""
        if self.across is not None and final.fit.excess >= LEAST:
            for name in self.across.names:
                yield Trying((name,))
                self.across.look(name, final, last=True)
                if not self._explains(final):
                    self.across.look(name, final, last=True, hidden=True)

    def _explained(self, node: Node[GreyboxFit]) -> float:
        return part_explained(self.judge.data, self.fixed.steps[0].fit, node.fit)

    def _explains(self, node: Node[GreyboxFit]) -> bool:
        """A set takes away more of the error's power than it leaves: what is far off in many quiet bands may yet do that."""
        return self._explained(node) >= 0.5


def _simpler(settled: Simplifying) -> Iterator[Trying]:
    while settled.step():
        yield Trying(tuple(sorted(settled.now.effects)))


def settle(data: AxisData, now: GreyboxFit) -> GreyboxFit:
    """Without what is no longer needed, with simpler relatives where they do as well, and one law for several that are the same."""
    if now.one_step:
        return now
    judge = AxisJudge(data, now.model.library)
    search: Search[GreyboxFit] = Search(judge=judge, clock=never, budget=BUDGET, most=MOST_EFFECTS, least=WORTH)
    names = frozenset(name for name, _ in now.model.effects)
    search.nodes[names] = Node(effects=names, fit=now, brief=now, parameters=sum(len(values) for _, values in now.model.effects), whole=True)
    settling = Simplifying(judge, search, frozenset())
    while settling.step():
        pass
    return joined(data, settling.now.fit)
