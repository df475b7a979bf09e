"""What the filter across a gap is made of: the force of the contact, and how the covariance goes on."""

from __future__ import annotations

from xy_sysid.effects._contract import law

Four = tuple[float, float, float, float]
Covariance = tuple[float, float, float, float, float, float, float, float, float, float]  # xx, xv, xd, xw, vv, vd, vw, dd, dw, ww


@law
def contact(depth_of: float, rate: float, half: float, k: float, c: float, loss: float) -> tuple[float, float, float]:
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


@law
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


@law
def _dot(one: Four, other: Four) -> float:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2] + one[3] * other[3]


@law
def spread_on(p: Covariance, of_v: Four, of_w: Four, h: float, drift: float) -> Covariance:
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
