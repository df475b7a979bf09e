"""The description of an effect, and the points of the simulation where its law can act.

A law is an ordinary function of numbers. Its arguments are bound by name: parameters and states of the effect, and
quantities of the simulation at that moment (``WORDS``). So a law looks like its equation and needs no further code.

| category | function | returns | where it acts |
|---|---|---|---|
| base | (none) | | part of every model: gain, delay, pole |
| input | output(u, t, x) | V | on each held voltage sample, before the delay |
| state | advance(states, u, v, x, t, h, gain, pole) | V that acts, new states | on the voltage in each sub-step |
| force | force(u, v, x, t, gain) | V against the drive | in each sub-step; x is the measured position |
| friction | level(u, v, direction) | V, never negative | dry friction with sticking; zero crossings of v are located in time |
| bristle | bend(state, v, h, level), force(state, v, level) | new state; V | all dry friction acts through it |
| motion | section(fs) | b0, b1, b2, a1, a2 | linear filter section on the motion, gain 1 at 0 Hz (see ``axis.resonant_loop``) |
| encoder | error(x) | m | added to the encoder reading; x is the true position, 0 where the encoder shows 0 |
"""

from __future__ import annotations

import functools
import inspect
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, ParamSpec, Protocol, TypeVar

import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from xy_sysid.effects._scene import USUAL_SWING, Guess, Scene
from xy_sysid.effects._similarity import USUAL, Similarity
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

USUAL_WITHIN = 2.0  # two of three real machines have sizes within this factor of the typical one
LEAST_START = 0.05  # of the typical value: least start value of a parameter that must not be 0
P = ParamSpec("P")
R = TypeVar("R")

Category = Literal["base", "input", "state", "force", "friction", "bristle", "motion", "encoder"]
Law = Callable[..., Any]


@dataclass(frozen=True, slots=True)
class Companions:
    """Companions of an effect that one-step prediction judges: effects that act together with it and can be removed from the recording.

    start, low, high, unit: (k,) start values, bounds and scale of their parameters, SI; positive: (k,) True if fitted as a logarithm
    undo: (gain, delay, pole and the k numbers; n) -> voltage (n,), V; position (n + 1,), m; forces against the drive (2, n), V, at the
          motor and on the table;
          fraction of a sudden change of that position that the encoder shows at once
    similar, swing: ratios of this motion to the reference machine's; typical distance between two reversals, m
    """

    start: FloatArray
    low: FloatArray
    high: FloatArray
    unit: FloatArray
    positive: NDArray[np.bool_]
    undo: Callable[[FloatArray, int], tuple[FloatArray, FloatArray, FloatArray, float]]
    similar: Similarity = USUAL
    swing: float = USUAL_SWING


