"""Comparison of a given model with a measured response and signal to which it was not fitted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.linear.simulate import SimulationError, held_response, simulation_error, velocity_error
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.response.h1 import divisor
from xy_sysid.samples.block import FloatArray
from xy_sysid.tables import Table, with_sentence
from xy_sysid.units import over, position_of, told

AT_THE_FLOOR = 1.3  # rms residual in sigma up to which a model from other data counts as consistent with the noise


@dataclass(frozen=True, slots=True)
class ModelCheck:
    """Result of a model on data to which it was not fitted.

    frequency, measured, predicted: (m,) trusted lines, Hz; the data; the model through hold and window
    sigmas: (m,) |measured - predicted| in standard deviations of the measurement
    relative_error: rms of |measured - predicted| / |measured|; noise_floor: rms of sigma / |measured|
    rms_sigma, worst_sigma: rms and largest of ``sigmas``; worst_hz: frequency of the largest
    simulation: in the time domain, None if the data are too short
    """

    frequency: FloatArray
    measured: ComplexArray
    predicted: ComplexArray
    sigmas: FloatArray
    relative_error: float
    noise_floor: float
    rms_sigma: float
    worst_sigma: float
    worst_hz: float
    simulation: SimulationError | None
    sentence: str

    @property
    def holds(self) -> bool:
        """True if the residual is at the noise floor."""
        return self.rms_sigma <= AT_THE_FLOOR

    def __repr__(self) -> str:
        return f"<ModelCheck: {self.sentence}>"

    @property
    def table(self) -> Table:
        """The residual and the noise floor, over all trusted lines."""
        rows = (
            ("relative error", 100.0 * self.relative_error, "%"),
            ("noise floor", 100.0 * self.noise_floor, "%"),
            ("residual, rms", self.rms_sigma, "sigma"),
            ("residual, largest", self.worst_sigma, "sigma"),
            ("frequency of the largest", self.worst_hz, "Hz"),
        )
        return Table(("quantity", "value", "unit"), rows)

    def __str__(self) -> str:
        """The sentence and the table."""
        return with_sentence(self.sentence, self.table)


def through_window(tf: TransferFunction, frf: FrequencyResponse, hold: Literal["zoh", "none"] = "zoh") -> ComplexArray:
    """(m,) expected response of this model in a measurement like ``frf``: with hold, sampling and the window's smoothing."""
    total = np.zeros(len(frf), dtype=np.complex128)
    for offset, weight in zip(frf.kernel_offset, frf.kernel_weight, strict=True):
        at = frf.frequency + offset
        safe = np.where(np.abs(at) < 1e-9 * frf.sampling_rate, 1e-9 * frf.sampling_rate, at)
        value = held_response(tf, safe, frf.sampling_rate) if hold == "zoh" else tf.response(safe)
        total += weight * value * (divisor(safe, frf.sampling_rate) if frf.differenced else 1.0)
    return np.asarray(total / (divisor(frf.frequency, frf.sampling_rate) if frf.differenced else 1.0), dtype=np.complex128)


def check(tf: TransferFunction, frf: FrequencyResponse, u: FloatArray, y: FloatArray, hold: Literal["zoh", "none"] = "zoh") -> ModelCheck:
    """Compare at the trusted lines, and simulate the samples u, y (n,).

    Raises BadInput for other units, another sampling time, no trusted line, or a response that is not finite.
    """
    if (tf.input_unit, tf.output_unit) != (frf.input_unit, frf.output_unit):
        given, wanted = (over(item.output_unit, item.input_unit) for item in (tf, frf))
        raise BadInput("unit of the model", given, wanted, "Use a model and a recording of the same units.")
    if tf.sampling_time is not None and abs(tf.sampling_time * frf.sampling_rate - 1.0) > 1e-6:
        wanted = f"{1 / frf.sampling_rate:g} s, the recording's"
        raise BadInput("sampling time of the model", f"{tf.sampling_time:g} s", wanted, "Use data of the same rate.")
    lines = frf.select(frf.trusted)
    if len(lines) == 0:
        raise BadInput("number of trusted lines", 0, "1 or more", "Record longer, excite more, or widen the band.")
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        predicted = through_window(tf, lines, hold)
        usable = bool(np.isfinite(np.sum(np.abs(predicted / lines.response) ** 2)))  # an overflow is not finite either
    if not usable:
        raise BadInput("response of the model", "not finite", "finite in the band of the recording", "Check the coefficients of the model.")
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # an unstable model diverges, and the result says so
            simulated = simulation_error(tf, frf.sampling_rate, u, y, hold=hold)
    except BadInput:
        simulated = None
    return _judged(lines, predicted, simulated)


def check_motion(velocity: FloatArray, simulated: FrequencyResponse, frf: FrequencyResponse, y: FloatArray) -> ModelCheck:
    """Compare any model by its simulated motion: velocity (n - 1,) for the run with output y (n,), and the response of that motion.

    simulated: estimated with the settings of ``frf``. Raises BadInput without trusted lines.
    """
    lines = frf.select(frf.trusted)
    if len(lines) == 0:
        raise BadInput("number of trusted lines", 0, "1 or more", "Record longer, excite more, or widen the band.")
    predicted = np.interp(lines.frequency, simulated.frequency, simulated.response.real)
    predicted = predicted + 1j * np.interp(lines.frequency, simulated.frequency, simulated.response.imag)
    return _judged(lines, np.asarray(predicted), velocity_error(velocity, frf.sampling_rate, y, f"{position_of(frf.output_unit)}/s"))


def _judged(lines: FrequencyResponse, predicted: ComplexArray, simulated: SimulationError | None) -> ModelCheck:
    error = np.abs(lines.response - predicted)
    size = np.abs(lines.response)
    relative = float(np.sqrt(np.mean((error / size) ** 2)))
    floor = float(np.sqrt(np.mean((lines.sigma / size) ** 2)))
    sigmas = error / lines.sigma
    worst = int(np.argmax(sigmas))
    rms = float(np.sqrt(np.mean(sigmas**2)))
    if rms <= AT_THE_FLOOR:
        sentence = f"the model holds: its residual is {rms:.2f} sigma, at the noise floor."
    else:
        sentence = (
            f"the model is off by {told(100 * relative, 2)} % where noise allows {told(100 * floor, 2)} %; "
            f"most at {lines.frequency[worst]:.4g} Hz ({told(float(sigmas[worst]))} sigma)."
        )
    return ModelCheck(
        frequency=lines.frequency,
        measured=lines.response,
        predicted=predicted,
        sigmas=sigmas,
        relative_error=relative,
        noise_floor=floor,
        rms_sigma=rms,
        worst_sigma=float(sigmas[worst]),
        worst_hz=float(lines.frequency[worst]),
        simulation=simulated,
        sentence=sentence,
    )
