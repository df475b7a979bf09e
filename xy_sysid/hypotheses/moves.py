"""The possible moves from a set of effects, with their predicted scores: a joint score test, so that pairs need no fit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import combinations

from xy_sysid.axis.model import AxisModel, Library
from xy_sysid.effects import Effect
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import LEAST_EXPLAINED, GreyboxFit, first_excess, has_inverse_starts, inverse_start_models, scene_of, screened
from xy_sysid.hypotheses.criteria import ALMOST, WIDTH
from xy_sysid.hypotheses.starts import added, swapped


@dataclass(frozen=True, slots=True)
class Move:
    """A change of one set of effects to another.

    effects: the new set; parameters: number of added ones
    predicted_gain: nats a line, to first order or of the best start model without a fit, whichever is larger
    starts: models with start values
    """

    effects: frozenset[str]
    parameters: int
    predicted_gain: float
    starts: Callable[[], Sequence[AxisModel]]


def count(library: Library, names: Iterable[str]) -> int:
    """Parameters of some effects."""
    return sum(len(library[name].parameters) for name in names)


def is_twice(library: Library, names: Iterable[str]) -> bool:
    """Whether a law is in a set twice: two of one family, or one as part of a sum."""
    own = set(names)
    families = [library[name].family for name in own if library[name].family]
    sums = (library[name].sum_of for name in own)
    return len(families) > len(set(families)) or any(whole is not None and own & set(whole.parts) for whole in sums)


def moves(data: AxisData, library: Library, now: GreyboxFit, screening: GreyboxFit, early: bool = True) -> list[Move]:
    """Effects to add, alone or in pairs, and effects that may replace a relative or a look-alike.

    The best of each kind.

    screening: the screening fit of the same set; early: use the data of the first stage, else all
    """
    model, own = now.model, frozenset(name for name, _ in now.model.effects)
    open_to = [e for e in library.acting if e.simulable and e.name not in own and (e.repeats or not (data.passed_once and e.is_by_place))]
    scene = scene_of(data, now, early)
    screen = screened(data, now, open_to, scene)
    traces = {trace.effect: trace.values for trace in screen.traces}
    gains = {name: screen.gain([name]) for name in screen.rows}
    here = first_excess(data, screening.model) if early else 0.0

    def predicted_gain(names: Iterable[str], start_models: Sequence[AxisModel] = ()) -> float:
        """To first order, or from the start models without a fit, whichever is larger."""
        first = screen.gain(names) if all(name in screen.rows for name in names) else 0.0
        return max(first, *(here - first_excess(data, start) for start in start_models if early), 0.0)

    singles, swaps = [], []
    for effect in open_to:
        traced = traces.get(effect.name)
        if not is_twice(library, own | {effect.name}):
            gain = predicted_gain([effect.name], inverse_start_models(data, now, model, effect.name, scene, LEAST_EXPLAINED) if early else ())
            singles.append(Move(own | {effect.name}, len(effect.parameters), gain, partial(added, data, now, model, effect, traced)))
        for name in sorted(own):
            related = bool(effect.family) and effect.family == library[name].family
            suspected = name in effect.suspects and (data.units.output == "rad" or not effect.angular)
            if related or suspected:
                starts = cache(partial(swapped, data, now, name, effect, traced))  # used for the predicted gain, and again for the fit
                rest = model.without(name)
                start_models: Sequence[AxisModel] = ()
                if suspected:
                    start_models = starts()
                elif early and has_inverse_starts(rest):
                    start_models = inverse_start_models(data, now, rest, effect.name, scene, LEAST_EXPLAINED)
                more = len(effect.parameters) - len(library[name].parameters)
                swaps.append(Move(own - {name} | {effect.name}, more, predicted_gain([effect.name], start_models), starts))
    pairs = _pairs(library, now, own, gains, screen.gain, lambda names: _both(data, now, [library[name] for name in names], traces))
    best = [sorted(kind, key=lambda move: -move.predicted_gain)[:WIDTH] for kind in (swaps, pairs)]
    return [*singles, *(move for kind in best for move in kind)]


def _both(data: AxisData, now: GreyboxFit, effects: Sequence[Effect], traces: Mapping[str, tuple[float, ...]]) -> list[AxisModel]:
    """The model with two more effects; the second gets a start value for each start of the first."""
    models = [now.model]
    for effect in effects:
        models = [start for model in models for start in added(data, now, model, effect, traces.get(effect.name))]
    return models


def _pairs(
    library: Library,
    now: GreyboxFit,
    own: frozenset[str],
    gains: Mapping[str, float],
    together: Callable[[Iterable[str]], float],
    starts: Callable[[Sequence[str]], list[AxisModel]],
) -> list[Move]:
    """Pairs of effects whose predicted gain is clearly above that of the better one alone."""
    found = []
    for one, other in combinations(sorted(gains, key=lambda name: -gains[name]), 2):
        if is_twice(library, own | {one, other}):
            continue
        both = together((one, other))
        if ALMOST * both > gains[one]:
            names = (one, other)
            found.append(Move(own | {one, other}, count(library, names), both, partial(starts, names)))
    return found
