"""Add effects one at a time, refit everything together, and watch the error on held-out data fall.

Greedy addition: the winner of a race of candidates is taken while it is worth it. Afterwards what is no longer needed is taken
out again, and a simpler relative takes the place of a richer one that does no better.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from xy_sysid.axis_model import STANDARD, AxisModel, Library
from xy_sysid.greybox import EPSILON, AxisData, GreyboxFit, finish, fit, fit_base, fit_with
from xy_sysid.one_step import AT_NOISE, one_step_fit
from xy_sysid.one_step_race import Grown, in_its_place, put_beside
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
    together,
)

LEAST_GAIN = 0.1  # excess that an addition must win, and
PART_GAIN = 0.11  # the part of the excess that it must win; or
MUCH = 0.75  # of the held-out error that it may leave at most
WEAK = 0.8  # of the excess that a single effect must leave at most, and less than FAR; else two at once are tried
PAIR_GAIN = 0.3  # excess that two at once must win where no single effect wins anything
NEEDED = 0.05  # excess that taking an effect out again must cost, or it goes
MOST_EFFECTS = 4
LED_ON = 0.7  # of the base's excess that a ladder may end with for a look-alike in it to stand for another effect


@dataclass(frozen=True, slots=True)
class Step:
    """One rung: the effect added (None for the base alone), the fit with it, and all that was tried for it, best first."""

    added: str | None
    fit: GreyboxFit
    tried: tuple[Candidate, ...]


@dataclass(frozen=True, slots=True)
class Ladder:
    """The rungs from the base down.

    rejected: what was tried last and not taken; effects: what remains after pruning; faint: those of them found below the floor
    """

    steps: tuple[Step, ...]
    rejected: tuple[Candidate, ...]
    final: GreyboxFit
    effects: tuple[str, ...]
    faint: tuple[str, ...] = ()

    @property
    def explained(self) -> bool:
        """The held-out error is at the floor."""
        return self.final.excess < AT_FLOOR


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
            better = _another_way(data, steps, move, most, len(kept), paired, library, begun) if now.excess >= AT_FLOOR else None
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


def _another_way(
    data: AxisData, steps: list[Step], last: Move, most: int, given: int, paired: set[int], library: Library, begun: Mapping[str, Grown]
) -> list[Step] | None:
    """Where one at a time has led astray, if that leads further down than all since.

    An effect that only one-step prediction can judge in the place of a look-alike; two at once, from the first rung on, because the
    first choices were made with least knowledge and the first rungs simulate fastest; or, from the base, an effect that only
    one-step prediction can judge and what is beside it.
    """
    if data.floor.epsilon > EPSILON:
        return None
    now = steps[-1].fit
    if not given and now.excess < LED_ON * steps[0].fit.excess:
        swapped = _without_stand_in(data, steps, library)
        if swapped is not None:
            return swapped
    for rung in range(given, len(steps)):
        here, top = steps[rung].fit, rung == len(steps) - 1
        tried = last.tried if top else steps[rung + 1].tried
        if rung in paired or not tried or (top and len(steps) >= most):
            continue
        paired.add(rung)
        if top:
            two = _two_at_once(data, here, tried, library)
        else:
            others = tuple(item for item in tried if item.effect != steps[rung + 1].added)
            two = _as_pair(together(data, here, others, library, WEAK * now.excess + NEAR), tried, WEAK * now.excess)
        if two:
            return [*steps[: rung + 1], *two]
    if given:
        return None
    tried = steps[1].tried if len(steps) > 1 else last.tried
    rungs = explaining(suspected(data, steps[0].fit, tried, library, patient=True, begun=begun))
    return [steps[0], *_as_steps(rungs, tried)] if rungs else None


def _without_stand_in(data: AxisData, steps: list[Step], library: Library) -> list[Step] | None:
    """A look-alike in the model gives way to the effect that only one-step prediction can judge, if that explains the axis."""
    now = steps[-1].fit
    for effect in library.acting:
        alike = [name for name in effect.look_alikes if name in now.model] if effect.one_step is not None else []
        alike = [name for name in alike if not any(library[own].category == "motion" for own, _ in now.model.without(name).effects)]
        all_tried = (in_its_place(data, now, effect, name) for name in alike)
        instead = next((found for found in all_tried if found is not None and found.rungs[-1][1].excess < AT_FLOOR), None)
        if instead is None:
            continue
        own = [name for name, _ in instead.rungs]
        found, fit = steps[:1], steps[0].fit
        for name, _ in instead.rungs[-1][1].model.effects:
            if name in now.model and name not in own:
                fit = fit_with(data, fit, [name])
                found.append(Step(name, fit, steps[1].tried if len(found) == 1 else ()))
        return [*found, *_as_steps(instead.rungs, steps[1].tried if len(found) == 1 else ())]
    return None


def _spring_instead(data: AxisData, base: GreyboxFit, begun: Mapping[str, Grown], tried: tuple[Candidate, ...]) -> tuple[Step, ...]:
    """A resonance that looks like what one-step prediction tried, with what it found beside it, where it explains the axis but for a gap.

    The filter then has found a spring; alone, neither that nor the friction beside it need help much.
    """
    library = base.model.library
    for name, item in begun.items():
        predicted = next((fit for _, fit in item.rungs if fit.held_out_error < AT_NOISE * fit.noise_floor), base)
        others = [own for own, _ in predicted.model.effects if own != name]
        springs = [own for own in library[name].look_alikes if library[own].category == "motion"]
        if not springs or not others:
            continue
        try:
            found = fit_with(data, base, [*others, springs[0]], dict(predicted.model.effects), brief=True)
        except np.linalg.LinAlgError:
            continue
        if not (found.excess < AT_FLOOR and plausible(found)):
            continue
        steps: list[Step] = []
        for own in others:
            fit = fit_with(data, steps[-1].fit if steps else base, [own])
            steps.append(Step(own, fit, () if steps else tried))
        return (*steps, Step(springs[0], finish(data, found.model, found.runs), ()))
    return ()


def _as_steps(rungs: Sequence[tuple[str, GreyboxFit]], tried: tuple[Candidate, ...]) -> tuple[Step, ...]:
    """Rungs of one-step prediction; the first shows what else was tried."""
    shares = {item.effect: item.share for item in tried}
    first = Candidate(rungs[0][0], shares.get(rungs[0][0], 0.0), rungs[0][1])
    return tuple(Step(name, fit, (first, *tried) if k == 0 else ()) for k, (name, fit) in enumerate(rungs))


@dataclass(frozen=True, slots=True)
class Move:
    """The next rungs: one, two that were found together, or none, if the floor is reached or nothing helps.

    tried: the candidates; paired: were pairs tried, too; begun: what one-step prediction did not explain yet
    stays: an effect that was found below the floor's threshold, where the mean over the bands hardly misses it
    """

    steps: tuple[Step, ...]
    tried: tuple[Candidate, ...]
    paired: bool = False
    begun: Mapping[str, Grown] = field(default_factory=dict)
    stays: str = ""


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
            return Move(_as_steps(rungs, tried), tried)
        if pairs:
            closed = _spring_instead(data, now, begun, tried)
            if closed:
                return Move(closed, tried, False, begun)
    taken = choose(now, tried, library)
    found = taken.fit if taken is not None else None
    paired = strict and pairs and (found is None or found.excess > min(WEAK * now.excess, FAR))
    two = _two_at_once(data, now, tried, library) if paired else ()
    if two:
        return Move(two, tried, paired, begun)
    hope = strict and found is not None and now.excess - found.excess >= LEAST_GAIN
    if taken is None or found is None or not (_worth(now, found) or hope):
        return Move((), tried, paired, begun)
    return Move((Step(taken.effect, found, tried),), tried, paired, begun)


def _two_at_once(data: AxisData, now: GreyboxFit, tried: tuple[Candidate, ...], library: Library) -> tuple[Step, ...]:
    """Two rungs that lead clearly further down than the best single effect; none if there are no such two."""
    taken = choose(now, tried, library)
    single = now.excess if taken is None or taken.fit is None else min(taken.fit.excess, now.excess)
    bar = WEAK * single if now.excess - single >= LEAST_GAIN else max(WEAK * single, now.excess - PAIR_GAIN)
    return _as_pair(together(data, now, tried, library, bar + NEAR), tried, bar)


def _as_pair(pair: tuple[Candidate, Candidate] | None, tried: tuple[Candidate, ...], bar: float) -> tuple[Step, ...]:
    """Two rungs, if they leave less excess than ``bar``."""
    if pair is None or pair[0].fit is None or pair[1].fit is None or not pair[1].fit.excess < bar:
        return ()
    return Step(pair[0].effect, pair[0].fit, tried), Step(pair[1].effect, pair[1].fit, ())


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
