"""Start values for a fit of the contact: the best of a grid, and then the best of a second grid around it.

The cost of a gap has many local minima, and those of a stiff contact are narrow. A filter that assumes large process noise
forgets within a few milliseconds, so its minima are wide; a thousand runs over two seconds take less than a second.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np

from xy_sysid.effects._contract import OneStepTask
from xy_sysid.effects.backlash.filter_source import NAMES
from xy_sysid.effects.backlash.innovations import Innovations, View
from xy_sysid.jit import on_all_cores
from xy_sysid.samples.block import FloatArray

FIRST = View(samples=4000, process_noise_factor=5.0, sub_steps=4, turn=0.7)
SECOND = View(samples=8000, process_noise_factor=1.2, sub_steps=4, turn=0.35)
GAPS = (10.0, 0.5, 2.0)  # smallest gap in encoder noises, largest relative to the distance between two reversals, ratio of neighbours
WIDEST = 12  # largest number of gaps
SHARES = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
RATES = tuple(2.0 * np.pi * hertz for hertz in (250.0, 500.0, 1000.0, 2000.0))
DAMPINGS = (0.05, 0.3)
REST = (0.0, 0.1, 0.3, 0.0)  # loss, guide, hertz, rub
AROUND = ((0.75, 0.87, 1.0, 1.15, 1.32, 1.6), (0.7, 1.0, 1.6, 2.5), (0.0, 1.0))  # gap and rate relative to the first result; hertz
APART = {"gap": 0.6, "share": 0.15, "rate": 0.8}  # start values that differ by less (logarithms, except share) lead to the same result
NEAR = {"gap": 0.2, "rate": 0.6, "hertz": 0.7}
PART = 4  # a quarter of the start values, the best on a quarter of the samples, are tried on all samples (successive halving; Karnin et al. 2013)
BEST = (5, 4)  # start values that are fitted, of the first and of the second grid
ROUNDS = ((6, 2), (20, 1))  # solver steps of each start value, and how many start values are kept
ENOUGH = 3e-3  # relative fall of the cost in a step, below which it ends
GAP, RATE, HERTZ = (NAMES.index(name) for name in ("gap", "rate", "hertz"))


def best_of_grid(fit: Innovations, task: OneStepTask) -> tuple[FloatArray, float]:
    """Coordinates of the best of a grid after some solver steps, and the scale of its innovations, over the encoder noise."""
    view = FIRST.within(task.stages[0])
    grid = product(_gaps(task.noise, task.companions.swing), SHARES, RATES, DAMPINGS)
    starts = [fit.start(task.base, (*numbers, *REST), task.dry.values) for numbers in grid]
    found = _best_after_rounds(fit, _best(fit, starts, view, APART, BEST[0]), view)
    return found, fit.scale(fit.innovations(found, view))


def best_around(fit: Innovations, task: OneStepTask, found: FloatArray) -> FloatArray:
    """Coordinates near the best fit: the best of a second grid, around the result of the first."""
    view = SECOND.within(task.stages[0])
    around = [found]
    for wider, stiffer, hertz in product(*AROUND):
        numbers = fit.outer(found)
        numbers[GAP], numbers[RATE], numbers[HERTZ] = numbers[GAP] * wider, numbers[RATE] * stiffer, hertz
        around.append(fit.inner(numbers))
    return _best_after_rounds(fit, [found, *_best(fit, around, view, NEAR, BEST[1])], view)


def _best(fit: Innovations, starts: list[FloatArray], view: View, apart: dict[str, float], most: int) -> list[FloatArray]:
    """Start values with the least cost, best first; of similar ones only the best. Only the best on the first part of the samples see all."""
    early = _by_cost(fit, starts, replace(view, samples=view.samples // PART))
    places, widths = [NAMES.index(name) for name in apart], np.array(list(apart.values()))
    found: list[FloatArray] = []
    for start in _by_cost(fit, early[: len(starts) // PART], view):
        near = (np.abs(start - other)[places] * fit.unit[places] < widths for other in found)
        if not any(np.all(same) for same in near):
            found.append(start)
        if len(found) == most:
            break
    return found


def _by_cost(fit: Innovations, starts: list[FloatArray], view: View) -> list[FloatArray]:
    """The same start values, that with the least cost first."""
    errors = on_all_cores(lambda start: fit.innovations(start, view), starts)
    scale = min(fit.scale(error) for error in errors)
    return [starts[at] for at in np.argsort([fit.cost(error, scale) for error in errors], kind="stable")]


def _best_after_rounds(fit: Innovations, starts: list[FloatArray], view: View) -> FloatArray:
    """The best start value after a few solver steps; each round keeps fewer, with more steps."""
    scale = min(fit.scale(fit.innovations(start, view)) for start in starts)
    every = np.arange(starts[0].size)
    for steps, left in ROUNDS:
        moved = on_all_cores(partial(fit.solved, free=every, view=view, most=steps, enough=ENOUGH, scale=scale), starts)
        starts = sorted(moved, key=lambda start: fit.cost(fit.innovations(start, view), scale))[:left]
    return starts[0]


def _gaps(noise: float, swing: float) -> list[float]:
    """Gaps of the first grid, m."""
    low, high, wider = GAPS[0] * noise, max(GAPS[1] * swing, 4.0 * GAPS[0] * noise), GAPS[2]
    count = min(int(np.ceil(np.log(high / low) / np.log(wider))) + 1, WIDEST)
    return [float(gap) for gap in np.geomspace(low, high, count)]
