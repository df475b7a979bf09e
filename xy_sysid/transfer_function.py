"""A rational transfer function with delay."""

from __future__ import annotations

from dataclasses import dataclass

from xy_sysid.stream import FloatArray


@dataclass(frozen=True, slots=True)
class TransferFunction:
    """numerator(s) / denominator(s) * exp(-delay s), or in z with ``sampling_time`` set.

    numerator:     (m + 1,) coefficients of falling powers, in output_unit / input_unit and rad/s
    denominator:   (n + 1,) coefficients of falling powers, the first is 1
    delay:         s, >= 0
    sampling_time: s for a discrete function of z, None for a continuous function of s
    """

    numerator: FloatArray
    denominator: FloatArray
    delay: float = 0.0
    sampling_time: float | None = None
    input_unit: str = "V"
    output_unit: str = "m"
