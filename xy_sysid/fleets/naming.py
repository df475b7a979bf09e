"""Machine, axis and date of a recording: from the user's list, a pattern of the path, or the recording itself."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from xy_sysid.bags.opening import yaml_of
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import Settings, build, knob

ZONE = r"(?:Z|[+-]\d\d:\d\d|\+\d\d(?:-?\d\d)?|-(?:0[1-9]|1[0-2])(?:00|30))"  # others after a minus are numbers of runs
DATE = rf"(?<!\d)\d{{4}}[-_.]?\d\d[-_.]?\d\d(?:[T_ -]?\d\d[-_:]?\d\d(?:[-_:]?\d\d)?{ZONE}?)?(?!\d)"
PARTS = {"{machine}": r"(?P<machine>[^/]+?)", "{axis}": r"(?P<axis>[^/]+?)", "{date}": f"(?P<date>{DATE})", "*": "[^/]*"}
FIRST, LAST = datetime(2000, 1, 1, tzinfo=UTC), datetime(2100, 1, 1, tzinfo=UTC)  # dates outside count from another start
EXAMPLE = "{machine}/{date}*.csv"


class Named(Settings):
    """The user's names for one recording."""

    machine: str = knob("", "name of the machine")
    axis: str = knob("", "name of the axis, of a file that holds one")
    date: str = knob("", "when it was made, as 2026-03-03 or 2026-03-03T14:30:00")


class Names(Settings):
    """The names of recordings, and the effects followed in all of them: from a small YAML file, or options."""

    pattern: str = knob("", "of the end of a path, for example {machine}/{axis}/{date}*.csv; * stands for anything but a slash")
    follow: list[str] = knob([], "effects whose parameters are estimated in every recording")
    recordings: dict[str, Named] = knob({}, "by the end of a path: names that the path does not contain")


@dataclass(frozen=True, slots=True)
class Name:
    """The name of a recording.

    axis: if the file holds a single one; empty if the file's own names apply; date: UTC, None if unknown
    said: True if a list or a pattern names the machine; otherwise it is the folder's name, and a name in the recording takes precedence
    """

    machine: str
    axis: str = ""
    date: datetime | None = None
    said: bool = False

    def of(self, recording: Recording) -> str:
        """The machine of a recording that has been read."""
        return self.machine if self.said else recording.machine or self.machine


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
    """The value as text: YAML converts 2026-03-03 to a date. An empty value stays empty, which is refused."""
    return {key: one if one is None else str(one) for key, one in value.items()} if isinstance(value, dict) else value


def check(names: Names) -> None:
    """Raises BadInput for an invalid pattern, or an invalid date of a recording."""
    if names.pattern:
        compiled(names.pattern)
    for end, one in names.recordings.items():
        _said_date(one.date, f"date of {end}")


def fits(names: Names, paths: Sequence[Path]) -> None:
    """Raises BadInput if the pattern fits none of the recordings, and ``recordings`` names none of them."""
    if names.pattern and paths and set(unused(names, paths)) == {*names.recordings}:
        pattern = compiled(names.pattern)
        if not any(pattern.search(path.absolute().as_posix()) for path in paths):
            allowed = f"one that fits the end of the path of a recording, for example of {paths[0]}"
            raise BadInput("pattern", repr(names.pattern), allowed, f"Write for example {EXAMPLE}.")


def unused(names: Names, paths: Iterable[Path]) -> tuple[str, ...]:
    """The entries of ``recordings`` that name none of these recordings."""
    whole = [path.absolute().as_posix() for path in paths]
    ends = {place[found.start() :].removeprefix("/") for place in whole for found in re.finditer("/", place)} | {*whole}
    return tuple(end for end in names.recordings if end not in ends)


