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
from xy_sysid.effects._contract import PATIENT, Followed, Limits
from xy_sysid.greybox.free_run import AxisData, GreyboxFit
from xy_sysid.greybox.innovation_test import traces
from xy_sysid.greybox.one_step import AT_NOISE, Others, beside, error_without, followed
from xy_sysid.greybox.score_test import Trace
from xy_sysid.hypotheses.criteria import ALIKE, AT_FLOOR, LEAST, MOST_EFFECTS, OPTIMISM_AHEAD, SIZE, WORTH
from xy_sysid.hypotheses.refusal import none_of


@dataclass(frozen=True, slots=True)
class Wanted:
    """Requirements for a fit with one more effect.

    limits: when fits end; their bar is the error one sample ahead, m/s, of the best set without the gap: fits that cannot come near it end early
    least: least size of an added effect; refused: why a fit does not count, or empty
    hidden: start with the effects that this one hides (``Effect.hides``)
    """

    limits: Limits = PATIENT
    least: float = WORTH
    refused: Callable[[GreyboxFit], str] = lambda _: ""
    hidden: bool = False


@dataclass(frozen=True, slots=True)
class Grown:
    """Rungs, name and fit, and the filter's own result for the last."""

    rungs: tuple[tuple[str, GreyboxFit], ...]
    found: Followed


def told_apart(effect: Effect) -> bool:
    """Whether a filter with a gap can contain the effect and distinguish it from the gap. It cannot contain a resonance: together with a gap it
    explains too much (cogging at small amplitude, presliding friction)."""
    return undoable(effect) and effect.category != "motion"


def grown(data: AxisData, base: GreyboxFit, effect: Effect, wanted: Wanted | None = None) -> Grown:
    """Rungs: the effect together with those of the base, then one more effect at each."""
    wanted = wanted or Wanted()
    fit, found = followed(data, base, effect, _hidden(data, base, effect) if wanted.hidden else (), limits=wanted.limits)
    while not found.given_up and (name := none_of(data, fit)) not in ("", effect.name):  # a simulation had taken the gap for it
        fit, found = followed(data, replace(fit, model=fit.model.without(name)), effect, begin=found, limits=wanted.limits)
    if _does_something(data, fit, found) and fit.held_out_error < (wanted.limits.bar or inf):
        fit, found = _needed(data, fit, found, effect, wanted)
    rungs = [(effect.name, fit)]
    while len(rungs) < MOST_EFFECTS and not wanted.limits.late():
        now = rungs[-1][1]
        if not _does_something(data, now, found):
            break
        better = _better(data, now, effect, found, wanted)
        if better is None:
            break
        name, fit, found = better
        new = [own for own, _ in fit.model.effects if own not in now.model]
        rungs.append((name if name in fit.model else new[-1] if new else name, fit))
    return Grown(tuple(rungs), found)


def _does_something(data: AxisData, fit: GreyboxFit, found: Followed) -> bool:
    """Whether the same filter without the effect has a larger error; otherwise the effect is absent."""
    return not found.given_up and 2.0 * log(error_without(data, found) / fit.held_out_error) >= LEAST


def _hidden(data: AxisData, base: GreyboxFit, effect: Effect) -> Others:
    """The hidden effects that the base does not have, with their usual sizes."""
    library = base.model.library
    hidden = (library[name] for name in effect.hides if name in library.effects and name not in base.model)
    return [(other.name, tuple(item.typical for item in other.on(data.similar))) for other in hidden]


def _needed(data: AxisData, fit: GreyboxFit, found: Followed, effect: Effect, wanted: Wanted) -> tuple[GreyboxFit, Followed]:
    """Without effects of the simulation that do not help together with this effect; they must be as large as effects that are added later."""
    for name, _ in fit.model.effects:
        if name in (effect.name, effect.rubs) or wanted.limits.late():
            continue
        less, its = followed(data, replace(fit, model=fit.model.without(name)), effect, begin=found, limits=wanted.limits)
        if _size(less, (fit.held_out_error / less.held_out_error) ** 2) < _least(name, effect, wanted):
            fit, found = less, its
    return fit, found


_Tried = tuple[str, GreyboxFit, Followed]


