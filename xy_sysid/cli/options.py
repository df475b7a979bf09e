"""Options that commands share, and what they mean."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.settings import IdentifierSettings, changed

Rec = Annotated[Path, typer.Argument(metavar="REC", help="recording: a rosbag2 folder or file (.db3, .mcap), .csv, .mat or .npz")]
Axes = Annotated[list[str] | None, typer.Option("--axis", "-a", help="only this axis (may be repeated)")]
Set = Annotated[
    list[str] | None, typer.Option("--set", "-s", metavar="NAME=VALUE", help="change a setting, for example length=2048 (see docs/settings.md)")
]
Params = Annotated[Path | None, typer.Option("--params", metavar="FILE", help="ROS parameter file; the identifier's part is used")]
Topics = Annotated[
    list[str] | None,
    typer.Option("--topic", metavar="WHAT=NAME", help="topic names in a bag: voltage=..., position=... or joints=... (may be repeated)"),
]
Effort = Annotated[bool, typer.Option("--effort", help="take the input from the effort of a JointState")]
Period = Annotated[str, typer.Option(help="samples of the input's period: auto, none or a number")]
Span = Annotated[str, typer.Option("--span", metavar="FROM:TO", help="only this part, in seconds from the start, for example 10:70")]
Json = Annotated[bool, typer.Option("--json", help="one JSON document on stdout")]


def settings_from(params: Path | None, pairs: list[str] | None) -> IdentifierSettings:
    """The identifier's settings from a parameter file and NAME=VALUE pairs."""
    import yaml

    settings = IdentifierSettings()
    if params is not None:
        from xy_sysid.parameter_file import parameters

        settings = changed(settings, parameters(read_text(params), str(params)).get("identifier", {}))
    values: dict[str, Any] = {}
    for pair in pairs or []:
        name, equals, text = pair.partition("=")
        if not equals:
            raise BadInput("--set", repr(pair), "NAME=VALUE", "Write for example --set length=2048.")
        values[name.strip()] = yaml.safe_load(text)
    return changed(settings, values) if values else settings


def read_text(path: Path) -> str:
    """A text file; raises BadRecording in one line when it cannot be read."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError as problem:
        raise BadRecording(path, problem.strerror or "cannot be read", "Check the path.") from None
    except UnicodeDecodeError:
        raise BadRecording(path, "is not text", "Give a text file.") from None


def period_from(text: str) -> int | None:
    """0 for auto, None for none, or the number."""
    if text == "auto":
        return 0
    if text == "none":
        return None
    try:
        period = int(text)
    except ValueError:
        period = -1
    if period < 2:
        raise BadInput("--period", repr(text), "auto, none or a number of samples >= 2", "Change it.")
    return period


def span_from(text: str) -> tuple[float, float | None]:
    """Start and stop in seconds, stop None for the end."""
    if not text:
        return 0.0, None
    first, colon, last = text.partition(":")
    try:
        start, stop = float(first or 0.0), float(last) if last else None
    except ValueError:
        start, stop = -1.0, None
    if not colon or start < 0 or (stop is not None and stop <= start):
        raise BadInput("--span", repr(text), "FROM:TO in seconds, FROM < TO", "Write for example --span 10:70.")
    return start, stop


def topics_from(pairs: list[str] | None) -> dict[str, str]:
    """Keyword arguments of ``load`` from WHAT=NAME pairs."""
    known = {"voltage": "voltage_topic", "position": "position_topic", "joints": "joint_topic"}
    found: dict[str, str] = {}
    for pair in pairs or []:
        what, equals, name = pair.partition("=")
        if not equals or what not in known:
            raise BadInput("--topic", repr(pair), "voltage=NAME, position=NAME or joints=NAME", "Change it.")
        found[known[what]] = name
    return found
