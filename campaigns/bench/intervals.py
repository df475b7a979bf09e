"""Coverage of the 95 % intervals: many simulated recordings of an exactly known machine.

    python -m campaigns.bench intervals

Band-limited noise (0.1-300 Hz, 1 V) is held at 2 kHz and sent through the paper's machine (hold and fractional delay exact);
white noise is added to the position; spectra with Hann windows of 4096 samples, half overlapped; H1; maximum likelihood.
The seeds are fixed: the same numbers come out every time.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from campaigns.bench.tables import Check, Table
from xy_sysid.excitation import signal
from xy_sysid.fitting import Fit, Structure, identify
from xy_sysid.linear.simulate import simulate
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.batch_spectra import batch_spectra
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import Z95, FrequencyResponse
from xy_sysid.response.h1 import H1Options, frequency_response
from xy_sysid.response.windows import WindowShape
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation

RATE = 2000.0
SHAPE = WindowShape.of("hann", 4096, 0.5)
LEAST, MOST = 93.0, 97.0  # per cent
RUNS, FEW = 400, 3
CASES = ((60.0, 1e-6), (60.0, 10e-6))  # (s, m rms of noise): leakage larger than noise, and smaller


def machine() -> TransferFunction:
    """Velocity gain 0.097 m/s/V, pole 246 rad/s, antiresonance 46.2 Hz, resonance 47.56 Hz, delay 1.29 ms."""
    zero, pair = 2 * np.pi * 46.2, 2 * np.pi * 47.56
    numerator = np.array([1.0, 2 * 0.015 * zero, zero**2])
    denominator = np.convolve(np.convolve([1.0, 0.0], [1.0, 246.0]), [1.0, 2 * 0.04 * pair, pair**2])
    gain = 0.097 * 246.0 * pair**2 / zero**2
    return TransferFunction(gain * numerator, denominator, 1.29e-3)


def recorded(tf: TransferFunction, seconds: float, noise: float, seed: int) -> tuple[FloatArray, FloatArray]:
    """(input, output) of one recording, from a run that has already settled; noise: rms of the white noise on the output."""
    settled = int(RATE)
    u = signal(AxisExcitation(seed=seed, centring=0.0), RATE).next(int(seconds * RATE) + settled)
    y = simulate(tf, RATE, u)
    y += noise * np.random.default_rng([seed, 1]).standard_normal(y.size)
    return u[settled:], y[settled:]


def response(u: FloatArray, y: FloatArray) -> FrequencyResponse:
    """H1 as the offline commands estimate it."""
    spectra = batch_spectra([(0, u, y)], SHAPE, True)
    return frequency_response(spectra, SHAPE, RATE, H1Options(differenced=True, band=(0.5, 300.0)))


def truths(tf: TransferFunction, fit: Fit) -> dict[str, float]:
    """The true value of each parameter with an interval."""
    exact: dict[str, float] = {"delay": tf.delay, "gain": tf.gain}
    for name, value in zip(fit.parameters, np.concatenate((tf.numerator, tf.denominator[1:-1])), strict=False):
        exact[name] = float(value)
    for kind, roots, modes in (("pole", tf.poles()[tf.poles() != 0], tf.pole_modes()), ("zero", tf.zeros(), tf.zero_modes())):
        for number, root in enumerate(sorted((r for r in roots if r.imag >= 0), key=abs), start=1):
            if root.imag == 0:
                exact[f"{kind}_{number}"] = float(root.real)
            else:
                exact[f"{kind}_{number}.real"], exact[f"{kind}_{number}.imag"] = float(root.real), float(root.imag)
        pair = next(mode for mode in modes if mode.root.imag > 0)
        name = "resonance_1" if kind == "pole" else "antiresonance_1"
        exact[f"{name}.frequency"], exact[f"{name}.damping"] = pair.frequency, pair.damping
    return exact


def trials(runs: int, seconds: float, noise: float, report: Callable[[str], None] = lambda _: None) -> tuple[dict[str, list[Estimate]], list[Fit]]:
    """Estimates by name over ``runs`` recordings, and the fits."""
    tf = machine()
    found: dict[str, list[Estimate]] = {}
    fits: list[Fit] = []
    for seed in range(1, runs + 1):
        fit = identify(response(*recorded(tf, seconds, noise, seed)), Structure())
        fits.append(fit)
        for item in fit.intervals:
            found.setdefault(item.name, []).append(item)
        if seed % 50 == 0:
            report(f"intervals: {seed} of {runs} recordings of {seconds:g} s")
    return found, fits


def run(report: Callable[[str], None], short: bool = False) -> Table:
    """Coverage of every parameter, by noise."""
    runs, cases = (FEW, CASES[:1]) if short else (RUNS, CASES)
    columns, checks = ["parameter"], []
    rows: dict[str, tuple[str, ...]] = {}
    for seconds, noise in cases:
        found, fits = trials(runs, seconds, noise, report)
        exact = truths(machine(), fits[0])
        columns += [f"{seconds:g} s, noise {1e6 * noise:g} um: inside, %", "spread / sigma", "bias / sigma"]
        inside_all = []
        for name, items in found.items():
            inside = 100.0 * sum(item.low <= exact[name] <= item.high for item in items) / len(items)
            values, sigma = np.array([item.value for item in items]), float(np.median([item.sigma for item in items]))
            cells = (f"{inside:.1f}", f"{np.std(values) / sigma:.3f}", f"{(np.mean(values) - exact[name]) / sigma:+.2f}")
            rows[name] = (*rows.get(name, (name,)), *cells)
            inside_all.append(inside)
        excess = float(np.mean([fit.cost / fit.expected_cost for fit in fits]))
        rows["cost / expected cost"] = (*rows.get("cost / expected cost", ("cost / expected cost",)), "", f"{excess:.3f}", "")
        doubt = 100.0 * Z95 * math.sqrt(0.05 * 0.95 / runs)
        mean = float(np.mean(inside_all))
        worst = max(inside_all, key=lambda value: abs(value - 95.0))
        chance = f"worst {worst:.1f} %; chance alone is +-{doubt:.1f} %"
        text = f"intervals of {seconds:g} s with {1e6 * noise:g} um of noise that hold the truth, mean of all parameters ({chance})"
        checks.append(Check(text, f"{mean:.1f} %", f"{LEAST:g}-{MOST:g} %", LEAST <= mean <= MOST))
    return Table(
        "Coverage of the 95 % intervals",
        f"{__doc__.split(chr(10) * 2)[2]}\n\n{runs} recordings each.",
        tuple(columns),
        tuple(rows.values()),
        tuple(checks),
    )
