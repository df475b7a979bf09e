"""A rational transfer function with delay: response, poles and zeros, stability, Pade form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import factorial, inf
from typing import Literal

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import derivative_of

ON_THE_EDGE = 1e-9  # relative distance from the stability limit that counts as on the limit
LIGHT_DAMPING = 0.4  # damping ratio; a pole pair with more is not called a resonance


@dataclass(frozen=True, slots=True)
class Mode:
    """A root (rad/s, or z) as an oscillator: natural frequency in Hz and damping ratio (1 or -1 for a real root)."""

    root: complex
    frequency: float
    damping: float


@dataclass(frozen=True, slots=True)
class TransferFunction:
    """numerator(s) / denominator(s) * exp(-delay s), or in z with ``sampling_time`` set.

    numerator:     (m + 1,) coefficients of falling powers, in output_unit / input_unit and rad/s
    denominator:   (n + 1,) coefficients of falling powers, the first is 1
    delay:         s, >= 0; whole samples for a discrete function
    sampling_time: s for a discrete function of z, None for a continuous function of s
    """

    numerator: FloatArray
    denominator: FloatArray
    delay: float = 0.0
    sampling_time: float | None = None
    input_unit: str = "V"
    output_unit: str = "m"

    def __post_init__(self) -> None:
        if not self.delay >= 0.0 or self.delay == inf:
            raise BadInput("delay", f"{self.delay} s", ">= 0 s", "A causal model has no negative delay.")
        if self.numerator.ndim != 1 or self.denominator.ndim != 1:
            shapes = f"{self.numerator.shape} and {self.denominator.shape}"
            raise BadInput("shape of numerator and denominator", shapes, "(m,) and (n,)", "Give the coefficients in falling powers.")
        if self.denominator.size == 0 or not np.any(self.denominator != 0):
            raise BadInput("denominator", "zero", "at least one coefficient that is not 0", "Give its coefficients in falling powers.")

    def __str__(self) -> str:
        """The formula, in three lines."""
        variable = "s" if self.sampling_time is None else "z"
        above, below = (_polynomial(items, variable) for items in (self.numerator, self.denominator))
        wide = max(len(above), len(below))
        delay = f" exp(-{self.delay:.4g} s)" if self.delay and self.sampling_time is None else ""
        if self.delay and self.sampling_time is not None:
            delay = f" z^-{round(self.delay / self.sampling_time)}"
        left = f"G({variable}) = "
        return "\n".join((" " * len(left) + above.center(wide).rstrip(), f"{left}{'-' * wide}{delay}", " " * len(left) + below.center(wide).rstrip()))

    def response(self, frequency: FloatArray) -> ComplexArray:
        """(m,) response at frequencies in Hz, of the function itself: no hold, no sampling of a continuous function."""
        omega = 2 * np.pi * np.asarray(frequency, dtype=np.float64)
        variable = 1j * omega if self.sampling_time is None else np.exp(1j * omega * self.sampling_time)
        with np.errstate(divide="ignore", invalid="ignore"):
            value = _rational(self, np.asarray(variable, dtype=np.complex128)) * np.exp(-1j * omega * self.delay)
        return np.asarray(value, dtype=np.complex128)

    def poles(self) -> ComplexArray:
        """Roots of the denominator, rad/s (z for a discrete function)."""
        return _roots(self.denominator)

    def zeros(self) -> ComplexArray:
        """Roots of the numerator, rad/s (z for a discrete function)."""
        return _roots(self.numerator)

    @property
    def integrators(self) -> int:
        """Poles at s = 0 (z = 1)."""
        if self.sampling_time is None:
            trimmed = np.trim_zeros(self.denominator, "b")
            return int(self.denominator.size - trimmed.size)
        return int(np.sum(np.abs(self.poles() - 1.0) < 1e-6))

    @property
    def gain(self) -> float:
        """Limit of s^integrators H(s) at s = 0: static gain, or velocity gain with one integrator.

        For a velocity or acceleration output, the gain of the position: the zeros at s = 0 from differentiation are divided out.
        """
        count = self.integrators
        if self.sampling_time is None:
            top = self.numerator
            for _ in range(derivative_of(self.output_unit)):
                top = top[:-1] if top.size > 1 and top[-1] == 0.0 else top
            return float(top[-1] / self.denominator[self.denominator.size - 1 - count])
        reduced = self.denominator
        for _ in range(count):
            reduced = np.polydiv(reduced, np.array([1.0, -1.0]))[0]
        return float(np.polyval(self.numerator, 1.0) / np.polyval(reduced, 1.0)) / self.sampling_time**count

    @property
    def leading_gain(self) -> float:
        """Ratio of the first coefficients of numerator and denominator: the gain at the highest frequencies."""
        trimmed = np.trim_zeros(self.numerator, "f")
        return float(trimmed[0] / np.trim_zeros(self.denominator, "f")[0]) if trimmed.size else 0.0

    @property
    def is_stable(self) -> bool:
        """True if no pole is beyond the stability limit; integrators are allowed, also repeated ones, because they are physical."""
        return unstable(self.poles(), self.sampling_time).size == 0

    @property
    def phase_type(self) -> Literal["minimum", "non-minimum"]:
        """Minimum phase: no delay, and neither poles nor zeros beyond the limit of stability."""
        beyond = unstable(np.concatenate((self.poles(), self.zeros())), self.sampling_time)
        return "minimum" if self.delay == 0.0 and beyond.size == 0 else "non-minimum"

    def pole_modes(self) -> tuple[Mode, ...]:
        """Natural frequency and damping of each pole, conjugates once, lowest first."""
        return _modes(self.poles(), self.sampling_time)

    def zero_modes(self) -> tuple[Mode, ...]:
        """Natural frequency and damping of each zero, conjugates once, lowest first."""
        return _modes(self.zeros(), self.sampling_time)

    def pade(self, order: int = 4) -> TransferFunction:
        """The function without delay: exp(-s delay) becomes a Pade quotient; integer samples of a discrete function become poles at 0."""
        if self.delay == 0.0:
            return self
        if self.sampling_time is not None:
            samples = round(self.delay / self.sampling_time)
            return replace(self, denominator=np.append(self.denominator, np.zeros(samples)), delay=0.0)
        if not 1 <= order <= 10:
            raise BadInput("Pade order", order, "1 to 10", "4 is usual.")
        k = np.arange(order, -1, -1)
        weight = np.array([factorial(2 * order - i) / (factorial(i) * factorial(order - i)) for i in k.tolist()]) * self.delay**k
        top, bottom = weight * (-1.0) ** k, weight
        return replace(
            self,
            numerator=np.convolve(self.numerator, top / bottom[0]),
            denominator=np.convolve(self.denominator, bottom / bottom[0]),
            delay=0.0,
        )


def _rational(tf: TransferFunction, variable: ComplexArray) -> ComplexArray:
    return np.asarray(np.polyval(tf.numerator, variable) / np.polyval(tf.denominator, variable), dtype=np.complex128)


def _polynomial(coefficients: FloatArray, variable: str) -> str:
    """The polynomial in falling powers with four digits; zero coefficients are omitted."""
    text = ""
    for power, value in zip(range(coefficients.size - 1, -1, -1), coefficients.tolist(), strict=True):
        if value == 0.0:
            continue
        factor = {0: "", 1: variable}.get(power, f"{variable}^{power}")
        size = f"{abs(value):.4g}"
        item = factor if factor and size == "1" else f"{size} {factor}".rstrip()
        text += f" {'-' if value < 0 else '+'} {item}" if text else f"{'-' if value < 0 else ''}{item}"
    return text or "0"


def _roots(coefficients: FloatArray) -> ComplexArray:
    """Roots with the variable scaled, so that coefficients of s^0 .. s^12 in rad/s stay in range."""
    trimmed = np.trim_zeros(np.asarray(coefficients, dtype=np.float64), "f")
    core = np.trim_zeros(trimmed, "b")
    zeros = np.zeros(trimmed.size - core.size, dtype=np.complex128)
    if core.size < 2:
        return zeros
    scale = float(abs(core[-1] / core[0]) ** (1.0 / (core.size - 1)))
    scaled = core * scale ** -np.arange(core.size, dtype=np.float64)
    found = np.asarray(np.roots(scaled), dtype=np.complex128) * scale
    return np.concatenate((found[np.lexsort((found.imag, np.round(np.abs(found) / scale, 9)))], zeros))


def unstable(roots: ComplexArray, sampling_time: float | None) -> ComplexArray:
    """The roots beyond the stability limit."""
    if sampling_time is not None:
        return np.asarray(roots[np.abs(roots) > 1.0 + 1e-6])
    return np.asarray(roots[roots.real > ON_THE_EDGE * np.abs(roots)])


def _modes(roots: ComplexArray, sampling_time: float | None) -> tuple[Mode, ...]:
    out: list[Mode] = []
    for root in roots[roots.imag >= 0]:
        s = complex(root) if sampling_time is None else complex(np.log(root)) / sampling_time if root != 0 else complex(-inf)
        size = abs(s)
        out.append(Mode(complex(root), size / (2 * np.pi), -s.real / size if 0 < size < inf else 1.0))
    return tuple(sorted(out, key=lambda mode: mode.frequency))
