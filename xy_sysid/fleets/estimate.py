"""Speed and remaining time of a run."""

from __future__ import annotations

import math
from dataclasses import dataclass

from xy_sysid.response.frf import Z95


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a run.

    done, total: recordings, including ``unchanged`` ones, which are already in the table, and ``failed`` ones, whose rows have no answer
    elapsed: s since the first recording started; spent, square: sum of the durations of the done ones, s, and of their squares
    workers: processes at work; place: address of the dashboard, if there is one
    unused: entries in the file of names that fit none of the recordings
    """

    total: int
    done: int = 0
    unchanged: int = 0
    failed: int = 0
    elapsed: float = 0.0
    spent: float = 0.0
    square: float = 0.0
    workers: int = 1
    place: str = ""
    unused: tuple[str, ...] = ()

    @property
    def analysed(self) -> int:
        """Number of recordings that were not already in the table."""
        return self.done - self.unchanged

    @property
    def rate(self) -> float:
        """Analysed recordings per hour."""
        return 3600.0 * self.analysed / self.elapsed if self.elapsed > 0.0 else 0.0

    def remaining(self) -> tuple[float, float] | None:
        """95 % interval of the remaining time, s, if all of the rest must be analysed and takes as long as before; None for fewer than three."""
        count, rest = self.analysed, self.total - self.done
        if count < 3 or self.elapsed <= 0.0:
            return None
        mean = self.spent / count
        spread = math.sqrt(max(self.square / count - mean**2, 0.0) * count / (count - 1))
        width = Z95 * spread * math.sqrt(rest / count + 1.0) * math.sqrt(rest) if rest else 0.0
        share = self.elapsed / max(self.spent, 1e-9)  # s of elapsed time per s of work
        return max(rest * mean - width, 0.0) * share, (rest * mean + width) * share

    def sentence(self) -> str:
        """The progress in words."""
        parts = [f"{self.done} of {self.total} recording{'s' if self.total != 1 else ''}"]
        if self.unchanged:
            parts.append(f"{self.unchanged} were in the table already")
        if self.failed:
            parts.append(f"{self.failed} without an answer")
        if self.analysed:
            parts.append(f"{self.rate:.3g} an hour on {self.workers} process{'es' if self.workers != 1 else ''}")
        rest = self.remaining()
        if rest is not None and self.done < self.total:
            parts.append(f"{lasting(rest[0])} to {lasting(rest[1])} left")
        return ", ".join(parts)


def lasting(seconds: float) -> str:
    """A duration in the largest unit of which it has at least two."""
    for size, name in ((86400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.0f} {name}"
    return f"{seconds:.0f} s"
