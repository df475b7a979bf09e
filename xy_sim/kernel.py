"""From held voltages to encoder positions: fixed fine steps, cut exactly at switching instants and at events.

Between two switching instants of the delayed voltage the step is a fixed fraction of them, so a delay of any fraction
of a sample is exact. Classical Runge-Kutta of order 4 in smooth motion; a step over which a contact or the direction of
dry friction changes is halved until the change lies within 1/4096 of it.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from xy_sim.dynamics import FREE, dry_level, longest_step, rates, regime
from xy_sim.inlined import inlined
from xy_sim.layout import MOTOR, MOTOR_SPEED, TABLE, TABLE_SPEED, slot
from xy_sim.parts import dead_zone, lead_error, saturation, time_delay
from xy_sysid.compiled import compiled
from xy_sysid.stream import FloatArray

IntArray = NDArray[np.int64]
Run = Callable[[FloatArray, FloatArray, FloatArray, IntArray, FloatArray, FloatArray, float, float], None]

ROWS = 7
_NOW, _NEXT, _BETWEEN, _K1, _K2, _K3, _K4 = range(ROWS)  # rows of the state table
_EVENT = 1.0 / 4096.0  # of a step: how finely an event is located; 6 ns of 25 us
_FORCE, _DRY, _COUPLED, _ON_TABLE = slot("force_per_volt"), slot("dry"), slot("coupled"), slot("encoder_on_table")
_STATES = slot("states")
_DELAY, _WIDTH, _LIMIT = slot("time_delay.delay"), slot("dead_zone.width"), slot("saturation.limit")
_LEAD, _LEAD_WAVE, _LEAD_PHASE = slot("lead_error.amplitude"), slot("lead_error_wavenumber"), slot("lead_error.phase")


@inlined
def _step(p: FloatArray, y: FloatArray, n: int, t: float, dt: float, volts: float, mode: int) -> None:
    """One Runge-Kutta step of the first ``n`` states, from row NOW of ``y`` to row NEXT."""
    rates(p, y, _NOW, t, volts, mode, _K1)
    for i in range(n):
        y[_BETWEEN, i] = y[_NOW, i] + 0.5 * dt * y[_K1, i]
    rates(p, y, _BETWEEN, t + 0.5 * dt, volts, mode, _K2)
    for i in range(n):
        y[_BETWEEN, i] = y[_NOW, i] + 0.5 * dt * y[_K2, i]
    rates(p, y, _BETWEEN, t + 0.5 * dt, volts, mode, _K3)
    for i in range(n):
        y[_BETWEEN, i] = y[_NOW, i] + dt * y[_K3, i]
    rates(p, y, _BETWEEN, t + dt, volts, mode, _K4)
    for i in range(n):
        y[_NEXT, i] = y[_NOW, i] + dt / 6.0 * (y[_K1, i] + 2.0 * (y[_K2, i] + y[_K3, i]) + y[_K4, i])


@inlined
def _broken_loose(p: FloatArray, y: FloatArray, row: int, t: float, volts: float) -> int:
    """0 if dry friction can hold a motor at rest in state ``row``, else the direction in which it starts."""
    needed = rates(p, y, row, t, volts, 0, _K1)
    direction = 1 if needed > 0.0 else -1
    return direction if abs(needed) > p[_FORCE] * dry_level(p, 0.0, float(direction)) else 0


@inlined
def _advance(p: FloatArray, y: FloatArray, n: int, t: float, span: float, volts: float, mode: int) -> int:
    """Moves row NOW of ``y`` on by ``span`` (s) under a constant voltage; returns the friction mode at the end."""
    remaining, dt = span, span
    before = regime(p, y, _NOW)
    while remaining > 1e-9 * span:
        dt = max(longest_step(p, y[_NOW, MOTOR_SPEED], min(dt, remaining)), min(_EVENT * span, remaining))
        _step(p, y, n, t, dt, volts, mode)
        found, after = regime(p, y, _NEXT), mode
        if mode == 1 or mode == -1:
            after = mode if y[_NEXT, MOTOR_SPEED] * mode >= 0.0 else 0
        elif mode == 0:
            after = _broken_loose(p, y, _NEXT, t + dt, volts)
        if (after != mode or found != before) and dt > _EVENT * span:
            dt *= 0.5
            continue
        for i in range(n):
            y[_NOW, i] = y[_NEXT, i]
        t += dt
        remaining -= dt
        dt *= 2.0
        before = found
        if after != mode:
            if mode != 0:
                y[_NOW, MOTOR_SPEED] = 0.0
                after = _broken_loose(p, y, _NOW, t, volts)
            mode = after
    return mode


@inlined
def _piece(p: FloatArray, y: FloatArray, n: int, t: float, span: float, volts: float, mode: int, inner: float) -> int:
    """Moves row NOW on by ``span`` (s) in equal steps no longer than 1 / ``inner``; returns the friction mode."""
    if mode == 0:
        mode = _broken_loose(p, y, _NOW, t, volts)
    steps = max(math.ceil(span * inner - 1e-9), 1)
    for i in range(steps):
        mode = _advance(p, y, n, t + span * i / steps, span / steps, volts, mode)
    return mode


def _build(_text: int) -> Run:
    """The compiled loop; ``_text`` identifies the program text, so that a changed part is never run from a stale cache."""

    @compiled
    def run(
        p: FloatArray,
        y: FloatArray,
        past: FloatArray,
        counters: IntArray,
        u: FloatArray,
        out: FloatArray,
        rate: float,
        inner: float,
    ) -> None:
        """Steps one axis over all of ``u`` (V) and writes what the encoder's disk shows before each into ``out`` (m).

        y: (ROWS, states), the state in row 0; past: ring of voltages on their way; counters: sample number, friction mode;
        rate, inner: samples and inner steps per second, Hz. y, past and counters are changed.
        """
        counters[2] = _text
        whole, rest = time_delay.samples(p[_DELAY], rate)
        size, n = past.shape[0], int(p[_STATES])
        for row in range(u.shape[0]):
            sample = counters[0]
            if sample == 0:
                counters[1] = 0 if p[_DRY] != 0.0 else FREE
            if p[_COUPLED] == 0.0:
                y[_NOW, TABLE], y[_NOW, TABLE_SPEED] = y[_NOW, MOTOR], y[_NOW, MOTOR_SPEED]
            seen = y[_NOW, TABLE] if p[_ON_TABLE] != 0.0 else y[_NOW, MOTOR]
            out[row] = lead_error.reading(p[_LEAD], p[_LEAD_WAVE], p[_LEAD_PHASE], seen)
            past[sample % size] = saturation.output(p[_LIMIT], dead_zone.output(p[_WIDTH], u[row]))
            t = sample / rate
            now = past[(sample - whole) % size] if sample >= whole else 0.0
            mode = counters[1]
            if rest > 0.0:
                before = past[(sample - whole - 1) % size] if sample >= whole + 1 else 0.0
                mode = _piece(p, y, n, t, rest, before, mode, inner)
            mode = _piece(p, y, n, t + rest, 1.0 / rate - rest, now, mode, inner)
            counters[0], counters[1] = sample + 1, mode

    return run


def _fingerprint() -> int:
    """Check sum of every file that is compiled into the loop."""
    folder = Path(__file__).parent
    files = sorted([*folder.glob("*.py"), *(folder / "parts").glob("*.py")])
    return zlib.crc32(b"".join(file.read_bytes() for file in files))


run: Run = _build(_fingerprint())
