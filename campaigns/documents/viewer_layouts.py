"""Layouts that open the topics of this package in PlotJuggler and Foxglove, made from the columns and names of the messages.

    python -m campaigns.documents.viewer_layouts plotjuggler > config/plotjuggler.xml
    python -m campaigns.documents.viewer_layouts foxglove > config/foxglove.json

How they address fields. PlotJuggler: ``/topic/data[k]`` for an array, ``/topic/hardware_id/status/key`` for diagnostics, whose values
it reads as numbers. Foxglove: ``/topic.data[k]``, ``/topic.status[:]{name=="axis x"}.values[:]{key=="..."}.value``; as it has no
strides, a user script of the layout turns rows into columns, under ``/studio_script/``.
"""

from __future__ import annotations

import json
import sys
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from typing import Any

from xy_sysid.live.diagnosis_messages import LADDER_COLUMNS
from xy_sysid.live.messages import COMPARISON_COLUMNS
from xy_sysid.live.plain_messages import topic_of
from xy_sysid.samples.block import columns
from xy_sysid.settings import NAMESPACE

AXES = ("x", "y")
COLOURS = ("#2f7fd0", "#d9691e", "#1a9a6c", "#9a62d0")
LARGEST_BLOCK = 400  # numbers in a block of samples that PlotJuggler keeps; a response has thousands and is omitted

SAMPLES = columns(AXES).split(",")
STREAMS = (("voltage", "V"), ("position", "m"))
FITTED = (("relative error (1)", "relative error"), ("delay (s)", "delay, s"), ("resonance watched (Hz)", "resonance, Hz"))
DRIVEN = (("rms", "rms applied, V"), ("clipped", "samples clipped"), ("braked", "samples braked"))
MISSING = (("error now (m/s)", "error now, m/s"), ("noise floor (m/s)", "noise floor, m/s"))


def plotjuggler() -> str:
    """The XML."""
    root = ET.Element("root")
    tabs = ET.SubElement(root, "tabbed_widget", {"parent": "main_window", "name": "Main Window"})
    _tab(tabs, "signals", [[f"{NAMESPACE}/{topic}/data[{SAMPLES.index(axis)}]" for axis in AXES] for topic, _ in STREAMS])
    _tab(tabs, "identification", [[f"{NAMESPACE}/metrics/identifier/axis {axis}/{key}" for axis in AXES] for key, _ in FITTED])
    _tab(tabs, "excitation", [[f"{NAMESPACE}/metrics/excitation/excitation/{axis}.{key}" for axis in AXES] for key, _ in DRIVEN])
    _tab(tabs, "what is missing", [[f"{NAMESPACE}/diagnosis/diagnoser/axis {axis}/{key}" for key, _ in MISSING] for axis in AXES])
    ET.SubElement(tabs, "currentTabIndex", index="0")
    ET.SubElement(root, "use_relative_time_offset", enabled="1")
    plugins = ET.SubElement(root, "Plugins")
    for name in ("DataLoad ROS2 bags", "ROS2 Topic Subscriber"):
        plugin = ET.SubElement(plugins, "plugin", ID=name)
        for key, value in (("use_header_stamp", "false"), ("discard_large_arrays", "true"), ("max_array_size", str(LARGEST_BLOCK))):
            ET.SubElement(plugin, key, value=value)
        topics = [*(f"{NAMESPACE}/{topic}" for topic, _ in STREAMS), f"{NAMESPACE}/metrics", f"{NAMESPACE}/diagnosis"]
        ET.SubElement(plugin, "selected_topics", value=";".join(topics))
    ET.indent(root, " ")
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _tab(tabs: ET.Element, name: str, plots: Sequence[Sequence[str]]) -> None:
    """Add plots below each other, each with its curves."""
    container = ET.SubElement(ET.SubElement(tabs, "Tab", containers="1", tab_name=name), "Container")
    sizes = ";".join(f"{1 / len(plots):.6f}" for _ in plots)
    splitter = ET.SubElement(container, "DockSplitter", orientation="-", count=str(len(plots)), sizes=sizes)
    for curves in plots:
        plot = ET.SubElement(
            ET.SubElement(splitter, "DockArea", name="..."), "plot", mode="TimeSeries", style="Lines", flip_x="false", flip_y="false"
        )
        ET.SubElement(plot, "limitY")
        for curve, colour in zip(curves, COLOURS, strict=False):
            ET.SubElement(plot, "curve", name=curve, color=colour)


