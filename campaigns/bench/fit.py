"""Transfer function with delay on 612 lines, compared with scipy.optimize.least_squares and vector fitting.

The response is that of a minute of simulated data of the paper's machine (H1, Hann windows of 4096, 0.5 to 300 Hz). Every fit
except vector fitting minimises the same cost: errors over sigma, of a model with the window's blur and the hold.
*From the start*, *as live* and ``least_squares`` start from the true model with its parameters about 10 per cent off. *As live*
stops at a relative change of 1e-6; *cold* has no start model. ``least_squares`` differentiates numerically; its parameters are
coefficients of powers of s, scaled to 1 at the start. Vector fitting (scikit-rf) has no delay and no hold in its model and no
weights: it may use more poles instead.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import scipy.optimize

from campaigns.bench.intervals import RATE, machine, recorded, response
from campaigns.bench.tables import Table, at_least, at_most, medians
from xy_sysid.fitting import FitOptions, Structure, identify
from xy_sysid.fitting.prediction import predict
from xy_sysid.fitting.problem import from_transfer_function, model, problem
from xy_sysid.linear.simulate import held_response
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.samples.block import FloatArray

LINES, REPEATS = 612, 15


def measured() -> FrequencyResponse:
    """A simulated response with 612 lines."""
    return response(*recorded(machine(), 60.0, 1e-6, 7)).select(slice(0, LINES))


def start_from(tf: TransferFunction) -> TransferFunction:
    """The model with every parameter changed by 10 %, except the frequencies of the pair."""
    denominator = np.convolve(np.convolve([1.0, 0.0], [1.0, 1.1 * 246.0]), [1.0, 2 * 0.044 * 2 * np.pi * 47.3, (2 * np.pi * 47.3) ** 2])
    return replace(tf, numerator=tf.numerator * np.array([1.1, 1.2, 1.1]), denominator=denominator, delay=0.9 * tf.delay)


class ByHand:
    """Weighted errors as a function of scaled coefficients and the delay, with the public functions."""

    def __init__(self, frf: FrequencyResponse, start: TransferFunction) -> None:
        grid = frf.frequency[:, None] + frf.kernel_offset[None, :]
        grid[np.abs(grid) < 1e-6] = 1e-6
        keys, self._index = np.unique(np.round(np.abs(grid) / frf.resolution, 3), return_inverse=True)
        self._frequency, self._negative, self._frf = keys * frf.resolution, grid < 0, frf
        self._frequency[0] = max(self._frequency[0], 1e-6)
        self._difference = np.expm1(2j * np.pi * grid / RATE)
        self._own = np.expm1(2j * np.pi * frf.frequency / RATE)
        self._start = start
        self.scale = np.concatenate((start.numerator, start.denominator[1:-1], [start.delay]))

    def model(self, x: FloatArray) -> TransferFunction:
        """The model for parameters that are scaled to 1 at the start."""
        values = x * self.scale
        return replace(self._start, numerator=values[:3], denominator=np.concatenate(([1.0], values[3:6], [0.0])), delay=max(float(values[6]), 0.0))

    def __call__(self, x: FloatArray) -> FloatArray:
        held = held_response(self.model(x), self._frequency, RATE)[self._index].reshape(self._difference.shape)
        blurred = (np.where(self._negative, held.conj(), held) * self._difference) @ self._frf.kernel_weight / self._own
        error = (self._frf.response - blurred) / self._frf.sigma
        return np.concatenate((error.real, error.imag))


def in_kernel(frf: FrequencyResponse, start: TransferFunction) -> tuple[Callable[[FloatArray], FloatArray], FloatArray]:
    """(weighted errors, start) of our compiled model in its orthonormal basis."""
    task = problem(frf, Structure())
    point = from_transfer_function(task, start)
    assert point is not None
    here, first = model(task, point), np.concatenate((point.b, point.a[:-1], [point.delay * 1e3]))

    def errors(x: FloatArray) -> FloatArray:
        predicted: ComplexArray = predict(here, x[:3].copy(), np.append(x[3:6], 1.0), max(float(x[6]), 0.0) * 1e-3)
        error = task.weight * (task.frf.response - predicted)
        return np.concatenate((error.real, error.imag))

    return errors, first


def vector_fit(frf: FrequencyResponse, pairs: int) -> ComplexArray:
    """The response by scikit-rf's vector fitting of s H(s), with ``pairs`` complex pairs and one real pole."""
    import skrf
    from skrf.vectorFitting import VectorFitting

    s = 2j * np.pi * frf.frequency
    network = skrf.Network(frequency=skrf.Frequency.from_f(frf.frequency, unit="hz"), s=(s * frf.response * 10.0)[:, None, None], z0=50)
    fitting = VectorFitting(network)
    fitting.vector_fit(n_poles_real=1, n_poles_cmplx=pairs, fit_constant=True, fit_proportional=False)
    return np.asarray(fitting.get_model_response(0, 0, frf.frequency) / s / 10.0)


