"""The linear part of an axis model as a transfer function: base, delay, resonances and lags, without friction and other nonlinear effects.

Linear effects are found by evaluating their laws, so that users' own effects are included.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from xy_sysid.axis.model import AxisModel
from xy_sysid.axis.resonant_loop import FINE
from xy_sysid.effects import Effect
from xy_sysid.effects._contract import arguments
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.units import USUAL, Units

ROUNDING = 1e-3  # relative to a pole, above its imaginary part by rounding: a double root at 1 Hz has 2.5e-4
STEP = 1e-5  # s, step for the test of a lag


def linear_part(model: AxisModel, units: Units = USUAL) -> TransferFunction:
    """Position over voltage, continuous, with the delay: gain pole / (s (s + pole)) times every linear effect."""
    numerator, denominator = np.array([model.gain * model.pole]), np.array([1.0, model.pole, 0.0])
    for name, values in model.effects:
        top, bottom = _section(model.library[name], values)
        numerator, denominator = np.polymul(numerator, top), np.polymul(denominator, bottom)
    return TransferFunction(numerator / denominator[0], denominator / denominator[0], model.delay, input_unit=units.input, output_unit=units.output)


def nonlinear(model: AxisModel) -> tuple[str, ...]:
    """Names of the effects that are not in the linear part."""
    return tuple(name for name, values in model.effects if np.array_equal(_section(model.library[name], values), ([1.0], [1.0])))


def sections(model: AxisModel, sampling_rate: float) -> tuple[tuple[float, ...], ...]:
    """b0, b1, b2, a1, a2 of each section between the base's motion and the output, at this rate (Hz)."""
    passed = [(model.library[name], values) for name, values in model.effects if model.library[name].category == "motion"]
    laws = [(effect.functions["section"], effect, values) for effect, values in passed]
    return tuple(tuple(law(**_bound(law, effect, values, {"fs": sampling_rate}))) for law, effect, values in laws)


def resonance(effect: Effect, values: tuple[float, ...]) -> float:
    """Hz, at which the poles of a resonance oscillate: above its ``mode_frequency`` if that is the antiresonance.

    NaN if nothing oscillates: overdamped poles, and a user's law without poles or numbers.
    """
    try:
        poles = np.roots(_section(effect, values)[1])
    except np.linalg.LinAlgError:
        return math.nan
    swings = [abs(pole.imag) for pole in poles if abs(pole.imag) > ROUNDING * abs(pole)]
    return max(swings, default=math.nan) / (2.0 * math.pi)


def _section(effect: Effect, values: tuple[float, ...]) -> tuple[Any, Any]:
    """Numerator and denominator with gain 1 at 0 Hz; 1 and 1 for a nonlinear effect."""
    if effect.category == "motion":
        b0, b1, b2, a1, a2 = effect.functions["section"](**_bound(effect.functions["section"], effect, values, {"fs": FINE}))
        return _polynomial([b0, b1, b2]), _polynomial([1.0, a1, a2])
    lag = lag_of(effect, values)
    return ([1.0], [1.0]) if lag is None else ([1.0], [lag, 1.0])


def _polynomial(discrete: list[float]) -> Any:
    """Polynomial in s, 1 at 0 Hz, with the roots s = ln(z) fs; roots at z = -1 have no counterpart in s and are dropped."""
    roots = np.roots(discrete)
    kept = np.log(roots[(np.abs(roots) > 1e-9) & (np.abs(roots + 1.0) > 1e-6)].astype(np.complex128)) * FINE
    found = np.real(np.atleast_1d(np.poly(kept)))
    return found / found[-1]


def lag_of(effect: Effect, values: tuple[float, ...]) -> float | None:
    """The time constant if the law is a first-order lag of the voltage, independent of speed, position and time; None for any other effect."""
    if effect.category != "state" or len(effect.states) != 1:
        return None

    def end(u: float, state: float, v: float) -> float:
        words = {"u": u, effect.states[0]: state, "v": v, "x": v, "t": abs(v), "h": STEP, "gain": 0.1, "pole": 100.0}
        return float(effect.functions["advance"](**_bound(effect.functions["advance"], effect, values, words))[-1])

    one = end(1.0, 0.0, 0.0)
    tries = (end(7.0, 0.0, 0.0) / 7.0, end(-0.01, 0.0, 0.1) / -0.01, 1.0 - end(0.0, 1.0, -0.1))
    if not 0.0 < one < 1.0 or not np.allclose(tries, one, rtol=1e-6) or not math.isclose(end(1.0, 3.0, 0.5), 3.0 - 2.0 * one, rel_tol=1e-6):
        return None
    return -STEP / math.log1p(-one)


def _bound(function: Callable[..., Any], effect: Effect, values: tuple[float, ...], words: dict[str, float]) -> dict[str, float]:
    known = {**words, **dict(zip(effect.names, values, strict=True))}
    return {name: known[name] for name in arguments(function)}
