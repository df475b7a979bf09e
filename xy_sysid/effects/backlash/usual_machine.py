"""Scales a task of one-step prediction to the reference machine, for which constants and bounds of the filter are given, and the result back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from xy_sysid.effects._contract import Companions, DryFriction, FilterFit, OneStepTask
from xy_sysid.effects._similarity import Similarity
from xy_sysid.samples.block import FloatArray

BASE = ("m/s/V", "s", "rad/s")  # gain, delay, pole
CONTACT = ("m", "", "rad/s", "", "s/m", "", "", "V")  # gap, share, rate, damping, loss, guide, hertz, rub


def to_usual(task: OneStepTask) -> OneStepTask:
    """The task on the reference machine."""
    similar, bar = task.companions.similar, task.limits.bar
    return replace(
        task,
        sampling_rate=task.sampling_rate * similar.time,
        base=_triple(_scaled(task.base, BASE, similar, True)),
        noise=task.noise / similar.length,
        companions=usual(task.companions),
        dry=_dry(task.dry, similar, True),
        earlier=None if task.earlier is None else from_usual(task.earlier, similar, back=True),
        limits=task.limits if bar is None else replace(task.limits, bar=bar / similar.length),
    )


def usual(companions: Companions) -> Companions:
    """The companions on the reference machine; their own parameters stay as they are."""
    similar = companions.similar

    def undo(numbers: FloatArray, n: int) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        own = numbers.copy()
        own[:3] = _scaled(numbers[:3], BASE, similar, False)
        voltage, position, against, through = companions.undo(own, n)
        return voltage / similar.voltage, position / similar.length, against / similar.voltage, through

    return replace(companions, undo=undo, similar=Similarity(), swing=companions.swing / similar.length)


def from_usual(found: FilterFit, similar: Similarity, back: bool = False) -> FilterFit:
    """A result of the reference machine scaled to this one; back: the inverse."""
    length = 1.0 / similar.length if back else similar.length
    return replace(
        found,
        base=_triple(_scaled(found.base, BASE, similar, back)),
        values=tuple(_scaled(found.values, CONTACT, similar, back)),
        base_spread=_triple(_scaled(found.base_spread, BASE, similar, back)),
        spread=tuple(_scaled(found.spread, CONTACT, similar, back)),
        dry=_dry(found.dry, similar, back),
        innovation=found.innovation * length,
        without=found.without * length,
        noise=found.noise * length,
    )


def _dry(dry: DryFriction, similar: Similarity, back: bool) -> DryFriction:
    units = [item.unit for law in dry.laws for item in law.parameters]
    spread = tuple(_scaled(dry.spread, units, similar, back)) if dry.spread else ()
    return replace(dry, values=tuple(_scaled(dry.values, units, similar, back)), spread=spread)


def _scaled(values: Sequence[float] | FloatArray, units: Sequence[str], similar: Similarity, back: bool) -> list[float]:
    return [float(value) / similar.factor(unit) if back else float(value) * similar.factor(unit) for value, unit in zip(values, units, strict=True)]


def _triple(values: Sequence[float]) -> tuple[float, float, float]:
    gain, delay, pole = values
    return gain, delay, pole
