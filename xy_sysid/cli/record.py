"""xy-sysid record: topics to a rosbag2 until Ctrl-C."""

from __future__ import annotations

import re
from json import dumps as json_text
from pathlib import Path
from typing import Annotated, Any

import typer

from xy_sysid.cli import options as o


def record(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="folder of the new bag")],
    storage: Annotated[str, typer.Option(help="sqlite3 or mcap")] = "sqlite3",
    seconds: Annotated[float, typer.Option(help="stop this many seconds after the first message; 0: until Ctrl-C", min=0.0)] = 0.0,
    topic: Annotated[list[str] | None, typer.Option("--topic", help="topic below the namespace, a regular expression (may be repeated)")] = None,
    namespace: Annotated[str, typer.Option(help="ROS namespace")] = "/xy",
    machine: Annotated[str, typer.Option("--machine", metavar="TEXT", help="name of the machine, kept in the bag and shown by report")] = "",
    json: o.Json = False,
) -> None:
    """Record the topics of xy_sysid (docs/topics.md) to a rosbag2. Ctrl-C ends the recording and completes the bag."""
    from xy_sysid.cli.output import emit, people
    from xy_sysid.errors import BadInput, MissingExtra

    if storage not in ("sqlite3", "mcap"):
        raise BadInput("--storage", repr(storage), "sqlite3, mcap", "Choose one of these.")
    o.new_bag(out)
    try:
        import rclpy  # noqa: F401
    except ModuleNotFoundError:
        raise MissingExtra("ROS 2 (rclpy)", "ros") from None
    o.ros_domain()
    if not re.fullmatch(r"(/[A-Za-z_][A-Za-z0-9_]*)+|/", namespace):
        raise BadInput("--namespace", repr(namespace), "names after slashes, like /xy or /cell/xy", "Change it.")
    values: dict[str, Any] = {"output": str(out), "storage": storage, "seconds": float(seconds)}
    if topic:
        values["topics"] = list(topic)
    if machine:
        values["machine"] = machine
    code = _run(_arguments(values, namespace))
    if code:
        raise typer.Exit(code)
    found = _content(out)
    if json:
        emit({"output": str(out), "topics": found})
    else:
        people.print(f"{out}: {sum(found.values())} messages on {len(found)} topics")


def _arguments(values: dict[str, Any], namespace: str) -> list[str]:
    pairs = [word for name, value in values.items() for word in ("-p", f"{name}:={json_text(value)}")]
    return ["--ros-args", "-r", f"__ns:={namespace}", *pairs]


def _run(arguments: list[str]) -> int:
    """Run the recorder in this process; Ctrl-C ends it without an error."""
    from xy_sysid.nodes.run import maker, run_node

    return run_node(maker("xy_sysid.nodes.recorder_node:RecorderNode"), ["recorder", *arguments])


def _content(out: Path) -> dict[str, int]:
    import yaml

    told = yaml.safe_load((out / "metadata.yaml").read_text(encoding="utf-8"))["rosbag2_bagfile_information"]
    return {item["topic_metadata"]["name"]: int(item["message_count"]) for item in told["topics_with_message_count"]}
