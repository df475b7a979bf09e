"""Simulation of a refined model sample by sample, as a controller needs it: generator, numbers, state."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from xy_sysid.axis import interpolation, resonant_loop
from xy_sysid.axis.model import FINE, STANDARD, AxisModel, Library
from xy_sysid.control_design import series
from xy_sysid.control_design.law_text import NUMBERS, StateLayout
from xy_sysid.control_design.step_text import StepText, heeds
from xy_sysid.effects import Effect
from xy_sysid.effects._binding import law_names, law_texts
from xy_sysid.effects._contract import arguments
from xy_sysid.errors import BadInput
from xy_sysid.jit import compiled_text
from xy_sysid.samples.block import FloatArray

SERIES = {name: getattr(series, name) for name in ("unfold", "follow", "speed_after", "stops_after", "tug")}
LONGEST = 4096  # samples of delay that fit into a state


@dataclass(frozen=True, slots=True)
class Plant:
    """An axis model at one rate, ready for simulation.

    parameters, flags: of all effects of the loop; numbers: of ``NUMBERS``; moving, still: (n n,) generators by rows; layout: of the state
    """

    model: AxisModel
    sampling_rate: float
    parameters: FloatArray
    flags: Any
    numbers: FloatArray
    moving: FloatArray
    still: FloatArray
    layout: StateLayout

    @property
    def order(self) -> int:
        """n: number of states (position, speed, those of attached masses) plus one for the force."""
        return round(math.sqrt(self.moving.size))

    def number(self, name: str) -> float:
        """One of ``NUMBERS``."""
        return float(self.numbers[NUMBERS.index(name)])

    def rest(self) -> FloatArray:
        """A state at rest at position 0."""
        return np.zeros(self.layout.ring + int(self.number("ring")))


def sections(model: AxisModel, sampling_rate: float) -> tuple[FloatArray, FloatArray]:
    """Zeros and poles of all resonances as monic polynomials of s / rate, lowest power first. Raises BadInput for one without zeros or poles in s."""
    top, bottom = np.ones(1), np.ones(1)
    for name, values in model.effects:
        effect = model.library[name]
        if effect.category != "motion":
            continue
        section = effect.functions["section"]
        words = dict(zip(effect.names, values, strict=True)) | {"fs": resonant_loop.FINE}
        b0, b1, b2, a1, a2 = section(**{word: words[word] for word in arguments(section)})
        zeros, poles = resonant_loop.roots(b1 / b0, b2 / b0, sampling_rate), resonant_loop.roots(a1, a2, sampling_rate)
        if not (zeros[0] > 0.0 and poles[0] > 0.0):
            act = "Close loops on an encoder at the motor, or use the gains alone at a bandwidth far below it."
            raise BadInput(f"effect {name}", "a spring between motor and encoder", "a resonance that an encoder at the motor sees", act)
        top, bottom = resonant_loop.times(top, np.array([*zeros, 1.0])), resonant_loop.times(bottom, np.array([*poles, 1.0]))
    return top, bottom


def plant(model: AxisModel, sampling_rate: float, whole: bool = True, shake: float = 0.0) -> Plant:
    """The model at a rate, Hz. whole: True for the compiled loop of the library, False for the layout of this model alone, for printing.

    shake: m/s, mean absolute speed due to noise at rest, which the feedforward takes into account

    Raises BadInput for a delay of more than ``LONGEST`` samples, or a resonance without zeros or poles in s.
    """
    top, bottom = sections(model, sampling_rate)
    if top.size > 1:
        moving = resonant_loop.generator(model.gain, model.pole, top, bottom, sampling_rate)
    else:
        moving = np.array([[0.0, 1.0, 0.0], [0.0, -model.pole, model.gain * model.pole], [0.0, 0.0, 0.0]])
    fastest = resonant_loop.fastest(model.pole, bottom, sampling_rate)
    late = model.delay * sampling_rate
    if late > LONGEST:
        raise BadInput("delay", f"{model.delay:g} s", f"up to {LONGEST / sampling_rate:g} s at {sampling_rate:g} Hz", "Choose a lower rate.")
    back = int(late)
    part = late - back
    wanted = max(fastest / (resonant_loop.STIFF * sampling_rate), FINE / sampling_rate if heeds(model) else 1.0)
    cuts_old, cuts_new = interpolation.pieces(part, wanted)
    cuts_old = cuts_old if part > 0.0 else 0
    values = {
        "gain": model.gain,
        "pole": model.pole,
        "turn": math.copysign(1.0, model.gain),
        "h_old": part / sampling_rate / max(cuts_old, 1),
        "h_new": (1.0 - part) / sampling_rate / cuts_new,
        "cuts_old": cuts_old,
        "cuts_new": cuts_new,
        "back_old": back + 1,
        "back_new": back,
        "n": top.size + 2,
        "ring": back + 2,
        "shake": shake,
    }
    library = model.library.looped([model.library[name] for name, _ in model.effects]) if whole else model.library
    effects = library.acting if whole else tuple(model.library[name] for name, _ in model.effects)
    names = [effect.name for effect in effects]
    parameters, flags = np.ones(3 + sum(len(effect.names) for effect in effects)), np.zeros(len(effects), dtype=np.uint8)
    places = StepText(effects, 0).places
    for name, row in model.effects:
        effect = model.library[name]
        flags[names.index(name)] = row[0] != 0.0
        for key, value in zip(effect.names, row, strict=True):
            parameters[places[f"{name}.{key}"]] = value
    return Plant(
        model=model,
        sampling_rate=sampling_rate,
        parameters=parameters,
        flags=flags,
        numbers=np.array([float(values[name]) for name in NUMBERS]),
        moving=moving.ravel(),
        still=resonant_loop.resting(moving).ravel(),
        layout=StateLayout(tuple(effects), most_hanging(effects) if whole else top.size - 1),
    )


def most_hanging(effects: tuple[Effect, ...]) -> int:
    """Number of states of the attached masses with all resonances of a library."""
    return 2 * sum(effect.category == "motion" for effect in effects)


@cache
def step_of(library: Library) -> Callable[..., float]:
    """The compiled sample step of all effects of a library; see ``StepText.text``."""
    writer = StepText(library.acting, most_hanging(library.acting))
    names = {"math": math, "np": np, **SERIES, **law_names(library.acting)}
    parts = [*law_texts(library.acting), inspect.getsource(series)]
    return compiled_text(lambda name: writer.text(name), names, parts)


def begin(ready: Plant, state: FloatArray, speed: float, position: float = 0.0) -> None:
    """Set the state to this speed and position; the attached masses have the same speed."""
    top, _ = sections(ready.model, ready.sampling_rate)
    state[0], state[1] = position, speed
    if top.size > 1:
        state[2] = speed / top[0]


__all__ = ["STANDARD", "Plant", "begin", "plant", "step_of"]
