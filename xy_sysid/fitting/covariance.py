"""Uncertainty of a fit: covariance of the parameters, and the expected cost for noise and window alone.

Errors of neighbouring lines are correlated, so the sandwich (J'J)^-1 J' S J (J'J)^-1 with S the covariance of the weighted
errors (Pintelon & Schoukens, System Identification, 2nd ed., 9.11). S has two parts. Noise: independent of the input,
correlated by window and overlap alone. Leakage: it dominates the measured scatter where the response varies within the window's
main lobe, but most of it cancels between neighbouring lines and overlapping windows; its size follows from the model (``leakage``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from xy_sysid.fitting.damped import triangle
from xy_sysid.fitting.leakage import leakage
from xy_sysid.fitting.prediction import unblurred
from xy_sysid.fitting.problem import Point, Problem, model
from xy_sysid.jit import compiled
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.response.h1 import smoothed
from xy_sysid.samples.block import FloatArray

BLOCK = 32  # lines whose median noise replaces that of a line dominated by leakage
DOUBT = 3.0  # noise is estimated on its own line if it is this many standard deviations of sigma^2 above the leakage
RANK = 1e-11  # a direction with a smaller relative singular value is not estimated


def covariance(task: Problem, at: Point, table: FloatArray) -> tuple[FloatArray, float, float]:
    """((p, p) covariance of b, a, delay, expected cost, its standard deviation); NaN without sigma.

    table: (p + 1, 2 m) result of ``damped.weighted`` at the point.
    """
    size = table.shape[0] - 1
    if task.sigma is None:
        return np.full((size, size), np.nan), float("nan"), float("nan")
    upper = triangle(table)[:size, :size]
    scale = np.sqrt(np.sum(upper**2, axis=0))
    scale[~(scale > 0)] = 1.0
    _, values, right = np.linalg.svd(upper / scale)
    seen = values > RANK * values[0]
    back = right.T / np.maximum(values, RANK * values[0])  # from unit directions of the error to parameters
    place = _places(task)
    straight, folded = error_covariance(task, at, task.sigma, place)
    meat = _meat(np.ascontiguousarray(back.T @ (table[:-1] / scale[:, None])), straight, folded, place)
    meat[~seen], meat[:, ~seen] = 0.0, 0.0
    meat[~seen, ~seen] = 1.0
    expected = 0.5 * (float(np.sum(straight[0].real)) - float(np.sum(np.diag(meat)[seen])))
    spread = 2.0 * _square(straight) + 2.0 * _square(folded) - _square(straight[0]) - _square(folded[0])
    freedom = _freedom(task.frf)
    if task.structure.weighting == "sigma" and freedom > 4.5:  # sigma is itself estimated: |error|^2 / sigma^2 is F(2, freedom)
        expected *= freedom / (freedom - 2.0)
        spread *= freedom**3 / ((freedom - 2.0) ** 2 * (freedom - 4.0))
    return (back @ meat @ back.T) / np.outer(scale, scale), expected, 0.5 * float(np.sqrt(spread))


def _square(values: ComplexArray) -> float:
    return float(np.vdot(values, values).real)


def _leaky(frf: FrequencyResponse) -> bool:
    return frf.kernel_amplitude.size == frf.kernel_weight.size > 1


def _freedom(frf: FrequencyResponse) -> float:
    """Degrees of freedom of each line's sigma^2: from the windows and the averaged lines."""
    near = frf.line_correlation[1 : frf.smoothing]
    independent = frf.smoothing / (1.0 + 2.0 * float(np.sum((1.0 - np.arange(1, near.size + 1) / frf.smoothing) * near)))
    return 2.0 * (frf.averages - 1.0) * independent


