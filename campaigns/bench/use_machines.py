"""Machines for ``campaigns.bench.use``: tables of ``xy_sim`` and joints of MuJoCo, a minute of noise, a Ziegler-Nichols PID, and a path.

Neither shares physics with the identification. A slow sine is added to the noise, so that the motion covers the travel of the path: a spring, a
load and a position-dependent table are known only within the recorded travel.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from campaigns.bench.mujoco_machine import MujocoMachine
from xy_sim.hidden import draw
from xy_sim.machine import Machine
from xy_sysid.axis.model import STANDARD
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.closed_loop import Controller, Encoder
from xy_sysid.control_design.path import SampledPath
from xy_sysid.control_design.worth import encoder_of
from xy_sysid.diagnosis.of_run import refine
from xy_sysid.excitation.lockstep import drive
from xy_sysid.files.models import read_models, save
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings
from xy_sysid.units import USUAL, Units

LIMIT = 10.0  # V
SLOW, SLOW_PERIOD, CENTRING = 0.35, 15.0, 8.0  # V, s and V/m: with these the table moves 30 to 40 mm to each side
RELAY, RELAY_SECONDS, HYSTERESIS = 1.0, 4.0, 2e-6  # V, s, m: four counts
HALVINGS = 8  # most halvings of the gains of a PID that saturates its drive
JOINT = 10.0  # rad of a joint per metre of a table
FOREIGN = (
    ("hinge", ("gravity",)),
    ("slide", ("coulomb_friction",)),
    ("hinge", ("return_spring",)),
    ("slide", ("constant_load",)),
    ("hinge", ("gravity", "coulomb_friction")),
    ("slide", ("coulomb_friction", "constant_load")),
    ("hinge", ("return_spring", "coulomb_friction")),
    ("hinge", ("gravity", "return_spring")),
)
SIZES = {"gravity": (0.1, 0.5), "coulomb_friction": (0.05, 0.4), "return_spring": (0.1, 0.6), "constant_load": (0.03, 0.15)}  # V, and V/rad


class Driven(Protocol):
    """A machine of the campaign."""

    @property
    def axes(self) -> tuple[str, ...]: ...

    @property
    def rate(self) -> float: ...

    def reset(self) -> None: ...

    def step(self, voltage: FloatArray) -> FloatArray: ...


@dataclass(frozen=True, slots=True)
class Case:
    """A machine with its name; hidden: effects of each axis; size: rad or m of its path per metre; units: of its recording."""

    name: str
    machine: Driven
    hidden: tuple[tuple[str, ...], ...]
    size: float = 1.0
    units: Units = USUAL

    def place(self, axis: str) -> float:
        """True position of an axis on the encoder's side (of the table, behind a gap), relative to the base, m or rad."""
        machine: Any = self.machine
        if isinstance(machine, MujocoMachine):
            return machine.place
        state = machine.state(axis)
        return float(state["table"] if "backlash" in machine.spec.axes[machine.axes.index(axis)].parts else state["motor"])


@dataclass(frozen=True, slots=True)
class Identified:
    """Models of the axes, recorded travel (low, high) of each, m or rad, and the encoder as estimated from the recording."""

    models: dict[str, PhysicalModel]
    travel: dict[str, tuple[float, float]]
    encoders: dict[str, Encoder]


def table_case(seed: int) -> Case:
    """Two axes of a simulated table with one to three hidden effects each."""
    machine: Machine = draw(seed)
    hidden = tuple(tuple(name for name in axis.parts if name != "time_delay") for axis in machine.spec.axes)
    return Case(name=str(seed), machine=machine, hidden=hidden)


def joint_case(seed: int) -> Case:
    """A joint or a slide of MuJoCo with one or two effects, whose sizes are drawn."""
    kind, parts = FOREIGN[seed % len(FOREIGN)]
    random = np.random.default_rng(seed)
    sizes = {name: {"size": float(random.uniform(*SIZES[name]))} for name in parts}
    hinge = kind == "hinge"
    machine = MujocoMachine(kind, sizes, 1e-6 if hinge else 1e-7, seed)
    return Case(f"MuJoCo {seed}", machine, (parts,), JOINT if hinge else 1.0, Units(input="V", output="rad") if hinge else USUAL)


def identify(case: Case, seed: int, seconds: float, kept: Path | None = None) -> Identified:
    """The models after some seconds of noise. kept: folder for the travel and the models, so that a stopped campaign can continue."""
    file = kept / f"{case.name.replace(' ', '_')}.yaml" if kept is not None else None
    machine, size = case.machine, case.size
    drawn = {
        axis: AxisExcitation(
            seed=100 * seed + k, slow=SLOW, slow_period=SLOW_PERIOD, centring=CENTRING / size, travel_min=-0.14 * size, travel_max=0.14 * size,
            brake=0.02 * size,
        )
        for k, axis in enumerate(machine.axes)
    }  # fmt: skip
    settings = ExcitationSettings(lockstep=True, speed=0.0, rate=machine.rate, unit=case.units.output, axes=drawn)
    recording = drive(cast("Machine", machine), settings, seconds, lambda _: None)
    runs = {axis: recording.run(axis) for axis in machine.axes}
    travel = {axis: (float(run.position.min()), float(run.position.max())) for axis, run in runs.items()}
    if file is not None and file.exists():
        models: Any = dict(read_models(file, STANDARD))
    else:
        models = {axis: refine(run).model for axis, run in runs.items()}
        if file is not None:
            save(models, file, force=True)
    return Identified(models, travel, {axis: encoder_of(run) for axis, run in runs.items()})


