"""One attack and its outcome: full, part-and-said, one line, or zero volts within a bound (docs/faults.md); any other outcome is a fault."""

from __future__ import annotations

import io
import os
import signal
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Literal

Outcome = Literal["full", "part-and-said", "one line", "zero volts", "no sum", "silent", "traceback", "too late", "stump", "not told", "skipped"]
GOOD: tuple[Outcome, ...] = ("full", "part-and-said", "one line", "zero volts", "no sum")
"""full: everything is right. no sum: a number changed in a format that has no check sum for it, which docs/files.md says."""
LONGEST = 60.0  # s, limit for one try of a reader or a command in this process
ONE_LINE = 1000  # most characters of an error message


@dataclass(frozen=True, slots=True)
class Found:
    """Outcome of one try. seconds: duration, or time until zero volts; travel: m until rest; note: how to repeat a failed try, or figures."""

    outcome: Outcome
    seconds: float = 0.0
    travel: float = 0.0
    note: str = ""


@dataclass(frozen=True, slots=True)
class Attack:
    """One row of the table. tries: in the full campaign; short: in that of the tests; bound: the promised bound, in words."""

    name: str
    run: Callable[[int, Path], Iterable[Found]]
    tries: int
    short: int
    bound: str = ""


@dataclass(slots=True)
class Row:
    """Outcomes of all tries of an attack."""

    name: str
    bound: str = ""
    counts: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0
    travel: float = 0.0
    notes: list[str] = field(default_factory=list)
    bad: list[str] = field(default_factory=list)

    def add(self, found: Found) -> None:
        """Add one try."""
        self.counts[found.outcome] += 1
        self.seconds, self.travel = max(self.seconds, found.seconds), max(self.travel, found.travel)
        if found.outcome not in (*GOOD, "skipped"):
            self.bad.append(f"{found.outcome}: {found.note}")
        elif found.note:
            self.notes.append(found.note)

    @property
    def holds(self) -> bool:
        """True if every outcome is acceptable, and at least one try was made, or skipped with a reason."""
        return not self.bad and sum(self.counts.values()) > 0


def attacked(attack: Attack, folder: Path, short: bool) -> Row:
    """Run one attack."""
    row = Row(attack.name, attack.bound)
    folder.mkdir(parents=True, exist_ok=True)
    try:
        for found in attack.run(attack.short if short else attack.tries, folder):
            row.add(found)
    except Exception as error:  # noqa: BLE001  a fault found, or one of the attack itself: either ends this row only
        place = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {' '.join(str(error).split())[:200]} ({Path(place.filename).name}:{place.lineno})"
        row.add(Found("traceback", note=f"the attack itself: {text}"))
    return row


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Context that raises TimeoutError in code that takes longer (main thread only)."""

    def late(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"longer than {seconds:g} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def judged(work: Callable[[], Found], what: str, seconds: float = LONGEST) -> Found:
    """The outcome of the work; an error class of the project counts as one line, any other error as a fault."""
    from xy_sysid.errors import XySysidError

    begun = time.monotonic()
    try:
        with at_most(seconds), warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)  # unintended overflow or NaN
            found = work()
    except XySysidError as error:
        text = str(error)
        good = "\n" not in text and 0 < len(text) <= ONE_LINE
        found = Found("one line" if good else "not told", note="" if good else f"{what}: {text[:200]!r}")
    except TimeoutError as late:
        found = Found("too late", note=f"{what}: {late}")
    except (Exception, RecursionError) as error:  # noqa: BLE001  any error is a result of the campaign
        place = traceback.extract_tb(error.__traceback__)[-1]
        found = Found("traceback", note=f"{what}: {type(error).__name__}: {str(error)[:120]} ({Path(place.filename).name}:{place.lineno})")
    return Found(found.outcome, found.seconds or time.monotonic() - begun, found.travel, found.note)


@dataclass(frozen=True, slots=True)
class Said:
    """Exit code and output of a command in this process."""

    code: int
    out: str
    err: str


def command(*words: object) -> Said:
    """Run a command in this process."""
    from xy_sysid.cli import run

    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = run([str(word) for word in words])
    return Said(code, out.getvalue(), err.getvalue())


def answered(said: Said, what: str) -> Found:
    """The outcome of a command that must give an answer, or an error message in one line."""
    if "Traceback" in said.err or said.code not in (0, 1, 2):
        return Found("traceback", note=f"{what}: code {said.code}, {said.err[-200:]!r}")
    if said.code == 2:
        lines = [line for line in said.err.splitlines() if line and not line.startswith("note: ")]
        good = len(lines) == 1 and lines[0].startswith("xy-sysid: ") and said.out == ""
        return Found("one line" if good else "not told", note="" if good else f"{what}: {said.err[-200:]!r}")
    return Found("part-and-said" if "note: " in said.err or '"notes"' in said.out else "full")


def environment(**changes: str) -> dict[str, str]:
    """Environment for processes: no variables that change Python's behaviour, and the project on the path."""
    root = str(Path(__file__).parents[2])
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return {**kept, "PYTHONPATH": root, **changes}
