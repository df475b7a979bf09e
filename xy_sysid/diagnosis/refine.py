"""Add effects, refit everything together, and watch the error on held-out data fall: the search, and what it comes to.

First sets of effects by free simulation (``best_first``); then simpler sets where they do as well. What free simulation cannot judge, a
gap, is tried by one-step prediction against the best simulation with the same freedom: after the first sets, where a gap that explains the
axis ends the search, and else in the end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable
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
    across = None if kept else OneStepTrials(judge, search)
    for names in search.steps(fixed.steps[-1].fit, frozenset(kept)):
        yield Trying(tuple(sorted(names)))
        if across is not None and across.due:
            yield Trying(across.names)
            if across.explains():
                break
    settled = Simplifying(judge, search, frozenset(kept))
    if across is not None and across.found is not None:
        search.stopped = judge.late()
        return ladder_of_search(judge, search, settled, fixed, across.found)
    while True:
        while settled.step():
            yield Trying(tuple(sorted(settled.now.effects)))
        final = settled.now
        if search.goes_on(final):
            for names in search.steps_from(final):
                yield Trying(tuple(sorted(names)))
        else:
            for _ in range(FEWEST):  # along a valley that bends the first fit did not come to its end
                if not final.fit.converged and not judge.late():
                    final.fit = judge.whole(final.fit)
            search.stopped = search.stopped or judge.late()
            best = search.best
            if not judge.late() and final.effects > frozenset(kept):
                for names in search.rivals(final.effects):
                    yield Trying(tuple(sorted(names)))
            if search.best is best or search.best.score >= final.score - LEAST:
                break
        settled = Simplifying(judge, search, frozenset(kept))
    helps = _most_of_use(judge, search, fixed)
    if not _explains(judge, fixed, final) and _explains(judge, fixed, helps):
        settled.now = helps
        while settled.step():
            yield Trying(tuple(sorted(settled.now.effects)))
        final = settled.now
    if final.fit.excess >= LEAST and across is not None:
        for name in across.names:
            yield Trying((name,))
            across.look(name, final)
    return ladder_of_search(judge, search, settled, fixed, across.found if across is not None else None)


def _explains(judge: AxisJudge, fixed: Given, node: Node[GreyboxFit]) -> bool:
    """A set takes away more of the error's power than it leaves: what is far off in many quiet bands may yet do that."""
    explained = part_explained(judge.data, fixed.steps[0].fit, node.fit)
    return explained >= 1.0 - explained


def _most_of_use(judge: AxisJudge, search: Search[GreyboxFit], fixed: Given) -> Node[GreyboxFit]:
    """The set that takes away most of the error's power, of all that may be named."""
    nodes = [node for node in search.nodes.values() if node.whole and node.leads and not node.refused and node.effects >= set(fixed.names)]
    return max(nodes, key=lambda node: part_explained(judge.data, fixed.steps[0].fit, node.fit))


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
