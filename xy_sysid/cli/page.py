"""xy-sysid page: the page, live or of recordings."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.diagnose import Own
from xy_sysid.cli.next import Between, sets_of
from xy_sysid.cli.reading import Map, Rate, Scales, Units

if TYPE_CHECKING:
    from xy_sysid.page.orders import Reading

Recs = Annotated[
    list[Path] | None, typer.Argument(metavar="[REC]...", help="recordings to open side by side; without one the page is live over ROS 2")
]


def page(
    rec: Recs = None,
    host: Annotated[str, typer.Option(help="address to listen on; other machines need the printed token")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="port, or the next free one; 0: any", min=0, max=65535)] = 8080,
    folder: Annotated[Path, typer.Option(help="folder of the recordings that can be opened and of new bags")] = Path(),
    live: Annotated[bool | None, typer.Option("--live/--no-live", help="show the machine as well as recordings; default without recordings")] = None,
    topic: o.Topics = None,
    effort: o.Effort = False,
    map_: Map = None,
    unit: Units = None,
    scale: Scales = None,
    rate: Rate = None,
    effect_file: Own = None,
    namespace: Annotated[str, typer.Option(help="ROS namespace of the machine")] = "/xy",
    browse: Annotated[bool, typer.Option("--browse/--no-browse", help="open a browser if there is a display")] = True,
    between: Between = None,
    settle: Annotated[str, typer.Option(hidden=True, help="axis for which the experiments start automatically, for the demo")] = "",
    json: o.Json = False,
) -> None:
    """Show measurement and model in a browser, where they differ, and the missing effect; add it there and see the error fall. Ctrl-C ends it."""
    import re

    from xy_sysid.cli.output import aside, emit, people
    from xy_sysid.errors import BadInput, BadRecording, MissingExtra

    try:
        import nicegui  # noqa: F401
    except ModuleNotFoundError:
        raise MissingExtra("NiceGUI, which the page needs,", "page") from None
    for path in rec or []:
        if not path.exists():
            raise BadRecording(path, "is not there", "Check the path.")
    if not folder.is_dir():
        raise BadInput("--folder", str(folder), "an existing folder", "Make it first.")
    if not re.fullmatch(r"(/[A-Za-z_][A-Za-z0-9_]*)+", namespace):
        raise BadInput("--namespace", repr(namespace), "names after slashes, like /xy or /cell/xy", "Change it.")
    with_machine = not rec if live is None else live
    if with_machine:
        try:
            import rclpy  # noqa: F401
        except ModuleNotFoundError:
            raise MissingExtra("ROS 2 (rclpy), which a live page needs,", "ros") from None
        o.ros_domain()
    from xy_sysid.page.server import serve
    from xy_sysid.page.session import Session
    from xy_sysid.page.shelf import Shelf

    def told(address: str) -> None:
        if json:
            emit({"address": address})
        else:
            people.print(address)

    said = {"--map": map_ or [], "--unit": unit or [], "--scale": scale or [], "--rate": [] if rate is None else [f"{rate:g}"]}
    how = reading(topic, effort, effect_file, said)
    session = Session(Shelf(folder), with_machine, namespace, how)
    if session.settling is not None:
        session.settling.wished, session.settling.sets, session.settling.first = settle, tuple(sets_of(between)), bool(settle)
    try:
        for path in rec or []:
            session.open(path)
        serve(session, host, port, os.environ.get("XY_SYSID_TOKEN", ""), browse and display(), told)
    finally:
        session.close()
    aside.print("the page has ended")


def reading(topics: list[str] | None, effort: bool, effect_files: list[Path] | None, tables: Mapping[str, list[str]] | None = None) -> Reading:
    """How recordings are read, for the page and its reports; tables: the options for tables. Raises BadInput for invalid options."""
    from xy_sysid.files.effects import library
    from xy_sysid.page.orders import Reading
    from xy_sysid.page.orders import tables as table_arguments

    library(effect_files or [])  # raises BadInput for invalid files
    given = {option: texts for option, texts in (tables or {}).items() if texts}
    load: dict[str, Any] = {**o.topics_from(topics), **({"effort_as_voltage": True} if effort else {}), **table_arguments(given)}
    words = [word for topic in topics or [] for word in ("--topic", topic)] + ["--effort"] * effort
    words += [word for option, texts in given.items() for text in texts for word in (option, text)]
    words += [word for file in effect_files or [] for word in ("--effect-file", str(file))]
    return Reading(load, tuple(words), tuple(effect_files or ()))


def display() -> bool:
    """True if there is a display."""
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
