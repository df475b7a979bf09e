"""Scales a task of one-step prediction to the reference machine, for which constants and bounds of the filter are given, and the result back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from xy_sysid.effects._contract import Beside, DryFriction, Followed, OneStepTask
from xy_sysid.effects._similarity import Similarity
from xy_sysid.samples.block import FloatArray

BASE = ("m/s/V", "s", "rad/s")  # gain, delay, pole
CONTACT = ("m", "", "rad/s", "", "s/m", "", "", "V")  # gap, share, rate, damping, loss, guide, hertz, rub


def to_usual(task: OneStepTask) -> OneStepTask:
    """The same task there."""
    similar, bar = task.beside.similar, task.limits.bar
    return replace(
        task,
        sampling_rate=task.sampling_rate * similar.time,
        base=_triple(_scaled(task.base, BASE, similar, True)),
        noise=task.noise / similar.length,
        beside=usual(task.beside),
        dry=_dry(task.dry, similar, True),
        begin=None if task.begin is None else from_usual(task.begin, similar, back=True),
        limits=task.limits if bar is None else replace(task.limits, bar=bar / similar.length),
    )


def usual(beside: Beside) -> Beside:
    """What acts beside it there; its own numbers stay as they are."""
    similar = beside.similar

    def undo(numbers: FloatArray, n: int) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        own = numbers.copy()
        own[:3] = _scaled(numbers[:3], BASE, similar, False)
        voltage, position, against, through = beside.undo(own, n)
        return voltage / similar.voltage, position / similar.length, against / similar.voltage, through

    return replace(beside, undo=undo, similar=Similarity(), swing=beside.swing / similar.length)


def from_usual(found: Followed, similar: Similarity, back: bool = False) -> Followed:
    """A result there as one here; back: one here as it would be there."""
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
