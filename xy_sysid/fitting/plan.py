"""From a transfer function to the expected spectra: hold, delay, sampling, window.

Everything that depends only on the lines, the window and the structure is computed once and cached.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadInput
from xy_sysid.fitting.structure import Structure
from xy_sysid.linear.hold import ALIASES, TAIL_POINTS, interpolation, nodes_for
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.samples.block import FloatArray

STEPS = 1e5  # of the grid in one line; frequencies less than a step apart are one point
PART = 1e3  # steps: points that differ by whole lines, to within this, follow one another on the grid, so that sums over lines are fast
NO_WEIGHT = 1e-15  # weights of the window below this fraction of the largest are rounding errors


@dataclass(frozen=True, slots=True)
class Plan:
    """Where the model is evaluated, and the factors that give the prediction on the lines.

    scale:       rad/s that the variable s is divided by (1 in the z domain)
    period:      sampling time, s
    line:        (m,) the model's variable (scaled s, or z) on the lines
    line_omega:  (m,) rad/s
    line_factor: (m,) complex: prediction without aliases, window and delay = line_factor * N / D
    grid:        (g,) the model's variable at the frequencies that the window needs
    omega:       (g,) rad/s
    main:        (g,) factor of N / D exp(-j w delay) at the grid
    fold:        (g,) factor of the sum of aliases at the grid
    index:       (j, m) rows of the grid for each line (near 0 Hz the window reaches below it)
    runs:        first line of each run of lines whose rows follow one another, and the number of lines
    kernel:      (j,) weights of the window; seen: (j,) their indices in FrequencyResponse.kernel_weight
    after:       (m,) factor of the smoothed response: 1 over the response of the difference
    alias:       (nodes * 2 ALIASES,) scaled s of the aliases, grouped by node; alias_omega: rad/s
    alias_factor: (same,) 1 / (s sigma^integrators)
    alias_number: (2 ALIASES,) k
    spread:      (nodes, g) interpolates from nodes to grid
    tail:        (points, nodes) interpolates the tail from TAIL_POINTS to nodes
    """

    scale: float
    period: float
    line: ComplexArray
    line_omega: FloatArray
    line_factor: ComplexArray
    grid: ComplexArray
    omega: FloatArray
    main: ComplexArray
    fold: ComplexArray
    index: NDArray[np.int64]
    runs: NDArray[np.int64]
    kernel: FloatArray
    seen: NDArray[np.int64]
    after: ComplexArray
    alias: ComplexArray
    alias_omega: FloatArray
    alias_factor: ComplexArray
    alias_number: FloatArray
    spread: FloatArray
    tail: FloatArray


@dataclass(frozen=True, slots=True)
class PlanKey:
    """Everything that a plan depends on, as a cache key; rate, resolution: Hz."""

    frequency: bytes
    kernel_offset: bytes
    kernel_weight: bytes
    rate: float
    resolution: float
    differenced: bool
    integrators: int
    held: bool
    domain: str

    @staticmethod
    def of(frf: FrequencyResponse, structure: Structure) -> PlanKey:
        """The key for the lines of a response."""
        return PlanKey(
            frequency=frf.frequency.tobytes(),
            kernel_offset=frf.kernel_offset.tobytes(),
            kernel_weight=frf.kernel_weight.tobytes(),
            rate=frf.sampling_rate,
            resolution=frf.resolution,
            differenced=frf.differenced,
            integrators=structure.power,
            held=structure.hold == "zoh" and structure.domain == "s",
            domain=structure.domain,
        )


def plan_for(frf: FrequencyResponse, structure: Structure) -> Plan:
    """The plan for the lines of a response; cached for the last few calls."""
    return _plan(PlanKey.of(frf, structure))


@lru_cache(maxsize=32)
def _plan(lines: PlanKey) -> Plan:
    frequency, offset, weight = (np.frombuffer(b, dtype=np.float64) for b in (lines.frequency, lines.kernel_offset, lines.kernel_weight))
    rate, differenced, integrators, held, domain = lines.rate, lines.differenced, lines.integrators, lines.held, lines.domain
    seen = np.abs(weight) > NO_WEIGHT * np.max(np.abs(weight))
    offset, weight = offset[seen], weight[seen]
    if not bool(np.all(frequency > 0)):
        raise BadInput("lowest frequency", f"{np.min(frequency):g} Hz", "> 0 Hz", "Leave out the line at 0 Hz.")
    period = 1.0 / rate
    scale = float(np.median(2 * np.pi * frequency)) if domain == "s" else 1.0
    wanted = frequency[:, None] + offset[None, :]
    step = max(lines.resolution, 1e-6 * float(np.max(frequency))) / STEPS
    steps, first, inverse = np.unique(np.rint(wanted / step).astype(np.int64), return_index=True, return_inverse=True)
    order = np.lexsort((steps, np.rint(steps / PART) % (STEPS / PART))) if offset.size > 1 else np.arange(steps.size)
    index = np.ascontiguousarray(np.argsort(order)[inverse].reshape(wanted.shape).T).astype(np.int64)
    breaks = 1 + np.flatnonzero(np.any(np.diff(index, axis=1) != 1, axis=0))
    grid_frequency = wanted.ravel()[first][order]
    grid_frequency[np.abs(grid_frequency) < step] = 0.0
    omega, line_omega = 2 * np.pi * grid_frequency, 2 * np.pi * frequency
    main, fold = _factors(omega, scale, differenced, lines)
    after = 1.0 / np.expm1(1j * line_omega * period) if differenced else np.ones(frequency.size, dtype=np.complex128)
    line_main, _ = _factors(line_omega, scale, False, lines)
    nodes = nodes_for(float(np.max(grid_frequency)) * period)
    k = np.concatenate((np.arange(-ALIASES, 0), np.arange(1, ALIASES + 1))).astype(np.float64)
    if not held:
        nodes, k = nodes[:0], k[:0]
    s = np.asarray(2j * np.pi * rate * (nodes[:, None] + k[None, :]).ravel(), dtype=np.complex128)
    alias_factor = np.asarray(1.0 / (s * (s / scale) ** integrators), dtype=np.complex128)
    return Plan(
        scale=scale,
        period=period,
        line=_variable(line_omega, period, scale, domain),
        line_omega=line_omega,
        line_factor=line_main,
        grid=_variable(omega, period, scale, domain),
        omega=omega,
        main=main,
        fold=fold,
        index=index,
        runs=np.concatenate(([0], breaks, [frequency.size])),
        kernel=np.ascontiguousarray(weight),
        seen=np.flatnonzero(seen),
        after=after,
        alias=np.asarray(s / scale, dtype=np.complex128),
        alias_omega=np.ascontiguousarray(s.imag),
        alias_factor=alias_factor,
        alias_number=k,
        spread=np.ascontiguousarray(interpolation(nodes, grid_frequency * period).T) if held else np.zeros((0, omega.size)),
        tail=np.ascontiguousarray(interpolation(TAIL_POINTS, nodes).T) if held else np.zeros((TAIL_POINTS.size, 0)),
    )


def _variable(omega: FloatArray, period: float, scale: float, domain: str) -> ComplexArray:
    if domain == "z":
        return np.asarray(np.exp(1j * omega * period), dtype=np.complex128)
    return np.asarray(1j * omega / scale, dtype=np.complex128)


def _factors(omega: FloatArray, scale: float, differenced: bool, lines: PlanKey) -> tuple[ComplexArray, ComplexArray]:
    """(main, fold) at each frequency; at 0 Hz the limit, or 0 where it is infinite (the data have no DC there)."""
    period, integrators = 1.0 / lines.rate, lines.integrators
    zero = omega == 0
    s = 1j * np.where(zero, 1.0, omega)
    difference = np.expm1(s * period) if differenced else np.ones_like(s)
    if lines.domain == "z":
        main = difference / np.expm1(s * period) ** integrators
        limit = 1.0 if int(differenced) == integrators else 0.0
        return np.where(zero, limit, main), np.zeros_like(s)
    hold = -np.expm1(-s * period) / period
    main = difference / (s / scale) ** integrators * (hold / s if lines.held else 1.0)
    limit = (period * scale) ** integrators if int(differenced) == integrators else 0.0
    return np.where(zero, limit, main), np.where(zero, 0.0, difference * hold)
