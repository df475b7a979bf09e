"""Machines for ``campaigns.bench.use``: tables of ``xy_sim`` and joints of MuJoCo, a minute of noise, a PID of the shop floor, and a path.

Neither shares physics with the identification. The noise rides on a slow sine, so that it covers the travel on which the path will lie: a spring, a
load and a table by position are known where the axis has been, and not beyond.
"""

from __future__ import annotations

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
from xy_sysid.control_design.closed_loop import Controller
from xy_sysid.control_design.path import Bounds, SampledPath, s_curve
from xy_sysid.diagnosis.of_run import refine
from xy_sysid.excitation.lockstep import drive
from xy_sysid.files.models import read_models, save
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings
from xy_sysid.units import USUAL, Units

LIMIT = 10.0  # V
SLOW, SLOW_PERIOD, CENTRING = 0.35, 15.0, 8.0  # V, s and V/m: they take the table 30 to 40 mm to each side
RELAY, RELAY_SECONDS = 1.0, 4.0  # V, s
MOVE, TRIAL, HALVINGS = 0.01, Bounds(0.06, 1.0, 50.0), 8  # m: the move that a PID must manage, and how often its gains are halved until it does
JOINT = 10.0  # rad of a joint for a metre of a table
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
    """What the campaign drives."""

    @property
    def axes(self) -> tuple[str, ...]: ...

    @property
    def rate(self) -> float: ...

    def reset(self) -> None: ...

    def step(self, voltage: FloatArray) -> FloatArray: ...


@dataclass(frozen=True, slots=True)
class Case:
    """A machine with its name; hidden: effects of each axis; size: rad or m of its path for a metre; units: of its recording."""

    name: str
    machine: Driven
    hidden: tuple[tuple[str, ...], ...]
    size: float = 1.0
    units: Units = USUAL

    def place(self, axis: str) -> float:
        """Where an axis is on the encoder's side, or what it carries where a gap lies between, relative to the base, m or rad."""
        machine: Any = self.machine
        if isinstance(machine, MujocoMachine):
            return machine.place
        state = machine.state(axis)
        return float(state["table"] if "backlash" in machine.spec.axes[machine.axes.index(axis)].parts else state["motor"])


@dataclass(frozen=True, slots=True)
class Identified:
    """Models of the axes, and the travel (low, high) of each that the recording covers, m or rad."""

    models: dict[str, PhysicalModel]
    travel: dict[str, tuple[float, float]]


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
    """The models after some seconds of noise. kept: folder for the recordings' travel and the models, so that a campaign can go on where it ended."""
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
    return Identified(models, travel)


def followed(
    case: Case, paths: Sequence[SampledPath], extras: Sequence[FloatArray], controllers: Sequence[Controller]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """(n, axes) where the axes are, m, and whether (n, axes) the drive was at its limit, each axis under its PID along its path."""
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
        error = wanted[max(k - 1, 0)] - shown  # the newest reading is of the sample before
        speed = keeps * speed + (1.0 - keeps) * (error - before) / h * (k > 0)
        before = error
        u = kp * error + total + kd * speed + extra[k]
        held = np.clip(u, -LIMIT, LIMIT)
        full[k] = np.abs(u) > LIMIT
        total = np.where((held == u) | ((u - held) * error < 0.0), total + ki * error * h, total)
        shown = machine.step(held[None, :])[0]
    return place, full


def ziegler_nichols(case: Case) -> list[Controller]:
    """PID of every axis from a relay experiment; the gains are halved until a move stays away from the drive's limit.

    Source: Astrom & Hagglund, Automatica 20 (1984); Ziegler & Nichols, Trans. ASME 64 (1942).
    """
    machine = case.machine
    machine.reset()
    rate = machine.rate
    count, axes = int(RELAY_SECONDS * rate), len(machine.axes)
    shown, held = np.zeros((count, axes)), np.full(axes, RELAY)
    for k in range(count):
        shown[k] = machine.step(held[None, :])[0]
        held = np.where(shown[k] > shown[: k + 1].mean(axis=0) * (k > rate), -RELAY, RELAY)
    made = []
    for column in range(axes):
        late = shown[count // 2 :, column]
        late = late - late.mean()
        rising = np.flatnonzero((late[:-1] < 0.0) & (late[1:] >= 0.0))
        period = float(np.mean(np.diff(rising))) / rate if rising.size > 2 else 0.02
        size = 0.5 * float(np.ptp(late[rising[0] :])) if rising.size else 1e-4
        ultimate = 4.0 * RELAY / (math.pi * max(size, 1e-7))
        kp, integral, derivative = 0.6 * ultimate, 0.5 * period, 0.125 * period
        made.append(Controller(kp=kp, ki=kp / integral, kd=kp * derivative, derivative_time=derivative / 10.0, limit=LIMIT))
    return _calmed(case, made)


def _calmed(case: Case, controllers: list[Controller]) -> list[Controller]:
    """As anybody does whose drive hums: the gains are halved until a short move, and the rest after it, stay away from the drive's limit."""
    bounds = Bounds(case.size * TRIAL.speed, case.size * TRIAL.acceleration, case.size * TRIAL.jerk)
    path = s_curve([0.0, case.size * MOVE, -case.size * MOVE, 0.0], bounds, case.machine.rate)
    for _ in range(HALVINGS):
        _, full = followed(case, [path] * len(controllers), [np.zeros(path.position.size)] * len(controllers), controllers)
        loud = [bool(column.any()) for column in full.T]
        if not any(loud):
            break
        controllers = [
            replace(item, kp=0.5 * item.kp, ki=0.5 * item.ki, kd=0.5 * item.kd) if over else item
            for item, over in zip(controllers, loud, strict=True)
        ]
    return controllers
