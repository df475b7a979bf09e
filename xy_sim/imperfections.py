"""The imperfections ("dirt") of a machine; the kernel of a machine without any does not call this file.

The laws are in the parts; this file combines them.
"""

from __future__ import annotations

from xy_sim.inlined import inlined
from xy_sim.layout import CABLE, SECOND_WEAK, SECOND_WEAK_SPEED, WEAK, WEAK_SPEED, slot
from xy_sim.parts import cable_pull, curve, late_drive, mains_hum, sample_jitter, uneven_lines, weak_modes
from xy_sysid.samples.block import FloatArray

_DRAG, _DRAG_LENGTH, _DRAG_CURVE = slot("uneven_drag.depth"), slot("uneven_drag.length"), slot("uneven_drag.curve.0")
_GAIN, _GAIN_LENGTH, _GAIN_CURVE = slot("uneven_gain.depth"), slot("uneven_gain.length"), slot("uneven_gain.curve.0")
_WANDER, _WANDER_TIME, _WANDER_CURVE = slot("gain_wander.depth"), slot("gain_wander.time"), slot("gain_wander.curve.0")
_RUB, _RUB_TIME, _RUB_CURVE = slot("friction_wander.depth"), slot("friction_wander.time"), slot("friction_wander.curve.0")
_PULL, _PULL_REACH = slot("cable_pull.pull"), slot("cable_pull.reach")
_PULL_LENGTH, _PULL_CURVE = slot("cable_pull.length"), slot("cable_pull.curve.0")
_RIPPLE, _RECTIFIED = slot("mains_hum.ripple"), slot("mains_hum.rectified")
_MAINS, _MAINS_PHASE = slot("mains_hum.mains"), slot("mains_hum.phase")
_MASS, _FREQUENCY, _DAMPING = slot("weak_modes.mass"), slot("weak_modes.frequency"), slot("weak_modes.damping")
_MASS2, _FREQUENCY2 = slot("weak_modes.second_mass"), slot("weak_modes.second_frequency")
_JITTER, _JITTER_SEED = slot("sample_jitter.largest"), slot("sample_jitter.seed")
_FINE, _WAVE = slot("uneven_lines.fine"), slot("uneven_lines.wave")
_LINE, _LINE_LENGTH, _LINE_CURVE = slot("uneven_lines.period"), slot("uneven_lines.length"), slot("uneven_lines.curve.0")
_LATE, _LATE_SEED = slot("late_drive.largest"), slot("late_drive.seed")


@inlined
def gain_and_drag(p: FloatArray, t: float, q: float) -> tuple[float, float]:
    """Force per volt and drag, each relative to its nominal value, at ``t`` (s) and ``q`` (m)."""
    gain, drag = 1.0, 1.0
    if p[_WANDER] != 0.0:
        gain = curve.around_one(p, _WANDER_CURVE, p[_WANDER], t / p[_WANDER_TIME])
    if p[_GAIN] != 0.0:
        uneven = curve.around_one(p, _GAIN_CURVE, p[_GAIN], q / p[_GAIN_LENGTH])
        gain *= uneven
        drag = uneven * uneven
    if p[_DRAG] != 0.0:
        drag *= curve.around_one(p, _DRAG_CURVE, p[_DRAG], q / p[_DRAG_LENGTH])
    return gain, drag


@inlined
def hum(p: FloatArray, t: float) -> float:
    """Mains hum at ``t`` (s), V."""
    return mains_hum.volts(p[_RIPPLE], p[_RECTIFIED], p[_MAINS], p[_MAINS_PHASE], t) if p[_MAINS] != 0.0 else 0.0


@inlined
def friction(p: FloatArray, t: float) -> float:
    """Total friction relative to its nominal value, at ``t`` (s)."""
    return curve.around_one(p, _RUB_CURVE, p[_RUB], t / p[_RUB_TIME]) if p[_RUB] != 0.0 else 1.0


@inlined
def cable(p: FloatArray, y: FloatArray, i: int, x: float, v: float, o: int) -> float:
    """Force of the cable on the table at ``x`` (m) and ``v`` (m/s), V; writes the rate of its bend into row ``o`` of ``y``."""
    if p[_PULL] == 0.0:
        return 0.0
    z = y[i, CABLE]
    y[o, CABLE] = cable_pull.rate(z, v, p[_PULL_REACH])
    return cable_pull.force(p, _PULL_CURVE, p[_PULL], p[_PULL_REACH], p[_PULL_LENGTH], x, z)


@inlined
def modes(p: FloatArray, y: FloatArray, i: int, x: float, v: float, o: int) -> float:
    """Force of the table on its weak modes, N; writes their rates on a base at rest into row ``o`` of ``y``."""
    total = 0.0
    if p[_MASS] > 0.0:
        first = weak_modes.force(p[_MASS], p[_FREQUENCY], p[_DAMPING], x - y[i, WEAK], v - y[i, WEAK_SPEED])
        y[o, WEAK], y[o, WEAK_SPEED] = y[i, WEAK_SPEED], first / p[_MASS]
        total = first
    if p[_MASS2] > 0.0:
        second = weak_modes.force(p[_MASS2], p[_FREQUENCY2], p[_DAMPING], x - y[i, SECOND_WEAK], v - y[i, SECOND_WEAK_SPEED])
        y[o, SECOND_WEAK], y[o, SECOND_WEAK_SPEED] = y[i, SECOND_WEAK_SPEED], second / p[_MASS2]
        total += second
    return total


@inlined
def on_a_moving_base(p: FloatArray, y: FloatArray, o: int, of_base: float) -> None:
    """Correct the weak modes' rates in row ``o`` of ``y`` for the acceleration ``of_base`` of the base, m/s2."""
    if p[_MASS] > 0.0:
        y[o, WEAK_SPEED] -= of_base
    if p[_MASS2] > 0.0:
        y[o, SECOND_WEAK_SPEED] -= of_base


@inlined
def too_much(p: FloatArray, q: float, v: float, sample: int) -> float:
    """Error of the encoder reading at ``q`` (m) and ``v`` (m/s), m."""
    late = sample_jitter.shift(p[_JITTER], p[_JITTER_SEED], v, sample)
    if p[_LINE] == 0.0:
        return late
    return late + uneven_lines.error(p, _LINE_CURVE, p[_FINE], p[_WAVE], p[_LINE], p[_LINE_LENGTH], q + late)


@inlined
def late(p: FloatArray, delay: float, period: float, sample: int) -> float:
    """Time from the instant of a voltage sample to its effect, s, at most half a sample from ``delay``."""
    error = late_drive.lateness(min(p[_LATE], 0.5 * period), p[_LATE_SEED], sample)
    return max(delay + error, 0.0)
