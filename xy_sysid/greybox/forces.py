"""What the effects of a model push against the drive on the measured motion, and how some of them push what others did.

No simulation: place and time are known, and these laws ask for nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xy_sysid.axis.loop_source import undoable
from xy_sysid.axis.model import AxisModel, undoer
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.samples.block import FloatArray

LOOKS = 50  # at the forces, at most: a spring's rest far outside the travel takes ten


def pushing(model: AxisModel) -> list[str]:
    """Effects whose force follows from place and time alone."""
    return [name for name, _ in model.effects if model.library[name].category == "force" and undoable(model.library[name])]


def force_of(data: AxisData, model: AxisModel, name: str, counts: Sequence[int]) -> FloatArray:
    """(samples,) V, what one effect of a model pushes against the drive on the measured motion; counts: samples of each recording."""
    row = np.array([model.gain, model.delay, model.pole, *dict(model.effects)[name]])
    parts = []
    for run, count in zip(data.runs, counts, strict=True):
        undo = undoer(model.library, [name], data.sampling_rate, data.voltage[run], data.position[run])
        parts.append(undo(row, count)[2].sum(axis=0))
    return np.concatenate(parts)


def taken_over(data: AxisData, model: AxisModel, name: str) -> AxisModel:
    """The model without an effect, whose force the others that push by place and time take over as well as they can.

    A load beside a spring, say, is a spring that rests elsewhere. If there are no others, or a law gives no number, they stay as they were.
    """
    others = [own for own in pushing(model) if own != name]
    less = model.without(name)
    if not others or name not in pushing(model):
        return less
    from scipy.optimize import least_squares  # here, as it takes a while to import, and few ask

    counts = data.counts(early=True)
    wanted = np.sum([force_of(data, model, own, counts) for own in (*others, name)], axis=0)
    sizes = [len(dict(model.effects)[own]) for own in others]
    items = [item for own in others for item in model.library[own].on(data.similar)]
    low, high = np.array([item.low for item in items]), np.array([item.high for item in items])
    begun = np.clip(np.concatenate([dict(model.effects)[own] for own in others]), low, high)

    def moved(values: FloatArray) -> AxisModel:
        made, rest = less, iter(np.split(values, np.cumsum(sizes)[:-1]))
        for own in others:
            made = made.with_effect(own, next(rest))
        return made

    def left(values: FloatArray) -> FloatArray:
        now = moved(values)
        return np.asarray(np.sum([force_of(data, now, own, counts) for own in others], axis=0) - wanted)

    if not np.isfinite(left(begun)).all():
        return less
    return moved(least_squares(left, begun, bounds=(low, high), x_scale="jac", max_nfev=LOOKS).x)
