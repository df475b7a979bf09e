"""Resonances inside the loop: friction acts on the motion that the encoder sees, not on the rigid one.

Base and resonances together are one linear system from the force (in volts) to the speed v at the encoder,

    v = gain pole / (s + pole) prod_i H_i(s) (u - friction),   H_i = Z_i(s) / P_i(s),

whose order is 1 + m, with m = 2 per resonance. It is split at the point where friction acts, with sigma = s / rate and
Z = prod Z_i = sigma^m + sum z_j sigma^j:

    v'   = rate (strength (u - friction) - drag v - sum c_j q_j)
    q_j' = rate q_(j+1),   q_(m-1)' = rate (v - sum z_j q_j)

so that drag and c are the remainder of (sigma + pole / rate) prod P_i after division by Z. The q are the masses attached
to the encoder's side: base on its feet (Preumont, Vibration Control of Active Structures, 3rd ed., sec. 2.4) or table on
the screw; with v held at zero they swing freely, at the zeros. Between changes of the force all of this is exact
(matrix exponential; Moler & Van Loan, SIAM Review 45 (2003), method 3).

A state is a row (x, v, q_0 .. q_(m-1), force), (m + 3,); its generator holds the force constant.
"""

from __future__ import annotations

import math

import numpy as np

from xy_sysid.jit import compiled, inlined
from xy_sysid.samples.block import FloatArray

FINE = 1e5  # Hz at which the roots of a section are computed: far above any resonance, so that there is no aliasing
TERMS = 10  # terms of a power series within a sub-step; as STIFF is 0.5, the first omitted term is below 1e-10
STIFF = 0.5  # longest sub-step times the fastest rate
ONE_MODE = 5  # length of a state with one resonance, the usual case, whose sums are unrolled
CUTS = 0.004  # s: limit of sub-steps per sample over the requested rate, Hz, for any stiffness: the first round of a fit must not take minutes


@compiled
def roots(c1: float, c2: float, rate: float) -> tuple[float, float]:
    """a0, a1 of sigma^2 + a1 sigma + a0, sigma = s / rate, for z^2 + c1 z + c2 at FINE, z = exp(s / FINE); nan if there is none."""
    if not c2 > 0.0:
        return math.nan, math.nan
    middle, cosine = 0.5 * math.log(c2), -0.5 * c1 / math.sqrt(c2)
    if not cosine > -1.0:
        return math.nan, math.nan
    turn = math.acos(cosine) ** 2 if cosine <= 1.0 else -(math.acosh(cosine) ** 2)
    scale = FINE / rate
    return (middle * middle + turn) * scale * scale, -2.0 * middle * scale


@compiled
def times(first: FloatArray, second: FloatArray) -> FloatArray:
    """Product of two polynomials, lowest power first."""
    product = np.zeros(first.size + second.size - 1)
    for i in range(first.size):
        for j in range(second.size):
            product[i + j] += first[i] * second[j]
    return product


@compiled
def generator(gain: float, pole: float, top: FloatArray, bottom: FloatArray, rate: float) -> FloatArray:
    """(m + 3, m + 3) rate of change of a state, 1/s.

    top, bottom: products of the resonances' zeros and poles in sigma, (m + 1,), lowest power first, the highest is 1
    """
    whole = times(np.array([pole / rate, 1.0]), bottom)
    m = top.size - 1
    made = np.zeros((m + 3, m + 3))
    made[0, 1] = 1.0
    drag = whole[m] - top[m - 1]
    made[1, 1] = -drag * rate
    made[1, m + 2] = gain * whole[0] / top[0] * rate
    for j in range(m):
        made[1, 2 + j] = -(whole[j] - (top[j - 1] if j > 0 else 0.0) - drag * top[j]) * rate
        if j < m - 1:
            made[2 + j, 3 + j] = rate
        made[m + 1, 2 + j] = -top[j] * rate
    made[m + 1, 1] = rate
    return made


