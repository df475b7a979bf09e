"""Filters for the resonances of a model: a notch in the loop, and input shapers for the path, with Klipper's names.

A drive that controls the encoder's side leaves the attached mass free to oscillate at the antiresonance: this is the frequency to shape. The
loop contains the resonance: this is the frequency to notch.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from xy_sysid.axis.model import AxisModel
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.path import SampledPath, of_position
from xy_sysid.control_design.sample_step import sections
from xy_sysid.control_design.uncertain import Derived, derive
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

TOLERATED = 0.05  # of the unshaped vibration that an EI shaper leaves at its own frequency (Klipper: 1 / 20)
WIDEST, NARROWEST = 0.7, 0.05  # damping ratio of a notch's poles
UNIT = 1.0  # rad/s, rate at which roots are computed
ARRIVED = 1e-9  # of a path's length, from its end: as near as that it has arrived
HIGHEST = 0.45  # of the sampling rate: frequency of a filter in the loop


@dataclass(frozen=True, slots=True)
class Swing:
    """One mode: frequencies, Hz, and damping ratios of the load with the encoder's side held, and of the free axis."""

    held: Derived
    held_damping: float
    free: Derived
    free_damping: float


@dataclass(frozen=True, slots=True)
class LoopFilter:
    """A second-order section in the loop: a notch at a resonance, or a low-pass.

    kind: ``notch`` or ``low-pass``; frequency: Hz, of the resonance or the cut-off; depth: gain there; width: damping ratio of the poles
    section: (5,) b0, b1, b2, a1, a2 at the sampling rate, Hz; covers: whether a notch's -3 dB width covers the interval of the frequency
    """

    kind: str
    frequency: float
    depth: float
    width: float
    section: FloatArray
    sampling_rate: float
    covers: bool = True

    def phase_cost(self, at: float) -> float:
        """Phase lag of the section at a frequency, Hz, in degrees."""
        z = cmath.exp(2j * math.pi * at / self.sampling_rate)
        b0, b1, b2, a1, a2 = self.section.tolist()
        return -math.degrees(cmath.phase((b0 + b1 / z + b2 / z**2) / (1.0 + a1 / z + a2 / z**2)))


@dataclass(frozen=True, slots=True)
class Shaper:
    """An input shaper: pulses that replace a single one.

    name: zv, mzv, zvd or ei; frequency: Hz; damping: ratio; amplitudes, times: (k,) sum 1, s
    vibration: residual vibration at the frequency relative to no shaper; worst: the same at the ends of its interval too, 1 if an end is unknown
    """

    name: str
    frequency: float
    damping: float
    amplitudes: tuple[float, ...]
    times: tuple[float, ...]
    vibration: float
    worst: float

    @property
    def duration(self) -> float:
        """Time that the shaper adds to a path, s."""
        return self.times[-1]

    def shape(self, path: SampledPath) -> SampledPath:
        """The path after the shaper."""
        rate = path.sampling_rate
        start = path.position[0]
        tail = np.full(math.ceil(self.duration * rate), path.position[-1] - start)
        wanted = np.concatenate((path.position - start, tail))
        shaped = np.zeros_like(wanted)
        places = np.arange(wanted.size, dtype=np.float64)
        for size, time in zip(self.amplitudes, self.times, strict=True):
            shaped += size * np.interp(places - time * rate, places, wanted, left=0.0)
        return of_position(start + shaped, rate)


def modes(model: PhysicalModel) -> tuple[Swing, ...]:
    """The modes of the oscillating resonances in the model (damping below 1), lowest first."""
    zeros, poles = _pairs(model.model)
    found = []
    for k, (zero, pole) in enumerate(zip(zeros, poles, strict=True)):
        if zero[1] < 1.0 and pole[1] < 1.0:
            held = derive(model, "held mode", "Hz", "oscillates while the encoder's side is held (antiresonance)", _frequency(0, k))
            free = derive(model, "free mode", "Hz", "oscillates with the free axis (resonance)", _frequency(1, k))
            found.append(Swing(held=held, held_damping=zero[1], free=free, free_damping=pole[1]))
    return tuple(found)


def _frequency(which: int, place: int) -> Callable[[AxisModel], float]:
    def of(model: AxisModel) -> float:
        return _pairs(model)[which][place][0]

    return of


def _pairs(model: AxisModel) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """(natural frequency, Hz; damping ratio) of each pair of zeros, and of poles, by frequency; includes overdamped pairs."""
    parts = []
    for polynomial in sections(model, UNIT):
        roots = sorted(np.roots(polynomial[::-1]).tolist(), key=abs)
        pairs = [(math.sqrt(abs(one) * abs(two)), -complex(one + two).real) for one, two in zip(roots[::2], roots[1::2], strict=True)]
        parts.append([(size / (2.0 * math.pi), total / (2.0 * size)) for size, total in pairs])
    return parts[0], parts[1]


