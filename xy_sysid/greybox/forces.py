"""Forces of the effects of a model on the measured motion, and models in which other effects replace the force of one.

Nothing is simulated: position, time, speed and input are measured, and these laws depend on nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from xy_sysid.axis.loop_source import undoable
from xy_sysid.axis.model import AxisModel, undoer
from xy_sysid.effects import Effect, Scene
from xy_sysid.effects._contract import Parameter, arguments
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.samples.block import FloatArray

LOOKS = 50  # most evaluations of the forces: a spring's rest position far outside the travel takes ten
SMOOTH = 300.0  # Hz, low-pass for speeds
SPEEDS = 100  # number of speeds at which levels of dry friction are compared


def position_forces(model: AxisModel) -> list[str]:
    """Names of the effects whose force depends on position and time alone."""
    return [name for name, _ in model.effects if is_position_force(model.library[name])]


def force_of(data: AxisData, model: AxisModel, name: str, counts: Sequence[int]) -> FloatArray:
    """(samples,) V, force of one effect of a model against the drive, on the measured motion; counts: samples of each recording."""
    row = np.array([model.gain, model.delay, model.pole, *dict(model.effects)[name]])
    parts = []
    for run, count in zip(data.runs, counts, strict=True):
        undo = undoer(model.library, [name], data.sampling_rate, data.voltage[run], data.position[run])
        parts.append(undo(row, count)[2].sum(axis=0))
    return np.concatenate(parts)


def dry_frictions(model: AxisModel) -> list[str]:
    """Names of the effects of dry friction that depend on speed and input alone."""
    return [name for name, _ in model.effects if model.library[name].category == "friction"]


def friction_of(scene: Scene, model: AxisModel, name: str) -> FloatArray:
    """(n,) V, friction force of a model against the drive, on the measured motion, while the axis moves."""
    velocity, effect, values = scene.smooth(scene.velocity, SMOOTH), model.library[name], np.array(dict(model.effects)[name])
    if effect.is_of_the_input:
        most = float(np.max(np.abs(scene.voltage), initial=0.0))
        drives = np.linspace(-most, most, 2 * SPEEDS + 1)  # with 0, where such a level has its corner
        level = np.interp(scene.voltage, drives, _levels(effect, values, np.full(drives.size, np.std(velocity)), drives))
    else:
        speeds = np.linspace(float(np.min(velocity)), float(np.max(velocity)), 2 * SPEEDS)
        level = np.interp(velocity, speeds, _levels(effect, values, speeds))
    return np.asarray(np.copysign(1.0, model.gain) * scene.direction() * level)


def force_moved_to_others(data: AxisData, model: AxisModel, name: str) -> AxisModel:
    """The model without an effect; the other forces of position and time are adapted to replace its force as well as possible.

    For example, a spring with a load is a spring with another rest position. Without other forces, or if a law is not finite, nothing is adapted.
    """
    others = [own for own in position_forces(model) if own != name]
    less = model.without(name)
    if not others or name not in position_forces(model):
        return less
    counts = data.counts(early=True)
    wanted = np.sum([force_of(data, model, own, counts) for own in (*others, name)], axis=0)
    sizes = np.cumsum([len(dict(model.effects)[own]) for own in others])[:-1]

    def moved(values: FloatArray) -> AxisModel:
        made = less
        for own, part in zip(others, np.split(values, sizes), strict=True):
            made = made.with_effect(own, part)
        return made

    def left(values: FloatArray) -> FloatArray:
        now = moved(values)
        return np.asarray(np.sum([force_of(data, now, own, counts) for own in others], axis=0) - wanted)

    items = [item for own in others for item in model.library[own].on(data.similar)]
    return moved(_least(left, np.concatenate([dict(model.effects)[own] for own in others]), items))


def with_shared_values(data: AxisData, model: AxisModel, name: str, relative: Effect) -> AxisModel:
    """The model with an effect replaced by a related one: parameters of the same name keep their value, others get typical values."""
    own = dict(zip(model.library[name].names, dict(model.effects)[name], strict=True))
    pairs = ((own.get(item.name, item.typical), item) for item in relative.on(data.similar))
    return model.without(name).with_effect(relative.name, [min(max(value, item.low), item.high) for value, item in pairs])


def with_equal_force(data: AxisData, model: AxisModel, name: str, relative: Effect) -> AxisModel:
    """The model with an effect replaced by a related one, with a force as similar as possible.

    As ``with_shared_values`` if the laws are neither position forces nor dry friction.
    """
    effect, start = model.library[name], with_shared_values(data, model, name, relative)
    if effect.category == relative.category == "friction" and np.any(data.velocity != 0.0):
        return _matched_to_friction(data, model, name, relative)
    return _matched_to_force(data, model, name, start, relative) if is_position_force(effect) and is_position_force(relative) else start


def with_force_from_trace(data: AxisData, model: AxisModel, name: str, other: Effect, scene: Scene) -> AxisModel | None:
    """The model with an effect replaced by another law, with a force as similar as possible; start values are those of the most similar trace.

    None if the law leaves no trace on this motion, or if one of the two is not a position force.

    scene: of the first stage
    """
    traces = other.guessed(scene) if is_position_force(model.library[name]) and is_position_force(other) else []
    if not traces:
        return None
    wanted = force_of(data, model, name, data.counts(early=True))
    fits = [np.asarray(np.linalg.lstsq(trace.columns.T, wanted, rcond=None)[0], dtype=np.float64) for trace in traces]
    least = min(range(len(traces)), key=lambda k: float(np.sum((wanted - fits[k] @ traces[k].columns) ** 2)))
    start = model.without(name).with_effect(other.name, other.read(traces[least], fits[least], data.similar))
    return _matched_to_force(data, model, name, start, other)


def _matched_to_force(data: AxisData, model: AxisModel, name: str, start: AxisModel, other: Effect) -> AxisModel:
    """The start model with the parameters of the other law fitted to the force of the effect in the first model."""
    counts = data.counts(early=True)
    wanted = force_of(data, model, name, counts)

    def left(values: FloatArray) -> FloatArray:
        return np.asarray(force_of(data, start.with_effect(other.name, values), other.name, counts) - wanted)

    return start.with_effect(other.name, _least(left, np.array(dict(start.effects)[other.name]), other.on(data.similar)))


def _matched_to_friction(data: AxisData, model: AxisModel, name: str, relative: Effect) -> AxisModel:
    """``with_equal_force`` for two laws of dry friction: their levels are matched at the measured speeds, weighted by speed, as power is.

    The drag of the base may change from a tenth to ten times its value, at the same inertia, to match the part that depends on speed.
    """
    moving = data.velocity[data.velocity != 0.0]
    speeds = np.quantile(moving, np.linspace(0.0, 1.0, SPEEDS))
    size = np.abs(speeds) / float(np.max(np.abs(speeds)))
    drag = 1.0 / abs(model.gain)  # V s/m
    friction = _levels(model.library[name], np.array(dict(model.effects)[name]), speeds)

    def left(values: FloatArray) -> FloatArray:
        return np.asarray(size * (_levels(relative, values[:-1], speeds) + (values[-1] - drag) * np.abs(speeds) - friction))

    items, start = relative.on(data.similar), dict(with_shared_values(data, model, name, relative).effects)[relative.name]
    dragged = Parameter("drag", "V s/m", 0.1 * drag, 10.0 * drag, drag, "of the base")
    *values, more = _least(left, np.array([*start, drag]), [*items, dragged])
    slower = float(drag / more)
    return replace(model.without(name), gain=model.gain * slower, pole=model.pole / slower).with_effect(relative.name, values)


def is_position_force(effect: Effect) -> bool:
    """True for a force that depends on position and time alone."""
    return effect.category == "force" and undoable(effect)


def _levels(effect: Effect, values: FloatArray, speeds: FloatArray, voltage: FloatArray | None = None) -> FloatArray:
    """(n,) V, the level of a dry friction at each speed (m/s), under each voltage (V; zero if not given)."""
    law = effect.functions["level"]
    own, asked = dict(zip(effect.names, values.tolist(), strict=True)), arguments(law)
    drive = np.zeros(speeds.size) if voltage is None else voltage
    rows = ({**own, "u": u, "v": v, "direction": float(np.sign(v))} for u, v in zip(drive.tolist(), speeds.tolist(), strict=True))
    return np.array([law(**{word: row[word] for word in asked}) for row in rows])


def _least(left: Callable[[FloatArray], FloatArray], start: FloatArray, items: Sequence[Parameter]) -> FloatArray:
    """The values within the bounds with the smallest error; the start values within the bounds, if the error is not finite."""
    from scipy.optimize import least_squares  # here, because the import is slow and rarely needed

    low, high = np.array([item.low for item in items]), np.array([item.high for item in items])
    inside = np.clip(start, low, high)
    if not np.isfinite(left(inside)).all():
        return inside
    return np.asarray(least_squares(left, inside, bounds=(low, high), x_scale="jac", max_nfev=LOOKS).x)
