"""Spectra of a full recording at once: the same sums as window by window, in little more time than the FFTs.

One complex transform serves both signals, u + j y: the spectrum of a real signal is even, that of j times one is odd
(Press et al., Numerical Recipes, 3rd ed., sec. 12.3.1).
"""

from __future__ import annotations

import numpy as np
import scipy

from xy_sysid.errors import BadInput
from xy_sysid.jit import compiled
from xy_sysid.response.frf import ComplexArray
from xy_sysid.response.spectra import Spectra, mean
from xy_sysid.response.windows import LINES_APART, WindowShape, error_correlation
from xy_sysid.samples.block import FloatArray

CHUNK = 4  # windows transformed together: their samples and spectra fit in the processor's cache


@compiled
def _join(u: FloatArray, y: FloatArray, first: int, hop: int, taper: FloatArray, out: ComplexArray) -> float:
    """Write windows of both signals, mean removed and tapered, as one complex signal u + j scale y into ``out``; returns the scale.

    The scale gives both signals the same size, so that rounding errors of one do not affect the other.
    """
    length, scale = taper.shape[0], 1.0
    for i in range(out.shape[0]):
        one, other, row = u[first + i * hop :][:length], y[first + i * hop :][:length], out[i]
        mean_u, mean_y = mean(one), mean(other)
        if i == 0:
            size_u, size_y = mean((one - mean_u) ** 2), mean((other - mean_y) ** 2)
            scale = np.sqrt(size_u / size_y) if size_u > 0.0 and size_y > 0.0 else 1.0
        for j in range(length):
            row[j] = complex((one[j] - mean_u) * taper[j], (other[j] - mean_y) * (scale * taper[j]))
    return scale


@compiled
def _accumulate(z: ComplexArray, scale: float, gxx: FloatArray, gyy: FloatArray, real: FloatArray, imag: FloatArray) -> None:
    """Separate the transforms of both signals from the joint one: X = even part of Z, j scale Y = odd part; add their products to the sums."""
    half = 0.5 / scale
    for i in range(z.shape[0]):
        up, down = z[i], z[i, ::-1]
        xr, yr = up[0].real, up[0].imag / scale
        gxx[0] += xr * xr
        gyy[0] += yr * yr
        real[0] += yr * xr
        for k in range(1, gxx.shape[0]):
            above, below = up[k], down[k - 1]
            xr, xi = 0.5 * (above.real + below.real), 0.5 * (above.imag - below.imag)
            yr, yi = half * (above.imag + below.imag), half * (below.real - above.real)
            gxx[k] += xr * xr + xi * xi
            gyy[k] += yr * yr + yi * yi
            real[k] += yr * xr + yi * xi
            imag[k] += yi * xr - yr * xi


def batch_spectra(runs: list[tuple[int, FloatArray, FloatArray]], shape: WindowShape, differenced: bool) -> Spectra:
    """Spectra of one axis, summed over gap-free runs.

    runs: (counter of the first sample, input (n,), output (n,)) each; windows start at multiples of the hop, as online.
    Raises BadInput if no run holds a window.
    """
    lines = shape.length // 2 + 1
    gxx, gyy, real, imag = np.zeros((4, lines))
    taper = shape.taper()
    correlation = error_correlation(shape)
    indices: list[int] = []
    for seq, u, y in runs:
        output = np.diff(y) if differenced else y
        first = -(-seq // shape.hop)
        offset = first * shape.hop - seq
        number = max((output.shape[0] - offset - shape.length) // shape.hop + 1, 0)
        inputs, outputs = np.ascontiguousarray(u, dtype=np.float64), np.ascontiguousarray(output, dtype=np.float64)
        joined = np.empty((min(CHUNK, max(number, 1)), shape.length), dtype=np.complex128)
        for start in range(0, number, CHUNK):
            part = joined[: min(CHUNK, number - start)]
            scale = _join(inputs, outputs, offset + start * shape.hop, shape.hop, taper, part)
            _accumulate(scipy.fft.fft(part, overwrite_x=True), scale, gxx, gyy, real, imag)
        indices += range(first, first + number)
    if not indices:
        longest = max((len(u) for _, u, _ in runs), default=0)
        raise BadInput(
            "longest gap-free run", f"{longest} samples", f">= {shape.length + int(differenced)}", "Record for longer or shorten the window."
        )
    return Spectra(gxx=gxx, gyy=gyy, gyx=real + 1j * imag, weight=float(len(indices)), quadratic=_quadratic(np.array(indices), correlation))


def _quadratic(indices: FloatArray, correlation: FloatArray) -> FloatArray:
    """(LINES_APART,) sum of the error correlation over all pairs of windows."""
    total = np.zeros(LINES_APART) + len(indices) * correlation[0]
    for apart in range(1, correlation.shape[0]):
        pairs = np.intersect1d(indices, indices + apart, assume_unique=True).shape[0]
        total = total + 2.0 * pairs * correlation[apart]
    return np.asarray(total, dtype=np.float64)
