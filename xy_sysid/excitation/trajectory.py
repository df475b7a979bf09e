"""Excitation for a robot that takes only trajectories: a multisine or a sweep that begins and ends at rest, within limits.

A JointTrajectoryController interpolates between points with position, velocity and acceleration by quintic polynomials, so the motion is smooth.
The signal fades in and out by a smooth step whose first two derivatives are 0 at both ends. Its size is the largest within the limits of position,
speed and acceleration.
(Swevers, Ganseman, Tükel, De Schutter & Van Brussel, IEEE Trans. Robot. Autom. 13 (1997), 730-740)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

FADE = 0.1  # of the duration, at either end
CYCLES = 2.0  # least cycles of the lowest frequency
POINTS_EACH = 8.0  # least points in a period of the highest frequency


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Limits of the motion about the start: position (m or rad), speed and acceleration, all above 0; start: first and last position."""

    position: float
    speed: float
    acceleration: float
    start: float = 0.0


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Points of one joint: time (n,) s from 0; position, speed, acceleration (n,); limited_by: the limit that determines the size."""

    time: FloatArray
    position: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    limited_by: str


def trajectory(
    kind: str,
    band: tuple[float, float],
    seconds: float,
    rate: float,
    limits: MotionLimits,
    seed: int = 1,
) -> Trajectory:
    """The largest motion of a kind within the limits, about their start.

    kind: multisine or sweep; band: (low, high) Hz; seconds: duration; rate: points per second
    Raises BadInput for a band that does not fit the duration or the rate, or limits that are not positive.
    """
    low, high = band
    if kind not in ("multisine", "sweep"):
        raise BadInput("kind", repr(kind), "multisine, sweep", "Choose one of these.")
    for name, value in (("position", limits.position), ("speed", limits.speed), ("acceleration", limits.acceleration)):
        if not 0.0 < value < np.inf:
            raise BadInput(f"limit of {name}", value, "above 0", "Give the joint's own, or less.")
    if not 0.0 < low < high or not seconds * low >= CYCLES:
        raise BadInput(
            "band", f"{low:g} to {high:g} Hz in {seconds:g} s", f"{CYCLES:g} cycles of the lowest or more", "Lengthen it, or raise the lowest."
        )
    if rate < POINTS_EACH * high:
        raise BadInput(
            "points a second", rate, f"{POINTS_EACH * high:g} or more for {high:g} Hz", "Give more points, or lower the highest frequency."
        )
    time = np.arange(round(seconds * rate) + 1) / rate
    signal, first, second = (_multisine if kind == "multisine" else _sweep)(time, band, seconds, seed)
    fade, slope, bend = faded(time, seconds)
    moved = fade * signal
    speed = slope * signal + fade * first
    push = bend * signal + 2.0 * slope * first + fade * second
    room = {
        name: limit / float(np.max(np.abs(values)))
        for name, limit, values in (
            ("position", limits.position, moved), ("speed", limits.speed, speed), ("acceleration", limits.acceleration, push)
        )
    }  # fmt: skip
    tightest = min(room, key=lambda name: room[name])
    scale = room[tightest]
    return Trajectory(time=time, position=limits.start + scale * moved, speed=scale * speed, acceleration=scale * push, limited_by=tightest)


def _multisine(time: FloatArray, band: tuple[float, float], seconds: float, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A sum of all lines of the band, of equal amplitude in speed and random phases, and its two derivatives."""
    lines = np.arange(int(np.ceil(band[0] * seconds)), int(band[1] * seconds) + 1) / seconds
    omega = 2.0 * np.pi * lines
    turn = np.exp(1j * (time[:, None] * omega[None, :] + np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, lines.size)))
    size = 1.0 / omega
    return (turn @ size).real, (turn @ (1j * omega * size)).real, (turn @ (-(omega**2) * size)).real


def _sweep(time: FloatArray, band: tuple[float, float], seconds: float, _seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A sine whose frequency rises exponentially, of constant amplitude in speed, and its two derivatives."""
    growth = np.log(band[1] / band[0]) / seconds
    omega = 2.0 * np.pi * band[0] * np.exp(growth * time)
    phase = (omega - omega[0]) / growth
    size = 1.0 / omega
    signal, first = size * np.sin(phase), np.cos(phase) - growth * size * np.sin(phase)
    second = -(omega + growth**2 * -size) * np.sin(phase) - growth * np.cos(phase)
    return signal, first, second


def faded(time: FloatArray, seconds: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A smooth step up at the beginning and down at the end, and its two derivatives."""
    length = FADE * seconds
    value, slope, bend = np.ones(time.size), np.zeros(time.size), np.zeros(time.size)
    for sign, gone in ((1.0, time / length), (-1.0, (seconds - time) / length)):
        inside = gone < 1.0
        s = np.clip(gone[inside], 0.0, 1.0)
        value[inside] = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        slope[inside] = sign * 30.0 * s**2 * (1.0 - s) ** 2 / length
        bend[inside] = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / length**2
    return value, slope, bend
