"""The experiments that are compared: a grid over kind, band, amplitude, period, position and path, and neighbours of the best.

The centring of the excitation holds the axis at its start, or with an offset at another position. With a slow sine the axis follows a path.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

from xy_sysid.experiment_design.criteria import CREST, FULL, LONGEST, PLACES, QUIETER, SEED, TOP
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.settings import AxisExcitation

PART = {"noise": 1.0 / CREST, "sweep": 0.7, "step": FULL}  # largest rms (height of a step) over the limit of the voltage
HALVES = tuple(0.5**k for k in range(QUIETER))  # parts of the largest amplitude
FINER = tuple(2.0 ** (-0.5 * k) for k in range(2 * QUIETER + 1))  # the same for a slow sine, whose amplitude sets the stroke
NEAR = {
    "rms": (0.7, 1.4),
    "slow": (0.7, 1.4),
    "slow_period": (0.6, 1.6),
    "period": (0.6, 1.6),
    "low": (0.4, 2.5),
    "high": (0.5, 2.0),
    "offset": (0.7, 1.3),
}


def proposals(limits: MachineLimits, sampling_rate: float) -> list[Experiment]:
    """All experiments to compare, including those that would exceed a limit."""
    return [_experiment(limits, sampling_rate, {"seed": SEED, **told}) for told in _grid(limits, sampling_rate)]


def neighbours(experiment: Experiment, limits: MachineLimits, sampling_rate: float) -> Iterator[Experiment]:
    """The same experiment with one number changed."""
    told = experiment.excitation
    values = {name: getattr(told, name) for name in AxisExcitation.model_fields}
    for name, factors in NEAR.items():
        banded = name in ("low", "high") and told.kind in ("noise", "sweep") and told.rms > 0.0
        if name in ("low", "high") and not banded:
            continue
        if values[name] == 0.0 or (name == "slow_period" and told.slow == 0.0) or (name == "period" and told.kind not in ("step", "sweep")):
            continue
        for factor in factors:
            yield _experiment(limits, sampling_rate, {**values, name: values[name] * factor})


def _grid(limits: MachineLimits, sampling_rate: float) -> Iterator[dict[str, Any]]:
    most, top = limits.voltage, min(300.0, TOP * sampling_rate, limits.highest)
    bands = [(0.1, 10.0), (0.1, 50.0), (0.1, top), (20.0, top)]
    for (low, high), part in product(bands, HALVES[:4]):
        if low < high:
            yield {"kind": "noise", "low": low, "high": min(high, top), "rms": part * most / CREST}
    for part in HALVES[:3]:
        yield {"kind": "sweep", "low": 0.5, "high": top, "period": 4.0, "rms": part * PART["sweep"] * most}
    for part, period in product(HALVES, (0.1, 0.4, 1.6)):
        yield {"kind": "step", "period": period, "rms": part * PART["step"] * most}
    for part, period in product(FINER, (1.0, 3.0, LONGEST)):
        yield {"kind": "off", "rms": 0.0, "slow": FULL * part * most, "slow_period": period}
    for part, quiet, period in product(HALVES[1:], (0.25, 0.0625), (3.0, LONGEST)):
        yield {"kind": "noise", "low": 0.1, "high": top, "rms": quiet * most / CREST, "slow": 0.7 * part * most, "slow_period": period}
    yield from _held(limits, top)


def _held(limits: MachineLimits, top: float) -> Iterator[dict[str, Any]]:
    """Experiments away from the start, or along a path, both held by the centring."""
    pulls = [min(part * FULL * limits.voltage / limits.room, limits.centring) for part in HALVES[:2]]
    for side, pull, quiet in product((-PLACES, PLACES), pulls, HALVES[1::2]):
        yield {
            "kind": "noise",
            "low": 0.1,
            "high": top,
            "rms": quiet * (1.0 - PLACES) * limits.voltage / CREST,
            "offset": side * pull * limits.room,
            "centring": pull,
        }
    for pull, period in product(pulls, (3.0, LONGEST)):
        yield {"kind": "off", "rms": 0.0, "slow": PLACES * pull * limits.room, "slow_period": period, "centring": pull}


def _experiment(limits: MachineLimits, sampling_rate: float, told: dict[str, Any]) -> Experiment:
    """An experiment within the limits of the axis, with numbers that its settings allow."""
    told = {**told, "limit": limits.voltage, "travel_min": limits.travel[0], "travel_max": limits.travel[1]}
    told["brake"] = min(AxisExcitation.model_fields["brake"].default, 0.2 * (limits.travel[1] - limits.travel[0]))
    told["centring"] = min(max(told.get("centring", 0.0), _centring(limits)), limits.centring, 1e4)
    told["rms"] = min(told["rms"], PART.get(told["kind"], 0.0) * limits.voltage)
    told["slow"] = min(told.get("slow", 0.0), max(0.95 * limits.voltage - told["rms"] / PART.get(told["kind"], 1.0), 0.0))
    if "high" in told and told.get("kind") != "off":
        told["high"] = min(told["high"], 0.45 * sampling_rate, limits.highest)
        told["low"] = min(told.get("low", 0.1), 0.5 * told["high"])
    return Experiment(AxisExcitation(**{name: _within(name, value) for name, value in told.items()}), ramp=limits.ramp)


def _within(name: str, value: Any) -> Any:
    """A setting's value, clipped to its allowed range."""
    for bound in AxisExcitation.model_fields[name].metadata if isinstance(value, float) else ():
        value = max(value, getattr(bound, "ge", value))
        value = min(value, getattr(bound, "le", value))
    return value


def _centring(limits: MachineLimits) -> float:
    """V/m: a fiftieth of the voltage at the nearer end, enough against drift, too little to affect the result."""
    return min(0.02 * limits.voltage / limits.room, limits.centring, 1e4)
