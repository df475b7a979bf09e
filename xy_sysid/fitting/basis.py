"""Polynomials in a basis that stays well conditioned at any order.

Arnoldi's process makes polynomials orthonormal on the measured lines under a weight (Brubeck, Nakatsukasa & Trefethen,
"Vandermonde with Arnoldi", SIAM Review 63, 2021). All coefficients are real, as lines at -f are conjugates of those at f.
With the weight of the current fit this is the stabilised Sanathanan-Koerner iteration (Hokanson, arXiv:2009.10803).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.jit import compiled
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class Basis:
    """p_0 = first; x p_k = sum_j recurrence[j, k] p_j.

    recurrence: (order + 1, order) real, upper Hessenberg
    """

    first: float
    recurrence: FloatArray

    def values(self, x: ComplexArray) -> ComplexArray:
        """(len(x), order + 1) values of every polynomial at x."""
        return values_of(x, self.first, self.recurrence)

    def parts(self, x: ComplexArray) -> FloatArray:
        """(2, order + 1, len(x)) real and imaginary parts of the same values."""
        return _parts(x, self.first, self.recurrence)

    def powers(self) -> FloatArray:
        """(order + 1, order + 1): row k holds the coefficients of p_k, rising powers of x."""
        return _powers(self.first, self.recurrence)

    def roots(self, coefficients: FloatArray) -> ComplexArray:
        """Roots of sum_k coefficients[k] p_k, eigenvalues of the comrade matrix."""
        order = coefficients.shape[0] - 1
        if order < 1:
            return np.zeros(0, dtype=np.complex128)
        matrix = self.recurrence[:order, :order].copy()
        matrix[:, -1] -= self.recurrence[order, order - 1] * coefficients[:-1] / coefficients[-1]
        return np.asarray(np.linalg.eigvals(matrix), dtype=np.complex128)


def basis(x: ComplexArray, weight: FloatArray, order: int) -> Basis:
    """Polynomials up to an order, orthonormal under the real scalar product sum weight^2 Re(conj(p) q) over the points x."""
    first, recurrence = arnoldi(x, weight, order)
    return Basis(first, recurrence)


@compiled
def arnoldi(x: NDArray[np.complex128], weight: NDArray[np.float64], order: int) -> tuple[float, NDArray[np.float64]]:
    size = x.shape[0]
    vectors = np.empty((order + 1, size), dtype=np.complex128)
    recurrence = np.zeros((order + 1, order))
    first = 1.0 / max(np.sqrt(np.sum(weight * weight)), 1e-300)
    for i in range(size):
        vectors[0, i] = weight[i] * first
    for k in range(order):
        for i in range(size):
            vectors[k + 1, i] = x[i] * vectors[k, i]
        for _ in range(2):  # Gram-Schmidt twice is enough
            for j in range(k + 1):
                dot = 0.0
                for i in range(size):
                    dot += vectors[j, i].real * vectors[k + 1, i].real + vectors[j, i].imag * vectors[k + 1, i].imag
                recurrence[j, k] += dot
                for i in range(size):
                    vectors[k + 1, i] -= dot * vectors[j, i]
        norm = 0.0
        for i in range(size):
            norm += vectors[k + 1, i].real ** 2 + vectors[k + 1, i].imag ** 2
        norm = max(np.sqrt(norm), 1e-300)
        recurrence[k + 1, k] = norm
        for i in range(size):
            vectors[k + 1, i] /= norm
    return first, recurrence


@compiled
def values_of(x: NDArray[np.complex128], first: float, recurrence: NDArray[np.float64]) -> NDArray[np.complex128]:
    order = recurrence.shape[1]
    out = np.empty((x.shape[0], order + 1), dtype=np.complex128)
    for i in range(x.shape[0]):
        out[i, 0] = first
        for k in range(order):
            value = x[i] * out[i, k]
            for j in range(k + 1):
                value -= recurrence[j, k] * out[i, j]
            out[i, k + 1] = value / recurrence[k + 1, k]
    return out


@compiled
def _powers(first: float, recurrence: NDArray[np.float64]) -> NDArray[np.float64]:
    order = recurrence.shape[1]
    table = np.zeros((order + 1, order + 1))
    table[0, 0] = first
    for k in range(order):
        table[k + 1, 1:] = table[k, :-1]
        for j in range(k + 1):
            table[k + 1] -= recurrence[j, k] * table[j]
        table[k + 1] /= recurrence[k + 1, k]
    return table


@compiled
def _parts(x: NDArray[np.complex128], first: float, recurrence: NDArray[np.float64]) -> NDArray[np.float64]:
    order, size = recurrence.shape[1], x.shape[0]
    out = np.empty((2, order + 1, size))
    out[0, 0], out[1, 0] = first, 0.0
    for k in range(order):
        for i in range(size):
            real, imag = out[0, k, i], out[1, k, i]
            out[0, k + 1, i], out[1, k + 1, i] = x[i].real * real - x[i].imag * imag, x[i].real * imag + x[i].imag * real
        for j in range(k + 1):
            if recurrence[j, k] != 0.0:
                for part in range(2):
                    for i in range(size):
                        out[part, k + 1, i] -= recurrence[j, k] * out[part, j, i]
        for part in range(2):
            for i in range(size):
                out[part, k + 1, i] /= recurrence[k + 1, k]
    return out