def followed(
    case: Case, paths: Sequence[SampledPath], extras: Sequence[FloatArray], controllers: Sequence[Controller]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """(n, axes) true positions, m, and (n, axes) True where the drive was at its limit, each axis with its PID along its path."""
    machine = case.machine
    machine.reset()
    rate = machine.rate
    count, axes = len(paths[0].position), len(machine.axes)
    h = 1.0 / rate
    before, total, speed, held = np.zeros(axes), np.zeros(axes), np.zeros(axes), np.zeros(axes)
    keeps = np.array([controller.keeps(rate) for controller in controllers])
    kp, ki, kd = (np.array([getattr(controller, name) for controller in controllers]) for name in ("kp", "ki", "kd"))
    wanted, extra = np.array([path.position for path in paths]).T, np.array(extras).T
    place, full = np.zeros((count, axes)), np.zeros((count, axes), dtype=np.bool_)
    shown = machine.step(held[None, :])[0]
    for k in range(count):
        place[k] = [case.place(axis) for axis in machine.axes]
        error = wanted[max(k - 1, 0)] - shown  # the newest reading is that of the previous sample
        speed = keeps * speed + (1.0 - keeps) * (error - before) / h * (k > 0)
        before = error
        u = kp * error + total + kd * speed + extra[k]
        held = np.clip(u, -LIMIT, LIMIT)
        full[k] = np.abs(u) > LIMIT
        total = np.where((held == u) | ((u - held) * error < 0.0), total + ki * error * h, total)
        shown = machine.step(held[None, :])[0]
    return place, full


def ziegler_nichols(case: Case, paths: Sequence[SampledPath]) -> list[Controller]:
    """PID of every axis from a relay experiment; the gains are halved while that helps along its path. All paths have one length.

    The relay has a hysteresis of a few counts of the encoder, and period and amplitude are medians over whole cycles. Without it the noise switches
    the relay inside a gap or before the axis breaks away, and the period is not that of the oscillation.
    Source: Astrom & Hagglund, Automatica 20 (1984); Ziegler & Nichols, Trans. ASME 64 (1942).
    """
    machine = case.machine
    machine.reset()
    rate = machine.rate
    count, axes = int(RELAY_SECONDS * rate), len(machine.axes)
    wide = HYSTERESIS * case.size
    shown, held = np.zeros((count, axes)), np.full(axes, RELAY)
    for k in range(count):
        shown[k] = machine.step(held[None, :])[0]
        held = np.where(shown[k] > wide, -RELAY, np.where(shown[k] < -wide, RELAY, held))
    return _calmed(case, [_from_cycles(row, rate, wide) for row in shown[count // 2 :].T], paths)


def _from_cycles(shown: FloatArray, rate: float, wide: float) -> Controller:
    """The PID of Ziegler and Nichols from an oscillation (n,), m, under a relay of a hysteresis ``wide``, m."""
    above = np.where(shown > wide, 1.0, np.where(shown < -wide, -1.0, 0.0))
    last = np.maximum.accumulate(np.where(above != 0.0, np.arange(above.size), 0))
    begins = np.flatnonzero((above[last][:-1] <= 0.0) & (above[last][1:] > 0.0))
    assert begins.size > 2, "the relay does not make the axis oscillate"
    period = float(np.median(np.diff(begins))) / rate
    size = float(np.median([0.5 * np.ptp(shown[start:end]) for start, end in itertools.pairwise(begins)]))
    ultimate = 4.0 * RELAY / (math.pi * math.sqrt(size**2 - wide**2))
    kp, integral, derivative = 0.6 * ultimate, 0.5 * period, 0.125 * period
    return Controller(kp=kp, ki=kp / integral, kd=kp * derivative, derivative_time=derivative / 10.0, limit=LIMIT)


def _calmed(case: Case, controllers: list[Controller], paths: Sequence[SampledPath]) -> list[Controller]:
    """Halve the gains until the drive is not at its limit along the path, and further while the error falls.

    During sliding, dry friction adds less damping than in the relay experiment, so the gains may be too high.
    """
    best, error, loud = controllers, *_tried(case, controllers, paths)
    for _ in range(HALVINGS):
        halved = [replace(item, kp=0.5 * item.kp, ki=0.5 * item.ki, kd=0.5 * item.kd) for item in best]
        now, still = _tried(case, halved, paths)
        better = loud | (now < error)
        if not better.any():
            break
        best = [new if take else old for new, old, take in zip(halved, best, better, strict=True)]
        error, loud = np.where(better, now, error), np.where(better, still, loud)
    return best


def _tried(case: Case, controllers: list[Controller], paths: Sequence[SampledPath]) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Tracking error of each axis along its path, m rms, and True if its drive was at the limit."""
    place, full = followed(case, paths, [np.zeros(path.position.size) for path in paths], controllers)
    wanted = np.array([path.position for path in paths]).T
    return np.asarray(np.sqrt(np.mean((wanted - place) ** 2, axis=0))), np.asarray(full.any(axis=0))