@dataclass(frozen=True, slots=True)
class DryFriction:
    """Dry friction together with an effect that one-step prediction judges.

    laws: effects of category friction or bristle, which act together as in the simulation; values: their parameters, SI, one law
    after another; spread: standard errors of these, if known
    """

    laws: tuple[Effect, ...] = ()
    values: tuple[float, ...] = ()
    spread: tuple[float, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the laws."""
        return tuple(effect.name for effect in self.laws)

    def rows(self) -> list[tuple[Effect, tuple[float, ...], tuple[float, ...]]]:
        """Each law with its values, and their standard errors (0 where not known)."""
        found, at = [], 0
        spread = self.spread or (0.0,) * len(self.values)
        for effect in self.laws:
            end = at + len(effect.parameters)
            found.append((effect, self.values[at:end], spread[at:end]))
            at = end
        return found


def in_time() -> bool:
    """Always False: no time limit."""
    return False


@dataclass(frozen=True, slots=True)
class Limits:
    """When a fit by one-step prediction ends early.

    bar: rms of the held-out innovations of the best known model without the effect; a fit that stays far above it is given up;
         m/s where errors are velocities, m in a task
    late: True once time is up; the fit then ends with its best result so far
    """

    bar: float | None = None
    late: Callable[[], bool] = in_time


PATIENT = Limits()


@dataclass(frozen=True, slots=True)
class OneStepTask:
    """Input of a fit by one-step prediction.

    base: start values of gain, delay, pole; noise: of the encoder, m; stages: number of samples of the first stage, of training, in total
    companions, dry: effects and dry friction that act together with it
    earlier: an earlier result to start from, without the newest companion
    """

    sampling_rate: float
    base: tuple[float, float, float]
    noise: float
    stages: tuple[int, int, int]
    companions: Companions
    dry: DryFriction
    earlier: FilterFit | None = None
    limits: Limits = PATIENT


class OneStep(Protocol):
    """Fits base and effect together by one-step prediction, with given laws of dry friction."""

    def fit(self, task: OneStepTask) -> FilterFit:
        """The fit that minimises the innovations."""

    def innovation(self, sampling_rate: float, found: FilterFit, companions: Companions, samples: int) -> FloatArray:
        """(samples,) innovations divided by the noise, with the parameters of an earlier result and the companions at ``companions.start``."""


@dataclass(frozen=True, slots=True)
class FilterFit:
    """Result of a fit by one-step prediction, with the filter that predicts.

    base, values: gain, delay, pole, and the effect's parameters, SI; base_spread, spread: their standard errors
    dry:          dry friction, fitted together with it
    companions:   (k,) numbers of ``Companions``, and their standard errors
    innovation:   (n,) measured minus predicted position, one step ahead, m
    without:      (n,) innovations of the same filter (process noise, companions) without the effect, all else refitted, m
    noise:        standard deviation of the encoder, m; runs: number of filter runs; filtered: samples of all runs
    process_noise_factor: factor on the process noise that the filter assumes
    too_small:    True if the effect found is too small to count as present
    given_up:     True if the fit ended early, far above the bar
    """

    base: tuple[float, float, float]
    values: tuple[float, ...]
    base_spread: tuple[float, float, float]
    spread: tuple[float, ...]
    dry: DryFriction
    companions: tuple[tuple[float, ...], tuple[float, ...]]
    innovation: FloatArray
    without: FloatArray
    noise: float
    runs: int
    filtered: int
    process_noise_factor: float = 1.0
    too_small: bool = False
    given_up: bool = False


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

    low, high: bounds of a fit, SI; positive: fitted as a logarithm; typical: a usual size (scale of a step, tests); low, high and typical
    are those of the reference machine, see ``Similarity``
    per_recording: each recording of a machine has its own value (its payload, for example)
    """

    name: str
    unit: str
    low: float
    high: float
    typical: float
    meaning: str
    positive: bool = True
    per_recording: bool = False

    def on(self, similar: Similarity) -> Parameter:
        """The parameter with bounds and typical value scaled to another machine."""
        factor = similar.factor(self.unit)
        return replace(self, low=self.low * factor, high=self.high * factor, typical=self.typical * factor)

    @property
    def bounds(self) -> str:
        """Bounds of a fit on the reference machine, in words."""
        return f"{self.low:g} to {self.high:g}"

    def allows(self, value: float) -> bool:
        """True if a machine may have this value: without a unit, a number within the bounds; with a unit, any finite number of the right sign."""
        return self.low <= value <= self.high if not self.unit else math.isfinite(value) and (value > 0.0 or not self.positive)

    @property
    def allowed(self) -> str:
        """The allowed values, in words."""
        return f"{self.low:g} to {self.high:g}" if not self.unit else f"above 0 {self.unit}" if self.positive else f"a finite number of {self.unit}"


@dataclass(frozen=True, slots=True)
class Sum:
    """One law as the sum of several effects.

    parts: their names; joined: values of each part -> the effect's values; apart: the inverse of ``joined``
    """

    parts: tuple[str, ...]
    joined: Callable[[Sequence[Sequence[float]]], tuple[float, ...]]
    apart: Callable[[Sequence[float]], tuple[tuple[float, ...], ...]]


@dataclass(frozen=True, slots=True)
class Effect:
    """One physical effect.

    law:         one line of mathematics
    meaning:     what it is on a real machine
    validity:    conditions under which the law holds
    source:      paper or book, with the equation
    category:    where it acts (table above)
    parameters:  the first one is its size, or its limit or frequency: at zero the effect is absent
    shows:       how it looks in data
    look_alikes: names of effects that it can be mistaken for; shown to users, without influence on the search
    experiment:  distinguishes it from them
    functions:   the compiled law, by the names of the table above
    guesses:     its traces on a scene, with functions that read start values from their coefficients
    joint:       start values of base and effect together: (gain, delay beyond the scene's, pole, values of the parameters);
                 for effects so large that the base cannot be fitted alone
    states:      names of the law's states; all start at zero
    family:      effects of one family replace one another
    special_of:  the effect of another family that becomes this one at certain values of its parameters
    order:       place among the effects of its category, in the direction of the signal
    refusal:     reason to reject values on a travel between two positions (m) although each is within its bounds; empty if there is none
    one_step:    fits an effect that free simulation cannot judge, by one-step prediction (see ``contact.Contact``)
    sum_of:      other effects whose sum is the same law, if motor and table move together
    straight:    True for a force proportional to speed, with one factor for each direction: it needs no sub-steps
    angular:     True for a law of an angle: it replaces another law only if the position is in rad
    on_table:    True for a force that acts on the table: inside a backlash gap it does not reach the motor
    start_friction: for ``one_step``: the dry friction of its start model, if no other is given
    masks:       for ``one_step``: names of effects whose trace it masks, so they are always tried together with it
    suspects:    names of effects whose trace in an error is a reason to try this one as well, because its own trace is weak
    mode_frequency: of a resonance: which parameter is its frequency, Hz; a mode that the data do not excite cannot be named
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
    special_of: str = ""
    order: int = 0
    one_step: OneStep | None = None
    refusal: Callable[[Sequence[float], tuple[float, float]], str] | None = None
    sum_of: Sum | None = None
    straight: bool = False
    angular: bool = False
    on_table: bool = False
    start_friction: str = ""
    masks: tuple[str, ...] = ()
    suspects: tuple[str, ...] = ()
    mode_frequency: str = ""

    @property
    def simulable(self) -> bool:
        """False if free simulation cannot judge it."""
        return self.one_step is None

    def __post_init__(self) -> None:
        """Raises BadInput if the functions do not fit the category or use unknown argument names."""
        if self.category not in FUNCTIONS:
            raise BadInput(f"effect {self.name}: category", repr(self.category), ", ".join(FUNCTIONS), "Choose one of these.")
        expected = FUNCTIONS[self.category]
        if tuple(sorted(self.functions)) != tuple(sorted(expected)):
            raise BadInput(f"effect {self.name}: functions", sorted(self.functions), " and ".join(expected) or "none", "Give these.")
        if not self.name.isidentifier() or not self.parameters:
            raise BadInput(f"effect {self.name!r}", "incomplete", "a Python name and at least one parameter", "Complete it.")
        if self.guesses is not None and not callable(self.guesses):
            raise BadInput(f"effect {self.name}: guesses", repr(self.guesses), "a function of the scene, or None", "Correct it.")
        known = {*WORDS, *self.states, *(parameter.name for parameter in self.parameters)}
        for name in expected:
            for word in arguments(self.functions[name]):
                if word not in known:
                    raise BadInput(f"effect {self.name}: argument of {name}", repr(word), ", ".join(sorted(known)), "Rename it.")
        if any(item.per_recording and item.positive for item in self.parameters):
            act = "Give it positive=False: recordings differ by a sum."
            raise BadInput(f"effect {self.name}: per_recording", "of a positive parameter", "a parameter of either sign", act)
        if self.straight and not self._is_straight():
            act = "Leave straight out: then it is simulated in sub-steps."
            raise BadInput(f"effect {self.name}: straight", "of another law", "a force in proportion to v alone, forth and back", act)
        if self.mode_frequency and self.mode_frequency not in self.names:
            raise BadInput(f"effect {self.name}: mode_frequency", repr(self.mode_frequency), ", ".join(self.names), "Name one of these.")

    def has_equations_of(self, other: Effect) -> bool:
        """True if both have the same equations, like a flexible base and a flexible screw, so no data distinguish them."""
        return bool(self.family) and (self.family, self.names, self.law) == (other.family, other.names, other.law)

    def is_special_case(self, other: Effect) -> bool:
        """True if the other law becomes this one at certain values; within a family, the law with fewer parameters counts as special case."""
        return self.special_of == other.name or bool(self.family and self.family == other.family and len(self.names) < len(other.names))

    def _is_straight(self) -> bool:
        """True for a force that depends only on speed and base, and doubles with the speed."""
        words = {"v": 1.0, "gain": 1.0, "pole": 1.0, **dict(zip(self.names, self.typical, strict=True))}
        if self.category != "force" or not {"v"} <= {*arguments(self.functions["force"])} <= {*words}:
            return False
        force = self.functions["force"]
        at = {v: force(**{name: {**words, "v": v}[name] for name in arguments(force)}) for v in (-2.0, -1.0, 1.0, 2.0)}
        return all(math.isclose(at[2.0 * way], 2.0 * at[way], rel_tol=1e-9) for way in (-1.0, 1.0))

    @property
    def is_dry(self) -> bool:
        """True for dry friction whose level does not depend on the input. It holds an axis at rest without a drive."""
        return self.category in ("friction", "bristle") and not self.is_of_the_input

    @property
    def is_of_the_input(self) -> bool:
        """True for dry friction whose level depends on the input."""
        return self.category == "friction" and "u" in arguments(self.functions["level"])

    @property
    def is_behind(self) -> bool:
        """True for an effect that changes the motion between base and encoder: its traces are velocities, not forces."""
        return self.category in ("motion", "encoder")

    @property
    def can_be_undone(self) -> bool:
        """True for a section whose zeros are damped, so that its input can be computed from its output."""
        section = self.functions["section"]
        words = {"fs": 2000.0, **dict(zip(self.names, self.typical, strict=True))}
        zeros = np.roots(section(**{name: words[name] for name in arguments(section)})[:3])
        return bool(np.all(np.abs(zeros) < 1.0 - 1e-6))

    @property
    def is_by_place(self) -> bool:
        """True for a law that depends on the position."""
        return any("x" in arguments(item) for item in self.functions.values())

    @property
    def repeats(self) -> bool:
        """True for a position-dependent law that repeats along the travel (it has a period) or with each turn (it is a law of an angle)."""
        return self.is_by_place and ("period" in self.names or self.angular)

    @property
    def is_of_the_drag(self) -> bool:
        """True for a force whose size is relative to the base's own drag."""
        return self.category == "force" and {"v", "gain"} <= set(arguments(self.functions["force"]))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(parameter.name for parameter in self.parameters)

    @property
    def typical(self) -> tuple[float, ...]:
        """Typical value of each parameter on the reference machine, SI."""
        return tuple(parameter.typical for parameter in self.parameters)

    def on(self, similar: Similarity) -> tuple[Parameter, ...]:
        """Its parameters with bounds and typical values for another machine."""
        return tuple(item.on(similar) for item in self.parameters)

    def guessed(self, scene: Scene) -> list[Guess]:
        """Its guesses on a scene; empty without ``guesses``.

        Raises BadInput for columns without one finite number for each sample, which a user's own effect may return.
        """
        return scene.kept(self.name, lambda: self._guessed(scene))

    def _guessed(self, scene: Scene) -> list[Guess]:
        found = list(self.guesses(scene)) if self.guesses is not None else []
        wanted = scene.error.size
        for guess in found:
            shape = np.shape(guess.columns)
            if len(shape) != 2 or shape[1] != wanted:
                given, allowed = f"of shape {' x '.join(map(str, shape)) or '()'}", f"rows of {wanted} samples"
            elif not np.isfinite(guess.columns).all():
                given, allowed = "not finite", "finite numbers"
            else:
                continue
            raise BadInput(f"columns that {self.name} guesses", given, allowed, "Make them from the scene's own signals.")
        return found

    def read(self, guess: Guess, coefficients: FloatArray, similar: Similarity) -> tuple[float, ...]:
        """Parameter values for the coefficients of a guess's columns, within their bounds.

        The first parameter and those with V in their unit, if positive, are at least ``LEAST_START`` times their typical value.
        Raises BadInput unless there is one finite number for each parameter, which a user's own effect may violate.
        """
        given = tuple(guess.read(coefficients))
        if len(given) != len(self.parameters) or not all(isinstance(value, (int, float, np.number)) and np.isfinite(value) for value in given):
            said, allowed = ", ".join(str(value)[:20] for value in given), f"a number for each of {', '.join(self.names)}"
            raise BadInput(f"values that {self.name} guesses", said or "nothing", allowed, "Return them in this order.")
        items = self.on(similar)
        least = [LEAST_START * abs(item.typical) if item.positive and (k == 0 or "V" in item.unit) else item.low for k, item in enumerate(items)]
        return tuple(float(min(max(value, low), item.high)) for value, low, item in zip(given, least, items, strict=True))


@functools.cache
def arguments(function: Law) -> tuple[str, ...]:
    """The names of a law's arguments."""
    return tuple(inspect.signature(function).parameters)
