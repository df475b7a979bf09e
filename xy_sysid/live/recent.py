"""Which faults still occur: recovered faults are counted, but no longer a warning."""

from __future__ import annotations

CLEARS = 8.0  # s without anything new after which a complaint is over; statuses come each second, and a level clears within 10 s


class Recent:
    """``goes_on`` is asked again and again, with what changes whenever the complaint is made again, such as a count."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[object, float]] = {}

    def goes_on(self, what: str, mark: object, now: float) -> bool:
        """Whether the mark of this complaint has changed within CLEARS of now, s; a mark of 0 or nothing is no complaint."""
        if not mark:
            return False
        before = self._last.get(what)
        if before is None or before[0] != mark:
            self._last[what] = mark, now
            return True
        return now - before[1] < CLEARS