def run(report: Callable[[str], None], short: bool = False) -> Table:
    """Times, costs and ratios."""
    frf, structure = measured(), Structure()
    start = start_from(machine())
    by_hand = ByHand(frf, start)
    errors, first = in_kernel(frf, start)
    works: dict[str, Callable[[], object]] = {
        "xy_sysid, from the start": lambda: identify(frf, structure, start, doubt=False),
        "xy_sysid, as live (1e-6)": lambda: identify(frf, structure, start, FitOptions(relative_change=1e-6), doubt=False),
        "xy_sysid, cold": lambda: identify(frf, structure),
        "least_squares, trf": lambda: scipy.optimize.least_squares(by_hand, np.ones(7)),
        "least_squares, lm": lambda: scipy.optimize.least_squares(by_hand, np.ones(7), method="lm"),
        "least_squares, lm, our compiled model": lambda: scipy.optimize.least_squares(errors, first, method="lm"),
    }
    if importlib.util.find_spec("skrf"):
        works |= {f"vector fitting, {pairs} pairs": partial(vector_fit, frf, pairs) for pairs in (2, 4)}
    report("fit: times")
    times = medians(works, 1 if short else REPEATS)

    def outcome(name: str) -> tuple[float, float]:
        result = works[name]()
        if name.startswith("xy"):
            assert hasattr(result, "cost") and hasattr(result, "relative_error")
            return float(result.cost), float(result.relative_error)
        if name.startswith("least"):
            assert isinstance(result, scipy.optimize.OptimizeResult)
            error = result.fun[:LINES] + 1j * result.fun[LINES:]
            return float(result.cost), float(np.sqrt(np.mean(np.abs(error * frf.sigma / frf.response) ** 2)))
        error = np.asarray(result) - frf.response
        return 0.5 * float(np.sum(np.abs(error / frf.sigma) ** 2)), float(np.sqrt(np.mean(np.abs(error / frf.response) ** 2)))

    found = {name: outcome(name) for name in works}
    ours = "xy_sysid, from the start"
    rows = tuple(
        (name, f"{1e3 * times[name]:.2f}", f"{times[name] / times[ours]:.1f}x", f"{found[name][0]:.6g}", f"{100 * found[name][1]:.3f} %")
        for name in works
    )
    slow = "least_squares, trf"
    checks = (
        at_least("least_squares (trf) over xy_sysid, time", times[slow] / times[ours], 20.0),
        at_least("least_squares (lm) over xy_sysid, time", times["least_squares, lm"] / times[ours], 20.0),
        at_most("cost of xy_sysid over that of least_squares", found[ours][0] / min(found[slow][0], found["least_squares, lm"][0]), 1.0 + 1e-6),
    )
    columns = ("fit", "ms", "time over ours", "cost", "relative error")
    return Table("Transfer function with delay, 612 lines", __doc__.split("\n\n", 1)[1], columns, rows, checks)
