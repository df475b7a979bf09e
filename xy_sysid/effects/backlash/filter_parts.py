"""Parts of the filter across a gap: the contact force, and the step of the covariance."""

from __future__ import annotations

import math

from xy_sysid.effects._contract import law

FLAT = 18.0  # argument above which tanh is 1 in double precision, nearly
Four = tuple[float, float, float, float]
Covariance = tuple[float, float, float, float, float, float, float, float, float, float]  # xx, xv, xd, xw, vv, vd, vw, dd, dw, ww


@law
def contact(apart: float, rate: float, half: float, k: float, c: float, loss: float, hertz: float) -> tuple[float, float, float]:
    """Contact force, and its derivatives by ``apart`` and by ``rate``."""
    side = 1.0 if apart > 0.0 else -1.0
    depth = side * apart - half
    if depth > 0.0:
        stiffer, losses = math.sqrt(depth / half), 1.0 + loss * side * rate
        elastic = k * depth * (1.0 - hertz + hertz * stiffer)
        force = elastic * losses + c * side * rate
        if force > 0.0:
            return side * force, k * (1.0 - hertz + 1.5 * hertz * stiffer) * losses, elastic * loss + c
    return 0.0, 0.0, 0.0


@law
def smooth_sign(v: float, slow: float) -> float:
    """tanh(v / slow), three times as fast."""
    if abs(v) > FLAT * slow:
        return 1.0 if v > 0.0 else -1.0
    steep = math.exp(-2.0 * abs(v) / slow)
    return math.copysign((1.0 - steep) / (1.0 + steep), v)


@law
def _times(row: Four, p: Covariance) -> Four:
    """A row of derivatives by the state, times the covariance."""
    by_x, by_v, by_d, by_w = row
    xx, xv, xd, xw, vv, vd, vw, dd, dw, ww = p
    return (
        by_x * xx + by_v * xv + by_d * xd + by_w * xw,
        by_x * xv + by_v * vv + by_d * vd + by_w * vw,
        by_x * xd + by_v * vd + by_d * dd + by_w * dw,
        by_x * xw + by_v * vw + by_d * dw + by_w * ww,
    )


@law
def _dot(one: Four, other: Four) -> float:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2] + one[3] * other[3]


@law
def drifted(p: Covariance, h: float) -> Covariance:
    """The covariance after ``h`` s at constant speeds."""
    xx, xv, xd, xw, vv, vd, vw, dd, dw, ww = p
    return (
        xx + h * (2.0 * xv + h * vv),
        xv + h * vv,
        xd + h * (vd + xw + h * vw),
        xw + h * vw,
        vv,
        vd + h * vw,
        vw,
        dd + h * (2.0 * dw + h * ww),
        dw + h * ww,
        ww,
    )


@law
def kicked(p: Covariance, to_v: Four, to_w: Four, shaken: float) -> Covariance:
    """The covariance after a change of the speeds. to_v, to_w: derivatives of the new speed and rate by the state; shaken: added variance
    of the speed of each mass, m^2/s^2; that of the motor also enters the rate of the distance."""
    xx, _, xd, _, _, _, _, dd, _, _ = p
    v, w = _times(to_v, p), _times(to_w, p)
    return (xx, v[0], xd, w[0], _dot(to_v, v) + shaken, v[2], _dot(to_w, v) + shaken, dd, w[2], _dot(to_w, w) + 2.0 * shaken)
