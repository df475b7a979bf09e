"""Add effects one at a time, refit everything together, and watch the error on held-out data fall.

Greedy addition: of the effects whose trace is in the error the best few are fitted in full, and the simplest of those that
do as well as the best is taken. Afterwards what is no longer needed is taken out again.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.axis_model import STANDARD, Library
from xy_sysid.effects import Effect
from xy_sysid.errors import BadInput
from xy_sysid.greybox import EPSILON, AxisData, GreyboxFit, finish, fit, fit_base, fit_with, look
from xy_sysid.one_step import one_step_fit

# Tuned on development seeds 1-40 of the simulated machine's hidden effects.
AT_FLOOR = 0.15  # excess below which nothing is left to explain; clean axes stay below 0.02
SIMPLER = 0.08  # excess that a simpler model may be worse by and still be preferred
TRIED = 5  # effects that are fitted in full at each step, by their share of the error
NEAR = 0.3  # excess on the first stage within which candidates run the whole distance
HOPELESS = 1.5  # excess behind the best so far at which a candidate is given up after its first round
LEAST_SHARE = 5e-4  # of the error that an effect's trace must explain to be tried
LEAST_GAIN = 0.1  # excess that an addition must win, and
PART_GAIN = 0.11  # the part of the excess that it must win
WEAK = 0.8  # of the excess that a single effect must leave at most; else two at once are tried
WIDE = 3  # first effects of such pairs
SURE = 0.03  # excess up to which nothing at all is left; clean axes stay below 0.02
PART_LEFT = 0.4  # of the excess that an effect found between SURE and AT_FLOOR may leave
SUSPICIOUS = 0.1  # share of a look-alike from which an effect that free simulation cannot judge is tried
MUCH = 0.75  # of the held-out error
NEEDED = 0.05  # excess that taking an effect out again must cost, or it goes
MOST_EFFECTS = 4


@dataclass(frozen=True, slots=True)
class Candidate:
    """One effect tried: the share of the error that its trace explains, and its full fit (None if that failed)."""

    effect: str
    share: float
    fit: GreyboxFit | None


@dataclass(frozen=True, slots=True)
class Step:
    """One rung: the effect added (None for the base alone), the fit with it, and all that was tried for it, best first."""

    added: str | None
    fit: GreyboxFit
    tried: tuple[Candidate, ...]


@dataclass(frozen=True, slots=True)
class Ladder:
    """The rungs from the base down; ``rejected`` is what was tried last and not taken; ``effects`` what remains after pruning."""

    steps: tuple[Step, ...]
    rejected: tuple[Candidate, ...]
    final: GreyboxFit
    effects: tuple[str, ...]

    @property
    def explained(self) -> bool:
        """The held-out error is at the floor."""
        return self.final.excess < AT_FLOOR


def refine(data: AxisData, library: Library = STANDARD, most: int = MOST_EFFECTS, given: Iterable[str] = ()) -> Ladder:
    """Add effects until the floor is reached or nothing helps; ``given`` are added first, in their order, unasked."""
    now = fit_base(data, library)
    steps = [Step(None, now, ())]
    for name in given:
        now = added(data, now, name)
        steps.append(Step(name, now, ()))
    rejected: tuple[Candidate, ...] = ()
    paired = False
    while now.excess >= AT_FLOOR and len(steps) <= most:
        tried = candidates(data, now, library)
        if len(steps) == 1 and data.floor.epsilon <= EPSILON:
            tried = (*suspected(data, now, tried, library), *tried)
        taken = choose(tried, library)
        found = taken.fit if taken is not None else None
        if (found is None or found.excess > WEAK * now.excess) and len(steps) < most and not paired and data.floor.epsilon <= EPSILON:
            paired = True
            pair = together(data, now, tried, library)
            if pair is not None and (found is None or pair[1].fit.excess < WEAK * found.excess):
                steps += [replace(pair[0], tried=tried), pair[1]]
                now = pair[1].fit
                continue
        if taken is None or found is None or not _worth(now, found):
            rejected = tried
            break
        now = found
        steps.append(Step(taken.effect, now, tried))
    if SURE <= now.excess < AT_FLOOR and len(steps) <= most:
        last = polished(data, now, library)
        if last is not None:
            now = last.fit
            steps.append(last)
    pruned = simplified(data, prune(data, now, keep=tuple(given)), keep=tuple(given)) if len(steps) > 2 else now
    names = tuple(name for name, _ in pruned.model.effects)
    if any(name not in {step.added for step in steps} for name in names) and not any(library[name].one_step for name in names):
        steps = _again(data, steps, names, library)
    return Ladder(tuple(steps), rejected, pruned, names)


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
    return found


def _worth(now: GreyboxFit, then: GreyboxFit) -> bool:
    """Enough is won in the mean over the bands, or something there and much in the error as a whole."""
    gain = now.excess - then.excess
    return gain >= max(LEAST_GAIN, PART_GAIN * now.excess) or (gain >= LEAST_GAIN and then.held_out_error < MUCH * now.held_out_error)


def added(data: AxisData, now: GreyboxFit, name: str) -> GreyboxFit:
    """A fit with one more effect, by whatever can judge it. Raises BadInput where one-step prediction stands alone."""
    effect = now.model.library[name]
    if effect.one_step is None and not any(now.model.library[own].one_step for own, _ in now.model.effects):
        return fit_with(data, now, [name])
    if effect.one_step is None or now.model.effects:
        raise BadInput("effects", f"{name} with {', '.join(own for own, _ in now.model.effects)}", "backlash alone", "Fit them one at a time.")
    return one_step_fit(data, now, effect)


def together(data: AxisData, now: GreyboxFit, tried: tuple[Candidate, ...], library: Library) -> tuple[Step, Step] | None:
    """Two effects at once, where each alone helps little because the other's error hides it; None if that helps little, too."""
    if any(library[name].one_step for name, _ in now.model.effects):
        return None
    fitted = [item for item in tried if item.fit is not None and library[item.effect].one_step is None]
    richest = [item for item in fitted if library[item.effect].category == "bristle"]  # all dry friction goes through bristles
    fitted = [*richest, *(item for item in fitted if item not in richest)]
    best: tuple[Step, Step] | None = None
    for first in fitted[:WIDE]:
        assert first.fit is not None
        seconds = [item.effect for item in look(data, first.fit, _open(first.fit, library)) if item.share >= LEAST_SHARE][:1]
        always = [effect.name for effect in _open(first.fit, library) if effect.name == "constant_load"]
        for name in dict.fromkeys([*seconds, *always]):
            try:
                found = fit_with(data, now, [first.effect, name], brief=True)
            except np.linalg.LinAlgError:
                continue
            if np.isfinite(found.excess) and _plausible(found) and (best is None or found.excess < best[1].fit.excess):
                best = Step(first.effect, first.fit, ()), Step(name, found, ())
        if best is not None and best[1].fit.excess < AT_FLOOR:
            break
    if best is None:
        return None
    whole = finish(data, best[1].fit.model, best[1].fit.runs)
    return best[0], replace(best[1], fit=whole)


