"""Effects that act together with one that only one-step prediction can judge. They are found by their trace in the innovations
(``greybox.innovation_test``), and added while the residual error above the noise falls.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, log, sqrt

from xy_sysid.axis.loop_source import undoable
from xy_sysid.axis.model import Library
from xy_sysid.effects import Effect
from xy_sysid.effects._contract import PATIENT, FilterFit, Limits
from xy_sysid.greybox.free_run import AxisData, GreyboxFit
from xy_sysid.greybox.innovation_test import traces
from xy_sysid.greybox.one_step import AT_NOISE, Others, companions, error_without, filter_fit
from xy_sysid.greybox.score_test import Trace
from xy_sysid.hypotheses.criteria import ALIKE, AT_FLOOR, LEAST, LEAST_DRY, MOST_EFFECTS, OPTIMISM_AHEAD, SIZE
from xy_sysid.hypotheses.refusal import none_of


@dataclass(frozen=True, slots=True)
class Demand:
    """Requirements for a fit with one more effect.

    limits: when fits end; their bar is the error one sample ahead, m/s, of the best set without the gap: fits that cannot come near it end early
    refused: why a fit does not count, or empty
    masked: start with the effects that this one masks (``Effect.masks``)
    """

    limits: Limits = PATIENT
    refused: Callable[[GreyboxFit], str] = lambda _: ""
    masked: bool = False


@dataclass(frozen=True, slots=True)
class Extended:
    """An effect with its companions. rungs: names and fits, one more companion each; found: result of the filter for the last rung."""

    rungs: tuple[tuple[str, GreyboxFit], ...]
    found: FilterFit


def distinguishable(effect: Effect) -> bool:
    """Whether a filter with a gap can contain the effect and distinguish it from the gap. It cannot contain a resonance: together with a gap it
    explains too much (cogging at small amplitude, presliding friction)."""
    return undoable(effect) and effect.category != "motion"


def extended(data: AxisData, base: GreyboxFit, effect: Effect, demand: Demand | None = None) -> Extended:
    """Rungs: the effect together with those of the base, then one more effect at each."""
    demand = demand or Demand()
    fit, found = filter_fit(data, base, effect, _masked(data, base, effect) if demand.masked else (), limits=demand.limits)
    while not found.given_up and (name := none_of(data, fit)) not in ("", effect.name):  # a simulation had taken the gap for it
        fit, found = filter_fit(data, replace(fit, model=fit.model.without(name)), effect, earlier=found, limits=demand.limits)
    if _has_an_effect(data, fit, found) and fit.held_out_error < (demand.limits.bar or inf):
        fit, found = _needed(data, fit, found, effect, demand)
    rungs = [(effect.name, fit)]
    while len(rungs) < MOST_EFFECTS and not demand.limits.late():
        now = rungs[-1][1]
        if not _has_an_effect(data, now, found):
            break
        better = _better(data, now, effect, found, demand)
        if better is None:
            break
        name, fit, found = better
        new = [own for own, _ in fit.model.effects if own not in now.model]
        rungs.append((name if name in fit.model else new[-1] if new else name, fit))
    return Extended(tuple(rungs), found)


def _has_an_effect(data: AxisData, fit: GreyboxFit, found: FilterFit) -> bool:
    """Whether the effect is larger than the noise, and the same filter without it has a clearly larger held-out error; otherwise it is absent."""
    return not found.given_up and not found.too_small and 2.0 * log(error_without(data, found) / fit.held_out_error) >= LEAST


def _masked(data: AxisData, base: GreyboxFit, effect: Effect) -> Others:
    """The masked effects that the base does not have, with their typical sizes."""
    library = base.model.library
    masked = (library[name] for name in effect.masks if name in library.effects and name not in base.model)
    return [(other.name, tuple(item.typical for item in other.on(data.similar))) for other in masked]


def _needed(data: AxisData, fit: GreyboxFit, found: FilterFit, effect: Effect, demand: Demand) -> tuple[GreyboxFit, FilterFit]:
    """Without effects of the simulation that do not help together with this effect; they must be as large as effects that are added later."""
    for name, _ in fit.model.effects:
        if name in (effect.name, effect.start_friction) or demand.limits.late():
            continue
        less, its = filter_fit(data, replace(fit, model=fit.model.without(name)), effect, earlier=found, limits=demand.limits)
        if _size(less, (fit.held_out_error / less.held_out_error) ** 2) < SIZE:
            fit, found = less, its
    return fit, found


_Tried = tuple[str, GreyboxFit, FilterFit]


def _better(data: AxisData, now: GreyboxFit, effect: Effect, found: FilterFit, demand: Demand) -> _Tried | None:
    """The best fit with one more effect; None if none is large enough.

    First the effects with the best predicted gain. Then, if these do not explain the axis, richer laws of dry friction than the present one:
    their traces are not reliable, because presliding or sticking friction changes the estimate of the gap. Last, if nothing was predicted
    but an error remains, the effect with the largest prediction, because slow effects predict little.
    """
    library, on = now.model.library, replace(demand.limits, bar=None)
    known = {name for name, _ in companions(now.model, effect)[1]} | {name for name, _ in now.model.effects}
    open_to = [law for law in library.acting if distinguishable(law) and law.simulable and law.name not in known]
    seen = traces(data, now.model, effect, found, [*open_to, *_friction_with_load(effect, library, found)])
    promising = [trace for trace in seen if _size(now, 1.0 - OPTIMISM_AHEAD * trace.share) >= SIZE]
    richer = _richer_friction(now, library, found)
    tried: list[_Tried] = []

    def try_all(open_to: Sequence[Trace]) -> None:
        for trace in open_to:
            if not demand.limits.late():
                fit, its = filter_fit(data, now, effect, [_start(trace, library, found)], found, on)
                if not demand.refused(fit):
                    tried.append((trace.effect, fit, its))

    def is_explained() -> bool:
        return now.excess < AT_FLOOR or any(fit.excess < AT_FLOOR for _, fit, _ in tried)

    try_all(_nearly_best(promising))
    if richer and not is_explained():
        try_all(traces(data, now.model, effect, found, richer))
    if not promising and not is_explained() and now.held_out_error > AT_NOISE * now.noise_floor:
        try_all(_nearly_best([trace for trace in seen if trace.effect not in effect.suspects]))
    least = min((fit.held_out_error for _, fit, _ in tried), default=inf)
    alike = (item for item in tried if 2.0 * log(item[1].held_out_error / least) < LEAST)  # then the simplest
    best = min(alike, key=lambda item: (len(item[1].parameters), item[1].held_out_error), default=None)
    worth = best is not None and _size(now, (best[1].held_out_error / now.held_out_error) ** 2) >= SIZE
    return best if worth else None


def _nearly_best(seen: Sequence[Trace]) -> list[Trace]:
    """The effects whose predicted gain is nearly that of the best."""
    return [trace for trace in seen if trace.share >= ALIKE * seen[0].share]


def size_ahead(before: float, after: float, noise: float) -> float:
    """Explained power of an error one sample ahead, divided by the remaining power, both above the noise; arguments in m/s."""
    return (before**2 - noise**2) / max(after**2 - noise**2, 1e-300) - 1.0


def _size(now: GreyboxFit, part: float) -> float:
    """The same, if a given part of the error power of a fit remains."""
    return size_ahead(now.held_out_error, sqrt(max(part, 0.0)) * now.held_out_error, now.noise_floor)


def add_companion(data: AxisData, now: GreyboxFit, effect: Effect, other: Effect) -> GreyboxFit:
    """Add one more effect to a fit, in the place of its relatives. Raises BadInput if the filter cannot contain it."""
    assert effect.one_step is not None
    library, model = now.model.library, now.model.without(effect.name)
    for name, _ in model.effects:
        if other.family and library[name].family == other.family:
            model = model.without(name)
    companions(model.with_effect(other.name), effect)
    is_richer_friction = other.is_dry and other.name != effect.start_friction
    if not (undoable(other) or is_richer_friction):
        return filter_fit(data, replace(now, model=model.with_effect(other.name)), effect)[0]
    without = replace(now, model=now.model.without(effect.name) if is_richer_friction else model)
    _, found = filter_fit(data, without, effect)
    trace = traces(data, without.model, effect, found, [other])[0]
    return filter_fit(data, without, effect, [_start(trace, library, found)], found)[0]


def _richer_friction(now: GreyboxFit, library: Library, found: FilterFit) -> list[Effect]:
    """Richer laws of dry friction than the present one."""
    if not any(law.name in now.model for law in found.dry.laws):
        return []
    return [law for law in library.acting if law.is_dry and len(law.parameters) > len(found.dry.values) and law.sum_of is None]


def _friction_with_load(effect: Effect, library: Library, found: FilterFit) -> list[Effect]:
    """Laws that are Coulomb friction with a load at the motor, if the present friction is the default one: their traces are reliable."""
    if found.dry.names != (effect.start_friction,):
        return []
    return [law for law in library.acting if law.is_dry and law.sum_of is not None]


def _start(trace: Trace, library: Library, found: FilterFit) -> tuple[str, tuple[float, ...]]:
    """Name and start values: friction at its present level."""
    if not library[trace.effect].is_dry:
        return trace.effect, trace.values
    rest = trace.values[1:] if library[trace.effect].sum_of is None else (0.0,) * (len(trace.values) - 1)
    return trace.effect, (max(*found.dry.values[:1], LEAST_DRY), *rest)
