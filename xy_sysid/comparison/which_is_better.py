"""Is one model better than another? A paired test of both errors on the same windows of the same held-out data.

The excitation in a window affects both errors alike and cancels: a paired t-test (Student 1908) on
ln(error after / error before), overall and by frequency band (Holm 1979 for the many bands).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.comparison.where_it_fails import SKIP
from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import EPSILON
from xy_sysid.greybox.floor import Windows, bands, encoder_noise, floor
from xy_sysid.samples.block import FloatArray
from xy_sysid.tables import Table, with_sentence
from xy_sysid.units import USUAL, Units, bare, moved

ABOVE = 1.2  # least power of one of the two errors, relative to the floor, for a change to matter
WANTED, FEWEST = 10, 5  # adjacent windows: wanted number, least number
LEVEL = 0.05  # probability of a false "better" or "worse"
WORTH = 0.02  # relative change of the error that is negligible


@dataclass(frozen=True, slots=True)
class Change:
    """A range of frequency, Hz, and the change of the error in it: after over before; better, worse, or neither (None)."""

    low: float
    high: float
    ratio: float
    better: bool | None


@dataclass(frozen=True, slots=True)
class Paired:
    """Two models on the same windows.

    windows: adjacent; before, after, noise_floor: rms error up to ``top`` Hz, in ``unit``
    ratio, low, high: after over before, geometric mean over the windows, with its 95 % interval; t, p: of the paired test
    bands: every band; better: None if the test does not decide, or the change is negligible
    """

    windows: int
    top: float
    before: float
    after: float
    noise_floor: float
    ratio: float
    low: float
    high: float
    t: float
    p: float
    bands: tuple[Change, ...]
    unit: str = "m/s"

    def __repr__(self) -> str:
        return f"<Paired: {self.sentence}>"

    @property
    def table(self) -> Table:
        """Both errors, the noise floor, and the ratio with its 95 % interval."""
        sizes = (("error before", self.before), ("error after", self.after), ("noise floor", self.noise_floor))
        rows = (*((name, size, None, None, self.unit) for name, size in sizes), ("after over before", self.ratio, self.low, self.high, ""))
        return Table(("quantity", "value", "from", "to", "unit"), rows)

    def __str__(self) -> str:
        """The sentence and the table."""
        return with_sentence(self.sentence, self.table)

    @property
    def better(self) -> bool | None:
        """True if after is better than before, False if worse, None if undecided."""
        return self.ratio < 1.0 if self.p < LEVEL and abs(self.ratio - 1.0) > WORTH else None

    @property
    def changes(self) -> tuple[Change, ...]:
        """Neighbouring bands with the same change, joined; the largest change of each."""
        found: list[Change] = []
        for band in self.bands:
            last = found[-1] if found else None
            if band.better is not None and last is not None and last.better == band.better and last.high == band.low:
                most = min(last.ratio, band.ratio) if band.better else max(last.ratio, band.ratio)
                found[-1] = Change(last.low, band.high, most, band.better)
            elif band.better is not None:
                found.append(band)
        return tuple(found)

    @property
    def sentence(self) -> str:
        """The result in words."""
        word = {True: "better", False: "worse", None: "no different"}[self.better]
        figures = f"{moved(self.before, self.unit)} before, {bare(self.after, self.unit)} after (floor {bare(self.noise_floor, self.unit)})"
        test = f"{self.ratio:.3g} times the error, 95 % interval {self.low:.3g} to {self.high:.3g}, t = {self.t:.3g} over {self.windows} windows"
        where = [
            f"{'better' if item.better else 'worse'} from {item.low:.3g} to {item.high:.3g} Hz (down to {item.ratio:.2g} times)"
            if item.better
            else f"worse from {item.low:.3g} to {item.high:.3g} Hz (up to {item.ratio:.2g} times)"
            for item in self.changes
        ]
        return f"after is {word}: {figures}; {test}" + ("; " + "; ".join(where) if where else "") + "."


def paired(before: FloatArray, after: FloatArray, position: FloatArray, sampling_rate: float, units: Units = USUAL) -> Paired:
    """Two simulated velocities (n - 1,) against the measured position (n,). Raises BadInput for too little data."""
    skip = int(SKIP * sampling_rate)
    measured = np.diff(position)[skip:] * sampling_rate
    if before.shape != after.shape or before.size != position.size - 1:
        raise BadInput("length of the simulations", f"{before.size} and {after.size}", f"{position.size - 1}", "Simulate the same data.")
    layout = bands(sampling_rate, measured.size // WANTED, sensed=units.sensed)
    every = Windows(layout, np.arange(0, max(measured.size - layout.length, 0) + 1, layout.length // 2))
    errors = [every.spectrum(measured - values[skip:]) for values in (before, after)]
    power = [np.abs(error[::2]) ** 2 for error in errors]  # every other window: no overlap
    windows = power[0].shape[0]
    if windows < FEWEST:
        needed = (FEWEST + 1) * layout.length / sampling_rate + SKIP
        raise BadInput("unseen data", f"{position.size / sampling_rate:.3g} s", f"{needed:.3g} s or more", "Give a longer recording.")
    least = floor(every, measured, encoder_noise(sampling_rate, position, units.sensed), EPSILON)
    lines = np.bincount(layout.band, minlength=layout.count)
    whole = [float(np.sqrt(np.sum(lines * layout.power(error)) * 2.0 / layout.length)) for error in errors]
    total = _log_ratio(power[0].sum(axis=1), power[1].sum(axis=1))
    mean, spread, t, p = _test(total)
    reach = float(scipy.stats.t.ppf(0.975, windows - 1)) * spread
    edges = layout.edges()
    found = []
    for k in range(layout.count):
        inside = layout.band == k
        found.append(_test(_log_ratio(power[0][:, inside].sum(axis=1), power[1][:, inside].sum(axis=1))))
    audible = np.maximum(*(layout.power(error) for error in errors)) > ABOVE * least.power
    sure = _holm(np.array([item[3] for item in found])) & audible
    changes = tuple(
        Change(float(edges[k]), float(edges[k + 1]), float(np.exp(item[0])), item[0] < 0.0 if sure[k] and abs(np.expm1(item[0])) > WORTH else None)
        for k, item in enumerate(found)
    )
    noise = layout.rms(least.noise)
    ratio, low, high = (float(np.exp(value)) for value in (mean, mean - reach, mean + reach))
    return Paired(
        unit=units.judged,
        windows=windows,
        top=float(edges[-1]),
        before=whole[0],
        after=whole[1],
        noise_floor=noise,
        ratio=ratio,
        low=low,
        high=high,
        t=t,
        p=p,
        bands=changes,
    )


def _log_ratio(before: FloatArray, after: FloatArray) -> FloatArray:
    """(windows,) ln of the amplitude ratio."""
    return np.asarray(0.5 * np.log(np.maximum(after, 1e-300) / np.maximum(before, 1e-300)))


def _test(values: FloatArray) -> tuple[float, float, float, float]:
    """Mean, its standard error, t, and the probability of such a |t| without a change."""
    mean, spread = float(np.mean(values)), float(np.std(values, ddof=1) / np.sqrt(values.size))
    if spread == 0.0:
        return mean, 0.0, 0.0 if mean == 0.0 else float(np.copysign(np.inf, mean)), 1.0 if mean == 0.0 else 0.0
    t = mean / spread
    return mean, spread, t, float(2.0 * scipy.stats.t.sf(abs(t), values.size - 1))


def _holm(chances: FloatArray) -> NDArray[np.bool_]:
    """(n,) which of many tests are significant, with probability LEVEL for any false one."""
    order = np.argsort(chances)
    passes = chances[order] <= LEVEL / (chances.size - np.arange(chances.size))
    many = int(np.argmin(passes)) if not bool(passes.all()) else chances.size
    found = np.zeros(chances.size, dtype=np.bool_)
    found[order[:many]] = True
    return found
