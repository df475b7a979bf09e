"""Spectra of a whole recording at once: the same sums as window by window, in the time of the FFTs they need."""

from __future__ import annotations

import numpy as np
from scipy import fft

from xy_sysid.compiled import compiled
from xy_sysid.errors import BadInput
from xy_sysid.frf import ComplexArray
from xy_sysid.spectra import Spectra
from xy_sysid.stream import FloatArray
from xy_sysid.windows import LINES_APART, WindowShape, error_correlation

SUMS = 16  # partial sums of a mean: less rounding, and they run side by side
CHUNK = 4  # windows transformed together: their samples and spectra stay in the processor's cache


@compiled
def _taper(signal: FloatArray, first: int, hop: int, taper: FloatArray, out: FloatArray) -> None:
    length = taper.shape[0]
    for i in range(out.shape[0]):
        window, row = signal[first + i * hop : first + i * hop + length], out[i]
        sums, total = np.zeros(SUMS), 0.0
        for j in range(0, length - SUMS + 1, SUMS):
            for k in range(SUMS):
                sums[k] += window[j + k]
        for k in range(SUMS):
            total += sums[k]
        for j in range(length - length % SUMS, length):
            total += window[j]
        mean = total / length
        for j in range(length):
            row[j] = (window[j] - mean) * taper[j]


@compiled
def _accumulate(x: ComplexArray, y: ComplexArray, gxx: FloatArray, gyy: FloatArray, real: FloatArray, imag: FloatArray) -> None:
    for i in range(x.shape[0]):
        for k in range(x.shape[1]):
            xr, xi, yr, yi = x[i, k].real, x[i, k].imag, y[i, k].real, y[i, k].imag
            gxx[k] += xr * xr + xi * xi
            gyy[k] += yr * yr + yi * yi
            real[k] += yr * xr + yi * xi
            imag[k] += yi * xr - yr * xi


def batch_spectra(runs: list[tuple[int, FloatArray, FloatArray]], shape: WindowShape, differenced: bool) -> Spectra:
    """Spectra of one axis over gap-free runs.

    runs: (counter of the first sample, input (n,), output (n,)) each; windows start on multiples of the hop, as online.
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
        x, z = np.empty((2, min(CHUNK, max(number, 1)), shape.length))
        for start in range(0, number, CHUNK):
            size = min(CHUNK, number - start)
            _taper(inputs, offset + start * shape.hop, shape.hop, taper, x[:size])
            _taper(outputs, offset + start * shape.hop, shape.hop, taper, z[:size])
            _accumulate(fft.rfft(x[:size]), fft.rfft(z[:size]), gxx, gyy, real, imag)
        indices += range(first, first + number)
    if not indices:
        longest = max((len(u) for _, u, _ in runs), default=0)
        raise BadInput(
            "longest gap-free run", f"{longest} samples", f">= {shape.length + int(differenced)}", "Record for longer or shorten the window."
        )
    return Spectra(gxx, gyy, real + 1j * imag, float(len(indices)), _quadratic(np.array(indices), correlation))


def _quadratic(indices: FloatArray, correlation: FloatArray) -> FloatArray:
    """(LINES_APART,) sum of the error correlation over all pairs of windows."""
    total = np.zeros(LINES_APART) + len(indices) * correlation[0]
    for apart in range(1, correlation.shape[0]):
        pairs = np.intersect1d(indices, indices + apart).shape[0]
        total = total + 2.0 * pairs * correlation[apart]
    return np.asarray(total, dtype=np.float64)