def polished(data: AxisData, now: GreyboxFit, library: Library) -> Step | None:
    """One more effect below the threshold of the floor, if it takes away most of what is left there."""
    for trace in look(data, now, _open(now, library))[:2]:
        found = _tried(data, now, trace.effect)
        if found is not None and found.excess < now.excess:
            found = finish(data, found.model, found.runs)
            if found.excess < PART_LEFT * now.excess:
                return Step(trace.effect, found, ())
    return None


def _open(now: GreyboxFit, library: Library) -> list[Effect]:
    """What may still be added."""
    families = {library[name].family for name, _ in now.model.effects if library[name].family}
    return [e for e in library.acting if e.simulable and e.name not in now.model and not (e.family and e.family in families)]


def suspected(data: AxisData, now: GreyboxFit, tried: tuple[Candidate, ...], library: Library) -> tuple[Candidate, ...]:
    """Effects that only one-step prediction can judge, where no other explains the error and a look-alike left its trace."""
    if any(item.fit is not None and item.fit.excess < AT_FLOOR for item in tried):
        return ()
    shares = {item.effect: item.share for item in tried}
    found = []
    for effect in library.acting:
        share = max((shares.get(name, 0.0) for name in effect.look_alikes), default=0.0)
        if effect.one_step is not None and share >= SUSPICIOUS:
            rubbing = [item.fit for item in tried if item.effect == "coulomb_friction" and item.fit is not None and item.share >= SUSPICIOUS]
            fitted = one_step_fit(data, rubbing[0] if rubbing else now, effect)
            if fitted.excess < AT_FLOOR:
                found.append(Candidate(effect.name, share, fitted))
    return tuple(found)


