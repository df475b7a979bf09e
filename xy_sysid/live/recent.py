"""Which faults still occur: recovered faults are counted, but no longer a warning."""

from __future__ import annotations

CLEARS = 8.0  # s without a new occurrence after which a fault is over; statuses come each second, and a level clears within 10 s


class Recent:
    """Call ``goes_on`` repeatedly with a mark that changes at each occurrence of a fault, such as a count."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[object, float]] = {}

    def goes_on(self, what: str, mark: object, now: float) -> bool:
        """True if the mark of this fault has changed within CLEARS s before now; a mark of 0 or nothing is no fault."""
        if not mark:
            return False
        before = self._last.get(what)
        if before is None or before[0] != mark:
            self._last[what] = mark, now
            return True
        return now - before[1] < CLEARS
