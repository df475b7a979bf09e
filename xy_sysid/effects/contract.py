"""What an effect tells about itself, and the places of the simulation where its law can act.

A law is an ordinary function of numbers. Its arguments are bound by name: parameters and states of the effect, and what
the simulation knows at that moment (``WORDS``). So a law reads as the equation does, and needs no other glue.

| category | function | returns | where it acts |
|---|---|---|---|
| base | (none) | | part of every model: gain, delay, pole |
| input | output(u, t, x) | V | on each held voltage sample, before the delay |
| state | advance(states, u, v, x, t, h, gain, pole) | V that is left of u, new states | on the voltage in each sub-step |
| force | force(u, v, x, t, gain) | V against the drive | in each sub-step; x is the measured position |
| friction | level(v, direction) | V, never negative | dry friction: sticks, and zero crossings are found in time |
| bristle | bend(state, v, h, level), force(state, v, level) | new state; V | takes over all dry friction |
| motion | section(fs) | b0, b1, b2, a1, a2 | linear section, 1 at 0 Hz, that the motion passes (see ``swing``) |
| encoder | error(x) | m | added to what the encoder reads; x is where the axis is, 0 where the encoder shows 0 |
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, ParamSpec, Protocol, TypeVar

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from xy_sysid.effects.scene import Guess, Scene
from xy_sysid.errors import BadInput
from xy_sysid.stream import FloatArray

P = ParamSpec("P")
R = TypeVar("R")

Category = Literal["base", "input", "state", "force", "friction", "bristle", "motion", "encoder"]
Law = Callable[..., Any]


@dataclass(frozen=True, slots=True)
class Beside:
    """What acts beside an effect that one-step prediction judges, and how to take it out of a recording.

    start, low, high, unit: (k,) of its numbers, SI (unit: size of 1); positive: (k,) fitted as a logarithm
    undo: gain, delay, pole and the k numbers, and n -> voltage (n,), V; position (n + 1,), m; forces against the drive (2, n), V, at the
          motor and on the table;
          how much of a sudden change of that position the encoder shows at once
    """

    start: FloatArray
    low: FloatArray
    high: FloatArray
    unit: FloatArray
    positive: NDArray[np.bool_]
    undo: Callable[[FloatArray, int], tuple[FloatArray, FloatArray, FloatArray, float]]


@dataclass(frozen=True, slots=True)
class DryFriction:
    """Dry friction beside an effect that one-step prediction judges: whose law it is, its parameters, SI, and their standard errors if known."""

    effect: str = "coulomb_friction"
    values: tuple[float, ...] = (0.0,)
    spread: tuple[float, ...] = ()


NO_FRICTION = DryFriction()


class OneStep(Protocol):
    """Fits base and effect together by one-step prediction."""

    @property
    def frictions(self) -> tuple[str, ...]:
        """Effects whose law of dry friction it has inside; the first is what it begins with."""

    def fit(
        self,
        sampling_rate: float,
        base: tuple[float, float, float],
        noise: float,
        stages: tuple[int, int, int],
        beside: Beside,
        dry: DryFriction = NO_FRICTION,
        begin: Followed | None = None,
    ) -> Followed:
        """base: gain, delay, pole; noise: of the encoder, m; stages: samples of the first stage, of training, of all;
        dry: friction to begin with; begin: an earlier result without what is new beside."""

    def innovation(self, sampling_rate: float, found: Followed, beside: Beside, samples: int) -> FloatArray:
        """(samples,) measured minus predicted position over the noise, with the numbers of an earlier result; ``beside.start`` is beside."""


@dataclass(frozen=True, slots=True)
class Followed:
    """What one-step prediction found.

    base, values: gain, delay, pole, and the effect's parameters, SI; base_spread, spread: their standard errors
    dry:          friction that came out beside it
    beside:       (k,) numbers of ``Beside``, and their standard errors
    innovation:   (n,) measured minus predicted position, one step ahead, m
    without:      rms of the held-out innovation with the effect taken out and all else refitted, m; 0 if that was not worth while
    noise:        standard deviation of the encoder, m; runs: how often the filter ran
    """

    base: tuple[float, float, float]
    values: tuple[float, ...]
    base_spread: tuple[float, float, float]
    spread: tuple[float, ...]
    dry: DryFriction
    beside: tuple[tuple[float, ...], tuple[float, ...]]
    innovation: FloatArray
    without: float
    noise: float
    runs: int


FUNCTIONS: Mapping[str, tuple[str, ...]] = {
    "base": (),
    "input": ("output",),
    "state": ("advance",),
    "force": ("force",),
    "friction": ("level",),
    "bristle": ("bend", "force"),
    "motion": ("section",),
    "encoder": ("error",),
}

WORDS: Mapping[str, str] = {
    "u": "voltage at this place of the chain, V",
    "v": "velocity of the axis, m/s",
    "x": "measured position, m",
    "t": "time since the start, s",
    "h": "length of the sub-step, s",
    "direction": "+1 forth, -1 back",
    "level": "size of all dry friction at this speed, V",
    "gain": "speed per volt of the base, m/s/V",
    "pole": "rate of the base, rad/s",
    "fs": "sampling rate, Hz",
}


def law(function: Callable[P, R]) -> Callable[P, R]:
    """The same function, callable from Python, and compiled into the simulation."""
    compilable: Callable[P, R] = register_jitable(forceinline=True)(function)
    return compilable


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of an effect.

    low, high: what a fit may reach, SI; positive: fitted as a logarithm; typical: a usual size (scale of a step, tests)
    """

    name: str
    unit: str
    low: float
    high: float
    typical: float
    meaning: str
    positive: bool = True


