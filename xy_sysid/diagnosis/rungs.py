"""From the fits of a search to its ladder: one rung for each effect, rivals, sizes, and what no effect explains."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from xy_sysid.axis.model import Library
from xy_sysid.diagnosis.equal_laws import is_the_same, likely_names
from xy_sysid.diagnosis.ladder import Candidate, Ladder, Rival, Step, contains, is_taken_for, part_explained
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit, best_start, fit, fit_base, joined, screened
from xy_sysid.greybox.one_step import follower, one_step_fit
from xy_sysid.hypotheses import starts
from xy_sysid.hypotheses.companions import put_beside
from xy_sysid.hypotheses.compare import gain
from xy_sysid.hypotheses.criteria import ALMOST, AT_FLOOR, PRICE, TELLS
from xy_sysid.hypotheses.one_step import Filtered
from xy_sysid.hypotheses.pool import Node, Pool, alike


@dataclass(frozen=True, slots=True)
class Given:
    """Effects that were given, and their rungs."""

    names: tuple[str, ...]
    steps: tuple[Step, ...]

    @staticmethod
    def of(data: AxisData, library: Library, names: tuple[str, ...]) -> Given:
        """Each fitted after those before it."""
        steps = [Step((), fit_base(data, library))]
        for name in names:
            steps.append(Step((name,), with_one_more(data, library, steps[-1].fit, name)))
        return Given(names, tuple(steps))


def with_one_more(data: AxisData, library: Library, now: GreyboxFit, name: str) -> GreyboxFit:
    """A fit with one more effect, unasked; a relative of the same family gives way."""
    effect = library[name]
    relative = next((own for own, _ in now.model.effects if effect.family and library[own].family == effect.family), None)
    ahead = follower(now.model)
    if effect.one_step is not None:
        return one_step_fit(data, now, effect)
    if ahead is not None:
        return put_beside(data, now, ahead, effect)
    model = now.model if relative is None else now.model.without(relative)
    traced = screened(data, now, [effect]).traces[0].values
    return fit(data, best_start(data, starts.added(data, now, model, effect, traced)))


def ladder_of_given(data: AxisData, given: Given) -> Ladder:
    """The ladder of these effects alone: nothing is searched."""
    final = given.steps[-1].fit
    noise = final.noise_floor if final.one_step else data.noise
    return Ladder(
        steps=given.steps,
        final=final,
        effects=tuple(name for name, _ in final.model.effects),
        explained=part_explained(data, given.steps[0].fit, final),
        noise=noise,
        discrepancy=math.sqrt(max(final.held_out_error**2 - noise**2, 0.0)),
    )


def ladder_of_search(pool: Pool, given: Given, filtered: Filtered | None) -> Ladder:
    """The ladder of the best set, or of what one-step prediction found instead."""
    data, library, node, base = pool.data, pool.library, pool.answer, given.steps[0].fit
    alone = (item for item in pool.nodes.values() if len(item.effects) == 1)
    tried = [Candidate(next(iter(item.effects)), item.promised, item.fit, part_explained(data, base, item.fit)) for item in alone]
    tried.sort(key=lambda item: item.fit.held_out_error if item.fit else math.inf)
    refused = tuple((tuple(sorted(item.effects)), item.refused) for item in pool.nodes.values() if item.refused)
    if filtered is not None:
        return _of_one_step(pool, base, filtered, tried, refused)
    final = joined(data, node.fit, pool.late)
    own = {name: pool.without(node, name) for name in sorted(node.effects - pool.kept)}
    names = tuple(name for name, _ in final.model.effects)
    parts = {name: [own[part] for part in _parts(library, name) if part in own] for name in names}
    ordered = _ordered(library, {name: max((force for _, force in each), default=0.0) for name, each in parts.items()})
    ordered = (*given.names, *(name for name in ordered if name not in given.names))
    others = [
        item
        for item in pool.nodes.values()
        if item is not node and 0 < len(item.effects) <= len(node.effects) and not item.effects < node.effects
        if not contains(library, item.effects, node.effects)
        if not is_the_same(library, (item.effects, item.fit), (node.effects, node.fit), AT_FLOOR)
        if not item.refused or is_taken_for(library, item.effects, node.effects)  # it is no spring, but is it a wave?
    ]
    others.sort(key=lambda item: (-_doubt(node, item), item.brief.excess))
    for item in others[:1]:
        pool.finished(item, shown=True)
    rivals = [Rival(tuple(sorted(item.effects)), item.fit, _doubt(node, item), item.refused) for item in others]
    whole = [item for item in pool.nodes.values() if item.whole and not item.refused]
    ladder = Ladder(
        steps=(*given.steps, *_rungs(pool, given, ordered, final)),
        final=final,
        effects=ordered,
        tried=tuple(tried),
        rivals=tuple(rivals),
        sizes={name: min(size for size, _ in each) for name, each in parts.items() if each},
        helps=max((part_explained(data, base, item.fit) for item in whole), default=0.0),
        kept_out=_kept_out(pool, node),
        refused=refused,
        explained=part_explained(data, base, final),
        noise=data.noise,
        discrepancy=math.sqrt(max(final.held_out_error**2 - data.noise**2, 0.0)),
        stopped=pool.late(),
    )
    return likely_names(ladder, given.names)


def _doubt(node: Node, other: Node) -> float:
    """Probability that another set predicts better than the one that was taken, parameters at their price; at most a half, as it was not taken."""
    found = gain(*alike(node, other))
    priced = replace(found, nats=found.nats + PRICE * (other.parameters - node.parameters))
    return min(1.0 - priced.probability, 0.5)


def _of_one_step(
    pool: Pool,
    base: GreyboxFit,
    filtered: Filtered,
    tried: Sequence[Candidate],
    refused: tuple[tuple[tuple[str, ...], str], ...],
) -> Ladder:
    data, node, rungs, bar = pool.data, pool.answer, filtered.rungs, filtered.bar
    last = rungs[-1][1]
    names = tuple(name for name, _ in last.model.effects)
    noise = min(max(data.encoder * data.sampling_rate, last.noise_floor), last.held_out_error)  # what is predicted is no noise
    left, before = (error**2 - noise**2 for error in (last.held_out_error, bar))
    doubt = 0.5 * (last.held_out_error / bar) ** (2.0 / TELLS)
    return Ladder(
        steps=(Step((), base), *(Step((name,), fit) for name, fit in rungs)),
        final=last,
        effects=names,
        tried=(next(Candidate(name, 0.0, fit) for name, fit in rungs if fit.one_step), *tried),
        rivals=(Rival(tuple(sorted(node.effects)), node.fit, doubt),) if node.effects else (),
        sizes=dict.fromkeys(names, filtered.size),
        refused=refused,
        explained=1.0 - left / before,
        noise=noise,
        discrepancy=math.sqrt(left),
        stopped=pool.late(),
    )


def _ordered(library: Library, sizes: Mapping[str, float]) -> tuple[str, ...]:
    """Names, the largest size first; of what is alike to the largest dry friction first, as every machine has it."""
    order = sorted(sizes, key=lambda name: -sizes[name])
    alike = [name for name in order if library[name].is_dry and sizes[name] >= ALMOST * sizes[order[0]]]
    return tuple(dict.fromkeys((*alike, *order)))


def _kept_out(pool: Pool, node: Node) -> Rival | None:
    """The refused set that would leave least, if that is clearly less than the best leaves."""
    nodes = [item for item in pool.nodes.values() if item.refused and item.whole and gain(item.fit, node.fit).is_sure]
    best = max(nodes, key=lambda item: gain(item.fit, node.fit).nats, default=None)
    return None if best is None else Rival(tuple(sorted(best.effects)), best.fit, 0.5, best.refused)


def _parts(library: Library, name: str) -> tuple[str, ...]:
    """An effect, and what it is the sum of."""
    whole = library[name].sum_of
    return (name,) if whole is None else (name, *whole.parts)


def _rungs(pool: Pool, given: Given, names: tuple[str, ...], final: GreyboxFit) -> list[Step]:
    """One rung for each effect, the largest first; of two orders that are known, one in which each rung lowers the held-out error.

    An effect that lowers it in no order comes with the next one, in one rung.
    """
    steps: list[Step] = []
    now = shown = given.steps[-1].fit
    left, together = [name for name in names if name not in given.names], []
    while left:
        fits = {name: found for name in left if (found := _with(pool, now, name, final, name == left[0])) is not None}
        lower = [name for name, found in fits.items() if found.held_out_error < shown.held_out_error or found is final]
        name = lower[0] if lower else left[0]
        now = fits[name]
        left.remove(name)
        together.append(name)
        if name in lower:
            steps.append(Step(tuple(together), now))
            shown, together = now, []
    return steps


def _with(pool: Pool, now: GreyboxFit, name: str, final: GreyboxFit, asked: bool) -> GreyboxFit | None:
    """The fit with one more effect, from memory if it is known; None if it is not, and is not asked for."""
    effects = frozenset(own for own, _ in now.model.effects) | {name}
    if effects == frozenset(own for own, _ in final.model.effects):
        return final
    known = pool.nodes.get(effects)
    if known is not None and not known.refused and (known.whole or asked):
        return pool.finished(known, shown=True).fit
    return with_one_more(pool.data, pool.library, now, name) if asked else None
