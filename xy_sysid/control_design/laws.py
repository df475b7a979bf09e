"""Forces of a refined model against the drive by speed and position: its simulation laws, evaluated one by one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np

from xy_sysid.axis.model import AxisModel
from xy_sysid.effects import Effect
from xy_sysid.effects._contract import arguments
from xy_sysid.samples.block import FloatArray

LONG = 1e3  # s: after this long at a constant speed bristles slide


def ask(effect: Effect, values: tuple[float, ...], function: str, words: Mapping[str, float]) -> float:
    """The value of a law; words: its arguments besides parameters."""
    known = {**words, **dict(zip(effect.names, values, strict=True))}
    law = effect.functions[function]
    return float(law(**{name: known[name] for name in arguments(law)}))


def of_category(model: AxisModel, *categories: str) -> Iterator[tuple[Effect, tuple[float, ...]]]:
    """The effects of some categories with their values."""
    for name, values in model.effects:
        if model.library[name].category in categories:
            yield model.library[name], values


def asks(effect: Effect) -> frozenset[str]:
    """The arguments of the laws of an effect, besides parameters."""
    return frozenset(word for item in effect.functions.values() for word in arguments(item)) - set(effect.names) - set(effect.states)


def friction(model: AxisModel, speed: float, direction: float) -> float:
    """Dry friction at a constant speed, V, without the friction that grows with the input; at speed 0 the breakaway level."""
    level = sum(ask(effect, values, "level", {"u": 0.0, "v": speed, "direction": direction}) for effect, values in of_category(model, "friction"))
    for effect, values in of_category(model, "bristle"):
        v = speed if speed != 0.0 else direction * 1e-6
        state = {effect.states[0]: 0.0}
        bent = ask(effect, values, "bend", {**state, "v": v, "h": LONG / abs(v), "level": level})
        return abs(ask(effect, values, "force", {effect.states[0]: bent, "v": v, "level": level}))
    return level


def driving_factor(model: AxisModel) -> float:
    """Fraction of the voltage that drives the axis in the direction of its motion; the rest is friction that grows with the voltage."""
    words = {"v": model.gain, "direction": 1.0}
    rubbing = [item for item in of_category(model, "friction") if item[0].is_of_the_input]
    return 1.0 - sum(ask(*item, "level", {**words, "u": 1.0}) - ask(*item, "level", {**words, "u": 0.0}) for item in rubbing)


def force(model: AxisModel, speed: float, place: float, *, of_speed: bool | None = None, by_place: bool | None = None) -> float:
    """Force against the drive at a speed and a position, V, without dry friction and the base's own drag.

    of_speed, by_place: only laws that depend (True) or do not depend (False) on speed, on position; None: all
    """
    total = 0.0
    for effect, values in of_category(model, "force"):
        words = asks(effect)
        if of_speed is not None and ("v" in words) != of_speed:
            continue
        if by_place is not None and ("x" in words) != by_place:
            continue
        if "u" in words:
            continue  # it changes the effect of the voltage and is not a force of its own
        total += ask(effect, values, "force", {"v": speed, "x": place, "t": 0.0, "u": 0.0, "gain": model.gain, "pole": model.pole})
    return total


def scale_error(model: AxisModel, place: float) -> float:
    """Error of the encoder reading at a position, m; 0 at 0."""
    return sum(
        ask(effect, values, "error", {"x": place}) - ask(effect, values, "error", {"x": 0.0}) for effect, values in of_category(model, "encoder")
    )


def gain_factor(model: AxisModel, place: float) -> float:
    """Factor of the voltage at a position, with the axis at rest."""
    lost = 0.0
    for effect, values in of_category(model, "force"):
        if "u" in asks(effect):
            lost += ask(effect, values, "force", {"u": 1.0, "v": 0.0, "x": place, "t": 0.0, "gain": model.gain, "pole": model.pole})
    return 1.0 - lost


def largest_voltage(model: AxisModel) -> float:
    """The largest voltage that comes out of the amplifier of the model, V; infinite if nothing limits it."""
    top = 1e9
    held = top
    for effect, values in sorted(of_category(model, "input"), key=lambda item: (item[0].order, item[0].name)):
        if "t" not in asks(effect):
            held = ask(effect, values, "output", {"u": held, "x": 0.0})
    return held if held < 0.5 * top else math.inf


def along(model: AxisModel, places: FloatArray, what: str) -> FloatArray:
    """(n,) at positions, m: ``force`` at rest, V; ``scale`` error, m; ``gain`` factor; ``drag`` in addition to the base's, V s/m."""
    kinds: dict[str, Callable[[float], float]] = {
        "force": lambda x: force(model, 0.0, x, of_speed=False, by_place=True),
        "scale": lambda x: scale_error(model, x),
        "gain": lambda x: gain_factor(model, x),
        "drag": lambda x: force(model, 1.0, x, of_speed=True, by_place=True) - force(model, 0.0, x, of_speed=True, by_place=True),
    }
    return np.array([kinds[what](float(x)) for x in places])


def one_joint(model: AxisModel, limit: float) -> tuple[float, float, float]:
    """Mass, V s2/m, largest effort and mean level of dry friction, V, of a joint; limit: of the drive, V, infinite if unknown."""
    top = min(limit, largest_voltage(model))
    level = 0.5 * (friction(model, abs(model.gain), 1.0) + friction(model, -abs(model.gain), -1.0))
    return 1.0 / (abs(model.gain) * model.pole), top if math.isfinite(top) else 1e3 / abs(model.gain), level


def lost_in(language: str, model: AxisModel, effects: Iterable[str], travel: tuple[float, float] | None) -> tuple[tuple[str, str], ...]:
    """(effect, loss) in a format that has only the mean level of dry friction, with a delay and an unknown travel."""
    dry = [(name, model.library[name].is_dry) for name in effects]
    lost = [(name, "only its mean level at speed is kept" if is_dry else f"{language} cannot express it") for name, is_dry in dry]
    lost += [("delay", f"{language} has none")] if model.delay > 0.0 else []
    return tuple(lost if travel is not None else [*lost, ("travel", "it is not known")])
