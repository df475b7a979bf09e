"""The live page in a real browser, with real nodes over DDS: curves converge, an effect is found, STOP stops, lost nodes are named."""

from __future__ import annotations

import contextlib
import functools
import os
import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.browser_tools import Server, Tab, browser, needs_browser
from helpers.ros_tools import World, needs_ros, world_in

pytestmark = [needs_browser, needs_ros]

SIMULATED = {"lockstep": True, "speed": 2.0, "block": 100, "ramp": 0.05, "abort_ramp": 0.01}


class Scene:
    """A simulated machine with its nodes, a page server, and a tab on it."""

    def __init__(self, world: World, folder: Path, made: Any) -> None:
        self.world, self.folder = world, folder
        self.blocks = world.blocks()
        world.start("xy_sim.node", {"machine": "surprise.yaml"})
        self.identifier = world.start("xy_sysid.nodes.identifier", {"numerator_order": 0, "denominator_order": 2})
        world.start("xy_sysid.nodes.diagnoser", {"minimum": 8.0, "memory": 20.0})
        world.start("xy_sysid.nodes.excitation", SIMULATED)
        self.server = Server(folder, ROS_DOMAIN_ID=str(world.domain), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
        self.tab = Tab(made, self.server.address)

    def lifecycle(self, words: str, seconds: float = 15.0) -> None:
        """Wait until the page shows this state of the excitation."""
        said = self.tab.page.locator("[data-part=lifecycle]")
        self.tab.until(lambda: words in str(said.text_content()), seconds, lambda: f"{words!r} is not said, but {said.text_content()!r}")

    def drive(self) -> None:
        """Configure and Activate by clicks, if it does not drive already."""
        state = str(self.tab.page.locator("[data-part=lifecycle]").text_content())
        if "driving" in state:
            return
        self.tab.until(lambda: all(f"{name}" in self.nodes() for name in ("excitation", "identifier", "ballscrew", "diagnoser")), 30)
        if "not configured" in state or "not there" in state:
            self.lifecycle("not configured")
            self.tab.press("configure")
        self.lifecycle("nothing moves yet")
        self.tab.until(self.tab.page.locator("[data-act=activate]").is_enabled)
        self.tab.press("activate")
        self.lifecycle("driving")

    def nodes(self) -> str:
        """The text about the nodes."""
        return str(self.tab.page.locator("[data-part=nodes]").text_content())

    def silent(self) -> bool:
        """No more voltage is received, and the last was zero."""
        self.world.spin(0.3)
        count = len(self.blocks)
        self.world.spin(0.4)
        return len(self.blocks) == count and not self.blocks[-1].values.any()


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Scene]:
    folder = tmp_path_factory.mktemp("live")
    with browser() as made, world_in(folder) as world:
        one = Scene(world, folder, made)
        yield one
        one.tab.close()
        assert one.server.end() == 130 and "Traceback" not in one.server.said(), one.server.said()


def test_curves_converge_live(scene: Scene) -> None:
    """No motion before Activate; then the response appears, and its band narrows with more windows."""
    tab = scene.tab
    scene.lifecycle("not configured", 30)
    assert scene.blocks == []
    scene.drive()

    linear = tab.page.get_by_role("button", name="linear fit")
    tab.until(lambda: linear.count() == 1, 40, "no story begins by itself")
    pressed = [0.0]

    def linear_is_shown() -> bool:
        """A press that was lost with a connection is repeated, as a person would."""
        if not linear.is_visible():  # before a story, only this is shown
            return False
        if tab.page.locator("[aria-label='linear fit, live']:visible").count() == 1:
            return len(pressed) > 1
        if time.monotonic() > pressed[-1] + 10.0:
            linear.click()
            pressed.append(time.monotonic())
        return False

    tab.until(linear_is_shown, 40, "the linear fit is not shown")

    def width() -> float:
        (band,) = tab.curves("Frequency response of axis x", "95 % band")
        known = [value for value in band if np.isfinite(value)]
        return float(np.mean(np.abs(np.diff(known)))) if len(known) > 10 else 0.0

    def windows() -> int:
        found = tab.page.locator(".fact[aria-label=windows] .value")
        return int(found.first.text_content() or 0) if found.count() else 0

    tab.until(lambda: windows() >= 4 and width() > 0, 30, "no response")
    first, early = width(), windows()
    tab.until(lambda: windows() >= 2 * early + 4, 40, "no more windows")
    tab.until(lambda: 0 < width() < first, 10, f"the band does not narrow: {first} dB at first, now {width()} dB")
    assert "windows in" in str(tab.page.locator("[data-part=windows]").text_content())


def at_noise(worst: str) -> bool:
    """The tile of the explained model: no place, or one by chance on a few windows; the rigid model's is above 4."""
    return worst.startswith("nowhere") or (bool(worst) and float(worst.split()[0]) < 3.0)


