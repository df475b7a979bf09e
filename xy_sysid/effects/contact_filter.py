"""Two masses that touch across a gap, followed sample by sample: an extended Kalman filter on the motor's position.

State: motor position (x) and speed (v), motor minus table (d), its rate (w). Flanks push as k depth (1 + loss speed) + c speed
and never pull (Hunt & Crossley, J. Appl. Mech. 42, 1975, eq. 8). The motor rubs by the laws of Coulomb friction, Stribeck
friction, presliding hysteresis or friction that differs between the directions; the deflection of the bristles follows the
motor's position and is corrected with it. Forces of effects that are ``on_table`` act on the table. Integrated by the explicit
midpoint rule within each of a sample's two pieces of constant voltage (the filter: Jazwinski, Stochastic Processes and
Filtering Theory, 1970, sec. 8.3).
"""

from __future__ import annotations

import math

from xy_sysid.compiled import compiled
from xy_sysid.effects.presliding_hysteresis import bend
from xy_sysid.effects.presliding_hysteresis import force as bristle_force
from xy_sysid.effects.stribeck_friction import level
from xy_sysid.stream import FloatArray

NAMES = (
    "gain",
    "delay",
    "pole",
    "gap",
    "share",
    "rate",
    "damping",
    "loss",
    "guide",
    "coulomb",
    "excess",
    "velocity",
    "length",
    "bristle_damping",
    "asymmetry",
)
SLOW = 1e-3  # m/s at which the smoothed friction reaches its level
FAST = 18.0 * SLOW  # m/s above which nothing of that is left

Four = tuple[float, float, float, float]
Covariance = tuple[float, float, float, float, float, float, float, float, float, float]  # xx, xv, xd, xw, vv, vd, vw, dd, dw, ww


@compiled
def _push(depth_of: float, rate: float, half: float, k: float, c: float, loss: float) -> tuple[float, float, float]:
    """Force of the contact, and its derivatives by distance and by its rate."""
    if depth_of > half:
        depth = depth_of - half
        force = k * depth * (1.0 + loss * rate) + c * rate
        if force > 0.0:
            return force, k * (1.0 + loss * rate), k * depth * loss + c
    elif depth_of < -half:
        depth = depth_of + half
        force = k * depth * (1.0 - loss * rate) + c * rate
        if force < 0.0:
            return force, k * (1.0 - loss * rate), -k * depth * loss + c
    return 0.0, 0.0, 0.0


@compiled
def _rub(v: float, z: float, dry: float, excess: float, velocity: float, length: float, damping: float, bristles: bool) -> tuple[float, float, float]:
    """Friction in V, and its derivatives by speed and by position (bristles of deflection ``z`` follow it)."""
    if bristles:
        still = 1.0 - (z if v > 0.0 else -z) / length
        return bristle_force(dry, length, damping, z, v, 0.0), damping * still, dry / length * still
    steep = math.exp(-2.0 * abs(v) / SLOW) if abs(v) < FAST else 0.0
    smooth = math.copysign((1.0 - steep) / (1.0 + steep), v)  # tanh(v / SLOW), in a third of its time
    size = level(excess, dry, velocity, v) if excess > 0.0 else dry
    return size * smooth, size * (1.0 - smooth * smooth) / SLOW - 2.0 * v / (velocity * velocity) * (size - dry) * smooth, 0.0


@compiled
def _times(row: Four, p: Covariance) -> Four:
    """A row by the state, times the covariance."""
    by_x, by_v, by_d, by_w = row
    xx, xv, xd, xw, vv, vd, vw, dd, dw, ww = p
    return (
        by_x * xx + by_v * xv + by_d * xd + by_w * xw,
        by_x * xv + by_v * vv + by_d * vd + by_w * vw,
        by_x * xd + by_v * vd + by_d * dd + by_w * dw,
        by_x * xw + by_v * vw + by_d * dw + by_w * ww,
    )


@compiled
def _dot(one: Four, other: Four) -> float:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2] + one[3] * other[3]


@compiled
def _spread_on(p: Covariance, of_v: Four, of_w: Four, h: float, drift: float) -> Covariance:
    """The covariance ``h`` s on, to first order. of_v, of_w: derivatives, by the state, of what changes the speed and the distance's rate."""
    xx, xv, xd, xw, vv, vd, vw, dd, dw, ww = p
    to_v = (h * of_v[0], 1.0 + h * of_v[1], h * of_v[2], h * of_v[3])
    to_w = (h * of_w[0], h * of_w[1], h * of_w[2], 1.0 + h * of_w[3])
    x = (xx + h * xv, xv + h * vv, xd + h * vd, xw + h * vw)
    v = _times(to_v, p)
    d = (xd + h * xw, vd + h * vw, dd + h * dw, dw + h * ww)
    w = _times(to_w, p)
    shared = drift * h  # what shakes the motor shakes the distance, too
    return (
        x[0] + h * x[1],
        _dot(to_v, x),
        x[2] + h * x[3],
        _dot(to_w, x),
        _dot(to_v, v) + shared,
        v[2] + h * v[3],
        _dot(to_w, v) + shared,
        d[2] + h * d[3],
        _dot(to_w, d),
        _dot(to_w, w) + 2.0 * shared,
    )


