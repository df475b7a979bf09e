"""Base and resonances over a part of a sample, as power series in time: the linear part of every printed simulation.

A state is (x, v, q_0 .. q_(m-1)) as in ``axis.resonant_loop``, n = m + 3 with the force that drives it; ``a`` is its generator (n, n) in one
row. The sub-steps are so short that ten powers are exact to 1e-9. These functions are printed in other languages, so they use numbers,
loops and flat arrays only.
"""

from __future__ import annotations

from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray

TERMS = 10
ROUNDS = 60  # of Newton's method, safeguarded by bisection


@compiled
def unfold(a: FloatArray, n: int, s: FloatArray, force: float, w: FloatArray) -> None:
    """Write to w the state as a power series in time from now on, under a constant force."""
    for i in range(n - 1):
        w[i] = s[i]
    w[n - 1] = force
    for k in range(1, TERMS):
        for i in range(n):
            total = 0.0
            for j in range(1, n):
                total += a[i * n + j] * w[(k - 1) * n + j]
            w[k * n + i] = total / k


@compiled
def follow(n: int, w: FloatArray, h: float, s: FloatArray) -> None:
    """The state after ``h`` s."""
    for i in range(n - 1):
        total = 0.0
        for k in range(TERMS):
            total = total * h + w[(TERMS - 1 - k) * n + i]
        s[i] = total


@compiled
def speed_after(n: int, w: FloatArray, h: float) -> float:
    """Speed after ``h`` s, m/s."""
    total = 0.0
    for k in range(TERMS):
        total = total * h + w[(TERMS - 1 - k) * n + 1]
    return total


@compiled
def stops_after(n: int, w: FloatArray, h: float) -> float:
    """Zero crossing of the speed between 0 and ``h``, s."""
    low = 0.0
    high = h
    t = 0.5 * h
    if w[n + 1] != 0.0:
        t = -w[1] / w[n + 1]
    for _ in range(ROUNDS):
        if not (low < t and t < high):
            t = 0.5 * (low + high)
        value = 0.0
        slope = 0.0
        for k in range(TERMS):
            slope = slope * t + value
            value = value * t + w[(TERMS - 1 - k) * n + 1]
        if (value < 0.0) == (w[1] < 0.0):
            low = t
        else:
            high = t
        change = h
        if slope != 0.0:
            change = value / slope
        t = t - change
        if abs(change) < 1e-12 * h:
            break
    return min(max(t, 0.0), h)


@compiled
def tug(a: FloatArray, n: int, s: FloatArray) -> float:
    """Force of the attached masses at this instant, V."""
    total = 0.0
    for j in range(2, n - 1):
        total += a[n + j] * s[j] / a[n + n - 1]
    return total
