"""Frequency responses of short records: the local methods against H1.

Simulated: an axis with an integrator, a pole at 4.8 Hz and a resonance of 60 Hz with 0.5 % damping (0.6 Hz wide) behind a hold, 1 kHz, white
noise as input, 0.1 % of noise in the position; five seeds, lines of 1 to 300 Hz. Error: rms of |estimate / truth - 1| over the trusted
lines. Bias: the mean of |estimate / truth| - 1 at the resonance. Error over sigma: rms of the error divided by its estimated standard
deviation, 1 if sigma is right. From the same response a transfer function is fitted: the error of its resonance.

Measured: a motor bench with a multisine of 2,500 samples; two periods, treated as any record, against the mean of the periods that were not used.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy import signal

import xy_sysid as xy
from campaigns.bench.tables import Table, at_most
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording

METHODS = ("h1", "local_polynomial", "local_rational")
RATE, RESONANCE, DAMPING, NOISE = 1000.0, 60.0, 0.005, 1e-3
LENGTHS, BRIEF, SEEDS = (8_192, 16_384, 60_000), (8_192,), 5
PERIOD, USED = 2500, 2
FOLDER = Path(os.environ.get("XY_SYSID_DATA") or Path(__file__).parents[2] / "shared" / "data")


def axis(samples: int, seed: int) -> tuple[Recording, Callable[[FloatArray], ComplexArray]]:
    """A record of the simulated axis, and its true response."""
    random = np.random.default_rng(seed)
    pole, zero = 2 * np.pi * RESONANCE, 2 * np.pi * 0.8 * RESONANCE
    top = 12.0 * np.array([1 / zero**2, 2 * DAMPING / zero, 1.0])
    bottom = np.polymul([1.0, 30.0, 0.0], [1 / pole**2, 2 * DAMPING / pole, 1.0])
    b, a, _ = signal.cont2discrete((top, bottom), 1.0 / RATE)
    u = random.normal(size=samples)
    y = signal.lfilter(np.ravel(b), a, u)
    y = y + NOISE * float(np.std(np.diff(y))) * random.normal(size=samples)
    return Recording.from_arrays(RATE, u, y), lambda frequency: np.asarray(signal.freqz(np.ravel(b), a, frequency, fs=RATE)[1])


def simulated(samples: int, method: str, seeds: range) -> tuple[float, float, float, float]:
    """Error, bias at the resonance, error over sigma, and the fitted resonance's error in Hz."""
    errors, biases, ratios, resonances = [], [], [], []
    for seed in seeds:
        recording, truth = axis(samples, seed)
        found = xy.frf(recording, band_low=1.0, band_high=300.0, response=method)
        lines = found.select(found.trusted)
        true = truth(lines.frequency)
        errors.append(np.mean(np.abs(lines.response / true - 1.0) ** 2))
        ratios.append(np.mean((np.abs(lines.response - true) / lines.sigma) ** 2))
        near = int(np.argmin(np.abs(found.frequency - RESONANCE)))
        biases.append(abs(found.response[near] / truth(found.frequency[near : near + 1])[0]) - 1.0)
        model = xy.fit(found.band(20.0, 120.0), numerator_order=2, denominator_order=4)
        resonances.append(min(abs(mode.frequency - RESONANCE) for mode in model.tf.pole_modes()))
    return float(np.sqrt(np.mean(errors))), float(np.mean(biases)), float(np.sqrt(np.mean(ratios))), float(np.mean(resonances))


def measured(name: str, method: str) -> float:
    """Error of two periods against the mean of the others, at the lines that the input has."""
    held = np.load(FOLDER / "two_inertia_bench" / name)
    u, y, rate = held["u"], held["y"], float(held["fs"])
    whole = xy.frf(Recording.from_arrays(rate, u[(1 + USED) * PERIOD :], y[(1 + USED) * PERIOD :], units=("A", "rad")), period=PERIOD)
    rows = slice(PERIOD, (1 + USED) * PERIOD)
    part = xy.frf(Recording.from_arrays(rate, u[rows], y[rows], units=("A", "rad")), period=None, response=method)
    true = whole.select(whole.trusted)
    return float(np.sqrt(np.mean(np.abs(_at(part, true.frequency) / true.response - 1.0) ** 2)))


def _at(found: FrequencyResponse, frequency: FloatArray) -> ComplexArray:
    """The response between its lines, as magnitude and phase."""
    size = np.interp(frequency, found.frequency, np.log(np.abs(found.response)))
    phase = np.interp(frequency, found.frequency, np.unwrap(np.angle(found.response)))
    return np.asarray(np.exp(size + 1j * phase))


def run(tell: Callable[[str], None], short: bool = False) -> Table:
    """Every method on every record. short: the shortest record, one seed."""
    rows, errors = [], {}
    for samples in BRIEF if short else LENGTHS:
        for method in METHODS:
            tell(f"frf: {samples} samples, {method}")
            error, bias, ratio, off = simulated(samples, method, range(100, 101 if short else 100 + SEEDS))
            errors[samples, method] = error
            figures = f"{100 * error:.3g} %", f"{100 * bias:+.3g} %", f"{ratio:.2f}", f"{1e3 * off:.3g} mHz"
            rows.append((f"simulated, {samples / RATE:.3g} s", method, *figures))
    for name in ("multisineA.npz", "multisineB.npz"):
        if not short and (FOLDER / "two_inertia_bench" / name).exists():
            rows += [(f"bench, {name[:-4]}, {USED} periods", method, f"{100 * measured(name, method):.3g} %", "-", "-", "-") for method in METHODS]
    first = next(iter(errors))[0]
    ratio = errors[first, "local_rational"] / errors[first, "h1"]
    checks = (at_most("error of local_rational over that of h1, shortest record", ratio, 0.5),)
    columns = ("record", "method", "error", "bias at the resonance", "error over sigma", "fitted resonance off by")
    return Table("Frequency responses of short records", __doc__ or "", columns, tuple(rows), checks)
