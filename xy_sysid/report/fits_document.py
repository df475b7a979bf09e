"""The fits of one axis as JSON."""

from __future__ import annotations

from typing import Any

from xy_sysid.report.axis_fits import AxisFits


def fits_document(one: AxisFits, remarks: list[str], change: dict[str, Any] | None = None) -> dict[str, Any]:
    """One axis of the JSON document. remarks: for the reader; change: of the pair, None if none was looked for."""
    fits: dict[str, dict[str, Any]] = {
        name: {
            "converged": fit.converged,
            "stable": fit.tf.is_stable,
            "numerator": fit.tf.numerator,
            "denominator": fit.tf.denominator,
            "delay": fit.tf.delay if name == "ML" else None,
            "relative_error": fit.relative_error,
            "paper": {"error_cost": fit.error_cost, "confidence": fit.confidence},
            "poles": fit.poles,
            "zeros": fit.zeros,
        }
        for name, fit in one.fits.items()
    }
    if "ML" in one.fits:
        ml = one.fits["ML"]
        fits["ML"]["estimates"] = {item.name: {"value": item.value, "ci95": [item.low, item.high], "unit": item.unit} for item in ml.intervals}
    return {"problem": one.problem, "fits": fits, "change": change, "remarks": remarks}
