"""The parameters that have left their interval since commissioning, as a status of a node."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from xy_sysid.fleets.baseline import AGREEING, Baseline, Compared
from xy_sysid.fleets.causes import Causes
from xy_sysid.fleets.words import from_to
from xy_sysid.live.plain_messages import OK, WARN, StatusMessage

ONCE = 1e9  # axis-months; above this the exact number carries no information


def status(axis: str, baseline: Baseline, known: Causes, axis_months: float) -> StatusMessage:
    """``baseline <axis>``: WARN if a parameter has left its interval or cannot be compared, else OK; it says so while there are too few data.

    axis_months: months of an unchanged axis per false alarm
    """
    every = baseline.compared(axis_months)
    left = [item for item in every if item.left]
    level, ending = WARN if left or baseline.other_units else OK, ""
    if left:
        cause = baseline.cause(every, known)
        ending = f". Likely cause: {cause.cause}. {cause.check}".rstrip() if cause is not None else "."
        text = f"since commissioning {told(left)}"
    elif baseline.stretches < AGREEING:
        text = f"{baseline.stretches} of {AGREEING} estimates that are compared with commissioning"
    elif not every:
        level, text = WARN, "no parameter of the baseline is estimated"
    else:
        text = f"every parameter {'that is compared ' if baseline.other_units else ''}is within its interval since commissioning"
    values = tuple(pair for item in every for pair in _values(item))
    return StatusMessage(f"baseline {axis}", level, f"axis {axis}: {'; '.join((text, *_unlike(baseline)))}{ending}", values)


def _unlike(baseline: Baseline) -> Iterator[str]:
    """Reasons why the newest parameters cannot be compared with those of commissioning."""
    for name, (before, now) in baseline.other_units.items():
        yield f"{name} is not compared, since its unit was {before or '1'} at commissioning and is {now or '1'}"
    other = baseline.other_effects
    if other:
        each = ", ".join(f"{'with' if count > 0 else 'without'} {effect} ({abs(count)} of {AGREEING} estimates)" for effect, count in other.items())
        yield f"today's model has other effects than that of commissioning, on which gain and pole depend: {each}"


def told(left: Sequence[Compared]) -> str:
    """The changes in words, the largest first."""
    return "; ".join(_told(item) for item in sorted(left, key=lambda item: -item.statistic))


def _told(item: Compared) -> str:
    size = f" ({100 * item.part:+.3g} %)" if math.isfinite(item.part) else ""
    return f"{item.name} {from_to(item.before, item.now, item.unit)}{size}"


def _values(item: Compared) -> tuple[tuple[str, str], ...]:
    name, unit = item.name, item.unit or "1"
    return (
        (f"{name} ({unit})", f"{item.now:.9g}"),
        (f"{name} at commissioning ({unit})", f"{item.before:.9g}"),
        (f"{name} 95 % low", f"{item.low:.9g}"),
        (f"{name} 95 % high", f"{item.high:.9g}"),
        (f"{name} by chance once in (axis-months)", f"{min(item.one_in, ONCE):.3g}"),
    )
