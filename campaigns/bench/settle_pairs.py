"""Pairs of effects that one short recording does not distinguish, on simulated machines; see ``bench.settle``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from campaigns.bench.mujoco_machine import MujocoMachine
from xy_sim.machine import Machine
from xy_sysid.excitation.lockstep import drive
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.loop import Signals
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings

SMALLEST = 0.25  # smallest factor on the sizes in the table, drawn uniformly on a log scale
Parts = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Pair:
    """One ambiguity.

    sets: the two sets of effects; parts: of the machine if the first or the second is true, with sizes that a draw multiplies
    first: excitation of the ambiguous recording; seconds, skipped: its length, and the part left out at its start
    voltage, reach: limits of experiments, V, and m to either side; noise: of the (coarse) encoder, m (rad of a joint)
    """

    name: str
    sets: tuple[tuple[str, ...], tuple[str, ...]]
    parts: tuple[Parts, Parts]
    first: Mapping[str, float | str]
    seconds: float = 4.0
    skipped: float = 1.0
    voltage: float = 5.0
    reach: float = 0.14
    machine: str = "rigid.yaml"
    noise: float = 4e-6
    sized: tuple[str, ...] = field(default=())


HANGING = Pair(
    "gravity or a spring, near hanging",
    (("gravity",), ("return_spring",)),
    ({"gravity": {"amplitude": 0.5}}, {"return_spring": {"stiffness": 0.5}}),
    {"low": 0.5, "high": 20.0, "rms": 0.08, "centring": 0.0},
    seconds=12.0,
    voltage=1.2,
    reach=2.5,
    machine="joint.yaml",
    noise=2e-4,
    sized=("amplitude", "stiffness"),
)

PAIRS = (
    Pair(
        "Coulomb or Stribeck friction, seen only at speed",
        (("coulomb_friction",), ("stribeck_friction",)),
        ({"coulomb_friction": {"coulomb": 0.25}}, {"stribeck_friction": {"coulomb": 0.2, "excess": 0.1, "velocity": 0.008}}),
        {"low": 5.0, "high": 200.0, "offset": 0.55, "rms": 0.08, "centring": 0.0},
        sized=("excess",),
    ),
    Pair(
        "cogging or lead error, over less than three periods",
        (("cogging",), ("lead_error",)),
        (
            {"cogging": {"amplitude": 0.005, "per_revolution": 0.5, "phase": 1.0}},
            {"lead_error": {"amplitude": 8e-5, "per_revolution": 0.5, "phase": 1.0}},
        ),
        {"low": 5.0, "high": 100.0, "offset": 0.07, "rms": 0.005, "centring": 0.0},
        sized=("amplitude",),
    ),
    Pair(
        "load or asymmetric friction, seen in one direction",
        (("constant_load",), ("asymmetric_friction",)),
        ({"constant_load": {"load": 0.15}}, {"asymmetric_friction": {"asymmetry": 0.5, "coulomb": 0.1}}),
        {"low": 5.0, "high": 200.0, "offset": 0.45, "rms": 0.05, "centring": 0.0},
        sized=("load", "coulomb"),
    ),
    HANGING,
    Pair(
        "a saturation that is never reached",
        ((), ("saturation",)),
        ({}, {"saturation": {"limit": 5.0}}),
        {"low": 0.5, "high": 200.0, "rms": 0.3},
        voltage=6.0,
        sized=("limit",),
    ),
    Pair(
        "lag or delay, in a narrow band",
        ((), ("amplifier_lag",)),
        ({"time_delay": {"delay": 2.29e-3}}, {"amplifier_lag": {"lag": 1e-3}}),
        {"low": 1.0, "high": 8.0, "rms": 0.3},
        sized=("lag",),
    ),
    Pair(
        "Coulomb friction or presliding, at large amplitude",
        (("coulomb_friction",), ("presliding_hysteresis",)),
        ({"coulomb_friction": {"coulomb": 0.2}}, {"presliding_hysteresis": {"coulomb": 0.2, "length": 10e-6}}),
        {"kind": "step", "period": 0.4, "rms": 2.0, "centring": 0.0},
        sized=("coulomb",),
    ),
    Pair(
        "gain or drag that varies along the travel",
        (("position_dependent_gain",), ("position_dependent_drag",)),
        (
            {"position_dependent_gain": {"depth": 0.15, "period": 0.3}},
            {"position_dependent_drag": {"slope": 4.0}},
        ),
        {"kind": "off", "rms": 0.0, "slow": 1.2, "slow_period": 1.5, "centring": 0.0},
        sized=("depth", "slope"),
    ),
    Pair(
        "a weak spring, at a quarter of the excitation",
        ((), ("hardening_stiffness",)),
        ({}, {"hardening_stiffness": {"cubic": 1500.0}}),
        {"low": 0.5, "high": 100.0, "rms": 0.5},
        sized=("cubic",),
    ),
    Pair(
        "drag with the square of speed or a drive that warms, at rising speed",
        (("quadratic_drag",), ("gain_drift",)),
        ({"quadratic_drag": {"coefficient": 40.0}}, {"gain_drift": {"rate": -0.05}}),
        {"low": 5.0, "high": 100.0, "rms": 0.005, "slow": 0.5, "slow_period": 16.0, "centring": 0.0},
        sized=("coefficient", "rate"),
    ),
    replace(HANGING, name=f"{HANGING.name} (MuJoCo)", machine="mujoco hinge"),
    Pair(
        "load or Coulomb friction, seen in one direction (MuJoCo)",
        (("constant_load",), ("coulomb_friction",)),
        ({"constant_load": {"load": 0.15}}, {"coulomb_friction": {"coulomb": 0.15}}),
        {"low": 5.0, "high": 100.0, "offset": 0.45, "rms": 0.05, "centring": 0.0},
        machine="mujoco slide",
        sized=("load", "coulomb"),
    ),
)


class Rig(Protocol):
    """A machine with one axis x: ``step`` as in ``excitation.lockstep.Machine``, and a reset."""

    @property
    def rate(self) -> float:
        """Samples per second, Hz."""

    @property
    def axes(self) -> tuple[str, ...]:
        """Names, one per column."""

    def step(self, voltage: FloatArray) -> FloatArray:
        """(n, axes) V, held -> (n, axes) positions at the same instants."""

    def reset(self) -> None:
        """Back to rest at the origin."""


def machine(pair: Pair, truth: int, seed: int) -> Rig:
    """The machine with one axis whose first or second set is true, with drawn sizes down to a quarter."""
    random = np.random.default_rng([seed, truth])
    factor = float(SMALLEST ** random.uniform(0.0, 1.0))
    parts = {
        name: {key: value * (factor if key in pair.sized else 1.0) for key, value in values.items()} for name, values in pair.parts[truth].items()
    }
    if pair.machine.startswith("mujoco "):
        return MujocoMachine(pair.machine.removeprefix("mujoco "), parts, pair.noise, seed)
    made = Machine.from_file(pair.machine, seed)
    axis = made.spec.axes[0]
    coarse = replace(axis, drive=axis.drive.model_copy(update={"encoder_noise": pair.noise}))
    single = Machine(replace(made.spec, axes=(coarse,)), seed)
    return single.with_parts(parts)


def limits(pair: Pair) -> MachineLimits:
    """The limits of experiments on the machine of a pair."""
    return MachineLimits(voltage=pair.voltage, travel=(-pair.reach, pair.reach))


def recording(made: Rig, told: AxisExcitation, seconds: float) -> Signals:
    """Voltage and position under an excitation, from rest at the origin."""
    made.reset()
    settings = ExcitationSettings(rate=made.rate, lockstep=True, speed=0.0, axes={"x": told})
    found = drive(made, settings, seconds)
    return found.voltage[:, 0], found.position[:, 0]


def first_recording(pair: Pair, made: Rig, seed: int) -> Signals:
    """The short, ambiguous recording."""
    ends = {"limit": pair.voltage, "travel_min": -pair.reach, "travel_max": pair.reach}
    voltage, position = recording(made, AxisExcitation(**{**ends, **pair.first, "seed": seed}), pair.seconds)
    begin = round(pair.skipped * made.rate)
    return voltage[begin:], position[begin:]


def carry_out(made: Rig, experiment: Experiment) -> Signals:
    """The recording of an experiment."""
    return recording(made, experiment.excitation, experiment.seconds)


def left_limits(pair: Pair, recordings: Sequence[Signals]) -> int:
    """Number of recordings in which the machine exceeded its limits."""
    away = (np.max(np.abs(voltage)) > pair.voltage * (1 + 1e-9) or np.max(np.abs(position)) > pair.reach for voltage, position in recordings)
    return int(sum(away))
