"""A story as a JSON document: the result of ``diagnose --json`` for an axis, the error ladder, the model, and every step's figure data.

docs/story.md describes it; the page, the report and the topic ``story/<axis>`` are drawn from this document only.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from xy_sysid.comparison.residual_correlation import ResidualCorrelation
from xy_sysid.diagnosis.as_json import answer_document, parameters, place, rung_document
from xy_sysid.linear.transfer_function import Mode, TransferFunction
from xy_sysid.samples.block import FloatArray
from xy_sysid.story.pictures import Binned, Measured, Pictures
from xy_sysid.story.story import Story

FORMAT = "xy_sysid story 1"
DIGITS = 5
DRAWN = 8  # newest steps whose figure data stay in the document, in addition to the rigid model
UNKNOWN: dict[str, Any] = {
    "verdict": None, "effect": None, "effects": [], "confidence": None, "sentence": "Not diagnosed yet.",
    "where": [], "candidates": [], "runner_up": None, "look_alikes": [], "next_experiment": "",
}  # fmt: skip


def document(story: Story) -> dict[str, Any]:
    """The story of one axis in JSON types."""
    base, now, drawn = story.rungs[0] if story.rungs else None, story.now, len(story.rungs) - DRAWN
    told = UNKNOWN if story.diagnosis is None else answer_document(story.diagnosis)
    ladder = [rung_document(rung) for rung in story.rungs]
    shown = [_pictures(item, story.sampling_rate) if k == 0 or k >= drawn else None for k, item in enumerate(story.pictures)]
    sensed = {"measured": story.units.sensed} if story.units.sensed != "position" else {}
    made: dict[str, Any] = {
        "format": FORMAT,
        "axis": story.axis,
        "seconds": story.seconds,
        "sampling_rate": story.sampling_rate,
        "units": {"input": story.units.input, "output": story.units.output, "judged": story.units.judged, **sensed},
        **told,
        "tolerance": story.tolerance,
        "error": {
            "unit": story.units.judged,
            "now": base.held_out_error if base else None,
            "noise_floor": now.noise_floor if now else None,
            "held_out": now.held_out_error if now else None,
        },
        "explained": now.explained if now else False,
        "note": story.note,
        "ladder": ladder,
        "model": _model(story) if now else None,
        "measured": _measured(story.measured) if story.measured else None,
        "steps": [{**row, "pictures": item} for row, item in zip(ladder, shown, strict=True)],
    }
    return {name: _plain(value) for name, value in made.items()}


def _model(story: Story) -> dict[str, Any]:
    last = story.rungs[-1]
    return {
        "effects": list(last.effects),
        "parameters": parameters(last.parameters),
        "linear": _linear(story.pictures[-1].linear),
        "held_out_error": last.held_out_error,
        "noise_floor": last.noise_floor,
    }


def _measured(item: Measured) -> dict[str, Any]:
    return {
        "frequency_response": {
            "frequency": _row(item.frequency),
            "magnitude_db": _row(item.magnitude),
            "magnitude_low_db": _row(item.magnitude_low),
            "magnitude_high_db": _row(item.magnitude_high),
            "phase_deg": _row(item.phase),
            "phase_low_deg": _row(item.phase_low),
            "phase_high_deg": _row(item.phase_high),
            "coherence": _row(item.coherence),
            "trusted": item.trusted.tolist(),
        },
        "time": {
            "time": _row(item.time),
            "velocity_low": _row(item.velocity_low),
            "velocity_high": _row(item.velocity_high),
            "position": _row(item.position),
            "held_out": [[first, last] for first, last in item.held_out],
            "held_out_from": item.ahead,
        },
        "zoom": {
            "start": item.zoom_start,
            "voltage": _row(item.zoom_voltage),
            "velocity": _row(item.zoom_velocity),
        },
    }


def _pictures(item: Pictures, sampling_rate: float) -> dict[str, Any]:
    return {
        "frequency_response": {"magnitude_db": _row(item.magnitude), "phase_deg": _row(item.phase)},
        "residual": {
            "frequency": {"frequency": _row(item.band), "error_over_floor": _row(item.band_error), "up_to": item.band_end},
            "speed": _binned("speed", item.speed),
            "position": _binned("position", item.place),
            "time": _binned("time", item.time),
            "correlation": _correlation(item.correlation, sampling_rate),
        },
        "failing": [place(one) for one in item.failing],
        "time": {"velocity_low": _row(item.velocity_low), "velocity_high": _row(item.velocity_high), "position": _row(item.position)},
        "zoom": {"velocity": _row(item.zoom_velocity)},
        "linear": _linear(item.linear),
    }


def _binned(name: str, item: Binned) -> dict[str, list[float]]:
    return {name: _row(item.centre), "error_over_floor": _row(item.over_floor), "mean_error": _row(item.mean)}


def _correlation(item: ResidualCorrelation | None, sampling_rate: float) -> dict[str, Any] | None:
    if item is None:
        return None
    return {
        "lag": _row(item.lag / sampling_rate),
        "autocorrelation": _row(item.autocorrelation, 3),
        "white": item.white,
        "shift": _row(item.shift / sampling_rate),
        "input_correlation": _row(item.cross, 3),
        "unrelated": item.unrelated,
        "outside": item.outside,
    }


def _linear(tf: TransferFunction) -> dict[str, Any]:
    return {
        "numerator": _row(tf.numerator, 12),
        "denominator": _row(tf.denominator, 12),
        "delay": tf.delay,
        "poles": [_root(mode) for mode in tf.pole_modes()],
        "zeros": [_root(mode) for mode in tf.zero_modes()],
    }


def _root(mode: Mode) -> dict[str, float]:
    return {"real": mode.root.real, "imag": mode.root.imag, "frequency": mode.frequency, "damping": mode.damping}


def _row(values: FloatArray | Iterable[float], digits: int = DIGITS) -> list[float]:
    return [float(f"{value:.{digits}g}") for value in np.asarray(values, dtype=np.float64).tolist()]


def _plain(value: Any) -> Any:
    """Convert to JSON types: non-finite numbers become null."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
