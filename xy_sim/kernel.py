"""From held voltages to encoder positions: fixed fine steps, cut exactly at switching instants and at events.

Between two switching instants of the delayed voltage the step is a fixed fraction of them, so a delay of any fraction
of a sample is exact. Classical Runge-Kutta of order 4 in smooth motion. A step in which a contact or the direction of
dry friction changes is halved until the change is located within 1/4096 of it. The part ``first_order_steps`` integrates without all this.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from xy_sim import imperfections
from xy_sim.dynamics import FREE, at_the_motor, breakaway, longest_step, rates, regime, slide_length
from xy_sim.inlined import inlined
from xy_sim.layout import BASE, BRISTLE, MOTOR, MOTOR_SPEED, RATTLE, SECOND_WEAK, TABLE, TABLE_SPEED, WEAK, slot
from xy_sim.parts import dead_zone, lead_error, saturation, time_delay
from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray

IntArray = NDArray[np.int64]
Run = Callable[[FloatArray, FloatArray, FloatArray, IntArray, FloatArray, FloatArray, float, float, FloatArray | None], None]

ROWS = 7
_NOW, _NEXT, _BETWEEN, _K1, _K2, _K3, _K4 = range(ROWS)  # rows of the state table
_EVENT = 1.0 / 4096.0  # accuracy of an event's time, as a fraction of a step: 6 ns of 25 us
_DRY, _COUPLED, _ON_TABLE = slot("dry"), slot("coupled"), slot("encoder_on_table")
_COARSE, _PRE = slot("first_order_steps.step"), slot("presliding_hysteresis.coulomb")
_PLACES = (MOTOR, BASE, TABLE, RATTLE, WEAK, SECOND_WEAK)  # each is followed by its speed
_STATES = slot("states")
_DELAY, _WIDTH, _LIMIT = slot("time_delay.delay"), slot("dead_zone.width"), slot("saturation.limit")
_LEAD, _LEAD_WAVE, _LEAD_PHASE = slot("lead_error.amplitude"), slot("lead_error_wavenumber"), slot("lead_error.phase")


@inlined
def _step(p: FloatArray, y: FloatArray, n: int, t: float, dt: float, volts: float, mode: int, dirt: FloatArray | None) -> None:
    """One Runge-Kutta step of the first ``n`` states, from row NOW of ``y`` to row NEXT."""
    rates(p, y, _NOW, t, volts, mode, _K1, dirt)
    for i in range(n):
        y[_BETWEEN, i] = y[_NOW, i] + 0.5 * dt * y[_K1, i]
    rates(p, y, _BETWEEN, t + 0.5 * dt, volts, mode, _K2, dirt)
    for i in range(n):
        y[_BETWEEN, i] = y[_NOW, i] + 0.5 * dt * y[_K2, i]
    rates(p, y, _BETWEEN, t + 0.5 * dt, volts, mode, _K3, dirt)
    for i in range(n):
        y[_BETWEEN, i] = y[_NOW, i] + dt * y[_K3, i]
    rates(p, y, _BETWEEN, t + dt, volts, mode, _K4, dirt)
    for i in range(n):
        y[_NEXT, i] = y[_NOW, i] + dt / 6.0 * (y[_K1, i] + 2.0 * (y[_K2, i] + y[_K3, i]) + y[_K4, i])


@inlined
def _broken_loose(p: FloatArray, y: FloatArray, row: int, t: float, volts: float, dirt: FloatArray | None) -> int:
    """0 if dry friction can hold a motor at rest in state ``row``, else the direction in which it starts to move."""
    needed = rates(p, y, row, t, volts, 0, _K1, dirt)
    direction = 1 if needed > 0.0 else -1
    acting = at_the_motor(p, y, row, t, volts, dirt)
    return direction if abs(needed) > breakaway(p, t, float(direction), acting, dirt) else 0


@inlined
def _advance(p: FloatArray, y: FloatArray, n: int, t: float, span: float, volts: float, mode: int, dirt: FloatArray | None) -> int:
    """Advance row NOW of ``y`` by ``span`` (s) under a constant voltage; returns the friction mode at the end."""
    remaining, dt = span, span
    before = regime(p, y, _NOW)
    while remaining > 1e-9 * span:
        dt = max(longest_step(p, y[_NOW, MOTOR_SPEED], min(dt, remaining)), min(_EVENT * span, remaining))
        _step(p, y, n, t, dt, volts, mode, dirt)
        found, after = regime(p, y, _NEXT), mode
        if mode == 1 or mode == -1:
            after = mode if y[_NEXT, MOTOR_SPEED] * mode >= 0.0 else 0
        elif mode == 0:
            after = _broken_loose(p, y, _NEXT, t + dt, volts, dirt)
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
                after = _broken_loose(p, y, _NOW, t, volts, dirt)
            mode = after
    return mode


@inlined
def _first_order(p: FloatArray, y: FloatArray, n: int, t: float, dt: float, volts: float, mode: int, dirt: FloatArray | None) -> int:
    """Advance row NOW by ``dt`` (s) in one first-order step; a stop is detected at its end. Returns the friction mode."""
    rates(p, y, _NOW, t, volts, mode, _K1, dirt)
    bristle = y[_NOW, BRISTLE]
    for i in range(n):
        y[_NOW, i] += dt * y[_K1, i]
    for i in _PLACES:
        if i < n:
            y[_NOW, i] += dt * dt * y[_K1, i + 1]  # with the new speed
    speed = y[_NOW, MOTOR_SPEED]
    if p[_PRE] > 0.0:  # implicit: bristles are stiff
        y[_NOW, BRISTLE] = (bristle + dt * speed) / (1.0 + dt * abs(speed) / slide_length(p, speed, at_the_motor(p, y, _NOW, t, volts, dirt)))
    if (mode == 1 or mode == -1) and speed * mode < 0.0:
        y[_NOW, MOTOR_SPEED] = 0.0
        mode = 0
    return _broken_loose(p, y, _NOW, t + dt, volts, dirt) if mode == 0 else mode


@inlined
def _piece(p: FloatArray, y: FloatArray, n: int, t: float, span: float, volts: float, mode: int, inner: float, dirt: FloatArray | None) -> int:
    """Advance row NOW by ``span`` (s) in equal steps no longer than 1 / ``inner``; returns the friction mode."""
    if mode == 0:
        mode = _broken_loose(p, y, _NOW, t, volts, dirt)
    steps = max(math.ceil(span * inner - 1e-9), 1)
    for i in range(steps):
        mode = _advance(p, y, n, t + span * i / steps, span / steps, volts, mode, dirt)
    return mode


@inlined
def _uncommon(p: FloatArray, y: FloatArray, n: int, t: float, span: float, volts: float, mode: int, inner: float, dirt: FloatArray | None) -> int:
    """As ``_piece``, but with first-order steps if the machine has the part ``first_order_steps``."""
    if p[_COARSE] == 0.0:
        return _piece(p, y, n, t, span, volts, mode, inner, dirt)
    steps = max(math.ceil(span * inner - 1e-9), 1)
    for i in range(steps):
        mode = _first_order(p, y, n, t + span * i / steps, span / steps, volts, mode, dirt)
    return mode


@inlined
def _uncommon_sample(
    p: FloatArray, y: FloatArray, n: int, past: FloatArray, sample: int, mode: int, rate: float, inner: float, dirt: FloatArray | None
) -> int:
    """Advance row NOW by one sample with early or late voltages, or with first-order steps; returns the friction mode."""
    period, size = 1.0 / rate, past.shape[0]
    whole, _ = time_delay.samples(p[_DELAY], rate)
    begun, volts = 0.0, 0.0
    last = min(sample - whole + 1, sample)
    for arriving in range(sample - whole - 2, last + 2):  # no voltage arrives more than half a sample early or late
        ending = period
        if arriving <= last:
            ending = min((arriving - sample) * period + imperfections.late(p, p[_DELAY], period, arriving), period)
        if ending > begun + 1e-12:
            mode = _uncommon(p, y, n, sample * period + begun, ending - begun, volts, mode, inner, dirt)
            begun = ending
        volts = past[arriving % size] if 0 <= arriving <= last else 0.0
    return mode


def _build(_text: int) -> Run:
    """The compiled loop; ``_text`` is the checksum of the program text, so that a changed part is never run from an old cache."""

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
        dirt: FloatArray | None,
    ) -> None:
        """Simulates one axis over all samples of ``u`` (n,), V, and writes the position before each, without noise, into ``out`` (n,), m.

        y: (ROWS, states), the state in row 0; past: ring buffer of delayed voltages, V; counters: (3,) sample number, friction mode,
        checksum; rate, inner: samples and inner steps per second, Hz; dirt: p again if there are imperfections, else None.
        y, past and counters are changed.
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
            if dirt is not None:
                speed = y[_NOW, TABLE_SPEED] if p[_ON_TABLE] != 0.0 else y[_NOW, MOTOR_SPEED]
                out[row] += imperfections.too_much(dirt, seen, speed, sample)
            past[sample % size] = saturation.output(p[_LIMIT], dead_zone.output(p[_WIDTH], u[row]))
            t = sample / rate
            now = past[(sample - whole) % size] if sample >= whole else 0.0
            mode = counters[1]
            if dirt is not None:
                mode = _uncommon_sample(p, y, n, past, sample, mode, rate, inner, dirt)
            else:
                if rest > 0.0:
                    before = past[(sample - whole - 1) % size] if sample >= whole + 1 else 0.0
                    mode = _piece(p, y, n, t, rest, before, mode, inner, dirt)
                mode = _piece(p, y, n, t + rest, 1.0 / rate - rest, now, mode, inner, dirt)
            counters[0], counters[1] = sample + 1, mode

    return run


def _fingerprint() -> int:
    """Checksum of every file that is compiled into the loop."""
    folder = Path(__file__).parent
    files = sorted([*folder.glob("*.py"), *(folder / "parts").glob("*.py")])
    return zlib.crc32(b"".join(file.read_bytes() for file in files))


run: Run = _build(_fingerprint())
