"""Head of a report and footer of its printed pages: title, machine, author, date."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime
from html import escape
from pathlib import Path

from xy_sysid.fleets.naming import Names, date_of, date_within, name_of
from xy_sysid.samples.recording import Recording

BETWEEN = " · "  # separator in the footer


@dataclass(frozen=True, slots=True)
class Cover:
    """title: of the page; machine, author, recorded: empty if unknown; written: the date of the report."""

    title: str
    machine: str = ""
    author: str = ""
    recorded: str = ""
    written: str = ""

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """(label, value) of everything that is known."""
        every = (("Machine", self.machine), ("Author", self.author), ("Recorded", self.recorded), ("Report written", self.written))
        return tuple((what, value) for what, value in every if value)

    @property
    def foot(self) -> str:
        """The footer line of each printed page."""
        return BETWEEN.join(text for text in (self.title, self.machine, self.author, self.recorded or self.written) if text)

    @property
    def html(self) -> str:
        """The lines as a list of definitions."""
        rows = "".join(f"<dt>{escape(what)}</dt><dd>{escape(value)}</dd>" for what, value in self.lines)
        return f'<dl class="cover">{rows}</dl>' if rows else ""


def cover_of(recording: Recording, said: Cover, sources: Sequence[Path], today: date) -> Cover:
    """The cover: the given entries, completed from the recording.

    Machine: default from the metadata of the recording. Date: the given one, else the recording's clock, else the name of the first file.
    Raises BadInput for an invalid date.
    """
    when = date_of(said.recorded) if said.recorded else date_within(recording) or next((name_of(path, Names()).date for path in sources), None)
    return Cover(
        title=said.title or f"Report on {', '.join(path.name for path in sources) or recording.source or 'a recording'}",
        machine=said.machine or recording.machine,
        author=said.author,
        recorded=shown(when) if when is not None else "",
        written=today.isoformat(),
    )


def shown(when: datetime) -> str:
    """A date, with the time of day if it is known: 2026-03-03 14:30 UTC."""
    at = when.astimezone(UTC)
    return f"{at:%Y-%m-%d}" if (at.hour, at.minute, at.second) == (0, 0, 0) else f"{at:%Y-%m-%d %H:%M} UTC"


def css_string(text: str) -> str:
    """The text as a CSS string literal that cannot close the string or the element around it."""
    return '"' + re.sub(r'[\x00-\x1f"\\<>&\x7f-\x9f]', lambda found: f"\\{ord(found.group()):x} ", text) + '"'
