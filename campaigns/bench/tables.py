"""Results of a benchmark, and measurement of times."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Check:
    """A measured number and its goal; ``met`` is None without a goal."""

    what: str
    measured: str
    goal: str
    met: bool | None


@dataclass(frozen=True, slots=True)
class Table:
    """Result of one benchmark; text: its description, for the docs."""

    title: str
    text: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    checks: tuple[Check, ...] = field(default=())


def medians(works: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Median time of each, s. They run in turn, so that a slow period of the computer affects all; the first turn is a warm-up."""
    times: dict[str, list[float]] = {name: [] for name in works}
    for turn in range(repeats + 1):
        for name, work in works.items():
            begin = time.perf_counter()
            work()
            if turn:
                times[name].append(time.perf_counter() - begin)
    return {name: statistics.median(values) for name, values in times.items()}


def at_least(what: str, ratio: float, goal: float, unit: str = "x") -> Check:
    """A number that should be large."""
    return Check(what, f"{ratio:.3g}{unit}", f">= {goal:g}{unit}", ratio >= goal)


def at_most(what: str, value: float, goal: float, unit: str = "x") -> Check:
    """A number that should be small."""
    return Check(what, f"{value:.3g}{unit}", f"<= {goal:g}{unit}", value <= goal)
