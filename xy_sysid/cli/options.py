"""Options that commands share, and their values."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.settings import IdentifierSettings, Settings, changed, unknown_name

if TYPE_CHECKING:
    from xy_sysid.processes.run_plan import Told

Rec = Annotated[
    Path, typer.Argument(metavar="REC", help="recording: a rosbag2 folder or file (.db3, .mcap), .csv, .mat, .npz or another format of docs/files.md")
]
Recs = Annotated[
    list[Path],
    typer.Argument(
        metavar="REC", help="recordings of one machine: rosbag2 folders or files (.db3, .mcap), .csv, .mat, .npz or another format of docs/files.md"
    ),
]
Axes = Annotated[list[str] | None, typer.Option("--axis", "-a", help="only this axis (may be repeated)")]
Set = Annotated[
    list[str] | None, typer.Option("--set", "-s", metavar="NAME=VALUE", help="change a setting, for example length=2048 (see docs/settings.md)")
]
Params = Annotated[Path | None, typer.Option("--params", metavar="FILE", help="ROS parameter file or run file; the identifier's part is used")]
Topics = Annotated[
    list[str] | None,
    typer.Option("--topic", metavar="WHAT=NAME", help="topic names in a bag: voltage=..., position=... or joints=... (may be repeated)"),
]
Effort = Annotated[bool, typer.Option("--effort", help="use the effort of a JointState as input, in V or the unit of --unit")]
Velocity = Annotated[
    bool, typer.Option("--velocity", help="use the velocity of a JointState as output; without this option only if there are no positions")
]
Joints = Annotated[
    list[str] | None,
    typer.Option(
        "--joint", metavar="AXIS=JOINT", help="joint of an axis in the joint states of a bag, for example x=shoulder_pan_joint (may be repeated)"
    ),
]
EffortLag = Annotated[
    int, typer.Option(metavar="N", min=0, max=100, help="number of samples by which the effort is older than its stamp; 1 with ros2_control")
]
Period = Annotated[str, typer.Option(help="period of the input in samples: auto, none or a number")]
Span = Annotated[str, typer.Option("--span", metavar="FROM:TO", help="only this part, in seconds from the start, for example 10:70")]
LARGEST_DOMAIN = 232
Force = Annotated[bool, typer.Option("--force", help="replace an existing file")]
Json = Annotated[bool, typer.Option("--json", help="one JSON document on stdout")]


def settings_from(params: Path | None, pairs: list[str] | None) -> IdentifierSettings:
    """The identifier's settings from a parameter file and NAME=VALUE pairs."""
    settings = IdentifierSettings()
    if params is not None:
        settings = changed(settings, {name: value for name, value in told_to("identifier", params).parameters.items() if name != "axes"})
    return changed(settings, values_from(pairs, "--set", "length=2048", IdentifierSettings))


def axes_from(params: Path | None) -> tuple[str, ...]:
    """The identifier's axes in a parameter file; empty if it names none."""
    found = told_to("identifier", params).parameters.get("axes", []) if params is not None else []
    return tuple(map(str, found)) if isinstance(found, list) else ()


def told_to(kind: str, params: Path) -> Told:
    """The settings of a kind of node in a ROS parameter file or a run file; no parameters if a parameter file does not contain it."""
    from xy_sysid.files.ros_parameters import parameters
    from xy_sysid.processes.run_plan import Told, is_run_file, told

    text = read_text(params)
    if is_run_file(text, str(params)):
        return told(kind, text, str(params), lambda name: read_text(params.resolve().parent / name))
    return Told(parameters(text, str(params)).get(kind, {}))


def values_from(pairs: list[str] | None, option: str, example: str, cls: type[Settings]) -> dict[str, Any]:
    """Values by name from NAME=VALUE pairs, as text; the settings convert each to its declared type."""
    values: dict[str, Any] = {}
    for pair in pairs or []:
        name, equals, text = (part.strip() for part in pair.partition("="))
        if not equals:
            raise BadInput(option, repr(pair), "NAME=VALUE", f"Write for example {option} {example}.")
        if name not in cls.model_fields:
            raise unknown_name(name, list(cls.model_fields), option)
        values[name] = text
    return values


def ros_domain() -> None:
    """Raises BadInput for a ROS_DOMAIN_ID that ROS does not accept."""
    text = os.environ.get("ROS_DOMAIN_ID", "") or "0"
    if not (text.isascii() and text.isdigit() and int(text) <= LARGEST_DOMAIN):
        raise BadInput("ROS_DOMAIN_ID", repr(text), f"0 to {LARGEST_DOMAIN}", "Set it, or leave it unset for 0.")


def output_file(option: str, path: Path | None, force: bool, ending: str = "") -> None:
    """Raises BadInput, before any work, if a file cannot be written, would replace one without --force, or has another ending than this one."""
    if path is None:
        return
    if ending and path.suffix.lower() not in ("", ending):
        raise BadInput(option, str(path), f"a name that ends with {ending}", "Change the ending.")
    from xy_sysid.files.unasked import free

    folder = path.absolute().parent
    try:
        if path.is_dir():
            raise BadInput(option, str(path), "a file, not a folder", "Give the file a name.")
        if not folder.is_dir():
            raise BadInput(option, str(path), "a file in an existing folder", f"Make {folder} first.")
        free(option, path, force, "add --force")
    except OSError as problem:
        raise BadInput(option, str(path), "a name that the file system accepts", f"{problem.strerror}.") from None
    if not os.access(path if path.exists() else folder, os.W_OK):
        raise BadInput(option, str(path), "a file that you may write", "Choose another place.")


def new_bag(path: Path | None) -> None:
    """Raises BadRecording if the path exists: a bag never replaces anything."""
    from xy_sysid.bags.atomic import taken

    if path is not None and taken(path):
        raise BadRecording(path, "exists already", "Choose another name; nothing is overwritten.")


def read_text(path: Path) -> str:
    """The content of a text file; raises BadRecording in one line if it cannot be read."""
    from xy_sysid.bags.opening import text_of

    return text_of(path, "a parameter file")


def period_from(text: str) -> int | None:
    """The value of --period: 0 for auto, None for none, or the number of samples."""
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


Budget = Annotated[
    float | None,
    typer.Option(
        "--budget",
        metavar="S",
        min=0.1,
        help="limit of processor time for each axis, s; the search then gives its best result so far. Default: a fixed amount of work",
    ),
]
