"""Is a machine better for it? Hidden machines, a minute of identification, then a path with three kinds of feedforward.

    python -m campaigns.bench use            30 axes; writes the table into docs/use.md
    python -m campaigns.bench use --short    two of them, as the tests run it

Each axis of the simulated table has one to three hidden effects. It is driven with noise for a minute, its model is searched, and it follows a
path with (a) a PID that a relay experiment on the machine itself tunes by the rules of Ziegler and Nichols; (b) the same PID with kS, kV and kA;
(c) the same PID with the whole feedforward and the corrections by place and direction; (d) our PID with (c). The error is where the axis truly is on
the encoder's side (the table, where a gap lies between), from where the path begins to move. The seeds of the report were never tuned on.
"""

from __future__ import annotations

import math
import statistics
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from campaigns.bench.recordings import between
from campaigns.bench.tables import Check, Table, at_most
from xy_sim.hidden import draw
from xy_sim.machine import Machine
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.closed_loop import Controller
from xy_sysid.control_design.feedback import feedback
from xy_sysid.control_design.gains import gains, simple_feedforward
from xy_sysid.control_design.inverse import feedforward
from xy_sysid.control_design.laws import along
from xy_sysid.control_design.path import Bounds, SampledPath, of_position, s_curve
from xy_sysid.control_design.use import use
from xy_sysid.diagnosis.of_run import refine
from xy_sysid.errors import BadInput
from xy_sysid.excitation.lockstep import drive
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings

RATE, LIMIT = 2000.0, 10.0  # Hz, V
SECONDS, SHORT_SECONDS = 60.0, 8.0  # of identification
REPORT, SHORT = range(7000, 7015), range(12, 13)  # seeds
PLACES, BOUNDS = (0.0, 0.03, -0.02, 0.0), Bounds(0.06, 1.0, 50.0)
RELAY = 1.0  # V
PAGE = Path(__file__).parents[2] / "docs" / "use.md"
KINDS = ("PID", "kS kV kA", "whole", "whole, own PID")


@dataclass(frozen=True, slots=True)
class Outcome:
    """One axis: what was hidden in it, what was found, and rms tracking errors in the order of ``KINDS``, m; left: whether a limit was left."""

    name: str
    hidden: tuple[str, ...]
    found: tuple[str, ...]
    errors: tuple[float, ...]
    left: bool


def identified(machine: Machine, seed: int, seconds: float) -> dict[str, PhysicalModel]:
    """The models after some seconds of noise."""
    axes = {axis: AxisExcitation(seed=100 * seed + k) for k, axis in enumerate(machine.axes)}
    recording = drive(machine, ExcitationSettings(lockstep=True, speed=0.0, axes=axes), seconds, lambda _: None)
    return {axis: refine(recording.run(axis)).model for axis in machine.axes}


