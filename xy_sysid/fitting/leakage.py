"""Random errors of a response that varies within the main lobe of the window, and their correlation.

The estimate at a line is the smoothed response plus an error e = mean over windows of conj(X) L / mean |X|^2 with the leakage
L(f) = integral W(f - v) D_f(v) dZ(v), D_f(v) = G(v) - G_blurred(f). For an input that is locally white and Gaussian
(Isserlis), summed over pairs of windows k, l,
    E[e conj(e')] = sum conj(E[X_k conj(X'_l)]) E[L_k conj(L'_l)],   E[e e'] = sum E[L_k conj(X'_l)] E[L'_l conj(X_k)]
The second is 0 for noise. For leakage it makes errors of a frequency small and those of a damping large.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from xy_sysid.jit import compiled
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.samples.block import FloatArray

NEGLIGIBLE = 1e-6  # products of window amplitudes below this part of the largest are left out


def leakage(frf: FrequencyResponse, bends: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """((k, m) E[e_i conj(e_(i + d))], (k, m) E[e_i e_(i + d)]) for lines d = 0 .. k - 1 apart.

    bends: (j, m) D at kernel_offset[j] from each line of the whole grid of lines.
    """
    both, forms = _forms(frf.kernel_amplitude.tobytes(), frf.pairs.size, frf.hop, frf.line_correlation.size)
    straight: FloatArray = np.asarray(np.tensordot(frf.pairs, both, axes=1))
    split = np.concatenate((bends.real, bends.imag), axis=1)
    turned = forms @ split  # (windows apart, k, cos and sin, first and second line, real and imaginary)
    return _proper(straight, bends), _improper(frf.pairs, turned)


@lru_cache(maxsize=8)
def _forms(amplitude_bytes: bytes, apart: int, hop: float, lines: int) -> tuple[FloatArray, FloatArray]:
    """((apart, lines, j) weights of D_i(o) conj(D_(i + d)(o - 2 d)), (apart, lines, 2, 2, j) weights of D in E[L conj(X')])."""
    amplitude = np.frombuffer(amplitude_bytes, dtype=np.float64)
    size = amplitude.size
    offset = np.arange(size) - (size - 1) // 2
    both, forms = np.zeros((apart, lines, size)), np.zeros((apart, lines, 2, 2, size))
    for d in range(min(lines, (size + 1) // 2)):
        product = np.zeros(size)
        product[2 * d :] = amplitude[2 * d :] * amplitude[: size - 2 * d]
        product[np.abs(product) < NEGLIGIBLE * np.max(amplitude**2)] = 0.0
        for m in range(apart):
            for part, turn in enumerate((np.cos(np.pi * offset * m * hop), np.sin(np.pi * offset * m * hop))):
                first = product * turn
                both[m, d] += first * np.sum(first)
                forms[m, d, part, 0] = first
                forms[m, d, part, 1, : size - 2 * d] = first[2 * d :]
    return both, forms


@compiled
def _proper(weights: FloatArray, bends: ComplexArray) -> ComplexArray:
    out = np.zeros((weights.shape[0], bends.shape[1]), dtype=np.complex128)
    for d in range(weights.shape[0]):
        for o in range(2 * d, weights.shape[1]):
            if weights[d, o] != 0.0:
                for i in range(out.shape[1] - d):
                    out[d, i] += weights[d, o] * bends[o, i] * np.conj(bends[o - 2 * d, i + d])
    return out


@compiled
def _improper(pairs: FloatArray, turned: FloatArray) -> ComplexArray:
    size = turned.shape[4] // 2
    out = np.zeros((turned.shape[1], size), dtype=np.complex128)
    for m in range(turned.shape[0]):
        for d in range(turned.shape[1]):
            for part in range(2):
                for i in range(size - d):
                    first = complex(turned[m, d, part, 0, i], turned[m, d, part, 0, size + i])
                    second = complex(turned[m, d, part, 1, i + d], turned[m, d, part, 1, size + i + d])
                    out[d, i] += pairs[m] * first * second
    return out
