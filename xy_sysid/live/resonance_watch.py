"""Watches a resonance: has it moved since its first value?

Loose base bolts lower the base's stiffness, so that its antiresonance and resonance frequencies fall (finding of the paper).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from xy_sysid.response.frf import Z95

REFERENCE_WINDOWS = 12  # least number of windows for a reference; with fewer its interval is too wide to be useful
REFERENCE_GROWS = 60  # up to this many windows a better reference replaces the first one, if the resonance has not moved
CONFIRM = 2  # consecutive fits that must agree before an alarm; one alone may be chance


@dataclass(frozen=True, slots=True)
class Resonance:
    """A resonance (lightly damped pole pair) as fitted: frequency and its standard error, Hz."""

    frequency: float
    error: float


@dataclass(frozen=True, slots=True)
class Track:
    """The history of one resonance.

    reference: its first value; None before there is one
    now:       newest short-memory value; None without one
    away:      consecutive fits in which it differed; alarm: True if that is confirmed
    """

    reference: Resonance | None = None
    now: Resonance | None = None
    away: int = 0
    alarm: bool = False

    @property
    def shift(self) -> float:
        """Hz from the reference, nan when unknown."""
        return self.now.frequency - self.reference.frequency if self.now and self.reference else math.nan


def follow(track: Track, overall: Resonance | None, recent: Resonance | None, windows: int, sigmas: float) -> Track:
    """The track after one more fit.

    overall: from all remembered data, with ``windows`` windows; recent: from the short memory
    sigmas:  standard errors of the difference that count as moved
    """
    if track.reference is None or recent is None:
        learnt = overall if windows >= REFERENCE_WINDOWS else None
        return replace(track, reference=track.reference or learnt, now=recent)
    apart = abs(recent.frequency - track.reference.frequency)
    moved = apart > sigmas * math.hypot(recent.error, track.reference.error)
    if not moved:
        better = overall is not None and windows <= REFERENCE_GROWS and overall.error < track.reference.error
        return Track(overall if better else track.reference, recent, 0, False)
    away = track.away + 1
    return Track(track.reference, recent, away, track.alarm or away >= CONFIRM)


def alarm_sentence(axis: str, track: Track) -> str:
    """The alarm as a sentence."""
    if not (track.reference and track.now):
        return f"axis {axis}: the resonance has moved"
    direction = "down" if track.shift < 0 else "up"
    cause = "a joint or bolt of the base may be loose" if track.shift < 0 else "mass was taken off or something now touches the machine"
    was, now = track.reference, track.now
    return (
        f"axis {axis}: resonance moved {direction} by {abs(track.shift):.2f} Hz, from {was.frequency:.2f} to {now.frequency:.2f} +- "
        f"{Z95 * now.error:.2f} Hz; {cause}"
    )