@dataclass(frozen=True, slots=True)
class Sum:
    """One law written as several effects.

    parts: their names; apart: the effect's values -> values of each part; joined: the way back
    """

    parts: tuple[str, ...]
    apart: Callable[[Sequence[float]], tuple[tuple[float, ...], ...]]
    joined: Callable[[Sequence[Sequence[float]]], tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class Effect:
    """One physical effect.

    law:         one line of mathematics
    meaning:     what it is on a real machine
    validity:    where the law holds, and where it does not
    source:      paper or book, with the equation
    category:    where it acts (table above)
    parameters:  the first one is its size: at zero the effect is absent
    shows:       how it looks in data
    look_alikes: names of effects that it can be taken for
    experiment:  what separates it from them
    functions:   the compiled law, by the names of the table above
    guesses:     its signatures on a scene, with a way to read start values
    joint:       start values of base and effect together: (gain, delay beyond the scene's, pole, values of the parameters);
                 for effects so large that the base alone is led astray
    states:      names of the law's states; all start at zero
    family:      effects of one family replace one another
    order:       place among the effects of its category, in the direction of the signal
    simulable:   False if free simulation cannot judge it
    plausible:   False for values that no machine has, though each is within its bounds
    one_step:    then this does: fits the effect by one-step prediction (see ``contact.Contact``)
    sum_of:      other effects that together are the very same law, if there are and motor and table are one
    on_table:    True for a force that acts on the table: across a gap the motor does not feel it
    """

    name: str
    law: str
    meaning: str
    validity: str
    source: str
    category: Category
    parameters: tuple[Parameter, ...]
    shows: str
    look_alikes: tuple[str, ...]
    experiment: str
    functions: Mapping[str, Law] = field(default_factory=dict)
    guesses: Callable[[Scene], Iterable[Guess]] | None = None
    joint: Callable[[Scene], Iterable[tuple[float, float, float, tuple[float, ...]]]] | None = None
    states: tuple[str, ...] = ()
    family: str = ""
    order: int = 0
    simulable: bool = True
    one_step: OneStep | None = None
    plausible: Callable[[Sequence[float]], bool] | None = None
    sum_of: Sum | None = None
    on_table: bool = False

    def __post_init__(self) -> None:
        """Raises BadInput if the functions do not fit the category or ask for words that nobody knows."""
        if self.category not in FUNCTIONS:
            raise BadInput(f"effect {self.name}: category", repr(self.category), ", ".join(FUNCTIONS), "Choose one of these.")
        expected = FUNCTIONS[self.category]
        if tuple(sorted(self.functions)) != tuple(sorted(expected)):
            raise BadInput(f"effect {self.name}: functions", sorted(self.functions), " and ".join(expected) or "none", "Give these.")
        if not self.name.isidentifier() or not self.parameters:
            raise BadInput(f"effect {self.name!r}", "incomplete", "a Python name and at least one parameter", "Complete it.")
        known = {*WORDS, *self.states, *(parameter.name for parameter in self.parameters)}
        for name in expected:
            for word in arguments(self.functions[name]):
                if word not in known:
                    raise BadInput(f"effect {self.name}: argument of {name}", repr(word), ", ".join(sorted(known)), "Rename it.")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def typical(self) -> tuple[float, ...]:
        """A usual size of each parameter, SI."""
        return tuple(parameter.typical for parameter in self.parameters)


def arguments(function: Law) -> tuple[str, ...]:
    """The names of a law's arguments."""
    return tuple(inspect.signature(function).parameters)