def name_of(path: Path, names: Names) -> Name:
    """The name from a list or the path. Without a pattern the folder is the machine, and the first date in the file name is the date.

    Raises BadInput if the path does not match the pattern, or a given date is invalid.
    """
    whole = path.absolute().as_posix()
    said = next((one for end, one in names.recordings.items() if whole == end or whole.endswith(f"/{end}")), None)
    if said is not None and said.machine:
        return Name(said.machine, said.axis, _said_date(said.date), said=True)
    if names.pattern:
        found = compiled(names.pattern).search(whole)
        if found is None:
            raise BadInput(
                "path", str(path), f"one that ends with {names.pattern}", "Change the pattern, or name the recording in the file of names."
            )
        parts = found.groupdict()
        machine, axis, date = parts.get("machine") or "", parts.get("axis") or "", _said_date(parts.get("date") or "")
    else:
        machine, axis, date = "", "", _date_in(path.name)
    if said is not None:
        axis, date = said.axis or axis, _said_date(said.date) or date
    return Name(machine or path.absolute().parent.name, axis, date, said=bool(machine))


def _said_date(text: str, what: str = "date") -> datetime | None:
    """The date in a text that a user gave as a date; None for an empty text. Raises BadInput, which says ``what`` it is."""
    found = date_of(text, what) if text else None
    if found is not None and not FIRST <= found < LAST:
        raise BadInput(what, repr(text), f"a year from {FIRST.year} to {LAST.year - 1}", "Correct it, or leave it out.")
    return found


def _date_in(name: str) -> datetime | None:
    """The first date in the name of a file; None if it has none. One with separators comes first, and one after a letter, like SN20440101, last."""
    dates = re.finditer(f"(?=({DATE}))", name)
    for found in sorted(dates, key=lambda one: (one.group(1)[4].isdigit(), name[: one.start()][-1:].isalpha())):
        with suppress(BadInput):
            if FIRST <= (date := date_of(found.group(1))) < LAST:
                return date
    return None


def compiled(pattern: str) -> re.Pattern[str]:
    """The pattern as a regular expression. Raises BadInput for unknown names in braces, or a repeated name."""
    text = "".join(PARTS.get(part, re.escape(part)) for part in re.split(r"(\{[^}]*\}|\*)", pattern))
    unknown = [part for part in re.findall(r"\{[^}]*\}", pattern) if part not in PARTS]
    twice = [part for part in PARTS if part != "*" and pattern.count(part) > 1]
    if unknown or twice:
        raise BadInput("pattern", repr(pattern), "{machine}, {axis} and {date}, each once, and *", f"Write for example {EXAMPLE}.")
    return re.compile(f"(?:^|/){text}$")


def date_of(text: str, what: str = "date") -> datetime:
    """A date, in UTC if no zone is given. Raises BadInput."""
    zone = re.search(rf"{ZONE}$", text)
    local = re.sub(r"[^\d]", "", text[: zone.start()] if zone else text)
    digits, name = (local, _offset(zone.group())) if zone and len(local) in (12, 14) else (re.sub(r"[^\d]", "", text), "+0000")
    try:
        if re.fullmatch(DATE, text) and len(digits) in (8, 12, 14):
            form = "%Y%m%d%H%M%S"[: {8: 6, 12: 10, 14: 12}[len(digits)]]
            return datetime.strptime(f"{digits} {name}", f"{form} %z").astimezone(UTC)
        found = datetime.fromisoformat(text)
    except ValueError:
        raise BadInput(what, repr(text), "a day and a time of day", "Write for example 2026-03-03 or 2026-03-03T14:30:00.") from None
    return found.astimezone(UTC) if found.tzinfo else found.replace(tzinfo=UTC)


def _offset(zone: str) -> str:
    """A zone as +hhmm."""
    return "+0000" if zone == "Z" else zone[0] + re.sub(r"[^\d]", "", zone).ljust(4, "0")


def date_within(recording: Recording) -> datetime | None:
    """Time of the first sample, if the recording's clock gives a date."""
    first = float(recording.time[0]) if len(recording) else 0.0
    return datetime.fromtimestamp(first, UTC) if FIRST.timestamp() < first < LAST.timestamp() else None
