"""Start values for the fit of a set of effects: from the fit of another set, and from the measured motion without a model."""

from __future__ import annotations

from collections.abc import Sequence

from xy_sysid.axis.model import AxisModel
from xy_sysid.effects import Effect, Scene
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.forces import force_moved_to_others, with_equal_force, with_force_from_trace, with_shared_values
from xy_sysid.greybox.free_run import GreyboxFit, has_inverse_starts, inverse_start_models, scene_of
from xy_sysid.greybox.score_test import bounded


def added(
    data: AxisData, now: GreyboxFit, model: AxisModel, effect: Effect, traced: Sequence[float] | None, scene: Scene | None = None
) -> list[AxisModel]:
    """Start models with one more effect: from its trace, by inverse dynamics, and from base and effect together."""
    start_models = [] if traced is None else [model.with_effect(effect.name, bounded(effect, traced, data.similar))]
    return [*start_models, *inverse_start_models(data, now, model, effect.name, scene)]


def swapped(data: AxisData, now: GreyboxFit, name: str, other: Effect, traced: Sequence[float] | None) -> list[AxisModel]:
    """Start models with one effect replaced: with equal values of parameters of the same name, with an equal force, and by inverse dynamics."""
    model = now.model
    start_models = [make(data, model, name, other) for make in (with_shared_values, with_equal_force)]
    rest = model.without(name)
    if traced is not None:
        old = dict(zip(model.library[name].names, dict(model.effects)[name], strict=True))
        values = tuple(old.get(key, value) for key, value in zip(other.names, traced, strict=True))
        start_models.append(rest.with_effect(other.name, bounded(other, values, data.similar)))
    if has_inverse_starts(rest):
        start_models += inverse_start_models(data, now, rest, other.name)
    from_trace = with_force_from_trace(data, model, name, other, scene_of(data, now))
    return [*start_models, *([from_trace] if from_trace is not None else [])]


def dropped(data: AxisData, now: GreyboxFit, name: str, alone: Sequence[AxisModel]) -> list[AxisModel]:
    """Start models without an effect: unchanged, with its force moved to the others, by inverse dynamics, and with the others' values alone."""
    less, scene = now.model.without(name), scene_of(data, now)
    start_models = [less.with_effect(other, values) for model in alone for other, values in model.effects if other in less]
    read = [start for other, _ in less.effects for start in inverse_start_models(data, now, less.without(other), other, scene)]
    return [less, force_moved_to_others(data, now.model, name), *start_models, *read]


def merged(now: AxisModel, other: AxisModel) -> list[AxisModel]:
    """Start models with the effects of both, on the base of each."""
    found = []
    for base, more in ((now, other), (other, now)):
        model = base
        for name, values in more.effects:
            if name not in model:
                model = model.with_effect(name, values)
        found.append(model)
    return found
