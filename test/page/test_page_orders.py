"""Lost orders of the page, as on a loaded computer: repeated, but never one that must run only once."""

from __future__ import annotations

import time
from typing import Any

import pytest
from helpers.ros_tools import World, needs_ros

from xy_sysid.live.plain_messages import StatusMessage
from xy_sysid.page.live import Live
from xy_sysid.page.orders import Wish
from xy_sysid.page.topics_state import TopicsState


class Deaf:
    """A link that loses its orders."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    def trigger(self, service: str, told: Any, patience: float = 0.0) -> None:
        self.asked.append(service)
        self.told = told

    def set_parameters(self, node: str, values: dict[str, Any], told: Any) -> None:
        self.asked += [f"{node} {name}: {', '.join(value)}" for name, value in values.items()]
        self.told = told


def test_a_diagnosis_that_nobody_heard_of_is_asked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Idle for ten seconds after an order: repeated, at most twice; never if the diagnoser has worked and only its answer was lost."""
    now = [1000.0]
    monkeypatch.setattr("xy_sysid.page.live.time.monotonic", lambda: now[0])
    heard, deaf = TopicsState(), Deaf()
    heard.graph({"diagnoser"}, now[0])
    link: Any = deaf
    page = Live(heard, link, lambda words, done: None)
    page.ask("diagnose", "x")
    for _ in range(9):
        assert page.job("x") is not None
        now[0] += 5.0
    assert deaf.asked == 3 * ["diagnoser/diagnose/x"]
    page.ask("next", "x")
    heard.doing({"axis x": "tries them all", "axis y": "idle"}, now[0])
    now[0] += 11.0
    assert page.job("x") is not None and len(deaf.asked) == 4
    heard.doing({"axis x": "idle", "axis y": "idle"}, now[0])
    assert page.job("x") is None and len(deaf.asked) == 4
    page.ask("diagnose", "x")
    deaf.told(True, "axis x: found")
    now[0] += 100.0
    assert page.job("x") is None and len(deaf.asked) == 5


def test_each_axis_has_its_own_state(monkeypatch: pytest.MonkeyPatch) -> None:
    """Diagnose on x is for x only, and the buttons of y stay enabled: before the diagnoser reports, and while it works for x."""
    now = [1000.0]
    monkeypatch.setattr("xy_sysid.page.live.time.monotonic", lambda: now[0])
    heard, deaf = TopicsState(), Deaf()
    heard.graph({"diagnoser"}, now[0])
    link: Any = deaf
    page = Live(heard, link, lambda words, done: None)
    page.ask("diagnose", "x")
    assert page.job("x") is not None and page.job("y") is None and deaf.asked == ["diagnoser/diagnose/x"]
    stamp = page.stamp("y")
    heard.doing({"axis x": "searching for missing effects", "axis y": "idle"}, now[0])
    at_work = page.job("x")
    assert at_work is not None and at_work.words == "searching for missing effects" and at_work.running
    assert page.job("y") is None and page.stamp("y") == stamp
    page.ask("auto", "y")
    heard.doing({"axis x": "searching for missing effects", "axis y": "waits"}, now[0])
    waits = page.job("y")
    assert waits is not None and not waits.running and deaf.asked[-1] == "diagnoser/auto/y"
    page.cancel("y")
    assert deaf.asked[-1] == "diagnoser/cancel/y"


def test_live_says_what_is_waited_for_and_which_seconds_were_used() -> None:
    """Before a story: the amount of received data. Afterwards: the used range, and the amount of newer data, which can be used."""
    heard = TopicsState()
    link: Any = Deaf()
    page = Live(heard, link, lambda words, done: None)
    assert "does not answer" in page.words("x") and not page.ready("x")
    heard.graph({"diagnoser"}, 0.0)
    assert page.words("x").startswith("Waiting for the first samples.") and "press Diagnose" not in page.words("x")

    def said(**values: str) -> None:
        told = tuple((name.replace("_", " ") + " (s)", value) for name, value in values.items())
        heard.status(StatusMessage("diagnoser", 0, "", told), 0.0)

    said(seconds_kept="6.2")
    assert page.words("x") == "6 of 10 s of data have arrived; then the rigid model is fitted automatically." and not page.ready("x")
    said(seconds_kept="12", seconds_heard="12")
    assert "is being fitted" in page.words("x") and page.ready("x") and page.used("x") == ""
    heard.stories["x"] = {"seconds": 10.4, "ladder": []}
    said(seconds_kept="60", seconds_heard="60.5", axis_x_used_from="2.1", axis_x_used_to="12.5")
    assert page.used("x") == "Fitted to seconds 2 to 12 of the data. 48 s of newer data have come." and page.newer("x")
    said(seconds_kept="60", seconds_heard="12.7", axis_x_used_from="2.1", axis_x_used_to="12.5")
    assert page.used("x").endswith("They are the newest.") and not page.newer("x")
    said(seconds_kept="3", seconds_heard="3")
    assert "no longer kept" in page.used("x")
    page.ask("renew", "x")
    assert deaf_asked(link) == ["diagnoser/renew/x"]


