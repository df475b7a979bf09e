"""From the fits of a search to its answer: one rung for each effect, rivals, sizes, and what no effect explains."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from xy_sysid.axis.model import AxisModel, Library
from xy_sysid.diagnosis.answer import Answer, Rung, Tried
from xy_sysid.diagnosis.equal_laws import is_the_same, likely_names
from xy_sysid.diagnosis.sets import contains, is_mistaken_for, part_explained
from xy_sysid.effects import Effect
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit, best_start, fit, fit_base, joined, never_worse, screened
from xy_sysid.greybox.one_step import one_step_effect, one_step_fit
from xy_sysid.hypotheses import starts
from xy_sysid.hypotheses.companions import add_companion
from xy_sysid.hypotheses.compare import gain
from xy_sysid.hypotheses.criteria import ALMOST, AT_FLOOR, PRICE, TELLS
from xy_sysid.hypotheses.one_step import OneStepResult
from xy_sysid.hypotheses.pool import Node, Pool, comparable_fits


def rungs_of(data: AxisData, library: Library, names: Sequence[str] = ()) -> tuple[Rung, ...]:
    """The rigid base, then each of these effects, unasked, fitted after those before it."""
    rungs = [Rung.of(fit_base(data, library))]
    for name in names:
        rungs.append(Rung.of(with_one_more(data, library, rungs[0].fit, rungs[-1].fit, name), (name,)))
    return tuple(rungs)


def with_one_more(data: AxisData, library: Library, base: GreyboxFit, now: GreyboxFit, name: str) -> GreyboxFit:
    """A fit with one more effect, unasked; a relative of the same family gives way.

    It never fits worse than ``now``, unless a relative gave way. base: the rigid model. Where other effects were added before, the fit also starts
    from what the new effect makes of the base alone, so that the order in which effects are added matters little.
    """
    effect = library[name]
    relative = next((own for own, _ in now.model.effects if effect.family and library[own].family == effect.family), None)
    ahead = one_step_effect(now.model)
    if effect.one_step is not None:
        return one_step_fit(data, now, effect)
    if ahead is not None:
        return add_companion(data, now, ahead, effect)
    model = now.model if relative is None else now.model.without(relative)
    start_models = _added(data, now, model, effect)
    if any(own not in base.model for own, _ in model.effects):
        alone = fit(data, best_start(data, _added(data, base, base.model, effect)), screening=True)
        start_models += starts.merged(model, alone.model)
    found = fit(data, best_start(data, start_models))
    return found if relative is not None else never_worse(data, now, found)


def _added(data: AxisData, now: GreyboxFit, model: AxisModel, effect: Effect) -> list[AxisModel]:
    return starts.added(data, now, model, effect, screened(data, now, [effect]).traces[0].values)


def answer_of_rungs(data: AxisData, rungs: tuple[Rung, ...]) -> Answer:
    """The answer of these rungs alone: nothing is searched."""
    final = rungs[-1].fit
    noise = final.noise_floor if final.one_step else data.noise
    return Answer(
        rungs=rungs,
        best=rungs[-1].effects,
        explained=part_explained(data, rungs[0].fit, final),
        noise=noise,
        discrepancy=math.sqrt(max(final.held_out_error**2 - noise**2, 0.0)),
        units=data.units,
    )


def answer_of_search(pool: Pool, given: tuple[Rung, ...], filtered: OneStepResult | None) -> Answer:
    """The answer of the best set, or of what one-step prediction found instead. given: the base, and effects that were given."""
    data, library, node, base, kept = pool.data, pool.library, pool.answer, given[0].fit, [name for rung in given for name in rung.came]
    alone = (item for item in pool.nodes.values() if len(item.effects) == 1)
    tried = [_tried(pool, base, item) for item in alone]
    tried.sort(key=lambda item: item.rung.held_out_error)
    refused = tuple((tuple(sorted(item.effects)), item.refused) for item in pool.nodes.values() if item.refused)
    if filtered is not None:
        return _of_one_step(pool, given[0], filtered, tried, refused)
    final = joined(data, node.fit, pool.late)
    sizes = _sizes(pool, node, final)
    ordered = _ordered(library, {name: max((force for _, force in each), default=0.0) for name, each in sizes.items()})
    ordered = (*kept, *(name for name in ordered if name not in kept))
    rivals = tuple(_tried(pool, base, item, _doubt(node, item)) for item in _rivals(pool, node))
    whole = [item for item in pool.nodes.values() if item.has_full_fit and not item.refused]
    rungs = (*given, *_rungs(pool, given, ordered, final))
    found = Answer(
        rungs=rungs,
        best=ordered,
        settled=None if rungs[-1].fit is final else Rung.of(final),
        candidates=tuple(tried),
        rivals=rivals,
        sizes={name: min(size for size, _ in each) for name, each in sizes.items() if each},
        helps=max((part_explained(data, base, item.fit) for item in whole), default=0.0),
        kept_out=_kept_out(pool, base, node),
        refused=refused,
        explained=part_explained(data, base, final),
        noise=data.noise,
        discrepancy=math.sqrt(max(final.held_out_error**2 - data.noise**2, 0.0)),
        stopped=pool.late(),
        units=data.units,
    )
    return likely_names(found, kept)


def _sizes(pool: Pool, node: Node, final: GreyboxFit) -> dict[str, list[tuple[float, float]]]:
    """(size, force) of each part of each effect of the final fit."""
    own = {name: pool.without(node, name) for name in sorted(node.effects - pool.kept)}
    return {name: [own[part] for part in _parts(pool.library, name) if part in own] for name, _ in final.model.effects}


def _rivals(pool: Pool, node: Node) -> list[Node]:
    """The sets that may be meant instead of the best one, the most likely first."""
    others = [item for item in pool.nodes.values() if item is not node and _is_rival(pool.library, item, node)]
    others.sort(key=lambda item: (-_doubt(node, item), item.screening.excess))
    for item in others[:1]:
        pool.with_full_fit(item, shown=True)
    return others


def _is_rival(library: Library, other: Node, node: Node) -> bool:
    """True for a set of at most as many effects that is neither part of the best set nor the same law."""
    if not 0 < len(other.effects) <= len(node.effects) or other.effects < node.effects or contains(library, other.effects, node.effects):
        return False
    if is_the_same(library, (other.effects, other.fit), (node.effects, node.fit), AT_FLOOR):
        return False
    return not other.refused or is_mistaken_for(library, other.effects, node.effects)  # it is no spring, but is it a wave?


def _tried(pool: Pool, base: GreyboxFit, node: Node, doubt: float = 0.0) -> Tried:
    return Tried(Rung.of(node.fit, sorted(node.effects)), part_explained(pool.data, base, node.fit), doubt, node.refused)


def _doubt(node: Node, other: Node) -> float:
    """Probability that another set predicts better than the one that was taken, parameters at their price; at most a half, as it was not taken."""
    found = gain(*comparable_fits(node, other)).priced(PRICE * (other.parameters - node.parameters))
    return min(1.0 - found.probability, 0.5)


def _of_one_step(
    pool: Pool,
    base: Rung,
    filtered: OneStepResult,
    tried: Sequence[Tried],
    refused: tuple[tuple[tuple[str, ...], str], ...],
) -> Answer:
    data, node, bar, rungs = pool.data, pool.answer, filtered.bar, [Rung.of(fit, (name,)) for name, fit in filtered.rungs]
    last = rungs[-1]
    noise = min(max(data.encoder * data.sampling_rate, last.noise_floor), last.held_out_error)  # what is predicted is no noise
    left, before = (error**2 - noise**2 for error in (last.held_out_error, bar))
    doubt = 0.5 * (last.held_out_error / bar) ** (2.0 / TELLS)
    return Answer(
        rungs=(base, *rungs),
        best=last.effects,
        candidates=(next(Tried(rung) for rung in rungs if rung.one_step), *tried),
        rivals=(_tried(pool, base.fit, node, doubt),) if node.effects else (),
        sizes=dict.fromkeys(last.effects, filtered.size),
        refused=refused,
        explained=1.0 - left / before,
        noise=noise,
        discrepancy=math.sqrt(left),
        stopped=pool.late(),
        units=data.units,
    )


def _ordered(library: Library, sizes: Mapping[str, float]) -> tuple[str, ...]:
    """Names, the largest size first; of what is alike to the largest dry friction first, as every machine has it."""
    order = sorted(sizes, key=lambda name: -sizes[name])
    similar = [name for name in order if library[name].is_dry and sizes[name] >= ALMOST * sizes[order[0]]]
    return tuple(dict.fromkeys((*similar, *order)))


def _kept_out(pool: Pool, base: GreyboxFit, node: Node) -> Tried | None:
    """The refused set with the smallest error, if that is clearly below the error of the best set."""
    nodes = [item for item in pool.nodes.values() if item.refused and item.has_full_fit and gain(item.fit, node.fit).is_sure]
    best = max(nodes, key=lambda item: gain(item.fit, node.fit).nats, default=None)
    return None if best is None else _tried(pool, base, best, 0.5)


def _parts(library: Library, name: str) -> tuple[str, ...]:
    """An effect, and what it is the sum of."""
    whole = library[name].sum_of
    return (name,) if whole is None else (name, *whole.parts)


def _rungs(pool: Pool, given: tuple[Rung, ...], names: tuple[str, ...], final: GreyboxFit) -> list[Rung]:
    """One rung for each effect, the largest first; of two orders that are known, one in which each rung lowers the held-out error.

    An effect that lowers it in no order comes with the next one, in one rung.
    """
    rungs: list[Rung] = []
    now = shown = given[-1].fit
    left, together = list(names[sum(len(rung.came) for rung in given) :]), []
    while left:
        fits = {name: found for name in left if (found := _fit_with(pool, now, name, final, name == left[0])) is not None}
        lower = [name for name, found in fits.items() if found.held_out_error < shown.held_out_error or found is final]
        name = lower[0] if lower else left[0]
        now = fits[name]
        left.remove(name)
        together.append(name)
        if name in lower:
            rungs.append(Rung.of(now, together))
            shown, together = now, []
    return rungs


def _fit_with(pool: Pool, now: GreyboxFit, name: str, final: GreyboxFit, asked: bool) -> GreyboxFit | None:
    """The fit with one more effect, from memory if it is known; None if it is not, and is not asked for."""
    effects = frozenset(own for own, _ in now.model.effects) | {name}
    if effects == frozenset(own for own, _ in final.model.effects):
        return final
    known = pool.nodes.get(effects)
    if known is not None and not known.refused and (known.has_full_fit or asked):
        return pool.with_full_fit(known, shown=True).fit
    return with_one_more(pool.data, pool.library, pool.nodes[pool.kept].fit, now, name) if asked else None
