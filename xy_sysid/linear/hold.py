"""Effect of a zero-order hold and sampling on a continuous response: its aliases, summed to infinity.

A plant G behind a hold, a delay d and a sampler answers, with s_k = j (w + k 2 pi / T),
    H(w) = (1 - exp(-j w T)) / T * sum_k exp(-s_k d) G(s_k) / s_k
(Franklin, Powell & Workman, Digital Control, 3rd ed., 5.2; the delay makes it the modified z-transform). The sum is taken
term by term up to |k| = ALIASES. Beyond, G is replaced by its series in 1 / s, whose sums over all k have a closed form:
with x = w T / (2 pi) and 0 < mu <= 1,
    F_q(mu) = sum_k exp(-j 2 pi (x + k) mu) / (j 2 pi (x + k))^q = sum_i C_(q-i) (-mu)^i / i!
where dF_q / dmu = -F_(q-1), F_q(1) = exp(-j 2 pi x) F_q(0) for q >= 2, and C_1 = 1 / (exp(j 2 pi x) - 1).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from xy_sysid.jit import compiled
from xy_sysid.samples.block import FloatArray

# Terms on each side. With 5 series terms the rest is below 1e-8 of the response for poles up to Nyquist, below 1e-6 up to twice the
# sampling rate; a pole faster than that (4e-5 to 0.1 at eight times) is hardly more than a delay. ``simulation.held_response`` is exact.
ALIASES = 16
SERIES = 5
# where the tail is computed: away from x = 0, where its closed form would cancel; it is a smooth function of x
TAIL_POINTS = np.array([-0.5, -0.35, -0.2, 0.2, 0.35, 0.5])


@compiled
def tail_sums(points: NDArray[np.float64], delay: float, aliases: int, lowest: int, count: int) -> NDArray[np.complex128]:
    """(points, count): sum over |k| > aliases of exp(-j 2 pi k delay) / (j 2 pi (x + k))^q for q = lowest, lowest + 1, ...

    points: x, not whole numbers; delay in samples, >= 0.
    """
    whole = math.ceil(delay) - 1.0
    part = delay - whole
    out = np.zeros((points.shape[0], count), dtype=np.complex128)
    highest = lowest + count - 1
    constants = np.zeros(highest + 1, dtype=np.complex128)
    phase = np.exp(-2j * np.pi * delay * np.arange(-aliases, aliases + 1))
    for n in range(points.shape[0]):
        x = points[n]
        turn = np.exp(-2j * np.pi * x)
        if highest >= 1:
            constants[1] = turn / (1.0 - turn)
        for q in range(2, highest + 1):
            total = 0.0 + 0.0j
            factor = 1.0
            for i in range(1, q):
                factor *= -1.0 / i
                total += constants[q - i] * factor
            constants[q] = -total / (1.0 - turn)
        shift = np.exp(2j * np.pi * x * part)
        for c in range(count):
            q = lowest + c
            full = 0.0 + 0.0j
            factor = 1.0
            for i in range(q):
                if i > 0:
                    factor *= -part / i
                full += constants[q - i] * factor
            full *= shift  # takes the factor exp(-j 2 pi x delay) out of every term; whole samples turn by exp(-j 2 pi x whole)
            out[n, c] = full
        for m in range(2 * aliases + 1):
            inverse = complex(0.0, -1.0 / (2.0 * np.pi * (x + m - aliases)))
            term = phase[m]
            for _ in range(lowest):
                term *= inverse
            for c in range(count):
                out[n, c] -= term
                term *= inverse
    return out


def interpolation(nodes: FloatArray, points: FloatArray) -> FloatArray:
    """(points, nodes) matrix that interpolates a polynomial given at the nodes (barycentric formula)."""
    difference = nodes[:, None] - nodes[None, :]
    np.fill_diagonal(difference, 1.0)
    weight = 1.0 / np.prod(difference / np.ptp(nodes) * 4.0, axis=1)
    gap = points[:, None] - nodes[None, :]
    hit = np.abs(gap) < 1e-14 * np.max(np.abs(nodes))
    terms = weight / np.where(hit, 1.0, gap)
    matrix = terms / np.sum(terms, axis=1, keepdims=True)
    matrix[np.any(hit, axis=1)] = hit[np.any(hit, axis=1)]
    return np.asarray(matrix)


def nodes_for(highest: float, digits: float = 11.0) -> FloatArray:
    """Chebyshev nodes on [0, highest] (x, in sampling rates) that resolve aliases of poles below ``highest`` to this many digits."""
    top = min(max(highest, 1e-3), 0.5)
    nearest = max(2.0 / top - 3.0, 1.02)
    rate = nearest + math.sqrt(nearest**2 - 1.0)
    number = min(math.ceil(digits * math.log(10.0) / math.log(rate)) + 2, 40)
    angle = (2.0 * np.arange(number) + 1.0) / (2.0 * number) * np.pi
    return np.asarray(0.5 * max(highest, 1e-3) * (1.0 - np.cos(angle)))
