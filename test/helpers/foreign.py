"""Machines independent of ``xy_sim`` and the effects: another program, in closed loop, with moves instead of noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.signal

from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class Joint:
    """One axis, SI units. fs: Hz, seconds: of the record; count: of the encoder

    mass, drag, coulomb, load: of the moving part; spring, rest: stiffness and rest position; cogging, period: along the travel
    breaks: breakaway friction above that in motion, which decays with speed on the scale ``fades``
    moves: (largest position, speed, acceleration) of random moves under a controller (stiffness, damping), or None
    shake: rms, and band (Hz), of noise in the drive, around ``offset``
    limit, zone: of the drive: saturation, and dead zone
    """

    fs: float
    seconds: float
    count: float
    mass: float
    drag: float
    coulomb: float = 0.0
    load: float = 0.0
    spring: float = 0.0
    rest: float = 0.0
    cogging: float = 0.0
    period: float = 1.0
    breaks: float = 0.0
    fades: float = 1.0
    moves: tuple[float, float, float] | None = None
    control: tuple[float, float] = (0.0, 0.0)
    shake: float = 0.0
    band: tuple[float, float] = (0.5, 30.0)
    offset: float = 0.0
    limit: float = np.inf
    zone: float = 0.0


def driven(joint: Joint, seed: int) -> tuple[FloatArray, FloatArray]:
    """(n,) drive and (n,) position as its encoder shows it."""
    random = np.random.default_rng(seed)
    n = int(joint.seconds * joint.fs)
    noise = scipy.signal.sosfilt(scipy.signal.butter(2, joint.band, "bandpass", fs=joint.fs, output="sos"), random.standard_normal(n))
    shake = joint.offset + joint.shake * noise / noise.std()
    wanted = _moves(random, n, joint.fs, *joint.moves) if joint.moves else np.zeros(n)
    inner = max(4, int(20000 / joint.fs))
    forces = np.array(
        [joint.mass, joint.drag, joint.coulomb, joint.load, joint.spring, joint.rest, joint.cogging, joint.period, joint.breaks, joint.fades]
    )
    return _run(wanted, shake, joint.fs, inner, forces, np.array([*joint.control, joint.count, joint.limit, joint.zone]))


def across_gap(
    gap: float, table: float, coulomb: float, seed: int, fs: float = 2000.0, lag: float = 0.0, load: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """(n,) drive and (n,) position of a motor of 0.1 kg, driven with noise of 1 N for 20 s, and a table behind a gap (m), which drags as it does.

    lag: s, of the amplifier; load: N, on the table
    """
    noise = scipy.signal.sosfilt(
        scipy.signal.butter(2, (0.5, 100.0), "bandpass", fs=fs, output="sos"), np.random.default_rng(seed).standard_normal(40_000)
    )
    drive = noise / noise.std()
    return drive, _across(drive, fs, gap, table, coulomb, lag, load)


@compiled
def _across(drive: FloatArray, fs: float, gap: float, table: float, coulomb: float, lag: float, load: float) -> FloatArray:
    h, x, v, x2, v2, push, shown = 1.0 / fs / 20, 0.0, 0.0, 0.0, 0.0, 0.0, np.empty(drive.size)
    for i in range(drive.size):
        shown[i] = np.round(x / 1e-6) * 1e-6
        held = drive[i - 1] if i > 0 else 0.0  # one sample late
        for _ in range(20):
            deep = x - x2 - min(max(x - x2, -0.5 * gap), 0.5 * gap)
            contact = 2e5 * deep + 200.0 * (v - v2) if deep != 0.0 else 0.0
            contact = 0.0 if contact * deep < 0.0 else contact
            v2 += h * (contact - load - 10.0 * v2) / table
            x2 += h * v2
            push += (held - push) * (h / lag if lag > 0.0 else 1.0)
            new, stops = v + h * (push - 10.0 * v - contact) / 0.1, h * coulomb / 0.1
            new = new - stops if new > stops else new + stops if new < -stops else 0.0
            x += 0.5 * h * (v + new)
            v = new
    return shown


def _moves(random: np.random.Generator, n: int, fs: float, far: float, speed: float, acceleration: float) -> FloatArray:
    """Smooth moves between random positions, with pauses."""
    wanted, i, place = np.zeros(n), 0, 0.0
    while i < n:
        to = random.uniform(-far, far)
        lasts = max(1.5 * abs(to - place) / speed, np.sqrt(6.0 * abs(to - place) / acceleration), 0.05)
        part = np.linspace(0.0, 1.0, int(lasts * fs) + 1)
        path = np.concatenate((place + (to - place) * (10 * part**3 - 15 * part**4 + 6 * part**5), np.full(int(random.uniform(0.02, 0.3) * fs), to)))
        wanted[i : i + path.size] = path[: n - i]
        i, place = i + path.size, to
    return wanted


@compiled
def _run(wanted: FloatArray, shake: FloatArray, fs: float, inner: int, forces: FloatArray, seen: FloatArray) -> tuple[FloatArray, FloatArray]:
    mass, drag, coulomb, load, spring, rest, cogging, period, breaks, fades = forces
    stiffness, damping, count, limit, zone = seen
    h, x, v, speed, held = 1.0 / fs / inner, wanted[0], 0.0, 0.0, 0.0
    drive, shown = np.empty(wanted.size), np.empty(wanted.size)
    for i in range(wanted.size):
        shown[i] = np.round(x / count) * count
        if i > 0:
            speed += 0.3 * ((shown[i] - shown[i - 1]) * fs - speed)
        ahead = (wanted[min(i + 1, wanted.size - 1)] - wanted[i]) * fs
        drive[i] = stiffness * (wanted[i] - shown[i]) + damping * (ahead - speed) + shake[i]
        for _ in range(inner):
            push = held - drag * v - load - spring * (x - rest) - cogging * np.sin(2.0 * np.pi * x / period)
            new, stops = v + h * push / mass, h * (coulomb + breaks * np.exp(-((v / fades) ** 2))) / mass
            new = new - stops if new > stops else new + stops if new < -stops else 0.0
            x += 0.5 * h * (v + new)
            v = new
        cut = min(max(drive[i], -limit), limit)
        held = cut - min(max(cut, -zone), zone)  # one sample late
    return drive, shown
