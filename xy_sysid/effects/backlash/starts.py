"""Where a fit of the contact begins: the best of a grid, then of a second grid around what that became.

The innovations of a gap have many valleys, and those of a stiff contact are narrow. A filter that is told of much process noise
forgets within a few milliseconds, so that its valleys are wide; a thousand runs over two seconds take less than a second.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import product

import numpy as np

from xy_sysid.effects._contract import OneStepTask
from xy_sysid.effects.backlash.filter_source import NAMES
from xy_sysid.effects.backlash.innovations import Innovations, View
from xy_sysid.samples.block import FloatArray

FIRST = View(samples=4000, looseness=5.0, cuts=4, turn=0.7)
SECOND = View(samples=8000, looseness=1.2, cuts=4, turn=0.35)
GAPS = (10.0, 0.5, 2.0)  # from so many encoder noises up to so much of the way between two reversals, each so much wider
WIDEST = 12  # gaps at most
SHARES = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
RATES = tuple(2.0 * np.pi * hertz for hertz in (250.0, 500.0, 1000.0, 2000.0))
DAMPINGS = (0.05, 0.3)
REST = (0.0, 0.1, 0.3, 0.0)  # loss, guide, hertz, rub
AROUND = ((0.75, 0.87, 1.0, 1.15, 1.32, 1.6), (0.7, 1.0, 1.6, 2.5), (0.0, 1.0))  # gap and rate over what was found; hertz
APART = {"gap": 0.6, "share": 0.15, "rate": 0.8}  # starts that differ by less, in logarithms but for the share, find the same
NEAR = {"gap": 0.2, "rate": 0.6, "hertz": 0.7}
BEST = (5, 4)  # starts that are followed, of the first and of the second grid
STEPS, ENOUGH = 12, 1e-2
GAP, RATE, HERTZ = (NAMES.index(name) for name in ("gap", "rate", "hertz"))


def searched(fit: Innovations, task: OneStepTask) -> FloatArray:
    """Coordinates near the best fit, from a grid."""
    first, second = FIRST.within(task.stages[0]), SECOND.within(task.stages[0])
    grid = product(_gaps(task.noise, task.beside.swing), SHARES, RATES, DAMPINGS)
    starts = [fit.start(task.base, (*numbers, *REST), task.dry.values) for numbers in grid]
    found = _followed(fit, _best(fit, starts, first, APART, BEST[0]), first, task.limits.late)
    around = [found[0]]
    for wider, stiffer, hertz in product(*AROUND):
        numbers = fit.outer(found[0])
        numbers[GAP], numbers[RATE], numbers[HERTZ] = numbers[GAP] * wider, numbers[RATE] * stiffer, hertz
        around.append(fit.inner(numbers))
    chosen = _best(fit, [*around, *found[1:2]], second, NEAR, BEST[1])
    return _followed(fit, [found[0], *chosen], second, task.limits.late)[0]


def _best(fit: Innovations, starts: list[FloatArray], view: View, apart: dict[str, float], most: int) -> list[FloatArray]:
    """Those that cost least, each unlike the others, best first."""
    errors = [fit.seen(start, view) for start in starts]
    scale = min(fit.scale(error) for error in errors)
    costs = [fit.cost(error, scale) for error in errors]
    places, widths = [NAMES.index(name) for name in apart], np.array(list(apart.values()))
    found: list[FloatArray] = []
    for at in np.argsort(costs, kind="stable"):
        near = (np.abs(starts[at] - other)[places] * fit.unit[places] < widths for other in found)
        if not any(np.all(same) for same in near):
            found.append(starts[at])
        if len(found) == most:
            break
    return found


def _followed(fit: Innovations, starts: Iterable[FloatArray], view: View, late: Callable[[], bool]) -> list[FloatArray]:
    """What some steps make of each, best first; at least the first of them."""
    starts = list(starts)
    scale = min(fit.scale(fit.seen(start, view)) for start in starts)
    every, found = np.arange(starts[0].size), []
    for start in starts:
        if not found or not late():
            found.append(fit.solved(start, every, view, STEPS, ENOUGH, scale))
    return sorted(found, key=lambda one: fit.cost(fit.seen(one, view), scale))


def _gaps(noise: float, swing: float) -> list[float]:
    """Widths to begin with, m."""
    low, high, wider = GAPS[0] * noise, max(GAPS[1] * swing, 4.0 * GAPS[0] * noise), GAPS[2]
    count = min(int(np.ceil(np.log(high / low) / np.log(wider))) + 1, WIDEST)
    return [float(gap) for gap in np.geomspace(low, high, count)]
