"""Layouts for PlotJuggler and Foxglove: they name only topics and fields that we publish."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers import ROOT
from helpers.live_streams import blocks, last, recorded
from helpers.stories import told

from campaigns.documents.viewer_layouts import LARGEST_BLOCK, foxglove, plotjuggler
from xy_sysid.live.diagnosis_messages import LADDER_COLUMNS, diagnosis_status, ladder_message
from xy_sysid.live.fitter import Update
from xy_sysid.live.messages import COMPARISON_COLUMNS, comparison_message
from xy_sysid.live.plain_messages import StatusMessage
from xy_sysid.live.replay import replay
from xy_sysid.samples.block import Block, columns, pack
from xy_sysid.settings import ExcitationSettings, IdentifierSettings


@cache
def heard() -> Update:
    """Messages of the identifier for the paper's machine."""
    return last(replay(blocks(recorded("paper.yaml", 20.0)), IdentifierSettings(), ("x", "y")))


@cache
def series() -> frozenset[str]:
    """All names of our published fields in PlotJuggler: /topic/data[k] and /topic/hardware_id/status/key."""
    sample = Block(("x", "y"), np.arange(20.0), np.arange(20.0), np.zeros((20, 2)))
    names = {f"/xy/{topic}/data[{k}]" for topic in ("voltage", "position") for k in range(pack(sample).size)}
    names |= {f"/xy/metrics/identifier/{status.name}/{key}" for status in heard().statuses() for key, _ in status.values}
    status = diagnosis_status(told())
    names |= {f"/xy/diagnosis/diagnoser/axis {axis}/{key}" for axis in "xy" for key, _ in status.values}
    source = (ROOT / "xy_sysid" / "nodes" / "excitation_node.py").read_text(encoding="utf-8")
    names |= {f"/xy/metrics/excitation/excitation/{axis}.{key}" for axis in "xy" for key in re.findall(r'f"\{axis\}\.(\w+)"\]', source)}
    return frozenset(names)


def test_the_layouts_are_made_by_their_command() -> None:
    """python -m campaigns.documents.viewer_layouts plotjuggler > config/plotjuggler.xml, and foxglove > config/foxglove.json"""
    assert (ROOT / "config" / "plotjuggler.xml").read_text(encoding="utf-8") == plotjuggler()
    assert (ROOT / "config" / "foxglove.json").read_text(encoding="utf-8") == foxglove()


def test_every_curve_of_plotjuggler_is_a_series_that_we_publish() -> None:
    """Arrays by index, diagnostics by hardware id, status and key; and each is a number."""
    curves = [str(curve.get("name")) for curve in ET.fromstring(plotjuggler()).iter("curve")]
    assert len(curves) > 15 and len(set(curves)) == len(curves)
    assert set(curves) <= series(), sorted(set(curves) - series())


def test_plotjuggler_keeps_the_blocks_and_knows_the_topics() -> None:
    """A default block has fewer numbers than the layout keeps, and each topic of a curve is selected."""
    root = ET.fromstring(plotjuggler())
    assert ExcitationSettings().block * len(columns(("x", "y")).split(",")) <= LARGEST_BLOCK
    for plugin in root.iter("plugin"):
        chosen = [topic for item in plugin.iter("selected_topics") for topic in str(item.get("value")).split(";")]
        for curve in root.iter("curve"):
            assert any(str(curve.get("name")).startswith(f"{topic}/") for topic in chosen)


def test_the_values_of_diagnostics_read_as_numbers() -> None:
    """Texts that are drawn over time must be numbers."""
    wanted = {str(curve.get("name")).rpartition("/axis x/")[2] for curve in ET.fromstring(plotjuggler()).iter("curve")}
    statuses: list[StatusMessage] = [*heard().statuses(), diagnosis_status(told())]
    read = {key: float(value) for status in statuses for key, value in status.values if key in wanted}
    assert {"relative error (1)", "delay (s)", "error now (m/s)"} <= set(read)


@cache
def layout() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(foxglove())
    return found


def scripted() -> dict[str, set[str]]:
    """Topic that a script of the Foxglove layout makes -> fields that it gives."""
    made = {}
    for script in layout()["userNodes"].values():
        topic = re.search(r'export const output = "([^"]+)"', script["sourceCode"])
        assert topic is not None
        made[topic.group(1)] = set(re.findall(r"^    (\w+): column", script["sourceCode"], re.MULTILINE))
    return made


def paths() -> list[str]:
    found = []
    for panel in layout()["configById"].values():
        found += [item["value"] for item in panel.get("paths", [])]
        found += [panel["xAxisPath"]["value"]] if "xAxisPath" in panel else []
    return found


@pytest.mark.parametrize("path", paths())
def test_every_path_of_foxglove_leads_to_a_field(path: str) -> None:
    """Array elements, named values of diagnostics, or columns that a script of the layout makes."""
    if found := re.fullmatch(r"(/xy/\w+)\.data\[(\d+)\]", path):
        assert f"{found.group(1)}/data[{found.group(2)}]" in series()
    elif found := re.fullmatch(r'(/xy/\w+)\.status\[:\]\{name=="([^"]+)"\}\.values\[:\]\{key=="([^"]+)"\}\.value', path):
        assert f"{found.group(1)}/identifier/{found.group(2)}/{found.group(3)}" in series()
    else:
        topic, _, field = path.removesuffix("[:]").rpartition(".")
        assert field in scripted()[topic]


def test_the_scripts_of_foxglove_read_the_columns_that_we_send() -> None:
    """The columns of the messages, in their order; the inputs are our topics."""
    fit = heard().axes["x"].fit
    assert fit is not None
    sent = {"comparison/x": comparison_message("x", fit), "error_ladder/x": ladder_message(told())}
    for topic, (names, message) in {
        "comparison/x": (COMPARISON_COLUMNS, sent["comparison/x"]),
        "error_ladder/x": (LADDER_COLUMNS, sent["error_ladder/x"]),
    }.items():
        source = layout()["userNodes"][topic]["sourceCode"]
        assert message.topic == topic and f'inputs = ["/xy/{topic}"]' in source
        assert f"k % {message.sizes[1]} === place" in source and message.labels[1] == ",".join(names)
        for place, name in enumerate(names):
            assert f"{name}: column({place})," in source


def test_every_panel_of_foxglove_is_in_the_window_once() -> None:
    """The mosaic names each panel, and only those."""

    def leaves(tree: Any) -> list[str]:
        return [tree] if isinstance(tree, str) else [*leaves(tree["first"]), *leaves(tree["second"])]

    assert sorted(leaves(layout()["layout"])) == sorted(layout()["configById"])
