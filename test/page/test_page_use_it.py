"""*Use it* on the page of the demo, over DDS: a click stops the excitation, a path is followed, and the page shows the tracking errors."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers.browser_tools import Server, Tab, browser, needs_browser
from helpers.ros_tools import HAS_ROS, World, needs_ros, world_in
from helpers.simulated import recorded
from helpers.stories import with_effects

from xy_sysid.control_design.follower import KINDS
from xy_sysid.story.document import document
from xy_sysid.story.story import begin

if HAS_ROS:
    from std_msgs.msg import String

    from xy_sysid.nodes.common import LATCHED_QOS

pytestmark = [needs_browser, needs_ros]

MACHINE = """
axes:
  "x":
    velocity_gain: 0.097
    pole: 246.0
    encoder_noise: 0.1e-6
    parts: {time_delay: {delay: 1.29e-3}, coulomb_friction: {coulomb: 0.3}}
"""
DRIVEN = {"axes": "[x]", "lockstep": True, "speed": 4.0}


def story() -> str:
    """The story of such an axis, identified from another recording of it."""
    run = recorded("x:coulomb_friction=0.3", seconds=12.0).run("x")
    return json.dumps(document(with_effects(begin(run), run, "coulomb_friction")))


class Scene:
    """A simulated axis with dry friction, driven by the excitation, the controller of the demo, a page server, and a tab on it."""

    def __init__(self, world: World, folder: Path, made: Any) -> None:
        self.world = world
        file = folder / "rubbing.yaml"
        file.write_text(MACHINE, encoding="utf-8")
        world.start("xy_sim.node", {"machine": str(file)})
        world.start("xy_sysid.nodes.excitation", DRIVEN)
        world.start("xy_sysid.nodes.demo_follower", {"axes": "[x]", "distance": 0.005})
        self.told = world.node.create_publisher(String, "story/x", LATCHED_QOS)
        self.server = Server(folder, ROS_DOMAIN_ID=str(world.domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
        self.tab = Tab(made, self.server.address)

    def state(self) -> str:
        """The card's text about the path."""
        found = self.tab.page.locator("[data-part=use-state]")
        return str(found.text_content()) if found.count() else ""

    def errors(self) -> dict[str, float]:
        """The tracking errors on the card, um rms, by the controller."""
        words = self.tab.page.locator("[data-part=use-errors] > *").all_text_contents()
        return {name.removeprefix("axis x "): float(text.removesuffix(" um rms")) for name, text in zip(words[::2], words[1::2], strict=False)}


@pytest.fixture
def scene(tmp_path: Path) -> Iterator[Scene]:
    with browser() as made, world_in(tmp_path) as world:
        one = Scene(world, tmp_path, made)
        yield one
        one.tab.close()
        assert one.server.end() == 130 and "Traceback" not in one.server.said(), one.server.said()


def test_use_it_follows_the_path_and_shows_that_each_feedforward_makes_the_error_smaller(scene: Scene) -> None:
    """The button waits for a model; it stops the excitation; kS kV kA halve the error of the PID, and the compensation leaves a tenth of that."""
    tab, world = scene.tab, scene.world
    button = tab.page.locator("[data-act=use-it]")
    assert world.transition("excitation", "configure") and world.transition("excitation", "activate")
    tab.until(button.is_visible, 30)
    assert button.is_disabled()  # there is no model yet
    scene.told.publish(String(data=story()))
    tab.until(lambda: button.is_visible() and button.is_enabled(), 30, "a model came, and it cannot be used")
    tab.press_until("use-it", lambda: "not begun" not in scene.state() and "press Use it" not in scene.state(), 30)
    assert not button.is_enabled() or "three times" in scene.state()
    tab.until(lambda: "the path was followed three times" in scene.state(), 120, lambda: f"the path was not followed: {scene.state()}")
    tab.until(lambda: set(KINDS) <= set(scene.errors()), 20, "the errors are not shown")
    alone, simple, best = (scene.errors()[name] for name in KINDS)
    assert simple < 0.5 * alone and best < 0.1 * simple, scene.errors()
    assert world.state("excitation") == "inactive"
    for width in (1400, 400):
        tab.page.set_viewport_size({"width": width, "height": 900})
        tab.until(lambda: tab.over_each_other() == [], 10, f"words lie on each other at {width} px")
    assert button.is_enabled() and tab.errors == []