def test_the_failing_picture_comes_by_itself_and_every_number_follows_the_story(scene: Scene) -> None:
    """The failure of the rigid model is drawn automatically; after Diagnose and Add, headline, figure, ladder and tiles are the explained model's.

    The linear fit is one click away, with its intervals marked as unsure; Remove and Start over update everything.
    """
    tab = scene.tab
    scene.drive()
    missing = "Something is missing: "
    axes = {axis: tab.page.get_by_role("button", name=f"axis {axis}") for axis in "xy"}

    def shown(axis: str) -> bool:
        return bool(axes[axis].get_attribute("aria-pressed") == "true")

    tab.click_until(axes["y"], lambda: shown("y") and tab.headline().startswith(missing) and tab.over_floor() > 4, 40, "no failing picture")
    tab.page.wait_for_timeout(2500)  # some more of the travel
    tab.press_until("diagnose", lambda: "Missing: coulomb friction" in tab.verdict() and tab.filled() == ["Add coulomb friction"], 90)
    tab.until(lambda: tab.headline().startswith("Something is missing: ") and len(tab.ladder()) == 1, 40, "the headline is stale")
    assert tab.ladder()[0] > 4
    told = "x was diagnosed with y"
    tab.click_until(axes["x"], lambda: shown("x") and tab.headline().startswith(missing) and tab.filled() == ["Diagnose"], 40, told)
    assert "Missing:" not in tab.verdict() and tab.page.locator("[data-act=diagnose]").is_enabled()
    tab.click_until(axes["y"], lambda: shown("y") and "Missing: coulomb friction" in tab.verdict(), 40, "axis y is not shown")
    tab.press_until("named", lambda: tab.headline().startswith("Explained: ") and tab.over_floor() < 2 and len(tab.ladder()) == 2, 60)
    tab.until(lambda: at_noise(tab.fact("worst place")), 40, lambda: f"the tiles are stale: {tab.fact('worst place')}")
    assert tab.ladder()[1] < 1.2 and "at the noise floor" in tab.verdict() and tab.fact("held-out error").startswith("0.3")
    assert tab.page.locator("[aria-label='linear fit, live']:visible").count() == 0
    shows = tab.page.locator("[aria-label='linear fit, live']:visible")
    tab.click_until(tab.page.get_by_role("button", name="linear fit"), lambda: shows.count() == 1, 60, "the linear fit is not shown")
    tab.until(lambda: tab.page.locator(".fact.unsure[aria-label=gain]").count() == 1 and tab.fact("held-out error") == "", 60, "no linear fit")
    assert "fails" in str(tab.page.locator("[aria-label='linear fit, live']").text_content())
    remove = tab.page.locator("[data-remove=coulomb_friction]:enabled").first
    tab.click_until(remove, lambda: tab.headline().startswith(missing) and tab.over_floor() > 4, 40, "stale after Remove")
    tab.press_until("reset", lambda: len(tab.ladder()) == 1 and tab.headline().startswith("Something is missing: "), 60, "stale after Start over")
    assert tab.filled() == ["Add coulomb friction"]


def test_settings_are_checked_and_reach_the_node(scene: Scene) -> None:
    """A value outside its limits is refused with the limits; one inside arrives at the node."""
    tab, world = scene.tab, scene.world
    field = tab.page.locator("input[data-knob='x.rms']")
    told = tab.page.locator("[data-told=x]")

    def says(words: str) -> bool:
        return words in str(told.text_content())

    def asked(typed: str, pressed: list[float]) -> None:
        """Type and press; repeat if a reload after a stall has cleared it, or a press is lost."""
        from playwright.sync_api import TimeoutError as Late

        with contextlib.suppress(Late):  # it is being reloaded
            if not field.is_visible():
                tab.page.locator("[data-part=excitation]").click(timeout=5000)
                field.wait_for(state="visible", timeout=5000)
            if not pressed or field.input_value(timeout=5000) != typed or time.monotonic() > pressed[-1] + 20.0:
                field.fill(typed, timeout=5000)
                tab.page.locator("[data-apply=x]").click(timeout=5000)
                pressed.append(time.monotonic())

    def refused(typed: str, words: str, pressed: list[float]) -> bool:
        asked(typed, pressed)
        return says(words)

    def applied(pressed: list[float]) -> bool:
        asked("0.5", pressed)
        return says("applied") or (len(pressed) > 1 and says("nothing was changed"))

    for typed, words in (("-5", ">= 0"), ("", "empty"), ("1e9", "100")):
        tab.until(functools.partial(refused, typed, words, []), 10, words)
    tab.until(functools.partial(applied, []), 20)
    from rcl_interfaces.srv import GetParameters

    answer = world.call(GetParameters, "/xy/excitation/get_parameters", GetParameters.Request(names=["x.rms"]), times=3)
    assert answer.values[0].double_value == 0.5


