"""Sum, product, inverse and closed loop of responses, with uncertainty (first order; errors of two measurements are assumed to be independent).

The second operand may be another response, anything with ``response(frequency)`` and units (a transfer function), or a number. Two
measured responses are interpolated to the lines of the first, within their common band.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True, slots=True)
class Operand:
    """Values (m,) of the second operand at the first one's lines, their sigma, trusted lines, and units; empty units match any."""

    values: ComplexArray
    sigma: FloatArray
    trusted: Any
    input_unit: str
    output_unit: str


def added(one: FrequencyResponse, other: Any, sign: float = 1.0) -> FrequencyResponse:
    """one + sign other. Raises BadInput for different units, or bands without common lines."""
    one, second = _together(one, other)
    if second.output_unit and (second.input_unit, second.output_unit) != (one.input_unit, one.output_unit):
        raise _apart("sum", one, second)
    return _made(one, one.response + sign * second.values, np.hypot(one.sigma, second.sigma), second.trusted)


def multiplied(one: FrequencyResponse, other: Any) -> FrequencyResponse:
    """Series connection: the output of other is the input of one. Raises BadInput if their units or bands do not match."""
    one, second = _together(one, other)
    if second.output_unit and second.output_unit != one.input_unit:
        raise _apart("product", one, second)
    sigma = np.hypot(one.sigma * np.abs(second.values), second.sigma * np.abs(one.response))
    made = _made(one, one.response * second.values, sigma, second.trusted)
    return replace(made, input_unit=second.input_unit or one.input_unit)


def inverted(one: FrequencyResponse) -> FrequencyResponse:
    """The inverse response: input over output."""
    with np.errstate(divide="ignore", invalid="ignore"):
        response, sigma = 1.0 / one.response, one.sigma / np.abs(one.response) ** 2
    made = _made(one, response, sigma, np.isfinite(response))
    return replace(made, input_unit=one.output_unit, output_unit=one.input_unit)


def closed(plant: FrequencyResponse, controller: Any) -> FrequencyResponse:
    """The closed loop from reference to output, P C / (1 + P C); the controller is from the plant's output to its input.

    Raises BadInput if units or bands do not match.
    """
    plant, second = _together(plant, controller)
    if second.output_unit and (second.output_unit, second.input_unit) != (plant.input_unit, plant.output_unit):
        raise _apart("loop", plant, second)
    loop = plant.response * second.values
    sigma = np.hypot(plant.sigma * np.abs(second.values), second.sigma * np.abs(plant.response))
    made = _made(plant, loop / (1.0 + loop), sigma / np.abs(1.0 + loop) ** 2, second.trusted)
    return replace(made, input_unit=plant.output_unit)


def _together(one: FrequencyResponse, other: Any) -> tuple[FrequencyResponse, Operand]:
    if isinstance(other, (int, float, complex, np.number)):
        every, none = np.full(len(one), complex(other)), np.zeros(len(one))
        return one, Operand(values=every, sigma=none, trusted=np.isfinite(every), input_unit="", output_unit="")
    if not isinstance(other, FrequencyResponse):
        if not callable(getattr(other, "response", None)):
            raise BadInput("operand", type(other).__name__, "a frequency response, a transfer function or a number", "Give one of these.")
        values = np.asarray(other.response(one.frequency), dtype=np.complex128)
        return one, Operand(
            values=values, sigma=np.zeros(len(one)), trusted=np.isfinite(values), input_unit=other.input_unit, output_unit=other.output_unit
        )
    low, high = max(one.frequency[0], other.frequency[0]), min(one.frequency[-1], other.frequency[-1])
    if not low < high:
        bands = " and ".join(f"{item.frequency[0]:.4g} to {item.frequency[-1]:.4g} Hz" for item in (one, other))
        raise BadInput("bands of the responses", bands, "some lines in common", "Measure both in one band.")
    one = one.band(float(low), float(high))
    f = one.frequency
    size = np.exp(np.interp(f, other.frequency, np.log(np.maximum(np.abs(other.response), 1e-300))))
    phase = np.interp(f, other.frequency, np.unwrap(np.angle(other.response)))
    finite = np.where(np.isfinite(other.sigma), other.sigma, 1e300)
    return one, Operand(
        values=np.asarray(size * np.exp(1j * phase), dtype=np.complex128),
        sigma=np.interp(f, other.frequency, finite),
        trusted=np.interp(f, other.frequency, other.trusted.astype(np.float64)) == 1.0,
        input_unit=other.input_unit,
        output_unit=other.output_unit,
    )


def _made(one: FrequencyResponse, response: ComplexArray, sigma: FloatArray, trusted: Any) -> FrequencyResponse:
    """The result as a response, without the smoothing kernel, which is valid for the first operand only."""
    return replace(
        one,
        response=np.asarray(response, dtype=np.complex128),
        sigma=np.asarray(sigma, dtype=np.float64),
        trusted=one.trusted & trusted & np.isfinite(response),
        kernel_offset=np.zeros(1),
        kernel_weight=np.ones(1),
        kernel_amplitude=np.zeros(0),
        differenced=False,
        noise=np.zeros(0),
        distortion=np.zeros(0),
    )


def _apart(what: str, one: FrequencyResponse, second: Operand) -> BadInput:
    units = f"{one.output_unit} per {one.input_unit} and {second.output_unit} per {second.input_unit}"
    return BadInput(f"units of the {what}", units, "units that fit together", "Change the order, or convert one of them.")
