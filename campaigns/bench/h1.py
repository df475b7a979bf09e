"""H1 and coherence of five minutes, compared with scipy.signal, pyFRF and the bare FFTs.

600,000 samples of one axis at 2 kHz, Hann windows of 4096, half overlapped, the window's mean removed. Ours gives the response,
the coherence and sigma, and takes both signals through one complex FFT a window; scipy.signal runs ``csd`` and two ``welch``;
the bare FFTs are one real FFT a window and a signal, of windows already cut and tapered, one by one or four together (in cache)
or all in one call.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.signal
from scipy import fft

from campaigns.bench.intervals import RATE, SHAPE
from campaigns.bench.tables import Table, at_least, at_most, medians
from xy_sysid.response.batch_spectra import batch_spectra
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.response.h1 import H1Options, frequency_response
from xy_sysid.samples.block import FloatArray

SAMPLES, BRIEF, REPEATS = 600_000, 20_000, 21


def ours(u: FloatArray, y: FloatArray) -> FrequencyResponse:
    """H1 without differencing, as in the paper."""
    return frequency_response(batch_spectra([(0, u, y)], SHAPE, False), SHAPE, RATE, H1Options(differenced=False))


def scipys(u: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(H1, coherence)."""
    how: Any = {"fs": RATE, "window": "hann", "nperseg": SHAPE.length, "noverlap": SHAPE.length - SHAPE.hop}
    _, pxy = scipy.signal.csd(u, y, **how)
    _, pxx = scipy.signal.welch(u, **how)
    _, pyy = scipy.signal.welch(y, **how)
    return pxy / pxx, np.abs(pxy) ** 2 / (pxx * pyy)


def pyfrfs(u: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(H1, coherence); force and displacement, so that nothing is converted."""
    import pyFRF

    made = pyFRF.FRF(int(RATE), exc=u, resp=y, exc_type="f", resp_type="d", window="hann", nperseg=SHAPE.length, noverlap=SHAPE.hop)
    return np.asarray(made.get_H1()), np.asarray(made.get_coherence())


def run(report: Callable[[str], None], short: bool = False) -> Table:
    """Times and ratios; the answers are compared first."""
    random = np.random.default_rng(0)
    u = random.standard_normal(BRIEF if short else SAMPLES)
    y = scipy.signal.lfilter([0.0, 0.2], [1.0, -0.8], u) + 0.1 * random.standard_normal(u.size)
    mine, (theirs, coherence) = ours(u, y), scipys(u, y)
    same = max(float(np.max(np.abs(mine.response / theirs[1:] - 1.0))), float(np.max(np.abs(mine.coherence - coherence[1:]))))
    taper = SHAPE.taper()
    cut = np.lib.stride_tricks.sliding_window_view
    windows = [np.ascontiguousarray((cut(v, SHAPE.length)[:: SHAPE.hop]) * taper) for v in (u, y)]

    def together(size: int) -> Callable[[], None]:
        def work() -> None:
            for block in windows:
                for first in range(0, block.shape[0], size):
                    fft.rfft(block[first : first + size])

        return work

    works: dict[str, Callable[[], object]] = {
        "xy_sysid": lambda: ours(u, y),
        "scipy.signal: csd, 2 welch": lambda: scipys(u, y),
        "bare rFFTs, one by one": lambda: [fft.rfft(window) for block in windows for window in block],
        "bare rFFTs, four together": together(4),
        "bare rFFTs, all in one call": together(10**6),
    }
    if importlib.util.find_spec("pyFRF"):
        works["pyFRF"] = lambda: pyfrfs(u, y)
    report("h1: times")
    slow = works.pop("pyFRF", None)
    times = medians(works, 1 if short else REPEATS)
    if slow is not None:
        times |= medians({"pyFRF": slow}, 1)
    mine_time = times["xy_sysid"]
    rows = tuple((name, f"{1e3 * value:.1f}", f"{value / mine_time:.2f}x") for name, value in times.items())
    bare = "bare rFFTs, one by one"
    checks = (
        at_least("scipy.signal over xy_sysid, time", times["scipy.signal: csd, 2 welch"] / mine_time, 6.0),
        at_most("xy_sysid over the bare FFTs it needs, one by one", mine_time / times[bare], 1.25),
        at_most("xy_sysid over the bare FFTs it needs, four together", mine_time / times["bare rFFTs, four together"], 1.25),
        at_most("largest relative difference from scipy.signal", same, 1e-12, ""),
    )
    text = __doc__.split("\n\n", 1)[1] + f"\n{windows[0].shape[0]} windows, {2 * windows[0].shape[0]} FFTs."
    return Table("H1 and coherence of 5 minutes", text, ("what", "ms", "time over ours"), rows, checks)