def _noise(total: FloatArray, leaks: FloatArray, after: FloatArray, freedom: float) -> FloatArray:
    """(m,) the part of sigma^2 that is noise; leaks: the part due to leakage; after: |factor of the response|^2.

    freedom: degrees of freedom of the leakage's scatter, which smoothing over lines does not increase.
    Where leakage dominates, the difference is random and would be positive on half of the lines only: there the median of the
    surrounding lines is used.
    """
    rest = total - leaks
    chance = DOUBT * np.sqrt(2.0 / max(freedom, 2.0)) * leaks
    size = rest.size // BLOCK
    if size < 2:
        return np.maximum(rest, 0.0)
    ranked = np.sort((rest / after)[: size * BLOCK].reshape(size, BLOCK), axis=1)
    blocks = 0.5 * (ranked[:, BLOCK // 2 - 1] + ranked[:, BLOCK // 2])  # median
    around = np.interp(np.arange(rest.size), (np.arange(size) + 0.5) * BLOCK - 0.5, blocks) * after
    return np.where(rest > chance, rest, np.clip(around, 0.0, chance))


def _places(task: Problem) -> NDArray[np.int64]:
    """(m,) index of each line on the grid of lines, from 0."""
    frf = task.frf
    if (frf.line_correlation.size == 1 and not _leaky(frf)) or not frf.resolution > 0:
        return np.arange(len(frf))
    place = np.rint(frf.frequency / frf.resolution).astype(np.int64)
    return np.asarray(place - place[0])


def error_covariance(task: Problem, at: Point, sigma: FloatArray, place: NDArray[np.int64]) -> tuple[ComplexArray, ComplexArray]:
    """((k, places) E[e_i conj(e_(i + d))], (k, places) E[e_i e_(i + d)]) of the weighted errors of lines d = 0 .. k - 1 apart.

    0 at lines that were left out.
    """
    frf, plan = task.frf, task.plan
    weight, noise = np.zeros((2, int(place[-1]) + 1))
    weight[place] = task.weight
    noise[place] = sigma**2
    straight = folded = np.zeros((frf.line_correlation.size, noise.size), dtype=np.complex128)
    if _leaky(frf):
        near = unblurred(model(task, at), at.b, at.a, at.delay)
        bends, single = _bends(near, plan.index, plan.kernel, plan.after, plan.seen, place, frf.kernel_amplitude.size)
        straight, folded = leakage(frf, bends)
        single -= straight[0].real  # contribution of leakage to the scatter
        share = smoothed(single, frf.smoothing)
        noise[place] = _noise(sigma**2, share[place] / max(frf.averages - 1.0, 1.0), np.abs(plan.after) ** 2, 2.0 * (frf.averages - 1.0))
    return _weighted(frf.line_correlation, np.sqrt(noise), straight, weight), _weighted(np.zeros(1), noise, folded, weight)


@compiled
def _bends(
    near: NDArray[np.complex128], index: NDArray[np.int64], kernel: NDArray[np.float64], after: NDArray[np.complex128],
    seen: NDArray[np.int64], place: NDArray[np.int64], offsets: int,
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:  # fmt: skip
    """((offsets, places) response around each line minus its smoothed value, (places,) the scatter that this causes in one window).

    ``after`` hardly changes within a main lobe, so it is applied here.
    """
    size = int(place[-1]) + 1
    bends, single = np.zeros((offsets, size), dtype=np.complex128), np.zeros(size)
    for i in range(place.shape[0]):
        mean = 0.0 + 0.0j
        for j in range(kernel.shape[0]):
            mean += kernel[j] * near[index[j, i]]
        for j in range(kernel.shape[0]):
            bend = (near[index[j, i]] - mean) * after[i]
            bends[seen[j], place[i]] = bend
            single[place[i]] += kernel[j] * (bend.real * bend.real + bend.imag * bend.imag)
    return bends, single


@compiled
def _weighted(
    correlation: NDArray[np.float64], noise: NDArray[np.float64], leaks: NDArray[np.complex128], weight: NDArray[np.float64]
) -> NDArray[np.complex128]:
    out = np.zeros_like(leaks)
    for d in range(leaks.shape[0]):
        share = correlation[d] if d < correlation.shape[0] else 0.0
        for i in range(leaks.shape[1] - d):
            out[d, i] = weight[i] * weight[i + d] * (share * noise[i] * noise[i + d] + leaks[d, i])
    return out


def _meat(rows: FloatArray, straight: ComplexArray, folded: ComplexArray, place: NDArray[np.int64]) -> FloatArray:
    """(p, p) covariance of J' e over real and imaginary parts; rows: (p, 2 m) J."""
    size = straight.shape[1]
    spaced = rows
    if rows.shape[1] != 2 * size:  # lines left out: zeros in their place
        spaced = np.zeros((rows.shape[0], 2 * size))
        spaced[:, np.concatenate((place, size + place))] = rows
    part = spaced @ _times(straight, folded, spaced).T
    return np.asarray(0.5 * (part + part.T))


@compiled
def _times(straight: NDArray[np.complex128], folded: NDArray[np.complex128], rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """(p, 2 places) rows of C J, C the covariance of real and imaginary parts: its diagonal and twice its upper diagonals."""
    size = straight.shape[1]
    out = np.zeros(rows.shape)
    for d in range(straight.shape[0]):
        double = 0.5 if d == 0 else 1.0
        for p in range(rows.shape[0]):
            for i in range(size - d):
                s, f = straight[d, i], folded[d, i]
                real, imag = rows[p, i + d], rows[p, size + i + d]
                out[p, i] += double * ((s.real + f.real) * real + (f.imag - s.imag) * imag)
                out[p, size + i] += double * ((f.imag + s.imag) * real + (s.real - f.real) * imag)
    return out