@compiled
def resting(moving: FloatArray) -> FloatArray:
    """The generator while friction holds v at zero."""
    made = moving.copy()
    for j in range(made.shape[1]):
        made[0, j] = made[1, j] = 0.0
    return made


@compiled
def fastest(pole: float, bottom: FloatArray, rate: float) -> float:
    """Upper bound of the rates of the full system, rad/s, within a factor of 2 (Fujiwara 1916)."""
    found = pole / rate
    m = bottom.size - 1
    for k in range(1, m + 1):
        found = max(found, abs(bottom[m - k]) ** (1.0 / k))
    return found * rate


@compiled
def product(a: FloatArray, b: FloatArray) -> FloatArray:
    """a b of two square matrices."""
    n = a.shape[0]
    made = np.zeros((n, n))
    for i in range(n):
        for k in range(n):
            for j in range(n):
                made[i, j] += a[i, k] * b[k, j]
    return made


@compiled
def exponential(a: FloatArray, h: float) -> FloatArray:
    """exp(a h) by scaling and squaring. Written with loops: array expressions take ten times as long to compile."""
    n, norm = a.shape[0], 0.0
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += abs(a[i, j])
        norm = max(norm, total * h)
    halvings = max(math.ceil(math.log2(norm / 0.25)), 0) if norm > 0.0 else 0
    scale = h / 2.0**halvings
    small, made, term = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    for i in range(n):
        made[i, i] = term[i, i] = 1.0
        for j in range(n):
            small[i, j] = a[i, j] * scale
    for k in range(1, 13):
        term = product(term, small)
        for i in range(n):
            for j in range(n):
                term[i, j] /= k
                made[i, j] += term[i, j]
    for _ in range(halvings):
        made = product(made, made)
    return made


@compiled
def exponentials(a: FloatArray, first: float, second: float) -> FloatArray:
    """(2, n, n) exp(a h) for two steps h. Assigning a full matrix would make numba compile its error text for another shape, which takes 3 s."""
    n = a.shape[0]
    made = np.empty((2, n, n))
    for piece in range(2):
        over = exponential(a, first if piece == 0 else second)
        for i in range(n):
            for j in range(n):
                made[piece, i, j] = over[i, j]
    return made


@inlined
def ahead(by: FloatArray, piece: int, state: FloatArray, force: float) -> float:
    """Speed at the end of a sub-step under a constant force."""
    n = state.size
    if n == ONE_MODE:
        only: float = by[piece, 1, 4] * force + by[piece, 1, 1] * state[1] + by[piece, 1, 2] * state[2] + by[piece, 1, 3] * state[3]
        return only
    total: float = by[piece, 1, n - 1] * force
    for j in range(1, n - 1):
        total += by[piece, 1, j] * state[j]
    return total


@inlined
def step(by: FloatArray, piece: int, state: FloatArray, force: float, spare: FloatArray) -> float:
    """Advance the state by a sub-step; returns the distance, m."""
    n = state.size
    if n == ONE_MODE:
        v, a, b = state[1], state[2], state[3]
        for i in range(ONE_MODE - 1):
            state[i] = by[piece, i, 1] * v + by[piece, i, 2] * a + by[piece, i, 3] * b + by[piece, i, 4] * force
        state[ONE_MODE - 1] = force
        covered: float = state[0]
        return covered
    state[0], state[n - 1] = 0.0, force
    for i in range(n - 1):
        total = 0.0
        for j in range(1, n):
            total += by[piece, i, j] * state[j]
        spare[i] = total
    for i in range(n - 1):
        state[i] = spare[i]
    distance: float = spare[0]
    return distance


@inlined
def tug(moving: FloatArray, state: FloatArray) -> float:
    """Force of the attached masses at this instant, V."""
    n = state.size
    total: float = 0.0
    for j in range(2, n - 1):
        total += moving[1, j] * state[j] / moving[1, n - 1]
    return total


