"""The demo with its page: the same nodes, the page as one more process, and an address to open."""

from __future__ import annotations

import importlib.util
import os
import sys
import webbrowser
from typing import Any

from xy_sysid.errors import MissingExtra

LAST = 20  # lines of the nodes that are shown when one of them fails


def wished(page: bool | None, json: bool) -> bool:
    """True if the demo shows a page: as requested; by default in a terminal with NiceGUI installed."""
    from xy_sysid.cli.output import aside, people

    there = importlib.util.find_spec("nicegui") is not None
    if page is None:
        return there and not json and people.is_terminal and aside.is_terminal
    if page and not there:
        raise MissingExtra("NiceGUI, which the page needs,", "page")
    return page


TABLE = "a simulated table with a hidden effect in each axis"
TOLD = "See where the rigid model fails, press Diagnose, then Add. Ctrl-C ends everything."


def watch_page(
    specs: list[Any], axes: tuple[str, ...], speed: float, port: int, browse: bool, more: tuple[str, ...] = (), words: tuple[str, str] = (TABLE, TOLD)
) -> int:
    """Run the nodes and the page until Ctrl-C or until the page ends; returns the exit code.

    speed: times real time, 0 at full speed; port: of the page, or the next free one; browse: open a browser if there is a display
    more: options of the page; words: the simulated machine, and the user's next action on the page
    """
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    from xy_sysid.cli.monitor import Monitor, refuse_others
    from xy_sysid.cli.output import aside, people, say
    from xy_sysid.cli.page import display
    from xy_sysid.processes.run_plan import ProcessSpec
    from xy_sysid.processes.starter import run

    aside.print(f"starting the nodes and the page: {words[0]}, over ROS 2 ...")
    monitor = Monitor(axes)
    refuse_others(monitor)
    command = (sys.executable, "-m", "xy_sysid", "page", "--no-browse", "--port", str(port), *more)
    page = ProcessSpec("page", command, (("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),), stop_rank=max(spec.stop_rank for spec in specs))
    lines: list[str] = []

    def heard(name: str, line: str) -> None:
        if name == "page" and line.startswith("http"):
            people.print(f"the page is at {line}")
            pace = f"{speed:g} times faster than real time" if speed else "at full speed"
            say(f"The machine is simulated, {pace}. {words[1]}")
            if browse and display():
                webbrowser.open(line)

    def enough() -> bool:
        monitor.spin(0.05)
        monitor.start_when_ready()
        return False

    try:
        code = run([*specs, page], say=lines.append, heard=heard, enough=enough)
    finally:
        monitor.close()
    if code not in (0, 130, 143):
        for line in lines[-LAST:]:
            aside.print(line, markup=False)
    return code