def _better(data: AxisData, now: GreyboxFit, effect: Effect, found: Followed, wanted: Wanted) -> _Tried | None:
    """The best fit with one more effect; None if none is large enough.

    First the effects with the best predicted gain. Then, if these do not explain the axis, richer laws of dry friction than the present one:
    their traces are not reliable, because presliding or sticking friction changes the estimate of the gap. Last, if nothing was predicted
    but an error remains, the effect with the largest prediction, because slow effects predict little.
    """
    library, on = now.model.library, replace(wanted.limits, bar=None)
    known = {name for name, _ in beside(now.model, effect)[1]} | {name for name, _ in now.model.effects}
    open_to = [law for law in library.acting if told_apart(law) and law.simulable and law.name not in known]
    seen = traces(data, now.model, effect, found, [*open_to, *_uneven(effect, library, found)])
    promising = [trace for trace in seen if _size(now, 1.0 - OPTIMISM_AHEAD * trace.share) >= _least(trace.effect, effect, wanted)]
    rubbing = _rubbing(now, library, found)
    tried: list[_Tried] = []

    def try_all(open_to: Sequence[Trace]) -> None:
        for trace in open_to:
            if not wanted.limits.late():
                fit, its = followed(data, now, effect, [_start(trace, library, found)], found, on)
                if not wanted.refused(fit):
                    tried.append((trace.effect, fit, its))

    def is_explained() -> bool:
        return now.excess < AT_FLOOR or any(fit.excess < AT_FLOOR for _, fit, _ in tried)

    try_all(_alike(promising))
    if rubbing and not is_explained():
        try_all(traces(data, now.model, effect, found, rubbing))
    if not promising and not is_explained() and now.held_out_error > AT_NOISE * now.noise_floor:
        try_all(_alike([trace for trace in seen if trace.effect not in effect.suspects]))
    least = min((fit.held_out_error for _, fit, _ in tried), default=inf)
    alike = (item for item in tried if 2.0 * log(item[1].held_out_error / least) < LEAST)  # then the simplest
    best = min(alike, key=lambda item: (len(item[1].parameters), item[1].held_out_error), default=None)
    worth = best is not None and _size(now, (best[1].held_out_error / now.held_out_error) ** 2) >= _least(best[0], effect, wanted)
    return best if worth else None


def _alike(seen: Sequence[Trace]) -> list[Trace]:
    """The effects whose predicted gain is nearly that of the first."""
    return [trace for trace in seen if trace.share >= ALIKE * seen[0].share]


def size_ahead(before: float, after: float, noise: float) -> float:
    """Explained power of an error one sample ahead, divided by the remaining power, both above the noise; arguments in m/s."""
    return (before**2 - noise**2) / max(after**2 - noise**2, 1e-300) - 1.0


def _size(now: GreyboxFit, part: float) -> float:
    """The same, if a given part of the error power of a fit remains."""
    return size_ahead(now.held_out_error, sqrt(max(part, 0.0)) * now.held_out_error, now.noise_floor)


def _least(name: str, effect: Effect, wanted: Wanted) -> float:
    """The least size of one more effect; larger for effects that imperfections of the contact imitate."""
    return max(wanted.least, SIZE) if name in effect.suspects else wanted.least


def put_beside(data: AxisData, now: GreyboxFit, effect: Effect, other: Effect) -> GreyboxFit:
    """Add one more effect to a fit, in the place of its relatives. Raises BadInput if the filter cannot contain it."""
    assert effect.one_step is not None
    library, model = now.model.library, now.model.without(effect.name)
    for name, _ in model.effects:
        if other.family and library[name].family == other.family:
            model = model.without(name)
    beside(model.with_effect(other.name), effect)
    rubs = other.is_dry and other.name != effect.rubs
    if not (undoable(other) or rubs):
        return followed(data, replace(now, model=model.with_effect(other.name)), effect)[0]
    without = replace(now, model=now.model.without(effect.name) if rubs else model)
    _, found = followed(data, without, effect)
    trace = traces(data, without.model, effect, found, [other])[0]
    return followed(data, without, effect, [_start(trace, library, found)], found)[0]


def _rubbing(now: GreyboxFit, library: Library, found: Followed) -> list[Effect]:
    """Richer laws of dry friction than the present one."""
    if not any(law.name in now.model for law in found.dry.laws):
        return []
    return [law for law in library.acting if law.is_dry and len(law.parameters) > len(found.dry.values) and law.sum_of is None]


def _uneven(effect: Effect, library: Library, found: Followed) -> list[Effect]:
    """Whether a law is Coulomb friction with a load at the motor: its trace is reliable."""
    if found.dry.names != (effect.rubs,):
        return []
    return [law for law in library.acting if law.is_dry and law.sum_of is not None]


def _start(trace: Trace, library: Library, found: Followed) -> tuple[str, tuple[float, ...]]:
    """Name and start values: friction at its present level."""
    if not library[trace.effect].is_dry:
        return trace.effect, trace.values
    rest = trace.values[1:] if library[trace.effect].sum_of is None else (0.0,) * (len(trace.values) - 1)
    return trace.effect, (max(*found.dry.values[:1], 1e-3), *rest)