@compiled
def unfold(a: FloatArray, state: FloatArray, force: float, series: FloatArray) -> None:
    """Write to series (TERMS, m + 3) the state as a power series in time from now on."""
    n = state.size
    for i in range(n):
        series[0, i] = state[i]
    series[0, 0], series[0, n - 1] = 0.0, force
    for k in range(1, TERMS):
        for i in range(n):
            total = 0.0
            for j in range(1, n):
                total += a[i, j] * series[k - 1, j]
            series[k, i] = total / k


@compiled
def follow(series: FloatArray, t: float, state: FloatArray) -> float:
    """The state after ``t`` s of its series; returns the distance, m."""
    for i in range(state.size):
        total = 0.0
        for k in range(TERMS):
            total = total * t + series[TERMS - 1 - k, i]
        state[i] = total
    distance: float = state[0]
    return distance


@compiled
def crossing(powers: FloatArray, h: float) -> float:
    """Zero crossing of a polynomial (TERMS,), lowest power first, between 0 and ``h``: Newton's method, safeguarded by bisection."""
    low, high, rising = 0.0, h, powers[0] < 0.0
    slope = powers[1]
    t = -powers[0] / slope if slope != 0.0 else 0.5 * h
    for _ in range(60):
        if not low < t < high:
            t = 0.5 * (low + high)
        value = slope = 0.0
        for k in range(TERMS):
            slope = slope * t + value
            value = value * t + powers[TERMS - 1 - k]
        if (value < 0.0) == rising:
            low = t
        else:
            high = t
        change = value / slope if slope != 0.0 else h
        t -= change
        if abs(change) < 1e-12 * h:
            break
    return min(max(t, 0.0), h)


@compiled
def stop(
    moving: FloatArray, still: FloatArray, state: FloatArray, push: float, force: float, forth: float, back: float, h: float, series: FloatArray
) -> float:
    """A sub-step within which v reaches zero: then it sticks or reverses; returns the distance, m.

    push: without friction, V; force: with that of the motion until now, V; forth, back: levels at rest, V, along the voltage
    """
    gone = 0.0
    moved = 0.0
    if state[1] != 0.0:
        unfold(moving, state, force, series)
        gone = crossing(series[:, 1].copy(), h)
        moved = follow(series, gone, state)
        state[1] = 0.0
    needed = push + tug(moving, state)
    if needed > forth:
        unfold(moving, state, push - forth, series)
    elif needed < -back:
        unfold(moving, state, push + back, series)
    else:
        unfold(still, state, push, series)
    return moved + follow(series, h - gone, state)


@compiled
def hold(
    moving: FloatArray,
    still: FloatArray,
    by: FloatArray,
    piece: int,
    state: FloatArray,
    push: float,
    forth: float,
    back: float,
    h: float,
    series: FloatArray,
    spare: FloatArray,
) -> float:
    """A sub-step that starts at rest: the attached masses may cause breakaway; returns the distance, m. Arguments as in ``stop``."""
    n = state.size
    after = push
    for j in range(2, n - 1):
        total = 0.0
        for k in range(2, n - 1):
            total += by[piece, j, k] * state[k]
        after += moving[1, j] * total / moving[1, n - 1]
    if -back <= after <= forth:
        return step(by, piece, state, push, spare)
    level = forth if after > 0.0 else -back
    unfold(still, state, push, series)
    powers = np.zeros(TERMS)
    powers[0] = push - level
    for k in range(TERMS):
        for j in range(2, n - 1):
            powers[k] += moving[1, j] * series[k, j] / moving[1, n - 1]
    gone = crossing(powers, h)
    follow(series, gone, state)
    unfold(moving, state, push - level, series)
    return follow(series, h - gone, state)


LOOP = {item.__name__: item for item in (roots, times, generator, resting, fastest, exponentials, ahead, step, tug, stop, hold)}
