"""Where one effect at a time leads nowhere: two at once, another first choice, or what only one-step prediction can judge.

Two effects may hide one another; a look-alike may stand for backlash; and what looks like backlash may be a spring.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from xy_sysid.axis_model import Library
from xy_sysid.greybox import EPSILON, AxisData, GreyboxFit, finish, fit_with
from xy_sysid.ladder import Move, Step
from xy_sysid.one_step import AT_NOISE
from xy_sysid.one_step_race import Grown, in_its_place
from xy_sysid.race import AT_FLOOR, NEAR, Candidate, choose, explaining, plausible, suspected, together

# Tuned on development draws of the simulated machine only (blind/cases.py).
LEAST_GAIN = 0.1  # excess that an addition must win
WEAK = 0.8  # of the excess that a single effect must leave at most, and less than FAR; else two at once are tried
PAIR_GAIN = 0.3  # excess that two at once must win where no single effect wins anything
LED_ON = 0.7  # of the base's excess that a ladder may end with for a look-alike in it to stand for another effect


def two_at_once(data: AxisData, now: GreyboxFit, tried: tuple[Candidate, ...], library: Library) -> tuple[Step, ...]:
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


def another_way(
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
            two = two_at_once(data, here, tried, library)
        else:
            others = tuple(item for item in tried if item.effect != steps[rung + 1].added)
            two = _as_pair(together(data, here, others, library, WEAK * now.excess + NEAR), tried, WEAK * now.excess)
        if two:
            return [*steps[: rung + 1], *two]
    if given:
        return None
    tried = steps[1].tried if len(steps) > 1 else last.tried
    rungs = explaining(suspected(data, steps[0].fit, tried, library, patient=True, begun=begun))
    return [steps[0], *as_steps(rungs, tried)] if rungs else None


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
        rest = [name for name, _ in instead.rungs[-1][1].model.effects if name in now.model and name not in own]
        tried = steps[1].tried
        return [steps[0], *_one_by_one(data, steps[0].fit, rest, tried), *as_steps(instead.rungs, () if rest else tried)]
    return None


def spring_instead(data: AxisData, base: GreyboxFit, begun: Mapping[str, Grown], tried: tuple[Candidate, ...]) -> tuple[Step, ...]:
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
        return (*_one_by_one(data, base, others, tried), Step(springs[0], finish(data, found.model, found.runs), ()))
    return ()


def _one_by_one(data: AxisData, base: GreyboxFit, names: Sequence[str], tried: tuple[Candidate, ...]) -> list[Step]:
    """Rungs of simulation, one effect more at each; the first shows what else was tried."""
    steps: list[Step] = []
    for name in names:
        steps.append(Step(name, fit_with(data, steps[-1].fit if steps else base, [name]), () if steps else tried))
    return steps


def as_steps(rungs: Sequence[tuple[str, GreyboxFit]], tried: tuple[Candidate, ...]) -> tuple[Step, ...]:
    """Rungs of one-step prediction; the first shows what else was tried."""
    shares = {item.effect: item.share for item in tried}
    first = Candidate(rungs[0][0], shares.get(rungs[0][0], 0.0), rungs[0][1])
    return tuple(Step(name, fit, (first, *tried) if k == 0 else ()) for k, (name, fit) in enumerate(rungs))
