"""The sets of effects that the present data do not rule out: the named one, those that predict as well, and effects too small to be visible."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.axis.model import AxisModel, Library
from xy_sysid.diagnosis.answer import Answer
from xy_sysid.diagnosis.equal_laws import equals
from xy_sysid.diagnosis.rungs import rungs_of
from xy_sysid.diagnosis.sets import contains
from xy_sysid.effects._contract import LEAST_START
from xy_sysid.errors import BadInput
from xy_sysid.experiment_design.beliefs import Belief, Evidence, believed, hidden
from xy_sysid.experiment_design.criteria import ALLOWED, DRAWS
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit, fit
from xy_sysid.hypotheses.compare import Gain, gain
from xy_sysid.hypotheses.criteria import CHANCE, DOUBTFUL, PRICE
from xy_sysid.hypotheses.moves import is_twice


@dataclass(frozen=True)
class Standing:
    """Sets of effects on the same data.

    names, fits: of each, on all data; chosen: index of the best score, with a penalty for each parameter
    doubt: probability that another set predicts better, at most a half
    """

    names: tuple[tuple[str, ...], ...]
    fits: tuple[GreyboxFit, ...]
    chosen: int
    doubt: float


def standing(data: AxisData, library: Library, sets: Sequence[Sequence[str]], known: Sequence[AxisModel | None] = ()) -> Standing:
    """Fit some sets and compare them on the held-out windows; known: a model of each set from other data, as a start. Raises as ``check``."""
    check(library, sets)
    names = tuple(tuple(each) for each in sets)
    before = tuple(known) or (None,) * len(names)
    each_fit = [_fitted(data, library, each, model) for each, model in zip(names, before, strict=True)]
    first = min(each_fit, key=lambda found: float(np.sum(found.scores)))
    fits = _of_one_law(library, names, [_from_the_best(data, each, found, first) for each, found in zip(names, each_fit, strict=True)])
    prices = [PRICE * sum(len(library[name].parameters) for name in each) for each in names]
    scores = [float(np.sum(found.scores)) + price for found, price in zip(fits, prices, strict=True)]
    chosen = int(np.argmin(scores))
    doubts = [_doubt(gained(data, fits[chosen], other), prices[k] - prices[chosen]) for k, other in enumerate(fits) if k != chosen]
    return Standing(names, fits, chosen, max(doubts, default=0.0))


def check(library: Library, sets: Iterable[Sequence[str]]) -> None:
    """Raises BadInput for an effect that is unknown, part of every model, or not predicted by free simulation, for a law twice in a set,
    and for a set given twice."""
    sets = [tuple(each) for each in sets]
    for name in (name for each in sets for name in each):
        if not library[name].simulable or library[name].category == "base":
            act = "It is judged one sample ahead; see its experiment in xy-sysid effects." if not library[name].simulable else "Leave it out."
            raise BadInput("effect", name, "effects that free simulation can predict", act)
    for each in sets:
        if len({*each}) < len(each):
            raise BadInput("set of effects", " and ".join(each), "each effect once", "Leave one out.")
        if sum({*each} == {*other} for other in sets) > 1:
            raise BadInput("sets of effects", f"{' and '.join(each) or 'rigid'} twice", "sets that differ", "Leave one out, or give another.")
        if is_twice(library, each):
            raise BadInput("set of effects", " and ".join(each), "each law once", "Leave one of a family out: it is the other with more parameters.")


def _of_one_law(library: Library, names: Sequence[tuple[str, ...]], fits: Sequence[GreyboxFit]) -> tuple[GreyboxFit, ...]:
    """Sets whose equations are the same have the same fit, the best of theirs, under their own names."""
    laws = [sorted(equals(library, name)[0].name for name in each) for each in names]
    found = []
    for own, law, fitted in zip(names, laws, fits, strict=True):
        best = min((fits[k] for k, other in enumerate(laws) if other == law), key=lambda item: float(np.sum(item.scores)))
        called = {one.name: name for name in own for one in equals(library, name)}
        effects = tuple((called.get(name, name), values) for name, values in best.model.effects)
        found.append(fitted if best is fitted else replace(best, model=replace(best.model, effects=effects)))
    return tuple(found)


def gained(data: AxisData, one: GreyboxFit, other: GreyboxFit) -> Gain:
    """``gain`` over the windows of one or several recordings."""
    return gain(one, other, np.searchsorted([step.start for step in data.steps], data.held_out.begins, side="right"))


def _from_the_best(data: AxisData, names: Sequence[str], found: GreyboxFit, best: GreyboxFit) -> GreyboxFit:
    """The fit, or a better one that starts from the best fit: the new effect takes over parameters of the same name (a period) from a replaced one.

    Otherwise a wave might be ruled out only because its fit did not find the period.
    """
    there = dict(best.model.effects)
    new, gone = [name for name in names if name not in there], [name for name in there if name not in names]
    known = {key: value for name in gone for key, value in zip(best.model.library[name].names, there[name], strict=True)}
    if len(new) != 1 or not known.keys() & set(best.model.library[new[0]].names):
        return found
    rest = best.model
    for name in gone:
        rest = rest.without(name)
    items = best.model.library[new[0]].on(data.similar)
    starts = [[known.get(item.name, item.typical) + turned * (item.unit == "rad") for item in items] for turned in (0.0, 0.5 * math.pi)]
    fits = [found, *(fit(data, rest.with_effect(new[0], values)) for values in starts)]
    return min(fits, key=lambda one: float(np.sum(one.scores)))


def _doubt(found: Gain, price: float) -> float:
    return min(1.0 - found.priced(price).probability, 0.5)


def _fitted(data: AxisData, library: Library, names: Sequence[str], known: AxisModel | None) -> GreyboxFit:
    found = rungs_of(data, library, names)[-1].fit
    if known is None:
        return found
    other = fit(data, known)
    return other if float(np.sum(other.scores)) < float(np.sum(found.scores)) else found


def beliefs_of(data: AxisData, library: Library, found: Standing, travel: tuple[float, float] | None = None, draws: int = DRAWS) -> list[Belief]:
    """The beliefs in the sets that the data do not rule out, the chosen set first; travel: (low, high), m, within which laws must be valid."""
    evidence = Evidence(data, travel)
    order = sorted(range(len(found.names)), key=lambda k: k != found.chosen)
    best = found.fits[found.chosen]
    beliefs = (_belief(evidence, library, found.names[k], (found.fits[k], best), draws) for k in order)
    return [belief for belief in beliefs if belief is not None]


def _belief(evidence: Evidence, library: Library, names: tuple[str, ...], fits: tuple[GreyboxFit, GreyboxFit], draws: int) -> Belief | None:
    """The belief in a set, None if the data rule it out; fits: of this set, and of the chosen one."""
    own, best = fits
    if own is best:
        return believed(evidence, own, draws)
    rest = frozenset(name for name, _ in best.model.effects)
    new = [name for name in names if name not in rest]
    holds = contains(library, frozenset(names), rest)  # then a worse fit is only not the optimum
    better = gained(evidence.data, best, own)
    if len(new) == 1 and holds and not gained(evidence.data, own, best).is_sure:
        model, least, family = best.model, evidence.nats(best.model), library[new[0]].family
        for name in rest - frozenset(names):
            model = model if family and library[name].family == family else model.without(name)
        unseen = hidden(evidence, model, new[0], least, draws)
        if unseen is not None or _is_gone(evidence.data, own, new[0]) or evidence.nats(own.model) > least + ALLOWED:
            return unseen
    elif not holds and better.probability > CHANCE and better.nats > PRICE:
        return None
    return believed(evidence, own, draws)


def _is_gone(data: AxisData, found: GreyboxFit, name: str) -> bool:
    """Whether the fit made an effect so small that the model is as good as without it."""
    effect = found.model.library[name]
    pairs = zip(effect.on(data.similar), dict(found.model.effects)[name], strict=True)
    return any(item.positive and (k == 0 or "V" in item.unit) and value < LEAST_START * abs(item.typical) for k, (item, value) in enumerate(pairs))


def possible(data: AxisData, library: Library, found: Answer, most: int = 4) -> list[tuple[str, ...]]:
    """The named set, then those that may be true instead: rivals that predict nearly as well, and look-alikes.

    If nothing was named: the simplest laws that may hide in the noise. At most 1 + ``most`` sets.
    Raises BadInput if free simulation cannot predict a named effect.
    """
    named = found.best
    for name in named:
        if not library[name].simulable:
            act = f"Its own experiment: {library[name].experiment}. Or compare other sets: --between."
            raise BadInput("effect that is named", name, "effects that free simulation can predict; it is judged one sample ahead", act)
    rivals = [item.effects for item in found.rivals if item.doubt >= DOUBTFUL and not item.refused]
    alike = [
        tuple(other if one == name else one for one in named)
        for name in named
        for other in look_alikes(library, name)
        if other not in named and _may_be(data, library, other)
    ]
    simplest = sorted(library.acting, key=lambda other: len(other.parameters))
    hiding = [(other.name,) for other in simplest if not named and _may_be(data, library, other.name)]
    sets = {frozenset(each): tuple(each) for each in reversed([named, *rivals, *alike, *hiding]) if all(library[name].simulable for name in each)}
    return [each for each in reversed(sets.values()) if not is_twice(library, each)][: 1 + most]


def look_alikes(library: Library, name: str) -> list[str]:
    """Effects that list this one as a look-alike or are listed by it, and the others of its family."""
    effect = library[name]
    others = [other for other in library.acting if other.name != name]
    return [
        other.name
        for other in others
        if other.name in effect.look_alikes or name in other.look_alikes or (effect.family and other.family == effect.family)
    ]


def _may_be(data: AxisData, library: Library, name: str) -> bool:
    effect = library[name]
    return effect.simulable and (data.units.output == "rad" or not effect.angular)


def names_of(sets: Iterable[Sequence[str]]) -> str:
    """Sets in words."""
    return ", ".join(" and ".join(each) or "the rigid model" for each in sets)
