"""The page designs an experiment, runs it on the machine over DDS, and settles an ambiguous recording."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from helpers.browser_tools import Server, Tab, browser, needs_browser
from helpers.live_nodes import ready
from helpers.ros_tools import World, needs_ros, world_in

from xy_sysid.cli.demo_settle import QUIET, RATE, TRAVEL, VOLTAGE
from xy_sysid.imports import load

pytestmark = [needs_browser, needs_ros]

JOINT = {"axes": "[x]", "unit": "rad", "x.limit": VOLTAGE, "x.travel_min": -TRAVEL, "x.travel_max": TRAVEL}
DRIVE = {**JOINT, **{f"x.{name}": value for name, value in QUIET.items()}, "rate": RATE, "lockstep": True, "speed": 8.0, "block": 100}


class Scene:
    """The joint with its nodes, driven with small motion, a page server, and a tab on it."""

    def __init__(self, world: World, folder: Path, made: Any) -> None:
        self.world = world
        world.start("xy_sim.node", {"machine": "hanging.yaml"})
        world.start("xy_sysid.nodes.identifier", {"axes": "[x]", "output_unit": "rad", "refit": 1000.0, "numerator_order": 0, "denominator_order": 2})
        world.start("xy_sysid.nodes.excitation", DRIVE)
        sets = ("--between", "gravity", "--between", "return_spring")
        self.server = Server(folder, *sets, ROS_DOMAIN_ID=str(world.domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
        self.tab = Tab(made, self.server.address)

    def said(self, part: str) -> str:
        """The text of a part of the card; empty while it is not there."""
        found = self.tab.page.locator(part)
        return str(found.text_content()) if found.count() else ""

    def parameters(self, *names: str) -> Any:
        """Values of the excitation."""
        from rcl_interfaces.srv import GetParameters

        request = GetParameters.Request(names=list(names))
        return self.world.call(GetParameters, "/xy/excitation/get_parameters", request, times=3).values


@pytest.fixture
def scene(tmp_path: Path) -> Iterator[Scene]:
    with browser() as made, world_in(tmp_path) as world:
        one = Scene(world, tmp_path, made)
        yield one
        one.tab.close()
        assert one.server.end() == 130 and "Traceback" not in one.server.said(), one.server.said()


def test_run_it_goes_on_by_itself_until_nothing_is_left_to_settle(scene: Scene, tmp_path: Path) -> None:
    """Design the next experiment, Run it, and the card names the effect. Every step is a bag; afterwards the settings are restored."""
    tab, world = scene.tab, scene.world
    ready(world, world.statuses(), "ballscrew")
    assert world.transition("excitation", "configure") and world.transition("excitation", "activate")
    tab.until(tab.page.locator("[data-act=design]").is_enabled, 30, "no axis is heard")
    assert not tab.page.locator("[data-act=run-it]").is_enabled()
    tab.press_until("design", lambda: "recording 12 s" in scene.said("[data-part=settle-state]"), 20)
    tab.until(tab.page.locator("[data-act=run-it]").is_enabled, 120, "nothing was designed")
    assert re.search(r"After \d+ s, .* are distinguished with 95 % probability", scene.said("[data-step='0']"))
    tab.press("run-it")
    tab.until(lambda: "Settled: gravity." in scene.said("[data-part=settle]"), 120, "the experiment did not settle it")
    (folder,) = tmp_path.glob("settle_x_*")
    experiment = yaml.safe_load((folder / "next_1.yaml").read_text(encoding="utf-8"))["experiment"]
    run = load(folder / "1").run("x")
    assert run.output_unit == "rad" and run.seconds >= 0.95 * experiment["seconds"]
    assert float(abs(run.voltage).max()) <= VOLTAGE and float(abs(run.position).max()) < TRAVEL
    assert load(folder / "1").seq[0] > load(folder / "0").seq[-1]  # the counter continues, so no node detects a restart
    tab.until(lambda: not tab.page.locator("[data-act=end-settle]").is_enabled(), 20, "the walk does not end")
    kind, rms, file = scene.parameters("x.kind", "x.rms", "experiment")
    assert (kind.string_value, rms.double_value, file.string_value) == ("noise", QUIET["rms"], "")
    assert world.state("excitation") == "inactive" and tab.errors == []
