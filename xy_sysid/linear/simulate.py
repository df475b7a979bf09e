"""A transfer function in the time domain: exact for an input held between samples, with any delay.

The state is stepped by the matrix exponential; a sample is split where the delayed input changes (Astrom & Wittenmark,
Computer-Controlled Systems, 3rd ed., sec. 2.3 and 3.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sysid.errors import BadInput
from xy_sysid.jit import compiled
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray

FINER = 8  # steps per sample for an input that is not held
WHOLE = 1e-9  # a delay within this fraction of a sample counts as an integer number of samples


@dataclass(frozen=True, slots=True)
class Stepper:
    """x[n+1] = step x[n] + new u[n-whole] + old u[n-whole-1],  y[n] = out x[n] + direct_new u[n-whole] + direct_old u[n-whole-1].

    step: (n, n); new, old, out: (n,); whole: samples
    """

    step: FloatArray
    new: FloatArray
    old: FloatArray
    out: FloatArray
    direct_new: float
    direct_old: float
    whole: int


def state_space(tf: TransferFunction) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    """(A, b, c, d) of the function without its delay, balanced. Raises BadInput if it has more zeros than poles."""
    top, bottom = np.trim_zeros(tf.numerator, "f"), np.trim_zeros(tf.denominator, "f")
    if top.size > bottom.size:
        raise BadInput("numerator order", top.size - 1, f"at most the denominator's, {bottom.size - 1}", "Such a function cannot be simulated.")
    order = bottom.size - 1
    full = np.concatenate((np.zeros(bottom.size - top.size), top)) / bottom[0]
    monic = bottom / bottom[0]
    direct = float(full[0])
    a = np.zeros((order, order))
    if order:
        a[0] = -monic[1:]
        a[np.arange(1, order), np.arange(order - 1)] = 1.0
    b = np.zeros(order)
    b[:1] = 1.0
    c = full[1:] - direct * monic[1:]
    if order:
        scale = float(np.max(np.abs(tf.poles()))) or 1.0
        weight = scale ** np.arange(order, dtype=np.float64)  # states in powers of s / scale
        a, b, c = a * weight[:, None] / weight[None, :], b * weight, c / weight
    return a, b, c, direct


def stepper(tf: TransferFunction, sampling_rate: float) -> Stepper:
    """The exact sampled form. Raises BadInput for a discrete function with another sampling time."""
    period = 1.0 / sampling_rate
    a, b, c, direct = state_space(tf)
    samples = tf.delay * sampling_rate
    whole = int(np.floor(samples + WHOLE))
    part = samples - whole
    if tf.sampling_time is not None:
        if abs(tf.sampling_time * sampling_rate - 1.0) > 1e-6:
            raise BadInput("sampling time of the model", f"{tf.sampling_time} s", f"{period} s, the data's", "Use data of the same rate.")
        return Stepper(step=a, new=b, old=np.zeros_like(b), out=c, direct_new=direct, direct_old=0.0, whole=round(samples))
    if part < WHOLE:
        step, new = _hold(a, b, period)
        return Stepper(step=step, new=new, old=np.zeros_like(b), out=c, direct_new=direct, direct_old=0.0, whole=whole)
    late, old = _hold(a, b, part * period)
    rest, new = _hold(a, b, (1.0 - part) * period)
    return Stepper(step=rest @ late, new=new, old=rest @ old, out=c, direct_new=0.0, direct_old=direct, whole=whole)


def _hold(a: FloatArray, b: FloatArray, time: float) -> tuple[FloatArray, FloatArray]:
    order = b.size
    block = np.zeros((order + 1, order + 1))
    block[:order, :order], block[:order, order] = a * time, b * time
    grown = scipy.linalg.expm(block)
    return np.asarray(grown[:order, :order]), np.asarray(grown[:order, order])


def simulate(tf: TransferFunction, sampling_rate: float, held_input: FloatArray) -> FloatArray:
    """(n,) output at the sample instants, from rest, for an input (n,) held from each sample to the next."""
    s = stepper(tf, sampling_rate)
    values = np.ascontiguousarray(held_input, dtype=np.float64)
    return _run(s.step, s.new, s.old, s.out, s.direct_new, s.direct_old, s.whole, values)


@compiled
def _run(
    step: NDArray[np.float64], new: NDArray[np.float64], old: NDArray[np.float64], out: NDArray[np.float64],
    direct_new: float, direct_old: float, whole: int, values: NDArray[np.float64],
) -> NDArray[np.float64]:  # fmt: skip
    order = out.shape[0]
    x, following = np.zeros(order), np.zeros(order)
    y = np.empty(values.shape[0])
    for n in range(values.shape[0]):
        u = values[n - whole] if n >= whole else 0.0
        before = values[n - whole - 1] if n >= whole + 1 else 0.0
        total = direct_new * u + direct_old * before
        for i in range(order):
            total += out[i] * x[i]
        y[n] = total
        for i in range(order):
            value = new[i] * u + old[i] * before
            for j in range(order):
                value += step[i, j] * x[j]
            following[i] = value
        for i in range(order):
            x[i] = following[i]
    return y


def held_response(tf: TransferFunction, frequency: FloatArray, sampling_rate: float) -> ComplexArray:
    """(m,) exact response from held input samples to output samples: zero-order hold, delay, plant, sampler.

    The sampled form at z = exp(j w T), correct for poles of any speed; a discrete function is used unchanged.
    Raises BadInput if it has more zeros than poles.
    """
    if tf.sampling_time is not None:
        return tf.response(frequency)
    s = stepper(tf, sampling_rate)
    turns = np.asarray(frequency, dtype=np.float64) / sampling_rate
    standing = turns == np.rint(turns)  # a multiple of the sampling rate appears at 0 Hz
    z = np.exp(2j * np.pi * np.where(standing, 0.5, turns))
    driven = s.new + s.old / z[:, None]
    state = np.linalg.solve(z[:, None, None] * np.eye(s.out.size) - s.step, driven[:, :, None])[:, :, 0]
    value = (state @ s.out + s.direct_new + s.direct_old / z) * z ** -float(s.whole)
    return np.asarray(np.where(standing, tf.response(np.zeros_like(turns)), value), dtype=np.complex128)


RUNS_AWAY = -1e5  # per cent; below it (an error of a thousand times the motion) no number is given


@dataclass(frozen=True, slots=True)
class SimulationError:
    """Difference between a simulation and the measurement.

    rms:     of the difference, in ``unit``
    nrmse:   100 (1 - |difference| / |measured - mean|), per cent; 100 is perfect; -inf, and rms inf, for a model that diverges
    compared: "output", or "velocity" (the output's difference times the rate) for an integrating model
    seconds: of data compared
    """

    rms: float
    nrmse: float
    unit: str
    compared: str
    seconds: float


def simulate_sampled(tf: TransferFunction, sampling_rate: float, values: FloatArray, hold: Literal["zoh", "none"] = "zoh") -> FloatArray:
    """(n,) response, from rest, to input samples (n,): held from each to the next, or band-limited between them."""
    if hold == "zoh" or tf.sampling_time is not None:
        return simulate(tf, sampling_rate, values)
    from scipy.signal import resample_poly

    fine = np.asarray(resample_poly(values, FINER, 1, padtype="line"), dtype=np.float64)
    middle = 0.5 * (fine + np.append(fine[1:], fine[-1:]))
    return simulate(tf, FINER * sampling_rate, middle)[::FINER]


def simulation_error(
    tf: TransferFunction,
    sampling_rate: float,
    held_input: FloatArray,
    measured: FloatArray,
    skip: float = 0.5,
    hold: Literal["zoh", "none"] = "zoh",
) -> SimulationError:
    """Simulate from the measured input and compare with the measured output.

    An integrating model is compared in velocity, as its position drifts from any tiny offset. Constant parts are removed
    (a recording does not start from rest), and the first ``skip`` seconds left out (for the same reason).
    Raises BadInput for arrays of unequal or too small length.
    """
    if held_input.shape != measured.shape or held_input.ndim != 1:
        raise BadInput("shape of the output", measured.shape, f"that of the input, {held_input.shape}", "Give one row per sample of one axis.")
    first = int(skip * sampling_rate)
    if measured.size < first + 16:
        raise BadInput("number of samples", measured.size, f"{first + 16} or more", "Give a longer recording.")
    predicted = simulate_sampled(tf, sampling_rate, held_input - np.mean(held_input), hold)
    compared, unit, target = "output", tf.output_unit, measured
    if tf.integrators:
        compared, unit = "velocity", f"{tf.output_unit}/s"
        predicted, target = np.diff(predicted) * sampling_rate, np.diff(measured) * sampling_rate
    return _error(predicted[first:], target[first:], sampling_rate, unit, compared)


def velocity_error(velocity: FloatArray, sampling_rate: float, measured: FloatArray, unit: str, skip: float = 0.5) -> SimulationError:
    """A simulated velocity (n - 1,) of any model against the output (n,); as ``simulation_error``."""
    first = int(skip * sampling_rate)
    if measured.size < first + 16 or velocity.size != measured.size - 1:
        raise BadInput("number of samples", measured.size, f"{first + 16} or more", "Give a longer recording.")
    return _error(velocity[first:], np.diff(measured)[first:] * sampling_rate, sampling_rate, unit, "velocity")


def _error(predicted: FloatArray, target: FloatArray, sampling_rate: float, unit: str, compared: str) -> SimulationError:
    difference = target - predicted
    difference = difference - np.mean(difference)
    spread = float(np.linalg.norm(target - np.mean(target)))
    size = float(np.linalg.norm(difference))
    share = 100.0 * (1.0 - size / spread) if spread > 0 and np.isfinite(size) else float("-inf")
    if share < RUNS_AWAY:
        size, share = float("inf"), float("-inf")
    return SimulationError(rms=size / float(np.sqrt(target.size)), nrmse=share, unit=unit, compared=compared, seconds=target.size / sampling_rate)
