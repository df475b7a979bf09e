"""Tables 1 and 2 of the paper's study as rows of text, without HTML."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from xy_sysid.fitting import Fit
from xy_sysid.fitting.model_orders import OrderTrial
from xy_sysid.report.axis_fits import AxisFits
from xy_sysid.report.words import estimate_text, interval_parts, number, root, superscript
from xy_sysid.response.estimate import Estimate
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import over, readable

METHODS = ("LLS", "NLLS", "ML")


@dataclass(frozen=True, slots=True)
class Table:
    """caption, column heads, and rows; the first cell of a row is its head."""

    caption: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def coefficient_table(axis: str, fits: Mapping[str, Fit]) -> Table:
    """Table 1, for one axis: coefficients of falling powers of s, scaled so that the denominator's first one is 1."""
    ml = fits["ML"]
    scale, shown = readable(ml.tf.output_unit)
    rows: list[tuple[str, ...]] = []
    for part, letter, factor in (("numerator", "b", scale), ("denominator", "a", 1.0)):
        size = max(getattr(fit.tf, part).size for fit in fits.values())
        for power in range(size - 1, -1, -1):
            cells = [number(_coefficient(getattr(fits[name].tf, part), power) * factor, 6) for name in METHODS]
            item = _named(ml, f"{part}_{power}")
            if item is not None:
                cells[2:] = _with_interval(item, factor)
            else:
                cells.append("fixed")
            rows.append((f"{letter}{_subscript(power)}  (s{superscript(power)})", *cells))
    delay = _named(ml, "delay")
    last = _with_interval(delay, 1e3) if delay else [number(ml.tf.delay * 1e3, 5), "fixed"]
    rows.append(("delay (ms)", "absorbed", "absorbed", *last))
    caption = f"Axis {axis}: H(s) = Σ bₖ sᵏ / Σ aₖ sᵏ · e^(−s·delay), in {over(shown, ml.tf.input_unit)} and rad/s"
    return Table(caption, ("coefficient", "LLS", "NLLS", "ML", "ML, 95 % interval"), tuple(rows))


def result_table(one: AxisFits) -> Table:
    """Table 2, for one axis: errors, the paper's confidence measure, and the physical parameters with their intervals."""
    fits = one.fits
    ml = fits["ML"]
    same = [fits[name] for name in METHODS]
    rows: list[tuple[str, ...]] = [
        ("error cost = relative error (%)", *(number(fit.error_cost, 4) for fit in same)),
        ("“confidence” of the paper = 100 − error (%)", *(number(fit.confidence, 5) for fit in same)),
        ("cost / cost that noise explains", "–", "–", number(ml.cost / ml.expected_cost, 4) if ml.expected_cost > 0 else "–"),
        ("converged", *("yes" if fit.converged else f"no ({fit.iterations} iterations)" for fit in same)),
        ("stable", *("yes" if fit.tf.is_stable else "no" for fit in same)),
        ("poles (rad/s)", *(roots_text(fit.poles) for fit in same)),
        ("zeros (rad/s)", *(roots_text(fit.zeros) for fit in same)),
        ("delay", "absorbed", "absorbed", _interval(_named(ml, "delay"), "fixed")),
        (("static gain", "velocity gain", "acceleration gain")[ml.structure.integrators], "–", "–", _interval(_named(ml, "gain"))),
        ("pole", "–", "–", _interval(_slowest(ml))),
        ("antiresonance", "–", "–", _interval(one.pair.antiresonance if one.pair else None)),
        ("resonance", "–", "–", _interval(one.pair.resonance if one.pair else None)),
    ]
    return Table(f"Axis {one.axis}: values with their 95 % intervals", ("", *METHODS), tuple(rows))


def order_table(axis: str, tried: Sequence[OrderTrial], fit: Fit) -> Table | None:
    """The tested orders, shortest description length first; None if there was only one."""
    if len(tried) < 2:
        return None
    at = fit.structure.numerator_order, fit.structure.denominator_order
    least = min(item.length for item in tried)
    rows: list[tuple[str, ...]] = []
    for item in tried:
        orders = item.numerator_order, item.denominator_order
        cost = number(item.cost / fit.expected_cost, 3) if fit.expected_cost > 0 else number(item.cost, 4)
        used = fit.structure.parameters + sum(orders) - sum(at)
        rows.append((f"{orders[0]} / {orders[1]}{', taken' if orders == at else ''}", str(used), cost, number(item.length - least, 4)))
    judged = "cost over noise" if fit.expected_cost > 0 else "cost"
    caption = f"Axis {axis}: orders tried; the minimum description length (MDL) is best"
    return Table(caption, ("zeros / poles", "parameters", judged, "MDL above minimum (nats)"), tuple(rows))


def roots_text(roots: FloatArray | object) -> str:
    """Roots as text; a conjugate pair is written once."""
    values = np.asarray(roots, dtype=np.complex128)
    return "; ".join(together(root(complex(value))) for value in values if value.imag >= 0) or "none"


def _with_interval(item: Estimate, factor: float) -> list[str]:
    """[value, interval], both with the same decimals."""
    value, low, high, power = interval_parts(item.value * factor, item.low * factor, item.high * factor)
    return [f"{value}{power}", f"[{low}, {high}]{power}"]


def _named(fit: Fit, name: str) -> Estimate | None:
    return next((item for item in fit.intervals_with_misfit if item.name == name), None)


def _slowest(fit: Fit) -> Estimate | None:
    """The slowest real pole, except integrators."""
    real = [item for item in fit.intervals_with_misfit if item.name.startswith("pole_") and "." not in item.name]
    return min(real, key=lambda item: abs(item.value)) if real else None


def _interval(item: Estimate | None, without: str = "none found") -> str:
    return together(estimate_text(item)) if item is not None else without


def together(text: str) -> str:
    """The text with non-breaking spaces."""
    return text.replace(" ", "\u00a0")


def _coefficient(values: FloatArray, power: int) -> float:
    place = values.size - 1 - power
    return float(values[place]) if place >= 0 else 0.0


def _subscript(power: int) -> str:
    return str(power).translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"))
