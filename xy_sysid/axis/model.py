"""One axis in the time domain: a rigid base (gain, delay, pole) and any of a library's effects.

The velocity is simulated from the initial speed of the measured position. Laws that depend on position use the
measured one, so that there is no drift. Scheme:
each sample is split where the delayed voltage changes. In between, the viscous pole is integrated exactly for a constant
force, and the zero crossings of dry friction are located in time (Karnopp 1985's problem without his dead band). Laws that are
nonlinear in speed get sub-steps (two in each piece at 2 kHz), by the midpoint rule. Resonances filter the sampled motion, unless
a law depends on speed: then they are in the loop with it (``resonant_loop``), with the same parameters and the same linear response.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from xy_sysid.axis.loop_compile import Kernel, Moving, Undoing, build, build_moving, build_undoing
from xy_sysid.axis.loop_source import BASE, slots, undoable
from xy_sysid.axis.start_speed import start_speed
from xy_sysid.effects import EFFECTS, Effect
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import unknown_name

FINE = 16000.0  # Hz: sub-steps; LuGre bristles of 10 um and Stribeck curves of 10 mm/s need it
FADED = 3.0  # time constants after which a wrong start speed has decayed (5 %)
SURE = 3.0  # times its standard deviation: a larger error of the start speed is corrected
ROUNDS = 4  # correction rounds: friction makes the problem nonlinear


class Library:
    """A set of effects that simulate in one compiled loop, which is built at its first use."""

    def __init__(self, effects: Iterable[Effect]) -> None:
        self.effects: dict[str, Effect] = {effect.name: effect for effect in effects}
        self.acting: tuple[Effect, ...] = tuple(effect for effect in self.effects.values() if effect.category != "base")
        self.places: Mapping[str, int] = slots(self.acting)
        self._kernel: Kernel | None = None
        self._undoing: Undoing | None = None
        self._moving: Moving | None = None

    def __getitem__(self, name: str) -> Effect:
        """The effect of this name; raises BadInput with the nearest spelling."""
        if name not in self.effects:
            raise unknown_name(name, list(self.effects), "effect")
        return self.effects[name]

    @property
    def kernel(self) -> Kernel:
        """The compiled loop; see ``loop_source.text``."""
        if self._kernel is None:
            self._kernel = build(self.acting)
        return self._kernel

    @property
    def undoing(self) -> Undoing:
        """The compiled loop that removes effects from a recording; see ``loop_source.undoing``."""
        if self._undoing is None:
            self._undoing = build_undoing(self.acting)
        return self._undoing

    @property
    def moving(self) -> Moving:
        """The compiled loop of an axis whose position follows from its simulated motion; see ``loop_source.moving``."""
        if self._moving is None:
            self._moving = build_moving(self.acting)
        return self._moving

    def looped(self, active: Iterable[Effect]) -> Library:
        """The library in whose loop these effects run: the built-in one, which is cached on disk, unless one of them differs from it."""
        return STANDARD if all(STANDARD.effects.get(effect.name) is effect for effect in active) else self

    def extended(self, effects: Iterable[Effect]) -> Library:
        """A library with more effects; raises BadInput for a name that is in use."""
        added = list(effects)
        for effect in added:
            if effect.name in self.effects:
                raise BadInput("effect", effect.name, "a name that is not in the library yet", "Rename it.")
        return Library([*self.effects.values(), *added])


STANDARD = Library(EFFECTS.values())


@dataclass(frozen=True, slots=True)
class AxisModel:
    """A hypothesis about an axis.

    gain: m/s/V; delay: s; pole: rad/s; effects: (name, parameter values in the effect's order), SI
    per_recording: (``effect.parameter``, its value in each recording of a fit) for parameters that differ; ``effects`` holds the mean
    """

    gain: float
    delay: float
    pole: float
    effects: tuple[tuple[str, tuple[float, ...]], ...] = ()
    library: Library = field(default=STANDARD, compare=False, repr=False)
    per_recording: tuple[tuple[str, tuple[float, ...]], ...] = ()

    def __post_init__(self) -> None:
        for name, value, low in (("gain", self.gain, -np.inf), ("delay", self.delay, 0.0), ("pole", self.pole, 1e-9)):
            if not (np.isfinite(value) and value >= low):
                raise BadInput(name, value, f"finite, at least {low:g}", "Give another value.")
        for name, values in self.effects:
            effect = self.library[name]
            if effect.category == "base":
                raise BadInput("effect", name, "one that is not in every model already", "Leave it out.")
            if len(values) != len(effect.parameters):
                raise BadInput(
                    f"effect {name}", f"{len(values)} values", f"{len(effect.parameters)}: {', '.join(effect.names)}", "Give one per name."
                )

    def __contains__(self, name: str) -> bool:
        return any(name == own for own, _ in self.effects)

    def with_effect(self, name: str, values: Iterable[float] | None = None) -> AxisModel:
        """The model with one effect added or changed (None: its typical size)."""
        chosen = self.library[name].typical if values is None else tuple(float(value) for value in values)
        return self._of((*((own, old) for own, old in self.effects if own != name), (name, chosen)))

    def without(self, name: str) -> AxisModel:
        """The model without this effect."""
        return self._of(tuple(item for item in self.effects if item[0] != name))

    def _of(self, effects: tuple[tuple[str, tuple[float, ...]], ...]) -> AxisModel:
        """The same base with other effects; unchanged effects keep their values per recording."""
        same = {name for name, _ in set(effects) & set(self.effects)}
        return replace(self, effects=effects, per_recording=tuple(item for item in self.per_recording if item[0].partition(".")[0] in same))

    def in_recording(self, number: int) -> AxisModel:
        """The model for one of the recordings of its fit, counted from 0."""
        own = {name: values[number] for name, values in self.per_recording}
        if not own:
            return self
        rows = ((name, zip(self.library[name].names, row, strict=True)) for name, row in self.effects)
        effects = tuple((name, tuple(own.get(f"{name}.{key}", value) for key, value in row)) for name, row in rows)
        return replace(self, effects=effects, per_recording=())

    def _turned(self, name: str, values: tuple[float, ...]) -> tuple[float, ...]:
        """Convert a size signed by the motion (friction) to one signed by the drive (force), or back."""
        return (-values[0], *values[1:]) if self.gain < 0.0 and self.library[name].category == "force" else values

    def joined(self) -> AxisModel:
        """The same model with several effects merged into one whose law is their sum, if there is one in the library."""
        own = dict(self.effects)
        for effect in self.library.acting:
            if effect.sum_of is not None and all(part in own for part in effect.sum_of.parts):
                values = effect.sum_of.joined([self._turned(part, own[part]) for part in effect.sum_of.parts])
                if all(item.allows(value) for item, value in zip(effect.parameters, values, strict=True)):
                    kept = tuple((name, old) for name, old in self.effects if name not in effect.sum_of.parts)
                    return self._of((*kept, (effect.name, values)))
        return self

    def apart(self, name: str) -> AxisModel:
        """The same model with an effect replaced by its parts, if it is the sum of several."""
        whole, own = self.library[name].sum_of, dict(self.effects)
        if whole is None:
            return self
        parts = zip(whole.parts, whole.apart(own.pop(name)), strict=True)
        return self._of((*own.items(), *((part, self._turned(part, values)) for part, values in parts)))

    @property
    def row(self) -> FloatArray:
        """The parameters in the order that ``simulator`` expects."""
        return np.array([self.gain, self.delay, self.pole, *(value for _, values in self.effects for value in values)])

    def values(self) -> dict[str, float]:
        """Every parameter by name: ``gain``, ``delay``, ``pole``, ``effect.parameter``."""
        own = {f"{name}.{key}": value for name, row in self.effects for key, value in zip(self.library[name].names, row, strict=True)}
        return {"gain": self.gain, "delay": self.delay, "pole": self.pole, **own}


class Simulation(Protocol):
    """The function that ``simulator`` returns."""

    def __call__(self, parameters: FloatArray, start: float = 0.0) -> FloatArray: ...


def simulator(
    library: Library, active: Iterable[str], sampling_rate: float, voltage: FloatArray, position: FloatArray, fine: float = FINE
) -> Simulation:
    """A function from parameters to the simulated velocity (n - 1,), m/s, for many simulations of the same data; it may run in parallel.

    Its arguments are a row: gain, delay, pole, then each active effect's parameters, in the order of ``active``; and the speed at the
    first sample, m/s, 0 by default (see ``start_of``). With gain 0, by which laws divide, the result is NaN.
    voltage, position: (n,) V and m; the voltage of sample k is held to k + 1; fine: Hz, sub-steps for laws that depend on speed
    """
    if voltage.shape != position.shape or voltage.ndim != 1 or voltage.size < 2:
        raise BadInput("shape of voltage and position", f"{voltage.shape} and {position.shape}", "one and the same (n,), n >= 2", "Give one axis.")
    u = np.ascontiguousarray(voltage[:-1], dtype=np.float64)
    x = np.ascontiguousarray(position, dtype=np.float64)
    chosen = [library[name] for name in active]
    library = library.looped(chosen)
    ones = np.ones(len(library.places))
    where = np.array([library.places[name] for name in (*BASE, *(f"{effect.name}.{key}" for effect in chosen for key in effect.names))])
    names = [effect.name for effect in library.acting]
    sizes = [(names.index(effect.name), library.places[f"{effect.name}.{effect.names[0]}"]) for effect in chosen]
    kernel = library.kernel

    def run(parameters: FloatArray, start: float = 0.0) -> FloatArray:
        row = ones.copy()
        row[where] = parameters
        if row[0] == 0.0:
            return np.full(u.size, np.nan)
        on = np.zeros(len(names), dtype=np.uint8)
        for place, size in sizes:
            on[place] = row[size] != 0.0
        out = np.empty(u.size)
        kernel(u, x, row, on, float(sampling_rate), fine, start, out)
        return out

    return run


def undoer(
    library: Library, active: Iterable[str], sampling_rate: float, voltage: FloatArray, position: FloatArray
) -> Callable[[FloatArray, int], tuple[FloatArray, FloatArray, FloatArray, float]]:
    """A function that removes effects (of ``undoable``) from the first samples of a recording; it may run in several threads.

    Its arguments are a row as in ``simulator``, and n. It returns the voltage behind the amplifier (n,), V; the position before
    resonances and the scale's errors (n + 1,), m; the forces against the drive (2, n), at the motor and at the table, V; and the
    fraction of a sudden change of that position that the encoder shows at once.
    """
    chosen = [library[name] for name in active]
    library = library.looped(chosen)
    members = [effect for effect in library.acting if undoable(effect)]
    places, names = slots(members), [effect.name for effect in members]
    ones, on = np.ones(len(places)), np.zeros(len(names), dtype=np.uint8)
    on[[names.index(effect.name) for effect in chosen]] = 1
    where = np.array([places[name] for name in (*BASE, *(f"{effect.name}.{key}" for effect in chosen for key in effect.names))])
    u, x = np.ascontiguousarray(voltage, dtype=np.float64), np.ascontiguousarray(position, dtype=np.float64)
    kernel = library.undoing

    def undo(parameters: FloatArray, samples: int) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        row = ones.copy()
        row[where] = parameters
        held, place, against = np.empty(samples), np.empty(samples + 1), np.empty((2, samples))
        through = kernel(u[:samples], x[: samples + 1], row, on, float(sampling_rate), held, place, against)
        return held, place, against, through

    return undo


def simulate(model: AxisModel, sampling_rate: float, voltage: FloatArray, position: FloatArray) -> FloatArray:
    """(n - 1,) mean velocity of each sample, m/s, starting with the speed at the first; arguments as in ``simulator``."""
    names, start = [name for name, _ in model.effects], start_of(model, sampling_rate, voltage, position)
    return simulator(model.library, names, sampling_rate, voltage, position)(model.row, start)


def start_of(model: AxisModel, sampling_rate: float, voltage: FloatArray, position: FloatArray, fine: float = FINE) -> float:
    """The speed at the first sample, m/s, with which a model best explains the start of a recording; arguments as in ``simulator``.

    The effect of a wrong value decays with the pole. It is corrected while it is significant in the error that follows (Gauss's method, one unknown).
    """
    seen, doubt = start_speed(sampling_rate, position)
    start, low, high = (seen if abs(seen) > SURE * doubt else 0.0), seen - SURE * doubt, seen + SURE * doubt
    fades = max(int(FADED / model.pole * sampling_rate), 2)
    count = min(2 * fades, position.size - 1)
    if count <= fades:
        return start
    velocity, fading = sample_velocity(sampling_rate, position[: count + 1]), np.exp(-model.pole * (np.arange(fades) + 0.5) / sampling_rate)
    run = simulator(model.library, [name for name, _ in model.effects], sampling_rate, voltage[: count + 1], position[: count + 1], fine)
    for _ in range(ROUNDS):
        with np.errstate(all="ignore"):  # a model may diverge
            error = velocity - run(model.row, start)
            off = float(error[:fades] @ fading / (fading @ fading))
            known = SURE * float(np.std(error[fades:])) < abs(off) < np.inf
        if not known:
            break
        start = min(max(start + off, low), high)
    return start


def sample_velocity(sampling_rate: float, position: FloatArray) -> FloatArray:
    """(n - 1,) mean velocity of each sample, m/s: the quantity that ``simulate`` predicts."""
    return np.asarray(np.diff(position) * sampling_rate)
