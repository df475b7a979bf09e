"""A set of effects that is tried first: the set that explained earlier recordings of the same axis.

Every search ends where the error of the best set is at the noise floor. If the known set brings it there, and no simpler set does as well, there is
nothing to search for. Otherwise the search begins as if nothing were known, so that its answer does not depend on the known set.
"""

from __future__ import annotations

from dataclasses import replace

from xy_sysid.axis.model import Library
from xy_sysid.diagnosis.answer import Answer
from xy_sysid.diagnosis.refine import Effort
from xy_sysid.diagnosis.rungs import answer_of_search, rungs_of
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import best_start, fit, screened
from xy_sysid.hypotheses import starts
from xy_sysid.hypotheses.criteria import AT_FLOOR, WORK, WORK_EACH
from xy_sysid.hypotheses.one_step import OneStepTrials
from xy_sysid.hypotheses.pool import Pool


def answer_of_known_set(data: AxisData, library: Library, names: tuple[str, ...], effort: Effort) -> Answer | None:
    """The answer of a known set, or of a simpler one that does as well; None where the search has to be made.

    names: effects in any order; those that the library does not have make no set
    Effects that are judged one sample ahead are tried together with the others, as in a search that has found the others.
    """
    if not names or any(name not in library.effects for name in names):
        return None
    until, enough = effort.now() + effort.budget, data.work.done + WORK + WORK_EACH * data.velocity.size

    def late() -> bool:
        return effort.now() > until or data.work.done > enough

    base = rungs_of(data, library)
    pool = Pool(data, library, most=effort.most, late=late)
    pool.add_first(base[0].fit)
    trials = OneStepTrials(pool)
    _fitted(pool, tuple(name for name in names if library[name].one_step is None))
    for _ in pool.simplified():
        pass
    ahead = any(library[name].one_step is not None for name in names)
    if ahead and pool.best.fit.excess >= AT_FLOOR:
        for _ in trials.tried(last=False):
            pass
    if late() or (trials.found is None and pool.best.fit.excess >= AT_FLOOR):
        return None
    return replace(answer_of_search(pool, base, trials.found), tried_first=names)


def _fitted(pool: Pool, names: tuple[str, ...]) -> None:
    """Fit effects to the first stage's data, one after another, each from the best of its starts; then all of them to all data."""
    data, now = pool.data, pool.nodes[pool.kept]
    for name in names:
        effect, model = pool.library[name], now.screening.model
        traced = screened(data, now.screening, [effect]).traces[0].values
        start = best_start(data, starts.added(data, now.screening, model, effect, traced))
        screening = fit(data, start, screening=True, late=pool.late)
        now = pool.remember(now.effects | {name}, screening, screening, is_better=False)
    if names:
        now = pool.with_full_fit(now)
        now.is_better = now.has_full_fit and not now.refused
