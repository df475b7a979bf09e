"""xy-sysid demo: a simulated XY table, driven and identified live over ROS 2 on this machine."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli import options as o

if TYPE_CHECKING:
    from rich.console import RenderableType

    from xy_sim.machine import Machine
    from xy_sysid.cli.monitor import Monitor

DELAY_WITHIN, RESONANCE_WITHIN, ERROR_WITHIN = 20e-6, 0.2, 0.015  # s, Hz, 1: allowed errors of the demo on paper.yaml
BLOCK = 100  # samples in one message: a fifth of the usual work for the nodes


def demo(
    machine: Annotated[str, typer.Option(help="machine file or a name in config/machines; default paper.yaml, with the page surprise.yaml")] = "",
    seconds: Annotated[float | None, typer.Option(help="seconds of data; default 60, or until Ctrl-C with the page", min=5.0, max=86_400.0)] = None,
    speed: Annotated[float, typer.Option(help="times faster than real time; 0: full speed", min=0.0, max=1000.0)] = 4.0,
    seed: Annotated[int, typer.Option(help="of the excitation", min=1, max=2**31 - 100)] = 1,
    page: Annotated[bool | None, typer.Option("--page/--no-page", help="open the page in a browser; default in a terminal")] = None,
    port: Annotated[int, typer.Option(help="port of the page, or the next free one; 0: any", min=0, max=65535)] = 8080,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="open a browser if there is a display")] = True,
    settle: Annotated[
        bool, typer.Option("--settle", help="a machine with an ambiguous effect: design and run experiments until the effect is known")
    ] = False,
    use: Annotated[
        bool, typer.Option("--use", help="afterwards use the models: follow a path on the simulated table and compare the tracking errors")
    ] = False,
    json: o.Json = False,
) -> None:
    """Watch the live identification of two simulated axes. All nodes run on this machine."""
    from xy_sim.machine import Machine
    from xy_sysid.cli.demo_page import watch_page, wished
    from xy_sysid.cli.output import aside, emit, people
    from xy_sysid.errors import MissingExtra

    try:
        import rclpy  # noqa: F401
    except ModuleNotFoundError:
        raise MissingExtra("ROS 2 (rclpy)", "ros") from None
    o.ros_domain()
    with_page = wished(page, json)
    if settle:
        from xy_sysid.cli.demo_settle import settle_demo

        raise typer.Exit(settle_demo(machine or "hanging.yaml", speed, seed, (port, browser) if with_page else None, json))
    machine = machine or ("surprise.yaml" if with_page or use else "paper.yaml")
    table = Machine.from_file(machine)
    if use and not with_page:
        from xy_sysid.cli.demo_use import SECONDS, watch_use

        raise typer.Exit(watch_use(_specs(table, machine, 0.0, speed, seed), table, seconds or SECONDS, json))
    if with_page:
        specs = _specs(table, machine, seconds or 0.0, speed, seed)
        if use:
            from xy_sysid.cli.demo_use import excited

            specs = excited(table.axes, specs)
        raise typer.Exit(watch_page(specs, table.axes, speed, port, browser))
    seconds = seconds or 60.0
    aside.print("starting the nodes: a simulated table, an excitation and an identifier, over ROS 2 ...")
    code, monitor, lines, wall = _watch(_specs(table, machine, seconds, speed, seed), table.axes, seconds, plain=json)
    answer = {axis: result(monitor, axis, table.truth(axis)) for axis in table.axes}
    coupled = together(monitor, table.axes)
    if json:
        emit({"machine": machine, "seconds": seconds, "wall_seconds": wall, "axes": answer, "coupling": coupled, "exit_code": code})
    elif code == 0:
        people.print(_panel(monitor, table.axes, seconds))
        for axis in table.axes:
            people.print(function_text(monitor, axis), markup=False)
        for line in _summary(answer):
            people.print(line)
        if coupled:
            people.print(coupled)
        people.print(f"{seconds:g} s of data in {wall:.0f} s. Next: xy-sysid simulate rec && xy-sysid fit rec")
    if code not in (0, 130, 143):
        for line in lines[-20:]:
            aside.print(line, markup=False)
    raise typer.Exit(code)


def _specs(table: Machine, machine: str, seconds: float, speed: float, seed: int) -> list[Any]:
    from json import dumps
    from pathlib import Path

    from xy_sysid.processes.run_plan import plan

    excite: dict[str, Any] = {"lockstep": True, "speed": float(speed), "duration": float(seconds), "block": BLOCK, "unit": table.spec.unit}
    unit = {"output_unit": table.spec.unit}
    excite |= {axis: {"seed": seed + k} for k, axis in enumerate(table.axes)}
    rigid = all(table.truth(axis)["resonance_hz"] is None for axis in table.axes)
    orders = {"numerator_order": 0, "denominator_order": 2} if rigid else {"numerator_order": 2, "denominator_order": 4}
    document = {
        "env": {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"},
        "nodes": [
            {"executable": "ballscrew", "parameters": {"machine": machine}},
            {"executable": "identifier", "parameters": {**orders, **unit}},
            {"executable": "diagnoser", "parameters": unit},
            {"executable": "excitation", "parameters": excite},
        ],
    }
    return plan(dumps(document), "demo", Path.cwd())  # JSON is YAML with every name quoted


def _watch(specs: list[Any], axes: tuple[str, ...], seconds: float, plain: bool) -> tuple[int, Monitor, list[str], float]:
    """Start all nodes and show results until the end. Returns exit code, received results, output of the nodes, and duration in s."""
    import os

    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    from rich.live import Live

    from xy_sysid.cli.monitor import Monitor, refuse_others
    from xy_sysid.cli.output import aside
    from xy_sysid.processes.starter import run

    monitor = Monitor(axes)
    refuse_others(monitor)
    lines: list[str] = []
    begun = time.monotonic()
    live = None if plain or not aside.is_terminal else Live(console=aside, refresh_per_second=5, transient=True)
    shown = [begun]

    def enough() -> bool:
        monitor.spin(0.05)
        monitor.start_when_ready()
        now = time.monotonic()
        if live is not None:
            live.update(_panel(monitor, axes, seconds))
        elif now - shown[0] > 2.0:
            shown[0] = now
            aside.print(_line(monitor, axes), markup=False)
        return monitor.over()

    try:
        if live is not None:
            live.start()
        code = run(specs, say=lines.append, enough=enough)
    finally:
        if live is not None:
            live.stop()
        monitor.close()
    return code, monitor, lines, time.monotonic() - begun


def _line(monitor: Monitor, axes: tuple[str, ...]) -> str:
    said = [monitor.statuses[f"axis {axis}"][1] for axis in axes if f"axis {axis}" in monitor.statuses]
    heard = monitor.statuses.get(f"axis {axes[0]}", (0, "", {}))[2].get("seconds of data (s)", "0")
    return f"{float(heard):6.1f} s of data  " + ("   ".join(said) or "waiting for the nodes")


def _panel(monitor: Monitor, axes: tuple[str, ...], seconds: float) -> RenderableType:
    """The live display: Bode magnitude and results of each axis."""
    import numpy as np
    from rich.columns import Columns
    from rich.console import Group
    from rich.panel import Panel
    from rich.text import Text

    from xy_sysid.cli.drawing import curve
    from xy_sysid.live.plain_messages import topic_of

    panels = []
    for axis in axes:
        level, sentence, values = monitor.statuses.get(f"axis {axis}", (1, "waiting for data", {}))
        parts: list[RenderableType] = []
        message = monitor.arrays.get(topic_of("comparison", axis))
        if message is not None:
            rows = message.data.reshape(message.sizes)
            low, high = float(np.min(rows[:, 1])), float(np.max(rows[:, 1]))
            drawn = curve(rows[:, 0], rows[:, 1], 56, 8, low, high)
            parts.append(Text("\n".join(drawn), style="cyan"))
            parts.append(Text(f"{rows[0, 0]:.2g} Hz{f'|H| {high:.0f} .. {low:.0f} dB':^44}{rows[-1, 0]:.0f} Hz", style="dim"))
        for label, text in figures(values):
            parts.append(Text(f"{label:<16}{text}"))
        parts.append(Text(sentence, style={0: "green", 1: "yellow"}.get(level, "bold red")))
        panels.append(Panel(Group(*parts), title=f"axis {axis}", width=62))
    heard = float(monitor.statuses.get(f"axis {axes[0]}", (0, "", {}))[2].get("seconds of data (s)", "0"))
    return Group(Text(f"live over ROS 2: {heard:.0f} of {seconds:g} s of data"), Columns(panels))


def figures(values: dict[str, str]) -> list[tuple[str, str]]:
    """Label and text of the main results, from the values of the status of an axis."""
    found = []
    for key, label, scale, unit, digits in (
        ("delay (s)", "delay", 1e3, "ms", 4),
        ("gain (m/s/V)", "velocity gain", 1e3, "mm/s/V", 3),
        ("gain (rad/s/V)", "velocity gain", 1.0, "rad/s/V", 4),
        ("antiresonance_1.frequency (Hz)", "antiresonance", 1.0, "Hz", 3),
        ("resonance_1.frequency (Hz)", "resonance", 1.0, "Hz", 3),
        ("relative error (1)", "relative error", 100.0, "%", 2),
        ("windows", "windows", 1.0, "", 0),
    ):
        if key in values:
            name = key.split(" (")[0]
            value, low, high = (float(values[k]) * scale if k in values else float("nan") for k in (key, f"{name} 95 % low", f"{name} 95 % high"))
            spread = f" +- {(high - low) / 2:.{digits}f}" if high == high else ""
            found.append((label, f"{value:.{digits}f}{spread} {unit}".rstrip()))
    return found


def result(monitor: Monitor, axis: str, truth: dict[str, Any]) -> dict[str, Any]:
    """Estimated value, true value and difference, SI; ``within`` is True if the difference is small enough."""
    values = monitor.statuses.get(f"axis {axis}", (0, "", {}))[2]
    wanted = {
        "delay": ("delay (s)", truth["delay"], DELAY_WITHIN),
        "velocity_gain": ("gain (rad/s/V)" if "gain (rad/s/V)" in values else "gain (m/s/V)", truth["velocity_gain"], 0.01 * truth["velocity_gain"]),
        "antiresonance": ("antiresonance_1.frequency (Hz)", truth["antiresonance_hz"], RESONANCE_WITHIN),
        "resonance": ("resonance_1.frequency (Hz)", truth["resonance_hz"], RESONANCE_WITHIN),
    }
    found: dict[str, Any] = {}
    for name, (key, true, allowed) in wanted.items():
        value = float(values[key]) if key in values else None
        close = None if value is None or true is None else abs(value - true) <= allowed
        found[name] = {"value": value, "truth": true, "within": close}
    error = float(values["relative error (1)"]) if "relative error (1)" in values else None
    found["relative_error"] = {"value": error, "within": None if error is None else error <= ERROR_WITHIN}
    found["windows"] = int(values.get("windows", "0"))
    found["dropped_windows"] = int(values.get("dropped windows", "0"))
    return found


def function_text(monitor: Monitor, axis: str) -> str:
    """The published transfer function as a formula in one line."""
    from xy_sysid.live.messages import read_transfer_function
    from xy_sysid.live.plain_messages import topic_of

    message = monitor.arrays.get(topic_of("transfer_function", axis))
    if message is None:
        return f"axis {axis}: no transfer function was published"
    tf, values = read_transfer_function(message), monitor.statuses.get(f"axis {axis}", (0, "", {}))[2]
    return f"H_{axis}(s) = ({polynomial(tf.numerator)}) / ({polynomial(tf.denominator)}) exp(-{tf.delay:.4g} s)  [{values.get('output unit', 'm')}/V]"


def together(monitor: Monitor, axes: tuple[str, ...]) -> str:
    """Whether two single-axis models suffice, in a sentence; empty if this was not tested."""
    from xy_sysid.live.coupling_messages import coupling_name

    return monitor.statuses[coupling_name(axes)][1] if len(axes) > 1 and coupling_name(axes) in monitor.statuses else ""


def polynomial(coefficients: Any) -> str:
    """A polynomial in falling powers of s, as text."""
    terms = []
    for power, value in zip(range(len(coefficients) - 1, -1, -1), coefficients, strict=True):
        if value == 0:
            continue
        unit = value == 1 and power > 0
        variable = "" if power == 0 else "s" if power == 1 else f"s^{power}"
        terms.append(f"{'' if unit else f'{value:.5g}'}{'' if unit or not variable else ' '}{variable}")
    return " + ".join(terms).replace("+ -", "- ") or "0"


def _summary(answer: dict[str, Any]) -> list[str]:
    lines = []
    for axis, found in answer.items():
        parts = []
        for name, label, scale, unit, digits in (
            ("delay", "delay", 1e6, "us", 2),
            ("antiresonance", "antiresonance", 1.0, "Hz", 3),
            ("resonance", "resonance", 1.0, "Hz", 3),
        ):
            item = found[name]
            if item["value"] is not None and item["truth"] is not None:
                parts.append(f"{label} off by {(item['value'] - item['truth']) * scale:+.{digits}f} {unit}")
        lines.append(f"axis {axis} against the simulated truth: " + (", ".join(parts) or "nothing to compare"))
    return lines
