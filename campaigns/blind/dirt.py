"""Dirt: a random mixture of small imperfections outside the laws of the library, scaled to a fraction of the motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from xy_sim.drawing import sizes
from xy_sim.machine import Machine
from xy_sim.parts import PARTS
from xy_sim.parts.contract import Part
from xy_sysid.samples.block import FloatArray

DIRT = (
    *("uneven_drag", "uneven_gain", "weak_modes", "sample_jitter", "gain_wander", "friction_wander"),
    *("cable_pull", "uneven_lines", "mains_hum", "late_drive", "quadratic_drag"),
)
FEWEST, MOST = 3, 5  # kinds of dirt on one axis
SPREAD = 0.7  # standard deviation of the logarithm of their shares
BAND = 700.0  # Hz; higher frequencies do not count
PROBE = 10.0  # s, length of the simulations that set the share of each kind; the full record sets their sum
STEPS = 3  # most corrections of the mixture
CLOSE = 0.03  # relative difference from the requested amount at which corrections end

Parts = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class Dirt:
    """Parts of the dirt on one axis.

    parts: part -> parameter -> value, SI; reached: rms of their change of the velocity, over its rms
    """

    parts: Parts
    reached: float


def change(one: FloatArray, other: FloatArray, rate: float) -> float:
    """Rms of the difference of two velocities over that of the first, below BAND; positions (n,), m, at ``rate``, Hz."""
    spectrum = np.fft.rfft(np.diff(np.stack((one, other))))
    inside = np.fft.rfftfreq(one.shape[0] - 1, 1.0 / rate) < BAND
    before, after = spectrum[:, inside]
    return float(np.linalg.norm(after - before) / np.linalg.norm(before))


def moved(machine: Machine, voltage: FloatArray) -> FloatArray:
    """Exact positions (n,), m, of a machine of one axis under voltages (n,), V, from rest."""
    return Machine(machine.spec, machine.seed, clean=True).step(voltage[:, None])[:, 0]


def mixture(machine: Machine, voltage: FloatArray, amount: float, random: np.random.Generator) -> Dirt:
    """Random dirt that changes the motion of ``machine`` (one axis, without the effects to be found) by ``amount``.

    voltage: (n,) V, its input. Each kind first gets a random share, from a short run with it alone; then
    all are scaled together until the full record changes by the requested amount.
    """
    present = set(machine.spec.axes[0].parts)
    kinds = random.permutation([name for name in DIRT if name not in present])[: int(random.integers(FEWEST, MOST + 1))]
    weights = np.exp(SPREAD * random.standard_normal(kinds.size))
    weights /= float(np.linalg.norm(weights))
    short = voltage[: round(PROBE * machine.rate)]
    still = moved(machine, short)
    parts: dict[str, dict[str, float]] = {}
    for name, weight in zip(kinds.tolist(), weights.tolist(), strict=True):
        drawn = sizes(PARTS[name], random)
        alone = change(still, moved(machine.with_parts({name: drawn}), short), machine.rate)
        parts[name] = scaled(PARTS[name], drawn, amount * weight / alone)
    still = moved(machine, voltage)
    for _ in range(STEPS):
        reached = change(still, moved(machine.with_parts(parts), voltage), machine.rate)
        if abs(reached / amount - 1.0) < CLOSE:
            return Dirt(parts, reached)
        parts = {name: scaled(PARTS[name], values, amount / reached) for name, values in parts.items()}
    return Dirt(parts, change(still, moved(machine.with_parts(parts), voltage), machine.rate))


def scaled(part: Part, values: Mapping[str, float], scale: float) -> dict[str, float]:
    """The values of a part scaled by ``scale`` to each parameter's ``power``, within its limits."""
    powers = [(1.0 if place == 0 else 0.0) if item.power is None else item.power for place, item in enumerate(part.parameters)]
    return {
        item.name: min(max(values[item.name] * scale**power, item.minimum), item.maximum) for item, power in zip(part.parameters, powers, strict=True)
    }
