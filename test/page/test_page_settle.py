"""The page designs an experiment, runs it on the machine over DDS, and settles what one recording left open."""

from __future__ import annotations

from pathlib import Path

import yaml
from helpers.browser_tools import Server, Tab, browser, needs_browser
from helpers.ros_tools import needs_ros, world_in

from xy_sysid.cli.demo_settle import QUIET, RATE, TRAVEL, VOLTAGE
from xy_sysid.files.walk import run_of

pytestmark = [needs_browser, needs_ros]

JOINT = {"axes": "[x]", "unit": "rad", "x.limit": VOLTAGE, "x.travel_min": -TRAVEL, "x.travel_max": TRAVEL}
DRIVE = {**JOINT, **{f"x.{name}": value for name, value in QUIET.items()}, "rate": RATE, "lockstep": True, "speed": 8.0}


def test_run_it_goes_on_by_itself_until_nothing_is_left_to_settle(tmp_path: Path) -> None:
    """Design the next experiment, Run it, and the card says what it is. Every step is a bag; afterwards the excitation is as it was."""
    with browser() as made, world_in(tmp_path) as world:
        world.start("xy_sim.node", {"machine": "hanging.yaml"})
        world.start("xy_sysid.nodes.identifier", {"axes": "[x]", "output_unit": "rad", "numerator_order": 0, "denominator_order": 2})
        world.start("xy_sysid.nodes.excitation", DRIVE)
        sets = ("--between", "gravity", "--between", "return_spring")
        server = Server(tmp_path, *sets, ROS_DOMAIN_ID=str(world.domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
        tab = Tab(made, server.address)
        state = tab.page.locator("[data-part=settle-state]")
        assert world.transition("excitation", "configure") and world.transition("excitation", "activate")
        tab.until(tab.page.locator("[data-act=design]").is_enabled, 30, "no axis is heard")
        assert not tab.page.locator("[data-act=run-it]").is_enabled()
        tab.press_until("design", lambda: "recording 12 s" in str(state.text_content()), 20)
        tab.until(tab.page.locator("[data-act=run-it]").is_enabled, 120, "nothing was designed")
        assert "gravity and return_spring are distinguished" in str(tab.page.locator("[data-step='0']").text_content())
        assert tab.wide() <= 1400
        tab.press("run-it")
        tab.until(lambda: tab.page.locator("[data-step='1']").count() == 1, 120, "the experiment was not run")
        assert "Settled: gravity." in str(tab.page.locator("[data-step='1']").text_content())
        (folder,) = tmp_path.glob("settle_x_*")
        experiment = yaml.safe_load((folder / "next_1.yaml").read_text(encoding="utf-8"))["experiment"]
        run = run_of(folder / "1", "x")
        assert run.output_unit == "rad" and run.seconds >= 0.95 * experiment["seconds"]
        assert float(abs(run.voltage).max()) <= VOLTAGE and float(abs(run.position).max()) < TRAVEL
        from rcl_interfaces.srv import GetParameters

        names = ["x.kind", "x.rms", "experiment"]
        tab.until(lambda: "Settled" in tab.notices(), 20, "the end is not told")
        told = world.call(GetParameters, "/xy/excitation/get_parameters", GetParameters.Request(names=names), times=3).values
        assert (told[0].string_value, told[1].double_value, told[2].string_value) == ("noise", QUIET["rms"], "")
        assert world.state("excitation") == "inactive" and tab.errors == []
        tab.close()
        assert server.end() == 130 and "Traceback" not in server.said(), server.said()