def deaf_asked(link: Any) -> list[str]:
    """The orders to a link that loses them."""
    return list(link.asked)


def test_effects_that_the_diagnoser_does_not_begin_with_are_set_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Set and answered without a following job: set again, at most twice, then reported; never once the diagnoser has begun."""
    now = [1000.0]
    monkeypatch.setattr("xy_sysid.page.live.time.monotonic", lambda: now[0])
    heard, deaf, said = TopicsState(), Deaf(), []
    heard.graph({"diagnoser"}, now[0])
    link: Any = deaf
    page = Live(heard, link, lambda words, done: said.append(words))
    page.ask("add", "x", "coulomb_friction")
    for _ in range(3):
        deaf.told(True, "")
        now[0] += 3.5
        page.job("x")
    assert deaf.asked == 3 * ["diagnoser effects.x: coulomb_friction"]
    assert page.job("x") is None
    assert said == ["the model has these effects already; press Diagnose"]
    page.ask("add", "x", "coulomb_friction")
    deaf.told(True, "")
    heard.doing({"axis x": "adding coulomb_friction"}, now[0])
    heard.doing({"axis x": "idle", "axis y": "idle"}, now[0])
    now[0] += 3.5
    assert page.job("x") is None
    assert len(deaf.asked) == 4 and len(said) == 1


@needs_ros
def test_parameters_whose_answer_is_lost_are_set_again(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    """Over DDS: a call to a node without an answer is repeated, and the order counts as done."""
    from rcl_interfaces.msg import SetParametersResult
    from rcl_interfaces.srv import SetParameters

    from xy_sysid.page.link import PATIENCE, Link

    heard: list[float] = []

    def answer(request: Any, response: Any) -> Any:
        heard.append(request.parameters[0].value.double_value)
        if len(heard) == 1:
            time.sleep(PATIENCE + 0.5)
        response.results = [SetParametersResult(successful=True)]
        return response

    world.node.create_service(SetParameters, "/xy/diagnoser/set_parameters", answer)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(world.domain))
    link = Link(TopicsState())
    told: list[tuple[bool, str]] = []
    try:
        link.set_parameters("diagnoser", {"tolerance": 0.02}, lambda done, words: told.append((done, words)))
        assert world.until(lambda: bool(told), 20.0)
        assert told == [(True, "")] and heard == [0.02, 0.02]
    finally:
        link.close()


def test_what_is_clicked_while_something_is_being_done_comes_after_it_once() -> None:
    """The last click counts, for the shown axis; the text names the next action."""
    wish = Wish()
    assert wish.words == "" and wish.taken("x") is None
    wish.keep("x", "diagnose")
    wish.keep("x", "add", "coulomb_friction")
    assert wish.words == "; then adding coulomb friction"
    assert wish.taken("x") == ("add", "coulomb_friction") and wish.taken("x") is None
    wish.keep("x", "next")
    assert wish.taken("y") is None and wish.taken("x") is None


def test_a_click_on_its_way_when_the_button_is_disabled_is_heeded() -> None:
    """A click sent before the browser knew of the disabled button is not dropped."""
    from nicegui import Client, ui
    from nicegui.page import page

    from xy_sysid.page.buttons import heeded

    with Client(page("/nowhere")):
        button, plain = heeded(ui.button("Diagnose")), ui.button("Diagnose")
        button.set_enabled(False)
        plain.set_enabled(False)
        assert plain.is_ignoring_events and not button.is_ignoring_events
