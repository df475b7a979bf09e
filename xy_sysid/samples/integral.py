"""Velocity to position: a position whose mean velocity from each sample to the next equals the measured one, so that noise stays white.

A value measured at an instant then counts for the following step. Therefore an estimated delay contains half a sample (a full one if the
drive itself differences its encoder over the last sample); ``integrated`` says so.
"""

from __future__ import annotations

import numpy as np

from xy_sysid.samples.block import FloatArray

FAR = 1e9  # of any unit; beyond it a double is too coarse for a position, and the integral restarts at 0


def integral(values: FloatArray, lasting: FloatArray, start: FloatArray | float = 0.0) -> FloatArray:
    """(n, axes) cumulative sum of (n, axes) values before each sample, starting at ``start``. lasting: (n - 1,) s from each sample to the next.

    Over a gap the last value is held.
    """
    first = np.broadcast_to(start, (1, values.shape[1]))
    return np.asarray(np.cumsum(np.concatenate((first, values[:-1] * lasting[:, None])), axis=0))


def detrended(values: FloatArray) -> FloatArray:
    """(n,) values minus their straight line."""
    if values.size < 3:
        return values
    line = np.column_stack((np.ones(values.size), np.arange(values.size) / values.size))
    return np.asarray(values - line @ np.linalg.lstsq(line, values, rcond=None)[0])


def integrated(unit: str = "", rate: float | None = None) -> str:
    """A note on an integrated velocity. unit: its own; rate: Hz; both if known."""
    named, half = f" ({unit})" if unit else "", "" if rate is None else f" ({0.5e3 / rate:.3g} ms)"
    return (
        f"the output is a velocity{named}: it is integrated, so positions count from 0; "
        f"a delay found from it contains half a sample{half}, or a whole one if the drive differences its encoder"
    )


class Path:
    """add(seq, velocity, period) -> positions, for samples that arrive one by one or in blocks of any length."""

    def __init__(self, axes: int) -> None:
        self._place, self._velocity, self._seq = np.zeros(axes), np.zeros(axes), np.nan

    def add(self, seq: FloatArray, velocity: FloatArray, period: float) -> FloatArray:
        """(n, axes) positions. seq: (n,) counters; velocity: (n, axes); period: s of one sample.

        A row with a NaN has no position and does not affect the following rows; neither does one that
        would lead beyond ``FAR``, after which positions restart at 0. A counter that goes back adds nothing.
        """
        found = np.full(velocity.shape, np.nan)
        rows = np.flatnonzero(np.isfinite(velocity).all(axis=1) & np.isfinite(seq))
        while rows.size:
            before = seq[rows[0]] if np.isnan(self._seq) else self._seq
            lasting = np.maximum(np.diff(seq[rows], prepend=before), 0.0) * period
            places = integral(np.concatenate((self._velocity[None, :], velocity[rows])), lasting, self._place)[1:]
            beyond = np.flatnonzero((np.abs(places) > FAR).any(axis=1))
            near = rows[: beyond[0]] if beyond.size else rows
            found[near] = places[: near.size]
            last = rows[min(near.size, rows.size - 1)]
            self._seq = float(seq[last])
            self._place, self._velocity = (0.0 * places[0], 0.0 * places[0]) if beyond.size else (places[-1], velocity[last].copy())
            rows = rows[near.size + 1 :]
        return found