def test_a_bag_is_recorded_and_opened_beside(scene: Scene) -> None:
    """A name that is a path is refused; a plain one becomes a bag, which opens as a second panel."""
    tab = scene.tab
    scene.drive()
    tab.page.locator("[data-part=record]").click()
    name = tab.page.locator("input[data-part=bag]")
    name.fill("../elsewhere")
    tab.press("record")
    tab.until(lambda: "name of the bag is '../elsewhere'" in tab.notices(), 5)
    name.fill("taken")
    tab.press_until("record", lambda: (scene.folder / "taken").is_dir(), 15)
    tab.until(lambda: min(recorded(scene.folder / "taken", topic) for topic in ("voltage", "position")) > 60, 40, "the bag does not grow")
    tab.press("finish")
    tab.until(lambda: "recorded taken" in tab.notices() or tab.page.locator("[data-act=open-bag]").is_visible(), 15)
    tab.press("open-bag")
    tab.until(lambda: tab.page.locator(".panel").count() == 2 and "2000 Hz" in str(tab.page.locator(".panel").nth(1).text_content()), 30)
    assert not (scene.folder.parent / "elsewhere").exists()
    tab.click_until(tab.page.get_by_role("button", name="close recording"), lambda: tab.page.locator(".panel").count() == 1, why="it stays open")


def recorded(bag: Path, topic: str) -> int:
    """Messages of a topic in a bag that is still being written."""
    for file in bag.glob("*.db3"):
        with closing(sqlite3.connect(f"file:{file}?mode=ro", uri=True)) as data:
            try:
                query = "SELECT count(*) FROM messages JOIN topics ON topics.id = topic_id WHERE name = ?"
                return int(data.execute(query, (f"/xy/{topic}",)).fetchone()[0])
            except sqlite3.OperationalError:  # its tables are being made, or it is being written
                return 0
    return 0


@pytest.mark.parametrize("way", ["button", "Escape"])
def test_stop_really_makes_the_excitation_inactive(scene: Scene, way: str) -> None:
    """By the button and by the key: the node is inactive, the last voltage is zero, and the page says so."""
    tab, world = scene.tab, scene.world
    scene.drive()
    world.spin(0.3)
    assert scene.blocks[-1].values.any() or scene.blocks[-2].values.any()
    if way == "button":
        tab.page.get_by_role("button", name="Open a recording").click()  # even with a dialog over the page
        tab.page.get_by_role("button", name="STOP").click()
    else:
        tab.page.locator("body").press("Escape")
    heard: list[str] = []

    def stopped() -> bool:
        """The page shows both; a message is shown for some seconds only, and may end before the other appears."""
        heard.append(tab.notices())
        lifecycle = str(tab.page.locator("[data-part=lifecycle]").text_content())
        return "nothing moves yet" in lifecycle and any("stopped: the excitation is" in words for words in heard)

    tab.until(stopped, 15, lambda: f"{tab.page.locator('[data-part=lifecycle]').text_content()!r}, {set(heard)}")
    assert world.state("excitation") == "inactive" and scene.silent()
    tab.until(lambda: tab.page.get_by_role("button", name="Release STOP and activate").is_enabled(), 15, "what Activate does with STOP is not said")
    assert "activate is refused" not in scene.nodes()
    cancel = tab.page.get_by_role("button", name="Cancel").last
    if way == "button" and cancel.is_visible():  # a reloaded page has no dialog
        cancel.click()


def test_the_stop_of_another_is_overridden_with_its_name_seen(scene: Scene) -> None:
    """The button and the state say that another node holds STOP; a dialog names it, and after the override the button is only Activate."""
    from std_msgs.msg import Bool

    tab = scene.tab
    scene.drive()
    stop = scene.world.node.create_publisher(Bool, "stop", 1)
    said = tab.page.locator("[data-part=lifecycle]")

    def held() -> bool:
        stop.publish(Bool(data=True))  # repeated, because one subscriber may be found before the other
        return "STOP is on from test. Release it there, or override it here" in str(said.text_content())

    tab.until(held, 20, "the page does not say who holds STOP")
    activate = tab.page.locator("[data-act=activate]")
    tab.until(lambda: activate.text_content() == "Override STOP" and activate.is_enabled(), 15)
    assert "STOP is on from test" in scene.nodes()
    override = tab.page.locator("[data-act=override]")
    tab.click_until(activate, override.is_visible, why="the dialog does not open")
    assert "STOP is on from: test" in str(tab.page.locator(".card", has=override).text_content())
    for _ in range(2):  # opened and cancelled, twice: nothing is overridden
        tab.page.get_by_role("button", name="Cancel").last.click()
        tab.until(lambda: override.count() == 0, 15, "the dialog stays")
        tab.click_until(activate, override.is_visible, why="the dialog does not open")
    statuses = scene.world.statuses()

    def still_held() -> bool:
        return sum({"stop": "on", "stop held by": "test"}.items() <= {pair.key: pair.value for pair in one.values}.items() for one in statuses) > 3

    assert scene.world.until(still_held, 10.0)
    override.click()
    tab.until(lambda: activate.text_content() == "Activate", 15, "STOP is not overridden")
    scene.drive()


def test_a_lost_node_is_named(scene: Scene) -> None:
    """kill -9 of the identifier: the page says that it is lost."""
    os.kill(scene.identifier.process.pid, 9)
    scene.tab.until(lambda: "identifier" in scene.nodes() and ("lost" in scene.nodes() or "does not answer" in scene.nodes()), 20)
    assert scene.tab.errors == [], scene.tab.errors
