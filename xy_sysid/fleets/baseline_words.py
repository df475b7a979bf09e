"""What has left its interval since commissioning, as a status of a node."""

from __future__ import annotations

from collections.abc import Sequence

from xy_sysid.fleets.baseline import AGREEING, Baseline, Compared
from xy_sysid.fleets.causes import Causes
from xy_sysid.live.plain_messages import OK, WARN, StatusMessage
from xy_sysid.units import readable

ONCE = 1e9  # axis-months beyond which the number itself says nothing more


def status(axis: str, baseline: Baseline, known: Causes, axis_months: float) -> StatusMessage:
    """``baseline <axis>``: WARN where a parameter has left its interval, else OK; before enough is heard it says so.

    axis_months: of an unchanged axis, in which one false alarm is allowed
    """
    every = baseline.compared(axis_months)
    values = tuple(pair for item in every for pair in _values(item))
    left = [item for item in every if item.left]
    if left:
        cause = baseline.cause(every, known)
        likely = f" Likely cause: {cause.cause}. {cause.check}".rstrip() if cause is not None else ""
        return StatusMessage(f"baseline {axis}", WARN, f"axis {axis}: since commissioning {told(left)}.{likely}", values)
    if baseline.stretches < AGREEING:
        text = f"axis {axis}: {baseline.stretches} of {AGREEING} estimates that are compared with commissioning"
        return StatusMessage(f"baseline {axis}", OK, text, values)
    if not every:
        return StatusMessage(f"baseline {axis}", WARN, f"axis {axis}: no parameter of the baseline is estimated", values)
    return StatusMessage(f"baseline {axis}", OK, f"axis {axis}: every parameter is within its interval since commissioning", values)


def told(left: Sequence[Compared]) -> str:
    """The changes in words, the largest first."""
    return "; ".join(_told(item) for item in sorted(left, key=lambda item: -item.statistic))


def _told(item: Compared) -> str:
    scale, unit = readable(item.unit)
    verb = "rose" if abs(item.now) > abs(item.before) else "fell"
    return f"{item.name} {verb} from {item.before * scale:.4g} to {item.now * scale:.4g} {unit}".rstrip() + f" ({100 * item.part:+.3g} %)"


def _values(item: Compared) -> tuple[tuple[str, str], ...]:
    name, unit = item.name, item.unit or "1"
    return (
        (f"{name} ({unit})", f"{item.now:.9g}"),
        (f"{name} at commissioning ({unit})", f"{item.before:.9g}"),
        (f"{name} 95 % low", f"{item.low:.9g}"),
        (f"{name} 95 % high", f"{item.high:.9g}"),
        (f"{name} by chance once in (axis-months)", f"{min(item.one_in, ONCE):.3g}"),
    )