def candidates(data: AxisData, now: GreyboxFit, library: Library = STANDARD) -> tuple[Candidate, ...]:
    """The effects that may be added to a fit, the best few fitted, least excess first.

    A race: simpler effects first, each on the first stage's data only. Once one is at the floor, richer ones cannot be
    preferred to it and are left out; those that come near the best run the whole distance.
    """
    open_to = _open(now, library)
    traces = [trace for trace in look(data, now, open_to) if trace.share >= LEAST_SHARE]
    shares = {trace.effect: trace.share for trace in traces}
    names = _with_relatives([trace.effect for trace in traces[:TRIED]], open_to)
    found: list[Candidate] = []
    enough = np.inf
    for name in sorted(names, key=lambda name: (len(library[name].parameters), -shares.get(name, 0.0))):
        if len(library[name].parameters) > enough:
            found.append(Candidate(name, shares.get(name, 0.0), None))
            continue
        least = min((item.fit.excess for item in found if item.fit), default=np.inf)
        fitted = _tried(data, now, name, least + HOPELESS)
        if fitted is not None and fitted.excess < AT_FLOOR:
            fitted = finish(data, fitted.model, fitted.runs)
            if fitted.excess < SIMPLER:
                enough = len(library[name].parameters)
        found.append(Candidate(name, shares.get(name, 0.0), fitted))
    least = min((item.fit.excess for item in found if item.fit), default=np.inf)
    near = [item for item in found if item.fit and AT_FLOOR <= item.fit.excess <= least + NEAR]
    for item in near:
        assert item.fit is not None
        found[found.index(item)] = replace(item, fit=finish(data, item.fit.model, item.fit.runs))
    rest = [Candidate(trace.effect, trace.share, None) for trace in traces[TRIED:] if trace.effect not in names]
    return tuple(sorted(found, key=lambda item: item.fit.excess if item.fit else np.inf)) + tuple(rest)


def _with_relatives(names: list[str], open_to: list[Effect]) -> list[str]:
    """The names, and the rest of a family of which one is among the first two: relatives share their trace."""
    family = {effect.name: effect.family for effect in open_to}
    wanted = {family[name] for name in names[:2] if family[name]}
    return [*names, *(name for name in family if family[name] in wanted and name not in names)]


def _tried(data: AxisData, now: GreyboxFit, name: str, hopeless: float = np.inf) -> GreyboxFit | None:
    try:
        found = fit_with(data, now, [name], brief=True, hopeless=hopeless)
    except np.linalg.LinAlgError:
        return None
    return found if np.isfinite(found.excess) and _plausible(found) else None


def _plausible(found: GreyboxFit) -> bool:
    """No effect has values that no machine has."""
    checks = ((found.model.library[name].plausible, values) for name, values in found.model.effects)
    return all(check is None or check(values) for check, values in checks)


def choose(tried: tuple[Candidate, ...], library: Library = STANDARD) -> Candidate | None:
    """The simplest (fewest parameters) of those within SIMPLER of the least excess; None if nothing could be fitted."""
    fitted = [item for item in tried if item.fit is not None]
    if not fitted:
        return None
    least = min(item.fit.excess for item in fitted if item.fit)
    good = [item for item in fitted if item.fit and item.fit.excess <= least + SIMPLER]
    return min(good, key=lambda item: (len(library[item.effect].parameters), item.fit.excess if item.fit else np.inf))


def prune(data: AxisData, now: GreyboxFit, keep: tuple[str, ...] = ()) -> GreyboxFit:
    """Take out every effect whose absence costs next to nothing."""
    for name, _ in now.model.effects:
        if name in keep or len(now.model.effects) < 2:
            continue
        try:
            without = fit(data, now.model.without(name))
        except np.linalg.LinAlgError:
            continue
        needless = without.excess < SURE or PART_LEFT * without.excess < now.excess
        if without.excess <= now.excess + NEEDED and (needless or without.excess >= AT_FLOOR):
            now = without
    return now


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
            try:
                other = fit(data, now.model.without(name).with_effect(relative.name, start))
            except np.linalg.LinAlgError:
                continue
            same = other.excess <= now.excess + SURE and other.held_out_error <= 1.1 * now.held_out_error
            if same and _plausible(other):
                now = other
                break
    return now
