"""Smaller models: cancel poles against zeros, or cut weak states by balanced truncation.

Moore, "Principal component analysis in linear systems", IEEE Trans. Automatic Control 26, 1981; error bound: twice the sum
of the Hankel singular values cut (Glover, Int. J. Control 39, 1984).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from xy_sysid.errors import BadInput
from xy_sysid.linear.any_model import AnyModel
from xy_sysid.linear.simulate import state_space
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import over


@dataclass(frozen=True, slots=True)
class Cancelled:
    """A model without its common roots; removed: the poles left out (rad/s or z)."""

    tf: TransferFunction
    removed: ComplexArray


@dataclass(frozen=True, slots=True)
class Truncated:
    """A model of lower order.

    hankel: (stable states,) Hankel singular values of the stable part, largest first, in the units of the response
    bound:  largest error of the response at any frequency, same units
    """

    tf: TransferFunction
    hankel: FloatArray
    bound: float

    def __repr__(self) -> str:
        poles, unit = self.tf.denominator.size - 1, over(self.tf.output_unit, self.tf.input_unit)
        return f"<Truncated: {poles} pole{'s'[: poles != 1]}, its response within {self.bound:.3g} {unit} of the larger one's at any frequency>"


def minreal(tf: TransferFunction, tolerance: float = 1e-3) -> Cancelled:
    """The model without pairs of pole and zero that are closer than ``tolerance`` of their size; keeps the gain and the delay."""
    poles, zeros = tf.poles(), tf.zeros()
    smallest = 1e-3 if tf.sampling_time is not None else 1e-6 * float(np.max(np.abs(poles), initial=1e-300))
    removed: list[complex] = []
    for pole in poles[poles.imag >= 0]:
        same_kind = zeros[(zeros.imag == 0) if pole.imag == 0 else (zeros.imag > 0)]
        if same_kind.size == 0:
            continue
        zero = same_kind[np.argmin(np.abs(same_kind - pole))]
        if abs(zero - pole) > tolerance * max(abs(pole), smallest):
            continue
        for conjugate in {False, True} if pole.imag != 0 else {False}:
            gone_pole, gone_zero = (pole.conjugate(), zero.conjugate()) if conjugate else (pole, zero)
            poles = np.delete(poles, np.argmin(np.abs(poles - gone_pole)))
            zeros = np.delete(zeros, np.argmin(np.abs(zeros - gone_zero)))
            removed.append(complex(gone_pole))
    if not removed:
        return Cancelled(tf, np.zeros(0, dtype=np.complex128))
    small = replace(tf, numerator=tf.leading_gain * _polynomial(zeros), denominator=_polynomial(poles))
    if small.integrators == tf.integrators and small.gain != 0 and np.isfinite(small.gain):
        small = replace(small, numerator=small.numerator * (tf.gain / small.gain))
    return Cancelled(small, np.array(removed, dtype=np.complex128))


def _polynomial(roots: ComplexArray) -> FloatArray:
    return np.atleast_1d(np.real(np.poly(roots))).astype(np.float64)


def balanced_truncation(model: TransferFunction | AnyModel, order: int) -> Truncated:
    """A model with ``order`` poles: integrators, unstable poles and delay are kept, and the strongest stable states.

    ``tf`` is the reduced model, ``bound`` the largest error of its response. For a model with physical effects its linear part is reduced.
    Source: Moore, IEEE Trans. Automatic Control 26 (1981); Glover, Int. J. Control 39 (1984).
    Raises BadInput for an order below the number of poles that must be kept, or above the number of poles.
    """
    tf = model if isinstance(model, TransferFunction) else model.tf
    discrete = tf.sampling_time is not None
    a, b, c, direct = state_space(tf)
    scale = 1.0 if discrete else float(np.max(np.abs(tf.poles()), initial=0.0)) or 1.0
    a, b = a / scale, b / scale
    edge = 1e-9

    def is_stable(real: float, imag: float) -> bool:
        return real * real + imag * imag < 1.0 - edge if discrete else real < -edge * max(np.hypot(real, imag), edge)

    form, turn, stable = scipy.linalg.schur(a, output="real", sort=is_stable)
    total = a.shape[0]
    if not total - stable <= order <= total:
        raise BadInput("order", order, f"{total - stable} to {total}", "Integrators and unstable poles must stay.")
    b, c = turn.T @ b, c @ turn
    mixing = scipy.linalg.solve_sylvester(form[:stable, :stable], -form[stable:, stable:], -form[:stable, stable:])
    b[:stable] -= mixing @ b[stable:]
    c[stable:] += c[:stable] @ mixing
    inner = form[:stable, :stable]
    solve = scipy.linalg.solve_discrete_lyapunov if discrete else scipy.linalg.solve_continuous_lyapunov
    sign = 1.0 if discrete else -1.0
    left = _root(np.asarray(solve(inner, sign * np.outer(b[:stable], b[:stable])), dtype=np.float64))
    right = _root(np.asarray(solve(inner.T, sign * np.outer(c[:stable], c[:stable])), dtype=np.float64))
    u, hankel, vh = np.linalg.svd(right.T @ left)
    keep = order - (total - stable)
    weight = 1.0 / np.sqrt(hankel[:keep])
    to_small, to_large = weight[:, None] * (u[:, :keep].T @ right.T), left @ vh[:keep].T * weight
    small_a = scipy.linalg.block_diag(to_small @ inner @ to_large, form[stable:, stable:])
    small_b = np.concatenate((to_small @ b[:stable], b[stable:]))
    small_c = np.concatenate((c[:stable] @ to_large, c[stable:]))
    eigenvalues = np.linalg.eigvals(small_a) if order else np.zeros(0)
    if not discrete:
        eigenvalues = np.where(np.abs(eigenvalues) < 1e-12, 0.0, eigenvalues)
    bottom = np.atleast_1d(np.real(np.poly(eigenvalues)))
    shifted = np.atleast_1d(np.real(np.poly(np.linalg.eigvals(small_a - np.outer(small_b, small_c))))) if order else np.ones(1)
    top = shifted + (direct - 1.0) * bottom  # det(sI - A + b c) = (1 + c (sI - A)^-1 b) det(sI - A)
    power = scale ** np.arange(bottom.size, dtype=np.float64)
    top[np.abs(top) < 1e-14 * np.max(np.abs(top))] = 0.0
    reduced = replace(tf, numerator=np.trim_zeros(top * power, "f"), denominator=bottom * power)
    return Truncated(reduced, hankel, 2.0 * float(np.sum(hankel[keep:])))


def _root(gramian: FloatArray) -> FloatArray:
    values, vectors = np.linalg.eigh(0.5 * (gramian + gramian.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))