@compiled
def innovations(
    u: FloatArray,
    y: FloatArray,
    against: FloatArray,
    values: FloatArray,
    bristles: bool,
    fs: float,
    noise: float,
    drift: float,
    cuts: int,
    out: FloatArray,
) -> None:
    """One pass of the filter: (n,) measured minus predicted position, m.

    u: (n,) V; against: (2, n) V, forces at the motor and on the table, without delay; y: (n + 1,) m; values: by ``NAMES``
    bristles: is friction theirs? noise: variance of the encoder, m^2; drift: of the speeds, m^2/s^3
    """
    gain, delay, pole, gap, share = values[0], values[1], values[2], values[3], values[4]
    reduced = share * (1.0 - share)
    k, c, loss = reduced * values[5] ** 2, 2.0 * reduced * values[6] * values[5], values[7]
    guide, dry, excess, velocity, length, bristle, asymmetry = values[8], values[9], values[10], values[11], values[12], values[13], values[14]
    per_volt, rubs = pole * abs(gain), dry + excess > 0.0
    drag_motor, drag_table = pole * (1.0 - guide), pole * guide
    per_motor, per_table = 1.0 / share, 1.0 / (1.0 - share)
    steady = per_volt * asymmetry * dry  # beside friction that is the same both ways
    half = 0.5 * gap
    late = delay * fs
    whole = int(late)
    part = late - whole
    p = (noise, 0.0, 0.0, 0.0, 1e-8, 0.0, 0.0, half * half + 1e-14, 0.0, 1e-8)
    x, v, d, w, z, zm = y[0], 0.0, 0.0, 0.0, 0.0, 0.0
    rub, slip, spring = 0.0, 0.0, 0.0
    for i in range(out.shape[0]):
        for piece in range(2):
            h = (part if piece == 0 else 1.0 - part) / fs / cuts
            if h <= 0.0:
                continue
            at = i - whole - 1 + piece
            push = pole * gain * ((u[at] if at >= 0 else 0.0) - against[0, i]) - steady
            hold = pole * gain * against[1, i]
            for _ in range(cuts):
                force, _by_d, _by_w = _push(d, w, half, k, c, loss)
                if rubs:
                    rub = per_volt * _rub(v, z, dry, excess, velocity, length, bristle, bristles)[0]
                a = (push - rub - drag_motor * v - force) * per_motor
                r = a - (force - drag_table * (v - w) - hold) * per_table
                vm, dm, wm = v + 0.5 * h * a, d + 0.5 * h * w, w + 0.5 * h * r
                force, by_d, by_w = _push(dm, wm, half, k, c, loss)
                if rubs:
                    if bristles:
                        zm = bend(dry, length, z, vm, 0.5 * h, 0.0)
                        z = bend(dry, length, zm, vm, 0.5 * h, 0.0)
                    rub, slip, spring = _rub(vm, zm, dry, excess, velocity, length, bristle, bristles)
                    rub, slip, spring = per_volt * rub, per_volt * slip, per_volt * spring
                a = (push - rub - drag_motor * vm - force) * per_motor
                r = a - (force - drag_table * (vm - wm) - hold) * per_table
                x, v, d, w = x + h * vm, v + h * a, d + h * wm, w + h * r
                v_x = -spring * per_motor
                v_v, v_d, v_w = -(drag_motor + slip) * per_motor, -by_d * per_motor, -by_w * per_motor
                w_v, w_d, w_w = v_v + drag_table * per_table, v_d - by_d * per_table, v_w - (by_w + drag_table) * per_table
                p = _spread_on(p, (v_x, v_v, v_d, v_w), (v_x, w_v, w_d, w_w), h, drift)
        xx, xv, xd, xw, vv, vd, vw, dd, dw, ww = p
        seen = xx + noise
        error = y[i + 1] - x
        out[i] = error
        k0, k1, k2, k3 = xx / seen, xv / seen, xd / seen, xw / seen
        if bristles:
            z += k0 * error * (1.0 - (z if v > 0.0 else -z) / length)
        x, v, d, w = x + k0 * error, v + k1 * error, d + k2 * error, w + k3 * error
        p = (
            xx - k0 * xx,
            xv - k0 * xv,
            xd - k0 * xd,
            xw - k0 * xw,
            vv - k1 * xv,
            vd - k1 * xd,
            vw - k1 * xw,
            dd - k2 * xd,
            dw - k2 * xw,
            ww - k3 * xw,
        )
