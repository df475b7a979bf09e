"""The expected response of a transfer function at the lines: hold, delay, window, and its derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from helpers.fitting_data import RATE, held, lines, paper_machine

from xy_sysid.fitting import Structure, identify
from xy_sysid.fitting.damped import weighted
from xy_sysid.fitting.problem import Point, Problem, from_transfer_function, moved, problem, response
from xy_sysid.linear.simulate import held_response, simulate, state_space
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.batch_spectra import batch_spectra
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.response.h1 import H1Options, frequency_response
from xy_sysid.response.windows import WindowShape, blur_kernel
from xy_sysid.samples.block import FloatArray

SHAPE = WindowShape.of("hann", 4096, 0.5)


def by_exponential(tf: TransferFunction, frequency: FloatArray) -> ComplexArray:
    """Held samples to samples from the matrix exponential over each piece of constant input, solved in z: nothing shared."""
    a, b, c, d = state_space(tf)
    period, z = 1.0 / RATE, np.exp(2j * np.pi * frequency / RATE)
    whole = int(np.floor(tf.delay * RATE + 1e-9))
    part = tf.delay - whole * period

    def grown(time: float) -> tuple[FloatArray, FloatArray]:
        order = b.size
        block = np.zeros((order + 1, order + 1))
        block[:order, :order], block[:order, order] = a * time, b * time
        result = scipy.linalg.expm(block)
        return result[:order, :order], result[:order, order]

    late, old = grown(part)
    rest, new = grown(period - part)
    step = rest @ late
    out = np.empty(frequency.size, dtype=np.complex128)
    for i, zi in enumerate(z):
        x = np.linalg.solve(zi * np.eye(b.size) - step, new + rest @ old / zi)
        out[i] = (c @ x + d / zi ** int(part > 1e-12)) * zi**-whole
    return out


@pytest.mark.parametrize("delay", [0.0, 0.2e-3, 1.29e-3, 2e-3, 7.77e-3])
@pytest.mark.parametrize(
    "base",
    [
        paper_machine(0.0),
        TransferFunction(np.array([1.0]), np.array([1.0, 0.0, 0.0])),
        TransferFunction(np.array([1.0, 20.0, 4e6]), np.array([1.0, 300.0, 9e6])),
        TransferFunction(np.array([5000.0]), np.array([1.0, 5000.0])),
    ],
    ids=["paper", "double integrator", "direct feedthrough", "fast pole"],
)
def test_the_held_response_is_that_of_the_matrix_exponential(base: TransferFunction, delay: float) -> None:
    """With any fractional delay, up to the Nyquist frequency."""
    frequency = np.array([0.1, 3.0, 47.0, 111.0, 300.0, 700.0, 990.0])
    tf = replace(base, delay=delay)
    if tf.numerator.size == tf.denominator.size and 0 < (delay * RATE) % 1 < 1:
        frequency = frequency[:5]  # a jump between samples has aliases that fall only as 1 / k
    truth = by_exponential(tf, frequency)
    assert np.max(np.abs(held_response(tf, frequency, RATE) / truth - 1.0)) < 1e-7


@pytest.mark.parametrize("pole", [1e3, 1e5, 1e7])
@pytest.mark.parametrize("delay", [0.0, 0.4e-3, 1.29e-3])
def test_the_held_response_is_exact_for_poles_of_any_speed(pole: float, delay: float) -> None:
    """A lag behind a hold: y approaches u as 1 - exp(-pole t), derived by hand."""
    frequency = np.array([0.1, 47.0, 300.0, 990.0])
    z = np.exp(2j * np.pi * frequency / RATE)
    whole, part = divmod(delay * RATE, 1.0)
    settled, late = np.exp(-pole / RATE), np.exp(-pole * (1.0 - part) / RATE)
    truth = ((1.0 - late) + (late - settled) / z) / (z - settled) * z**-whole
    lag = TransferFunction(np.array([pole]), np.array([1.0, pole]), delay)
    assert np.max(np.abs(held_response(lag, frequency, RATE) / truth - 1.0)) < 1e-10


STRUCTURES = {
    "held, differenced, window": Structure(),
    "held, no integrator": Structure(1, 3, 0),
    "band-limited": Structure(hold="none"),
    "delay known": Structure(delay=1.1e-3),
    "relative weight": Structure(weighting="relative"),
    "z": Structure(2, 4, 1, domain="z", delay=0.001),
    "two integrators": Structure(1, 4, 2),
}


def windowed(frf: FrequencyResponse) -> FrequencyResponse:
    kernel = blur_kernel(SHAPE)
    half = (kernel.size - 1) // 2
    return replace(frf, kernel_offset=np.arange(-half, half + 1) * 0.5 * RATE / 4096, kernel_weight=kernel, differenced=True)


def around(task: Problem, random: np.random.Generator) -> Point:
    """A point with a bad fit, so that no derivative is small by chance."""
    structure = task.structure
    if structure.domain == "z":
        roots = np.concatenate((np.ones(structure.integrators), 0.4 + 0.3 * random.random(structure.free_order)))
        tf = TransferFunction(random.standard_normal(structure.numerator_order + 1), np.asarray(np.poly(roots), dtype=np.float64), 0.001, 1 / RATE)
    else:
        roots = np.concatenate((np.zeros(structure.integrators), -200.0 * (1 + random.random(structure.free_order))))
        tf = TransferFunction(1e4 * random.standard_normal(structure.numerator_order + 1), np.asarray(np.poly(roots), dtype=np.float64), 1.7e-3)
    point = from_transfer_function(task, tf)
    assert point is not None
    return point


@pytest.mark.parametrize("name", STRUCTURES)
def test_the_jacobian_is_the_slope_of_the_prediction(name: str) -> None:
    """Every column against central differences, to 1e-6 of its size."""
    structure = STRUCTURES[name]
    frf = held(paper_machine(), lines(120, 2.5))
    task = problem(windowed(frf) if structure.integrators == 1 else frf, structure)
    at = around(task, np.random.default_rng(3))
    table = weighted(task, at)
    free = at.b.size + at.a.size - 1
    assert table.shape == (structure.parameters + 1, 2 * 120)
    for k in range(structure.parameters):

        def shifted(change: float, k: int = k) -> ComplexArray:
            b, a, delay = at.b.copy(), at.a.copy(), at.delay
            if k < b.size:
                b[k] += change
            elif k < free:
                a[k - b.size] += change
            else:
                delay += change
            return response(task, moved(at, b, a, delay)) * task.weight

        size = 1e-7 if k == free else 1e-4 * max(abs(at.b[k]) if k < at.b.size else 1.0, 1e-3)
        slopes = [(shifted(h) - shifted(-h)) / (2 * h) for h in (size, size / 2)]
        slope = (4.0 * slopes[1] - slopes[0]) / 3.0  # Richardson: the error is of order h^4
        column = table[k, :120] + 1j * table[k, 120:]
        assert np.max(np.abs(column - slope)) < 1e-6 * np.max(np.abs(slope))


def test_the_prediction_is_the_held_response_seen_through_the_window() -> None:
    """Blur of the differenced response, divided by the difference's own: built here from its parts."""
    tf = paper_machine()
    frf = windowed(held(tf, lines(200)))
    task = problem(frf, Structure())
    point = from_transfer_function(task, tf)
    assert point is not None
    grid = frf.frequency[:, None] + frf.kernel_offset[None, :]
    grid[np.abs(grid) < 1e-9] = 1e-6  # the limit at 0 Hz
    differenced = held_response(tf, np.abs(grid).ravel(), RATE).reshape(grid.shape)
    differenced = np.where(grid < 0, np.conj(differenced), differenced) * np.expm1(2j * np.pi * grid / RATE)
    expected = differenced @ frf.kernel_weight / np.expm1(2j * np.pi * frf.frequency / RATE)
    assert np.max(np.abs(response(task, point) / expected - 1.0)) < 1e-8


def test_a_sharp_resonance_is_not_flattened_by_the_window() -> None:
    """A damping of 0.5 % at 40 Hz, far narrower than a line of the window: found to 3 %, because the model is blurred too."""
    pair = 2 * np.pi * 40.0
    tf = TransferFunction(np.array([pair**2]), np.array([1.0, 2 * 0.005 * pair, pair**2]), 0.6e-3)
    u = np.random.default_rng(4).standard_normal(400_000)
    y = simulate(tf, RATE, u)
    frf = frequency_response(batch_spectra([(0, u, y)], SHAPE, False), SHAPE, RATE, H1Options(differenced=False, band=(5.0, 200.0)))
    fit = identify(frf, Structure(0, 2, 0))
    sharp = identify(replace(frf, kernel_offset=np.zeros(1), kernel_weight=np.ones(1), kernel_amplitude=np.zeros(0)), Structure(0, 2, 0))
    assert fit.interval("resonance_1.damping").value == pytest.approx(0.005, rel=0.03)
    assert fit.interval("resonance_1.frequency").value == pytest.approx(40.0, abs=0.01)
    assert fit.consistent
    assert not sharp.consistent
    assert sharp.interval("resonance_1.damping").low > 0.005
