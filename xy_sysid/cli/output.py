"""Output of commands: tables, or one JSON document; progress always on stderr."""

from __future__ import annotations

import json
import math
import re
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import BarColumn, Progress, Task, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.progress_bar import ProgressBar
from rich.segment import Segment
from rich.table import Table

from xy_sysid.errors import ReaderGone
from xy_sysid.processes.terminal import printable
from xy_sysid.units import readable

if TYPE_CHECKING:
    from xy_sysid.axis.mechanics import Figure


PLAIN = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
POWER = re.compile("^·10")
NARROW = 40  # least width of wrapped text, columns
COMPILING = "compiling the effect laws, once on this machine"
USUAL = 20.0  # s that it takes on a computer of 2024; longer ones end with a full bar
TEXT = ("unit", "in words")  # columns with left-aligned text


class Terminal(Console):
    """A console that raises ReaderGone if the reader of a pipe has closed it."""

    def on_broken_pipe(self) -> None:
        """Called by rich, whose default ends the process."""
        raise ReaderGone

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        """The renderer of rich; text from files cannot control the terminal."""
        for part in super().render(renderable, options):
            yield part if part.control else Segment(printable(part.text), part.style)


people = Terminal(highlight=False, soft_wrap=True, markup=False, emoji=False)  # a file may be called [bold] or :car:
aside = Terminal(stderr=True, highlight=False, soft_wrap=True, markup=False, emoji=False)


def plain(value: Any) -> Any:
    """The value in JSON types: arrays as lists, complex numbers as [real, imag], non-finite numbers as null."""
    if is_dataclass(value) and not isinstance(value, type):
        return {item.name: plain(getattr(value, item.name)) for item in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return [plain(item) for item in value.tolist()]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, complex):
        return [plain(value.real), plain(value.imag)]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, (str, int, bool)) or value is None:
        return value
    if isinstance(value, Iterable):
        return [plain(item) for item in value]
    return str(value)


def emit(document: Mapping[str, Any]) -> None:
    """Print the JSON document of a command."""
    try:
        sys.stdout.write(json.dumps(plain(document), allow_nan=False) + "\n")
        sys.stdout.flush()
    except BrokenPipeError:
        raise ReaderGone from None


def say(text: str = "", to: Terminal = people, style: str | None = None) -> None:
    """Print text, wrapped at the width of the terminal; continuation lines are indented."""
    for line in text.split("\n"):
        inset = " " * (len(line) - len(line.lstrip()) + 2)
        broken = textwrap.wrap(line, max(to.width, NARROW), subsequent_indent=inset, break_long_words=False, break_on_hyphens=False)
        for part in broken or [""]:
            to.print(part, style=style)


def say_refused(refused: Mapping[str, str], before: str = "") -> None:
    """Print why axes have no answer. before: words before each reason."""
    for name, text in refused.items():
        say(f"axis {name}: {before}{text}")


def table(title: str, columns: Iterable[str], rows: Iterable[Iterable[str]]) -> None:
    """Print a table on stdout; the first column and those of TEXT are text, the others are numbers."""
    made = Table(title=title, title_justify="left", title_style="bold", header_style="bold", box=None, pad_edge=False)
    for number, name in enumerate(columns):
        made.add_column(name, justify="left" if number == 0 or name in TEXT else "right", overflow="fold", no_wrap=number == 0)
    for row in rows:
        made.add_row(*row)
    people.print(made)


def estimates(title: str, items: Iterable[Figure], head: str = "parameter") -> None:
    """Print values with their 95 % intervals, in display units; head: of the column of names."""
    rows = [estimate(item.name, (item.value, item.low, item.high), item.unit) for item in items]
    table(title, (head, "value", "95 % interval", "unit"), rows)


def estimate(name: str, figures: tuple[float, float, float], unit: str) -> tuple[str, str, str, str]:
    """Name, value, interval and unit of one parameter, with the significant digits of its interval; figures: value and both ends."""
    from xy_sysid.report.words import interval_parts, possible

    scale, shown = readable(unit)
    value, low, high = (each * scale for each in possible(name, figures))
    if not (math.isfinite(low) and math.isfinite(high)):
        return name, f"{value:.5g}" if math.isfinite(value) else "-", "-", shown
    middle, first, last, power = (part.replace("−", "-") for part in interval_parts(value, low, high))
    power = f"e{exponent}" if power and (exponent := POWER.sub("", power.translate(PLAIN))) else ""
    whole, begin, end = (part + power if float(part) or not power else "0" for part in (middle, first, last))
    return name, whole, f"{begin} .. {end}", shown


def progress() -> Progress:
    """A progress bar on stderr that disappears at its end; none if stderr is not a terminal."""
    words = TextColumn("{task.description}", markup=False)
    return Progress(words, BarColumn(), TaskProgressColumn(), TimeRemainingColumn(), console=aside, transient=True, disable=not aside.is_terminal)


class _OfTime(BarColumn):
    """The time that has passed, of the usual time: the compiler reports no progress."""

    def render(self, task: Task) -> ProgressBar:
        return ProgressBar(total=USUAL, completed=min(task.fields["before"] + (task.elapsed or 0.0), USUAL), width=self.bar_width)


def compiling() -> tuple[Callable[[], None], Callable[[], None]]:
    """(function that shows that laws are being compiled, with a bar of the usual time; function that removes it).

    The bar goes on where the last one ended. It may be shown above another bar.
    """
    shown: list[Progress] = []
    before = [0.0]  # s of all earlier bars

    def begins() -> None:
        words = TextColumn(f"{{task.description}}: about {USUAL:g} s", markup=False)
        bar = Progress(words, _OfTime(), console=aside, transient=True, disable=not aside.is_terminal)
        bar.add_task(COMPILING, total=None, before=before[0])
        bar.start()
        shown.append(bar)

    def ends() -> None:
        bar = shown.pop()
        before[0] += bar.tasks[0].elapsed or 0.0
        bar.stop()

    return begins, ends


def quantity(value: float, unit: str, digits: int = 4) -> str:
    """A value in display units: ms for short times, mm for small lengths."""
    if not math.isfinite(value):
        return "-"
    scale, shown = readable(unit)
    return f"{value * scale:.{digits}g} {shown}".rstrip()