def notch(mode: Swing, sampling_rate: float) -> LoopFilter:
    """The notch of a mode's resonance: as deep as the resonance is high, and as wide as the interval of its frequency.

    Its zeros have the damping of the resonance. Source: Franklin, Powell & Emami-Naeini, Feedback Control of Dynamic Systems, 7th ed., sec. 6.7.
    Raises BadInput for a resonance above ``HIGHEST`` of the sampling rate.
    """
    f = mode.free.value
    if f >= HIGHEST * sampling_rate:
        allowed = f"below {HIGHEST * sampling_rate:g} Hz, which is {HIGHEST:g} of the sampling rate"
        raise BadInput("notch", f"for a resonance at {f:.4g} Hz", allowed, "Sample faster, or leave it out.")
    spread = max(mode.free.high - f, f - mode.free.low) / f
    width = min(max(NARROWEST, 2.0 * spread, 4.0 * mode.free_damping), WIDEST)
    w = 2.0 * math.pi * f
    top = [1.0, 2.0 * mode.free_damping * w, w * w]
    bottom = [1.0, 2.0 * width * w, w * w]
    b, a = scipy.signal.bilinear(top, bottom, w / (2.0 * math.tan(0.5 * w / sampling_rate)))
    section = np.array([b[0], b[1], b[2], a[1], a[2]])
    return LoopFilter(
        kind="notch",
        frequency=f,
        depth=mode.free_damping / width,
        width=width,
        section=section,
        sampling_rate=sampling_rate,
        covers=width >= spread,
    )


def low_pass(frequency: float, sampling_rate: float) -> LoopFilter:
    """A Butterworth low-pass of second order; frequency: cut-off, Hz, below half the sampling rate."""
    b, a = scipy.signal.butter(2, frequency, fs=sampling_rate)
    section = np.array([b[0], b[1], b[2], a[1], a[2]])
    half = math.sqrt(0.5)
    return LoopFilter(kind="low-pass", frequency=frequency, depth=half, width=half, section=section, sampling_rate=sampling_rate)


def shapers(mode: Swing) -> tuple[Shaper, ...]:
    """ZV, MZV, ZVD and EI for the load's oscillation while the drive holds the encoder's side.

    Source: Singer & Seering, Preshaping command inputs, J. Dyn. Sys. Meas. Control 112 (1990); Singhose, Seering & Singer, Residual vibration
    reduction using vector diagrams, ASME J. Mech. Des. 116 (1994); MZV and all names as in Klipper's shaper_defs.
    """
    f, damping = mode.held.value, min(mode.held_damping, 0.99)
    damped = math.sqrt(1.0 - damping * damping)
    k = math.exp(-damping * math.pi / damped)
    period = 1.0 / (f * damped)
    third = math.exp(-0.75 * damping * math.pi / damped)
    kinds = {
        "zv": ((1.0, k), (0.0, 0.5)),
        "mzv": ((1.0 - 1.0 / math.sqrt(2.0), (math.sqrt(2.0) - 1.0) * third, (1.0 - 1.0 / math.sqrt(2.0)) * third * third), (0.0, 0.375, 0.75)),
        "zvd": ((1.0, 2.0 * k, k * k), (0.0, 0.5, 1.0)),
        "ei": ((0.25 * (1.0 + TOLERATED), 0.5 * (1.0 - TOLERATED) * k, 0.25 * (1.0 + TOLERATED) * k * k), (0.0, 0.5, 1.0)),
    }
    found = []
    for name, (sizes, places) in kinds.items():
        amplitudes = tuple(size / sum(sizes) for size in sizes)
        times = tuple(place * period for place in places)
        ends = f, mode.held.low, mode.held.high
        left = [vibration(amplitudes, times, at, damping) if math.isfinite(at) and at > 0.0 else 1.0 for at in ends]
        found.append(Shaper(name=name, frequency=f, damping=damping, amplitudes=amplitudes, times=times, vibration=left[0], worst=max(left)))
    return tuple(found)


def vibration(amplitudes: tuple[float, ...], times: tuple[float, ...], frequency: float, damping: float) -> float:
    """Residual vibration at a frequency, Hz, relative to that of one pulse (Singer & Seering 1990, eq. 5)."""
    w = 2.0 * math.pi * frequency
    swing = w * math.sqrt(1.0 - damping * damping)
    last = times[-1]
    total = sum(size * cmath.exp(-damping * w * (last - time)) * cmath.exp(-1j * swing * time) for size, time in zip(amplitudes, times, strict=True))
    return abs(total)


def rings_after(path: SampledPath, mode: Swing) -> float:
    """Amplitude, m, with which the load still swings about the encoder's side when that side has arrived at the end of a path."""
    w, damping, rate = 2.0 * math.pi * mode.held.value, mode.held_damping, path.sampling_rate
    tail = np.full(math.ceil(2.0 * rate / mode.held.value), path.position[-1])
    held = np.concatenate((path.position, tail)) - path.position[0]
    load = ([2.0 * damping * w, w * w], [1.0, 2.0 * damping * w, w * w])
    _, place, _ = scipy.signal.lsim(load, held, np.arange(held.size) / rate)
    moving = np.flatnonzero(np.abs(held - held[-1]) > ARRIVED * float(np.ptp(held)))
    return 0.5 * float(np.ptp(place[int(moving[-1]) + 1 if moving.size else 0 :]))


def best_shaper(found: tuple[Shaper, ...]) -> Shaper:
    """The shortest shaper with at most ``TOLERATED`` residual vibration over the frequency's interval; else the one with the least."""
    good = [item for item in found if item.worst <= TOLERATED]
    return min(good, key=lambda item: item.duration) if good else min(found, key=lambda item: item.worst)
