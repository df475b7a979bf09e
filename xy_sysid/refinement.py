"""Add effects one at a time, refit everything together, and watch the error on held-out data fall.

Greedy addition: the winner of a race of candidates is taken while it is worth it. Afterwards what is no longer needed is taken
out again, and a simpler relative takes the place of a richer one that does no better.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from xy_sysid.axis_model import STANDARD, AxisModel, Library
from xy_sysid.detours import LEAST_GAIN, WEAK, another_way, as_steps, spring_instead, two_at_once
from xy_sysid.greybox import EPSILON, AxisData, GreyboxFit, finish, fit, fit_base, fit_with
from xy_sysid.ladder import Ladder, Move, Step
from xy_sysid.one_step import one_step_fit
from xy_sysid.one_step_race import Grown, put_beside
from xy_sysid.race import (
    AT_FLOOR,
    FAR,
    HOPELESS,
    NEAR,
    PART_LEFT,
    SURE,
    Candidate,
    candidates,
    choose,
    explaining,
    faint,
    plausible,
    polished,
    suspected,
)

PART_GAIN = 0.11  # the part of the excess that an addition must win, and LEAST_GAIN; or
MUCH = 0.75  # of the held-out error that it may leave at most
NEEDED = 0.05  # excess that taking an effect out again must cost, or it goes
MOST_EFFECTS = 4


def refine(data: AxisData, library: Library = STANDARD, most: int = MOST_EFFECTS, given: Iterable[str] = ()) -> Ladder:
    """Add effects until the floor is reached or nothing helps; ``given`` are added first, in their order, unasked."""
    now, kept = fit_base(data, library), tuple(given)
    steps = [Step(None, now, ())]
    for name in kept:
        now = added(data, now, name)
        steps.append(Step(name, now, ()))
    rejected: tuple[Candidate, ...] = ()
    paired: set[int] = set()  # rungs from which pairs were tried
    begun: dict[str, Grown] = {}
    stays = kept
    while len(steps) <= most:
        move = advance(data, now, library, pairs=len(steps) == 1 + len(kept) < most)
        if move.paired:
            paired.add(len(steps) - 1)
        begun |= move.begun
        stays = (*stays, move.stays) if move.stays else stays
        if not move.steps:
            better = another_way(data, steps, move, most, len(kept), paired, library, begun) if now.excess >= AT_FLOOR else None
            if better is None:
                rejected = move.tried
                break
            steps = better
        steps += move.steps
        now = steps[-1].fit
        if now.model.ahead:
            break
    while now.excess >= AT_FLOOR and len(steps) > 1 + len(kept) and not _worth(steps[-2].fit, now):  # hope that did not come true
        rejected, now = steps[-1].tried, steps[-2].fit
        del steps[-1]
    settled = settle(data, now, stays) if len(steps) > 2 and not now.model.ahead else now
    names = tuple(name for name, _ in settled.model.effects)
    if any(name not in {step.added for step in steps} for name in names) and not settled.model.ahead:
        steps = _again(data, steps, names, library)
    return Ladder(tuple(steps), rejected, settled, names, tuple(name for name in names if name in stays and name not in kept))


def advance(data: AxisData, now: GreyboxFit, library: Library = STANDARD, pairs: bool = True) -> Move:
    """One move down from a fit; pairs: two effects may be tried at once where one alone helps little."""
    if now.excess < AT_FLOOR:
        if now.model.ahead:
            return Move((), ())
        last = polished(data, now, library) if now.excess >= SURE else None
        hidden = faint(data, now, library) if last is None and data.floor.epsilon <= EPSILON else None
        last = last or hidden
        stays = "" if last is None or (hidden is None and now.model.effects) else last.effect
        return Move(() if last is None or last.fit is None else (Step(last.effect, last.fit, ()),), (), stays=stays)
    strict = data.floor.epsilon <= EPSILON
    begun: dict[str, Grown] = {}
    tried = candidates(data, now, library)
    if strict and not now.model.effects:
        begun = suspected(data, now, tried, library)
        rungs = explaining(begun)
        if rungs:
            return Move(as_steps(rungs, tried), tried)
        if pairs:
            closed = spring_instead(data, now, begun, tried)
            if closed:
                return Move(closed, tried, False, begun)
    taken = choose(now, tried, library)
    found = taken.fit if taken is not None else None
    paired = strict and pairs and (found is None or found.excess > min(WEAK * now.excess, FAR))
    two = two_at_once(data, now, tried, library) if paired else ()
    if two:
        return Move(two, tried, paired, begun)
    hope = strict and found is not None and now.excess - found.excess >= LEAST_GAIN
    if taken is None or found is None or not (_worth(now, found) or hope):
        return Move((), tried, paired, begun)
    return Move((Step(taken.effect, found, tried),), tried, paired, begun)


def _again(data: AxisData, steps: list[Step], names: tuple[str, ...], library: Library) -> list[Step]:
    """The rungs once more, with the relatives that were preferred in the end."""
    families = {library[name].family: name for name in names if library[name].family}
    now, found = steps[0].fit, steps[:1]
    for step in steps[1:]:
        if step.added is None:
            continue
        name = step.added if step.added in names else families.get(library[step.added].family)
        if name is not None and name not in now.model:
            now = fit_with(data, now, [name])
            found.append(Step(name, now, step.tried))
    for name in names:
        if name not in now.model:
            now = fit_with(data, now, [name])
            found.append(Step(name, now, ()))
    return found


def _worth(now: GreyboxFit, then: GreyboxFit) -> bool:
    """Enough is won in the mean over the bands, or something there and much in the error as a whole."""
    gain = now.excess - then.excess
    return gain >= max(LEAST_GAIN, PART_GAIN * now.excess) or (gain >= LEAST_GAIN and then.held_out_error < MUCH * now.held_out_error)


def added(data: AxisData, now: GreyboxFit, name: str) -> GreyboxFit:
    """A fit with one more effect, by whatever can judge it. Raises BadInput where one-step prediction cannot have it beside."""
    library = now.model.library
    ahead = now.model.ahead
    if library[name].one_step is not None:
        return one_step_fit(data, now, library[name])
    return fit_with(data, now, [name]) if ahead is None else put_beside(data, now, ahead, library[name])


def settle(data: AxisData, now: GreyboxFit, keep: tuple[str, ...] = ()) -> GreyboxFit:
    """Without what is no longer needed, with simpler relatives where they do as well, and one law for several that are the same.

    keep: effects that stay as they are
    """
    found = simplified(data, prune(data, now, keep), keep)
    whole = found.model.joined()
    if whole is found.model or any(name not in whole for name in keep):
        return found
    return finish(data, whole)


def prune(data: AxisData, now: GreyboxFit, keep: tuple[str, ...] = ()) -> GreyboxFit:
    """Take out every effect whose absence costs next to nothing."""
    for name, _ in now.model.effects:
        if name in keep or len(now.model.effects) < 2:
            continue
        without = _unless_hopeless(data, now.model.without(name), now.excess + NEEDED)
        if without is None:
            continue
        needless = without.excess < SURE or PART_LEFT * without.excess < now.excess
        if without.excess <= now.excess + NEEDED and (needless or without.excess >= AT_FLOOR):
            now = without
    return now


def _unless_hopeless(data: AxisData, model: AxisModel, bar: float) -> GreyboxFit | None:
    """The fit of a model, or None if the first stage shows that its excess will stay far above ``bar``."""
    try:
        found = fit(data, model, brief=True, hopeless=bar + HOPELESS)
        return finish(data, found.model, found.runs) if found.excess <= bar + NEAR else None
    except np.linalg.LinAlgError:
        return None


def simplified(data: AxisData, now: GreyboxFit, keep: tuple[str, ...] = ()) -> GreyboxFit:
    """A simpler relative in the place of each effect of a family, where that costs next to nothing.

    While another effect was still missing, the richer relative may have looked better.
    """
    library = now.model.library
    for name, values in now.model.effects:
        effect = library[name]
        if not effect.family or name in keep or effect.one_step is not None:
            continue
        own = dict(zip(effect.names, values, strict=True))
        simpler = [e for e in library.acting if e.family == effect.family and len(e.parameters) < len(effect.parameters)]
        for relative in sorted(simpler, key=lambda e: len(e.parameters)):
            start = tuple(own.get(key, usual) for key, usual in zip(relative.names, relative.typical, strict=True))
            other = _unless_hopeless(data, now.model.without(name).with_effect(relative.name, start), now.excess + SURE)
            if other is None:
                continue
            same = other.excess <= now.excess + SURE and other.held_out_error <= 1.1 * now.held_out_error
            if same and plausible(other):
                now = other
                break
    return now