def foxglove() -> str:
    """The JSON."""
    panels: dict[str, Any] = {}
    for topic, unit in STREAMS:
        paths = [(f"{NAMESPACE}/{topic}.data[{SAMPLES.index(axis)}]", f"{topic} {axis}, {unit}") for axis in AXES]
        panels[f"Plot!{topic}"] = _plot(f"{topic}: the first sample of each block", paths)
    for key, label in FITTED:
        named = [(f'{NAMESPACE}/metrics.status[:]{{name=="axis {axis}"}}.values[:]{{key=="{key}"}}.value', f"{label}, {axis}") for axis in AXES]
        panels[f"Plot!{key.split(' ')[0]}"] = _plot(label, named)
    scripts: dict[str, Any] = {}
    for axis in AXES:
        comparison, ladder = topic_of("comparison", axis), topic_of("error_ladder", axis)
        for topic, names in ((comparison, COMPARISON_COLUMNS), (ladder, LADDER_COLUMNS)):
            scripts[topic] = {"name": f"columns of {topic}", "sourceCode": _script(topic, names)}
        over = f"{_made(comparison)}.log10_frequency[:]"
        magnitudes = [(f"{_made(comparison)}.{name}[:]", name.removesuffix("_db")) for name in COMPARISON_COLUMNS[1:3]]
        panels[f"Plot!bode_{axis}"] = _plot(f"{axis}: magnitude in dB over log10 of Hz", magnitudes, over)
        errors = [(f"{_made(ladder)}.{name}[:]", name.replace("_", " ")) for name in LADDER_COLUMNS[1:]]
        panels[f"Plot!ladder_{axis}"] = _plot(f"{axis}: the error ladder, m/s", errors, f"{_made(ladder)}.{LADDER_COLUMNS[0]}[:]")
    panels["RawMessages!diagnosis"] = {"topicPath": f"{NAMESPACE}/diagnosis", "diffEnabled": False, "title": "what is missing"}
    layout = {
        "configById": panels,
        "globalVariables": {},
        "userNodes": scripts,
        "playbackConfig": {"speed": 1.0},
        "layout": _stacked("row", [_stacked("column", list(panels)[k::3]) for k in range(3)]),
    }
    return json.dumps(layout, indent=1) + "\n"


def _plot(title: str, paths: Sequence[tuple[str, str]], over: str = "") -> dict[str, Any]:
    """A plot over time, or of the newest message over a path."""
    drawn = [
        {"value": value, "label": label, "enabled": True, "timestampMethod": "receiveTime", "color": colour}
        for (value, label), colour in zip(paths, COLOURS, strict=False)
    ]
    axis: Mapping[str, Any] = {"xAxisVal": "currentCustom", "xAxisPath": {"value": over, "enabled": True}} if over else {"xAxisVal": "timestamp"}
    shown = {"showXAxisLabels": True, "showYAxisLabels": True, "showLegend": True, "legendDisplay": "top", "isSynced": not over}
    return {"title": title, "paths": drawn, **shown, **axis}


def _made(topic: str) -> str:
    """The topic on which a script publishes the columns of a topic."""
    return f"/studio_script{NAMESPACE}/{topic}"


def _script(topic: str, names: Sequence[str]) -> str:
    """TypeScript that turns the rows of a topic into columns; for a frequency it also gives the logarithm."""
    fields = [f"    {name}: column({place})," for place, name in enumerate(names)]
    kinds = [f"{name}: number[];" for name in names]
    if names[0] == "frequency":
        fields.append("    log10_frequency: column(0).map((value) => Math.log10(value)),")
        kinds.append("log10_frequency: number[];")
    return "\n".join(
        [
            'import { Input } from "./types";',
            f"type Output = {{ {' '.join(kinds)} }};",
            f'export const inputs = ["{NAMESPACE}/{topic}"];',
            f'export const output = "{_made(topic)}";',
            f'export default function script(event: Input<"{NAMESPACE}/{topic}">): Output {{',
            "  const data = Array.from(event.message.data);",
            f"  const column = (place: number) => data.filter((_, k) => k % {len(names)} === place);",
            "  return {",
            *fields,
            "  };",
            "}",
            "",
        ]
    )


def _stacked(direction: str, names: Sequence[Any]) -> Any:
    """A split of the window; further splits are nested in the second half."""
    if len(names) == 1:
        return names[0]
    return {"direction": direction, "first": names[0], "second": _stacked(direction, names[1:]), "splitPercentage": round(100 / len(names), 1)}


if __name__ == "__main__":
    made = {"plotjuggler": plotjuggler, "foxglove": foxglove}
    if len(sys.argv) != 2 or sys.argv[1] not in made:
        sys.exit(f"usage: python -m campaigns.documents.viewer_layouts {' | '.join(made)}")
    sys.stdout.write(made[sys.argv[1]]())
