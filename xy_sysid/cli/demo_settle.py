"""xy-sysid demo --settle: a simulated machine with an ambiguous recording, and the experiments that resolve it, over ROS 2."""

from __future__ import annotations

import os
import tempfile
import threading
from pathlib import Path
from typing import Any

TRAVEL, VOLTAGE = 2.5, 1.2  # rad to each side, V
RATE = 1000.0  # Hz, of the machine
QUIET = {"low": 0.5, "high": 20.0, "rms": 0.08, "centring": 0.0, "brake": 0.2}  # the arm stays near the hanging position
JOIN = 15.0  # s for the series of experiments to end
WORDS = (
    "a simulated joint whose arm hangs, pulled back by a weight or a spring",
    "It hardly swings: a weight and a spring look the same. Watch the page design the experiment that distinguishes them, and run it.",
)


def pulls() -> tuple[tuple[str, ...], ...]:
    """The two possible causes: a law of an angle, and its first look-alike."""
    from xy_sysid.effects import EFFECTS

    law = next(effect for effect in EFFECTS.values() if effect.angular)
    return (law.name,), (law.look_alikes[0],)


def settle_demo(machine: str, speed: float, seed: int, page: tuple[int, bool] | None, json: bool) -> int:
    """Start the nodes and settle the diagnosis of axis x; returns the exit code: 0 if it is settled, otherwise 1.

    page: its port, and True to open a browser; None prints the steps instead. The bags are kept; their folder is printed.
    """
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    folder = Path(tempfile.mkdtemp(prefix="xy_settle_"))
    if page is not None:
        from xy_sysid.cli.demo_page import watch_page

        between = [word for names in pulls() for word in ("--between", "+".join(names))]
        more = ("--settle", "x", "--folder", str(folder), *between)
        return watch_page(specs(machine, speed, seed, watched=True), ("x",), speed, *page, more, WORDS)
    return _headless(machine, speed, seed, folder, json)


def specs(machine: str, speed: float, seed: int, watched: bool) -> list[Any]:
    """The processes of the nodes; watched: include identifier and diagnoser, for the page."""
    from json import dumps

    from xy_sysid.processes.run_plan import plan

    one: dict[str, Any] = {"axes": ["x"]}
    axis = {**QUIET, "limit": VOLTAGE, "travel_min": -TRAVEL, "travel_max": TRAVEL, "seed": seed}
    excite = {**one, "rate": RATE, "lockstep": True, "speed": float(speed), "unit": "rad", "x": axis}
    unit = {**one, "output_unit": "rad"}
    listeners = [
        {"executable": "identifier", "parameters": {**unit, "numerator_order": 0, "denominator_order": 2}},
        {"executable": "diagnoser", "parameters": unit},
    ]
    nodes = [
        {"executable": "ballscrew", "parameters": {"machine": machine}},
        *(listeners if watched else ()),
        {"executable": "excitation", "parameters": excite},
    ]
    document = {"env": {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, "nodes": nodes}
    return plan(dumps(document), "demo --settle", Path.cwd())  # JSON is YAML with every name quoted


def _headless(machine: str, speed: float, seed: int, folder: Path, json: bool) -> int:
    from xy_sysid.cli.monitor import Monitor, refuse_others
    from xy_sysid.cli.output import aside, emit, people, say
    from xy_sysid.nodes.settle import Settler, Wishes
    from xy_sysid.processes import starter

    watcher = Monitor(("x",))
    refuse_others(watcher)
    watcher.close()
    aside.print("starting the nodes: a simulated joint and its excitation, over ROS 2 ...")
    over = threading.Event()
    lines: list[str] = []
    settler = Settler(Wishes("x", folder / "walk", sets=pulls(), alone=True), lambda words: None if json else say(words), over.is_set, lambda: True)
    thread = threading.Thread(target=settler.run, name="settle", daemon=True)
    thread.start()
    try:
        code = starter.run(specs(machine, speed, seed, watched=False), say=lines.append, enough=lambda: not thread.is_alive())
    finally:
        over.set()
        thread.join(JOIN)
        settler.close()
    settled = settler.ending in ("settled", "alike") and not settler.problem
    if json:
        answer = {"ending": settler.ending, "problem": settler.problem or None, "folder": str(folder / "walk"), "steps": list(settler.steps)}
        emit({**answer, "exit_code": code or (0 if settled else 1)})
    elif settled:
        people.print(f"The bags of every step: {folder / 'walk'}", markup=False, soft_wrap=True)
    if code not in (0, 130, 143):
        for line in lines[-20:]:
            aside.print(line, markup=False)
    return code or (0 if settled else 1)
