"""The search: effects are added and fitted together, and the held-out error falls; then the answer is assembled.

First sets of effects by simulation, the most promising first; then simpler sets where they do as well. What simulation cannot judge, backlash,
is tried by one-step prediction against the best simulation with the same freedom: after the first sets, where backlash that explains the
axis ends the search, and otherwise at the end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.diagnosis.answer import Answer
from xy_sysid.diagnosis.rungs import answer_of_rungs, answer_of_search, rungs_of
from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import AxisData, longest, one_stretch
from xy_sysid.greybox.free_run import GreyboxFit, joined
from xy_sysid.greybox.whitened import enough
from xy_sysid.hypotheses.criteria import AT_FLOOR, MOST_EFFECTS, WORK, WORK_EACH
from xy_sysid.hypotheses.one_step import OneStepTrials, one_step_names
from xy_sysid.hypotheses.pool import Pool
from xy_sysid.jit import spent_compiling


def never() -> float:
    """A clock that stands still: no budget ever ends."""
    return 0.0


@dataclass(frozen=True, slots=True)
class Effort:
    """How far a search goes.

    most: effects, besides those given
    budget: s of processor time as ``clock`` tells it, after which it says the best it has; the time in which laws are compiled, once on a
        machine, does not count. Without one the search ends after a fixed amount of work, and the same data give the same answer
    """

    most: int = MOST_EFFECTS
    budget: float = math.inf
    clock: Callable[[], float] = never

    def now(self) -> float:
        """s of the clock without what compiling took."""
        return self.clock() - spent_compiling()


def refine(
    data: AxisData,
    library: Library = STANDARD,
    given: Iterable[str] = (),
    effort: Effort | None = None,
    trying: Callable[[frozenset[str]], None] = lambda names: None,
) -> Answer:
    """Add effects until nothing promises more. given: are added first, in their order, unasked; trying: is told each set before it is fitted."""
    kept, effort = tuple(given), effort or Effort()
    rungs = rungs_of(data, library, kept)
    if rungs[-1].one_step or effort.most == 0:
        return answer_of_rungs(data, rungs)
    until, enough = effort.now() + effort.budget, data.work.done + WORK + WORK_EACH * data.velocity.size

    def late() -> bool:
        return effort.now() > until or (effort.budget == math.inf and data.work.done > enough)

    pool = Pool(data, library, frozenset(kept), most=effort.most, late=late)
    pool.add_first(rungs[-1].fit)
    trials = OneStepTrials(pool)
    _search(pool, None if kept else trials, trying)
    found = answer_of_search(pool, rungs, trials.found)
    return found if kept else _of_longest(data, found, library, replace(effort, budget=until - effort.now()), trying)


def _search(pool: Pool, trials: OneStepTrials | None, trying: Callable[[frozenset[str]], None]) -> None:
    """Search, simplify, and search again from what is simpler, until neither changes the best set."""
    before = None
    while pool.best is not before and not pool.late():
        before = pool.best
        for names in pool.search():
            trying(names)
            if trials is not None and trials.due(last=False):
                for tried in trials.tried(last=False):
                    trying(tried)
                if trials.found is not None:
                    return
        for names in chain(pool.suspected(), pool.simplified()):
            trying(names)
    if trials is not None and trials.due(last=True):
        for tried in trials.tried(last=True):
            trying(tried)


def _of_longest(data: AxisData, found: Answer, library: Library, effort: Effort, trying: Callable[[frozenset[str]], None]) -> Answer:
    """The answer about several stretches, or about the longest alone if an effect is found in it that needs one stretch without a gap.

    The best set of the search of all stretches is what one-step prediction has to beat.
    """
    names = one_step_names(library)
    if len(data.starts) < 2 or found.final.excess < AT_FLOOR or not names:
        return found
    place = longest(data)
    try:
        alone = one_stretch(data, place)
    except BadInput:
        return replace(found, untried=names)
    if not alone.holds_out or not enough(np.arange(alone.velocity.size) >= alone.training):
        return replace(found, untried=names)
    rungs, until = rungs_of(alone, library), effort.now() + effort.budget
    pool = Pool(alone, library, most=effort.most, late=lambda: effort.now() > until)
    pool.add_first(rungs[-1].fit)
    simulated = found.final.model.in_recording(place)
    node = pool.with_screening_fit(frozenset(own for own, _ in simulated.effects), lambda: [simulated]) if simulated.effects else None
    if node is not None:
        pool.with_full_fit(node)
    trials = OneStepTrials(pool)
    if trials.due(last=True):
        for names_tried in trials.tried(last=True):
            trying(names_tried)
    return found if trials.found is None else replace(answer_of_search(pool, rungs, trials.found), stretch=place)


def settle(data: AxisData, now: GreyboxFit) -> GreyboxFit:
    """Without what is no longer needed, with simpler relatives where they do as well, and one law for several that are the same."""
    if now.one_step:
        return now
    pool = Pool(data, now.model.library)
    pool.add_first(now)
    for _ in pool.simplified():
        pass
    return joined(data, pool.best.fit)
