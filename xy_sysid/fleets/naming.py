"""Which machine, axis and date a recording belongs to: a list of the user's, a pattern of the path, the recording itself."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from xy_sysid.bags.opening import yaml_of
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import Settings, build, knob

DATE = r"(?<!\d)\d{4}[-_.]?\d\d[-_.]?\d\d(?:[T_ -]?\d\d[-_:]?\d\d(?:[-_:]?\d\d)?)?Z?(?!\d)"
PARTS = {"{machine}": r"(?P<machine>[^/]+?)", "{axis}": r"(?P<axis>[^/]+?)", "{date}": f"(?P<date>{DATE})", "*": "[^/]*"}
FIRST = datetime(2000, 1, 1, tzinfo=UTC)  # no clock of a recording was right before; one that counts from its start is not a date
EXAMPLE = "{machine}/{date}*.csv"


class Named(Settings):
    """What a user says about one recording."""

    machine: str = knob("", "name of the machine")
    axis: str = knob("", "name of the axis, of a file that holds one")
    date: str = knob("", "when it was made, as 2026-03-03 or 2026-03-03T14:30:00")


class Names(Settings):
    """How recordings are named, and what is followed in all of them: a small YAML file, or options."""

    pattern: str = knob("", "of the end of a path, for example {machine}/{axis}/{date}*.csv; * stands for anything but a slash")
    follow: list[str] = knob([], "effects whose parameters are estimated in every recording")
    recordings: dict[str, Named] = knob({}, "by the end of a path: what cannot be told from it")


@dataclass(frozen=True, slots=True)
class Name:
    """What a recording is called. axis: of a file that holds one, empty where the file's own names stand; date: UTC, None if nobody knows."""

    machine: str
    axis: str = ""
    date: datetime | None = None


def names_from(path: Path) -> Names:
    """The names of a YAML file. Raises BadRecording or BadInput in one line."""
    found = yaml_of(path, "a file of names")
    if not isinstance(found, dict):
        raise BadRecording(path, "no keys", f"Write for example: pattern: '{EXAMPLE}'.")
    values = {
        key: {end: _dated(one) for end, one in value.items()} if key == "recordings" and isinstance(value, dict) else value
        for key, value in found.items()
    }
    return build(Names, values, str(path))


def _dated(value: Any) -> Any:
    """YAML makes a date of 2026-03-03 by itself."""
    return {key: one if isinstance(one, str) else str(one) for key, one in value.items()} if isinstance(value, dict) else value


def name_of(path: Path, names: Names) -> Name:
    """The name that a list or the path gives; without a pattern the folder is the machine, and a date in the file's name its date.

    Raises BadInput where the path does not fit the pattern, or a date is none.
    """
    whole = path.absolute().as_posix()
    said = next((one for end, one in names.recordings.items() if whole == end or whole.endswith(f"/{end}")), None)
    if said is not None and said.machine:
        return Name(said.machine, said.axis, date_of(said.date) if said.date else None)
    if names.pattern:
        found = compiled(names.pattern).search(whole)
        if found is None:
            raise BadInput(
                "path", str(path), f"one that ends with {names.pattern}", "Change the pattern, or name the recording in the file of names."
            )
        parts = found.groupdict()
    else:
        dates = re.search(DATE, path.name)
        parts = {"machine": path.absolute().parent.name, "date": dates.group() if dates else None}
    machine, axis, date = parts.get("machine") or path.absolute().parent.name, parts.get("axis") or "", parts.get("date")
    if said is not None:
        axis, date = said.axis or axis, said.date or date
    return Name(machine, axis, date_of(date) if date else None)


def compiled(pattern: str) -> re.Pattern[str]:
    """The pattern as a regular expression. Raises BadInput for braces that mean nothing, or a name that stands twice."""
    text = "".join(PARTS.get(part, re.escape(part)) for part in re.split(r"(\{\w*\}|\*)", pattern))
    unknown = [part for part in re.findall(r"\{\w*\}", pattern) if part not in PARTS]
    twice = [part for part in PARTS if part != "*" and pattern.count(part) > 1]
    if unknown or twice:
        raise BadInput("pattern", repr(pattern), "{machine}, {axis} and {date}, each once, and *", f"Write for example {EXAMPLE}.")
    return re.compile(f"(?:^|/){text}$")


def date_of(text: str) -> datetime:
    """A date, in UTC where it names no zone. Raises BadInput."""
    digits = re.sub(r"[^\d]", "", text)
    try:
        if re.fullmatch(DATE, text) and len(digits) in (8, 12, 14):
            return datetime.strptime(digits, "%Y%m%d%H%M%S"[: {8: 6, 12: 10, 14: 12}[len(digits)]]).replace(tzinfo=UTC)
        found = datetime.fromisoformat(text)
    except ValueError:
        raise BadInput("date", repr(text), "a day and a time of day", "Write for example 2026-03-03 or 2026-03-03T14:30:00.") from None
    return found.astimezone(UTC) if found.tzinfo else found.replace(tzinfo=UTC)


def date_within(recording: Recording) -> datetime | None:
    """When the first sample was taken, if its clock tells the date."""
    first = float(recording.time[0]) if len(recording) else 0.0
    return datetime.fromtimestamp(first, UTC) if first > FIRST.timestamp() else None