def followed(
    machine: Machine, paths: Sequence[SampledPath], extras: Sequence[FloatArray], controllers: Sequence[Controller]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """(n, axes) where the axes are, m, and whether (n, axes) the drive was at its limit, each axis under its PID along its path."""
    machine.reset()
    count, axes = len(paths[0].position), len(machine.axes)
    h = 1.0 / RATE
    before, total, rate, held = np.zeros(axes), np.zeros(axes), np.zeros(axes), np.zeros(axes)
    keeps = np.array([controller.keeps(RATE) for controller in controllers])
    kp, ki, kd = (np.array([getattr(controller, name) for controller in controllers]) for name in ("kp", "ki", "kd"))
    wanted, extra = np.array([path.position for path in paths]).T, np.array(extras).T
    place, full = np.zeros((count, axes)), np.zeros((count, axes), dtype=np.bool_)
    shown = machine.step(held[None, :])[0]
    for k in range(count):
        place[k] = [_judged(machine, axis) for axis in machine.axes]
        error = wanted[max(k - 1, 0)] - shown  # the newest reading is of the sample before
        rate = keeps * rate + (1.0 - keeps) * (error - before) / h * (k > 0)
        before = error
        u = kp * error + total + kd * rate + extra[k]
        held = np.clip(u, -LIMIT, LIMIT)
        full[k] = np.abs(u) > LIMIT
        total = np.where((held == u) | ((u - held) * error < 0.0), total + ki * error * h, total)
        shown = machine.step(held[None, :])[0]
    return place, full


def _judged(machine: Machine, axis: str) -> float:
    """Where the axis is on the encoder's side, or the table where a gap lies between, relative to the base, m."""
    state = machine.state(axis)
    return state["table"] if "backlash" in machine.spec.axes[machine.axes.index(axis)].parts else state["motor"]


def ziegler_nichols(machine: Machine) -> list[Controller]:
    """PID of every axis from a relay experiment. Source: Astrom & Hagglund, Automatica 20 (1984); Ziegler & Nichols, Trans. ASME 64 (1942)."""
    machine.reset()
    count, axes = int(4.0 * RATE), len(machine.axes)
    shown, held = np.zeros((count, axes)), np.full(axes, RELAY)
    for k in range(count):
        shown[k] = machine.step(held[None, :])[0]
        held = np.where(shown[k] > shown[: k + 1].mean(axis=0) * (k > RATE), -RELAY, RELAY)
    made = []
    for column in range(axes):
        late = shown[count // 2 :, column]
        late = late - late.mean()
        rising = np.flatnonzero((late[:-1] < 0.0) & (late[1:] >= 0.0))
        period = float(np.mean(np.diff(rising))) / RATE if rising.size > 2 else 0.02
        size = 0.5 * float(np.ptp(late[rising[0] :])) if rising.size else 1e-4
        ultimate = 4.0 * RELAY / (math.pi * max(size, 1e-7))
        kp, integral, derivative = 0.6 * ultimate, 0.5 * period, 0.125 * period
        made.append(Controller(kp=kp, ki=kp / integral, kd=kp * derivative, derivative_time=derivative / 10.0, limit=LIMIT))
    return made


def corrected(model: PhysicalModel, path: SampledPath) -> SampledPath:
    """What the encoder has to show so that the table is on the path: the scale's error, and half of the gap in the direction of motion."""
    position = path.position + along(model.model, path.position, "scale")
    gap = use(model, limit=LIMIT).gap
    if gap is not None:
        way = np.sign(path.speed)
        last = np.maximum.accumulate(np.where(way != 0.0, np.arange(way.size), -1))
        way = np.where(last >= 0, way[np.maximum(last, 0)], 0.0)
        soft = np.convolve(np.concatenate((np.zeros(40), way)), np.full(41, 1.0 / 41.0), mode="valid")  # within 20 ms
        position = position + 0.5 * gap.value * soft
    return of_position(position, path.sampling_rate)


def outcomes(seed: int, seconds: float = SECONDS) -> list[Outcome]:
    """Both axes of the machine of a seed."""
    machine = draw(seed)
    models = identified(machine, seed, seconds)
    path = s_curve(PLACES, BOUNDS, RATE)
    relay = ziegler_nichols(machine)
    still = np.zeros(path.position.size)
    own, simple, exact, whole = [], [], [], []
    for number, axis in enumerate(machine.axes):
        model = models[axis]
        simple.append(simple_feedforward(gains(model), path))
        exact.append(corrected(model, path))
        whole.append(feedforward(model.model, exact[-1]).voltage)
        try:
            late = replace(model, model=replace(model.model, delay=model.model.delay + 1.0 / RATE))  # a reading is a sample old
            own.append(feedback(late, RATE, limit=LIMIT).controller)
        except BadInput:
            own.append(relay[number])
    runs = (
        followed(machine, [path] * len(own), [still] * len(own), relay),
        followed(machine, [path] * len(own), simple, relay),
        followed(machine, exact, whole, relay),
        followed(machine, exact, whole, own),
    )
    found = []
    begun = int(np.flatnonzero(path.speed)[0])  # until then a load has moved what nobody held
    for number, axis in enumerate(machine.axes):
        errors = tuple(float(np.sqrt(np.mean((path.position - place[:, number])[begun:] ** 2))) for place, _ in runs)
        left = bool(runs[2][1][:, number].any() or np.max(np.abs(runs[2][0][:, number])) > 0.05)
        hidden = tuple(name for name in machine.spec.axes[number].parts if name != "time_delay")
        found.append(Outcome(name=f"{seed} {axis}", hidden=hidden, found=models[axis].effects, errors=errors, left=left))
    return found


def table(found: Sequence[Outcome], seconds: float = SECONDS) -> Table:
    """The campaign's outcome."""
    by_pid, by_simple = ([item.errors[2] / item.errors[k] for item in found] for k in (0, 1))
    rows = [
        (item.name, ", ".join(item.hidden) or "none", ", ".join(item.found) or "rigid", *(f"{1e6 * value:.3g}" for value in item.errors))
        for item in found
    ]
    middle = tuple(f"{1e6 * statistics.median(item.errors[k] for item in found):.3g}" for k in range(len(KINDS)))
    rows.insert(0, ("median", "", "", *middle))
    checks = (
        at_most("error of the whole feedforward over that of the PID, median", statistics.median(by_pid), 0.1),
        at_most("the same over that with kS, kV and kA, median", statistics.median(by_simple), 1.0 / 3.0),
        at_most("the same at worst", max(by_simple), 1.0),
        Check("axes worse than with kS, kV and kA", str(sum(value > 1.0 for value in by_simple)), "0", max(by_simple) <= 1.0),
        Check("axes that left a limit", str(sum(item.left for item in found)), "0", not any(item.left for item in found)),
    )
    told = f"{len(found)} axes with hidden effects, {seconds:g} s of identification each; tracking errors, um rms."
    return Table(
        title="A path after a minute of identification", text=told, columns=("axis", "hidden", "found", *KINDS), rows=tuple(rows), checks=checks
    )


def main(short: bool = False) -> None:
    """Run the campaign and print its table; docs/use.md gets it unless it is short."""
    from campaigns.bench.__main__ import text

    found: list[Outcome] = []
    for seed in SHORT if short else REPORT:
        found += outcomes(seed, SHORT_SECONDS if short else SECONDS)
        for item in found[-2:]:
            sys.stderr.write(f"{item.name}: {', '.join(item.found)}: {', '.join(f'{1e6 * value:.4g}' for value in item.errors)} um\n")
    made = text("use", table(found, SHORT_SECONDS if short else SECONDS))
    sys.stdout.write(made)
    if not short:
        PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), "use", made), encoding="utf-8")
