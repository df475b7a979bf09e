"""From the fits of a search to its ladder: one rung for each effect, rivals, sizes, and what no effect explains."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from xy_sysid.axis.model import Library
from xy_sysid.criteria import ALIKE, AT_FLOOR, LEAST
from xy_sysid.diagnosis.equal_laws import is_the_same, likely_names
from xy_sysid.diagnosis.ladder import Candidate, Ladder, Rival, Step, contains, is_taken_for, part_explained
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.judge.axis_judge import AxisJudge, joined
from xy_sysid.search.best_first import Search
from xy_sysid.search.one_step_trials import Filtered
from xy_sysid.search.simplify import Simplifying, whole


@dataclass(frozen=True, slots=True)
class Given:
    """Effects that were given, and their rungs."""

    names: tuple[str, ...]
    steps: tuple[Step, ...]

    @staticmethod
    def of(judge: AxisJudge, names: tuple[str, ...]) -> Given:
        steps = [Step(None, judge.begin())]
        for name in names:
            steps.append(Step(name, judge.added(steps[-1].fit, name)))
        return Given(names, tuple(steps))


def ladder_of_given(data: AxisData, judge: AxisJudge, given: Given) -> Ladder:
    """The ladder of these effects alone: nothing is searched."""
    final = given.steps[-1].fit
    base = given.steps[0].fit
    noise = data.noise_floor
    explained = part_explained(data, base, final)
    return Ladder(
        steps=given.steps,
        final=final,
        effects=tuple(name for name, _ in final.model.effects),
        explained=explained,
        noise=noise,
        discrepancy=math.sqrt(max(final.held_out_error**2 - final.noise_floor**2, 0.0)),
    )


def ladder_of_search(
    judge: AxisJudge,
    search: Search[GreyboxFit],
    settled: Simplifying,
    given: Given,
    filtered: Filtered | None,
) -> Ladder:
    """The ladder of the set that was settled on, or of what one-step prediction found instead."""
    data, node = judge.data, settled.now
    base = given.steps[0].fit
    tried = sorted(
        (Candidate(next(iter(item.effects)), item.promised, item.fit) for item in search.nodes.values() if len(item.effects) == 1),
        key=lambda item: item.fit.excess if item.fit else math.inf,
    )
    refused = tuple((tuple(sorted(item.effects)), item.refused) for item in search.nodes.values() if item.refused)
    if filtered is not None:
        rungs, bar = filtered.rungs, filtered.bar
        last = rungs[-1][1]
        names = tuple(name for name, _ in last.model.effects)
        noise = min(max(data.floor.encoder * data.sampling_rate, last.noise_floor), last.held_out_error)  # what is predicted is no noise
        left, before = (error**2 - noise**2 for error in (last.held_out_error, bar))
        return Ladder(
            steps=(Step(None, base), *(Step(name, fit) for name, fit in rungs)),
            final=last,
            effects=names,
            tried=(next(Candidate(name, 0.0, fit) for name, fit in rungs if fit.one_step), *tried),
            rivals=(Rival(tuple(sorted(node.effects)), node.fit, 2.0 * math.log(bar / last.held_out_error)),) if node.effects else (),
            sizes=dict.fromkeys(names, filtered.size),
            refused=refused,
            explained=1.0 - left / before,
            noise=noise,
            discrepancy=math.sqrt(left),
            stopped=search.stopped,
        )
    final, own = joined(data, node.fit, judge.late), settled.sizes()
    names = tuple(name for name, _ in final.model.effects)
    sizes = {name: [own[part] for part in _parts(judge.library, name) if part in own] for name in names}
    ordered = _ordered(judge.library, {name: max(each, default=0.0) for name, each in sizes.items()})
    ordered = (*given.names, *(name for name in ordered if name not in given.names))
    rivals = sorted(
        (
            Rival(tuple(sorted(item.effects)), item.fit, item.behind(node), item.refused)
            for item in search.nodes.values()
            if item is not node and 0 < len(item.effects) <= len(node.effects) and not item.effects < node.effects
            if not contains(judge.library, item.effects, node.effects)
            if not is_the_same(judge.library, (item.effects, item.fit), (node.effects, node.fit), LEAST)
            if not item.refused or is_taken_for(judge.library, item.effects, node.effects)  # it is no spring, but is it a wave?
        ),
        key=lambda item: item.behind,
    )
    ladder = Ladder(
        steps=(*given.steps, *_rungs(judge, search, given, ordered, final)),
        final=final,
        effects=ordered,
        tried=tuple(tried),
        rivals=tuple(rivals),
        sizes={name: min(each) for name, each in sizes.items() if each},
        astray=max((_astray(data, settled, name) for name in own if judge.library[name].category == "motion"), default=0.0),
        helps=max(1.0 - min(judge.rest(item.fit, base) for item in search.nodes.values() if item.whole and not item.refused), 0.0),
        kept_out=_kept_out(search, node.fit.excess),
        refused=refused,
        explained=part_explained(data, base, final),
        noise=data.noise_floor,
        discrepancy=math.sqrt(max(final.held_out_error**2 - data.noise_floor**2, 0.0)),
        stopped=search.stopped,
    )
    return likely_names(ladder, given.names)


def _ordered(library: Library, sizes: Mapping[str, float]) -> tuple[str, ...]:
    """Names, the largest size first; of what is alike to the largest dry friction first, as every machine has it."""
    order = sorted(sizes, key=lambda name: -sizes[name])
    alike = [name for name in order if library[name].is_dry and sizes[name] >= ALIKE * sizes[order[0]]]
    return tuple(dict.fromkeys((*alike, *order)))


def _kept_out(search: Search[GreyboxFit], left: float) -> Rival | None:
    """The refused set that would leave least, if that is clearly less than what is left."""
    nodes = [node for node in search.nodes.values() if node.refused and node.fit.excess < left - AT_FLOOR]
    best = min(nodes, key=lambda node: (round(node.fit.excess, 1), len(node.effects)), default=None)
    return None if best is None else Rival(tuple(sorted(best.effects)), best.fit, best.fit.excess - left, best.refused)


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


def _rungs(judge: AxisJudge, search: Search[GreyboxFit], given: Given, names: tuple[str, ...], final: GreyboxFit) -> list[Step]:
    """One rung for each effect, in this order, the fits that are known already taken from memory."""
    steps: list[Step] = []
    now = given.steps[-1].fit
    for name in names[len(given.names) :]:
        so_far = frozenset(own for own, _ in now.model.effects) | {name}
        if so_far == frozenset(own for own, _ in final.model.effects):
            now = final
        else:
            known = search.nodes.get(so_far)
            now = judge.added(now, name) if known is None or known.refused else whole(judge, known)
        steps.append(Step(name, now))
    return steps
