"""STOP always works, with any message to the page's link or to a node, by two paths, and confirmed by the machine's state."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.busy import allowed
from helpers.ros_tools import Integrator, World, needs_ros

from xy_sysid.page.session import Session
from xy_sysid.page.shelf import Shelf
from xy_sysid.page.topics_state import TopicsState
from xy_sysid.samples.block import Block

EXCITATION = "xy_sysid.nodes.excitation"
BRACKETS = "[" * 100_000


class Driven:
    """A driven machine, and a page's session connected to it; no browser."""

    def __init__(self, world: World, folder: Path) -> None:
        self.world, self.blocks = world, world.blocks()
        world.machine(Integrator())
        self.process = world.start(EXCITATION, {"watchdog": 2.0, "ramp": 0.0})
        self.session = Session(Shelf(folder), live=True)
        assert self.session.link is not None
        self.link: Any = self.session.link
        assert world.transition("excitation", "configure")

    def activate(self) -> None:
        """Activate by the page, and wait until it moves."""
        told: list[tuple[bool, str]] = []
        asked: list[int] = []
        for tries in range(3):  # a refusal on a busy computer is temporary, and people press again
            asked.append(tries)
            self.link.transition("activate", lambda done, words: told.append((done, words)))
            assert self.world.until(lambda: len(told) >= len(asked)), told
            if told[-1][0]:
                break
        assert told[-1][0], told
        sent = len(self.blocks)
        assert self.world.until(lambda: len(self.blocks) > sent + 5 and bool(self.blocks[-1].values.any()))

    def stop(self) -> tuple[bool, str, float]:
        """The answer to the page, and its time in s."""
        begun, answer = time.monotonic(), list[tuple[bool, str]]()
        asking = threading.Thread(target=lambda: answer.append(self.session.stop(5.0)))
        asking.start()
        self.world.until(lambda: not asking.is_alive(), 8.0)
        asking.join()
        return *answer[0], time.monotonic() - begun

    def stands(self) -> bool:
        """The node is inactive, and the last voltage is zero."""
        self.world.spin(0.2)
        return self.world.state("excitation") == "inactive" and not self.blocks[-1].values.any()


@pytest.fixture
def driven(world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Driven]:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(world.domain))
    one = Driven(world, tmp_path)
    yield one
    one.session.close()


def test_a_story_of_brackets_is_refused_in_words() -> None:
    """An unreadable message is refused with its topic, for any content."""
    for text in (BRACKETS, '{"a":' * 50_000, "\x00", "", "[]", "NaN", '{"axis": 1', "\ud800"):
        problem = TopicsState().story("x", text)
        assert problem.startswith("story/x is "), text[:10]


@needs_ros
def test_stop_works_after_a_message_that_nobody_can_read(driven: Driven) -> None:
    """A /xy/story/x of 100,000 brackets: the link continues, and STOP is confirmed with the voltage at zero, within a second."""
    from std_msgs.msg import String

    from xy_sysid.nodes.common import LATCHED_QOS

    driven.activate()
    story = driven.world.node.create_publisher(String, "story/x", LATCHED_QOS)
    story.publish(String(data=BRACKETS))
    assert driven.world.until(lambda: "story/x" in " ".join(driven.link._line._topics))
    driven.world.spin(1.0)
    assert driven.link.problem == "" and driven.link._line.dead() == ""
    stopped, words, seconds = driven.stop()
    assert stopped and "the voltage is zero" in words and seconds < allowed(1.0)
    assert driven.stands()


@needs_ros
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_dead_link_is_said_and_begun_anew_and_stop_works(driven: Driven) -> None:
    """The link's thread ends: within a second the page says so and has a new one, through which orders and STOP reach the machine."""
    driven.activate()
    first = driven.link._line
    driven.link._orders.put(lambda line: sys.exit())
    assert driven.world.until(lambda: driven.link._line is not first and driven.link.problem == "", 3.0)
    said = [message.words for message in driven.session.messages]
    assert any("link to the nodes was lost" in words for words in said) and any("restored" in words for words in said)
    assert driven.blocks[-1].values.any()
    sent, answer = len(driven.blocks), list[tuple[bool, str]]()
    asking = threading.Thread(target=lambda: answer.append(driven.session.stop(8.0)))
    asking.start()
    assert driven.world.until(lambda: len(driven.blocks) > sent and not driven.blocks[-1].values.any(), allowed(0.5))
    assert driven.world.until(lambda: bool(answer), 8.0) and answer[0][0]
    assert driven.stands()


@needs_ros
def test_stop_reaches_the_machine_while_the_link_stands_still(driven: Driven) -> None:
    """The topic is published from the caller's thread: zero volts at once although the link's thread hangs, which is detected."""
    driven.activate()
    free = threading.Event()
    driven.link._orders.put(lambda line: free.wait(20.0))
    driven.world.spin(0.2)
    sent = len(driven.blocks)
    asking = threading.Thread(target=driven.session.stop, args=(8.0,))
    asking.start()
    assert driven.world.until(lambda: len(driven.blocks) > sent and not driven.blocks[-1].values.any(), allowed(0.5))
    assert driven.stands()
    assert driven.world.until(lambda: any("not responded" in message.words for message in driven.session.messages), 8.0)
    ends = ("stopped: ", "STOP was not confirmed")  # the second if a new link needs longer to find the machine than STOP waits for its confirmation
    assert driven.world.until(lambda: any(message.words.startswith(ends) for message in driven.session.messages), 8.0)
    assert any("stopped: " in message.words for message in driven.session.messages) or allowed(1.0) > 2.0
    free.set()
    asking.join(10.0)


@needs_ros
def test_stop_is_not_confirmed_by_a_machine_that_is_not_there(world: World, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without an answer the page never reports that the machine has stopped."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(world.domain))
    session = Session(Shelf(tmp_path), live=True)
    try:
        stopped, words = session.stop(0.5)
        assert not stopped and "emergency stop" in words
    finally:
        session.close()


@needs_ros
@pytest.mark.parametrize("latched", [True, False])
def test_the_excitation_hears_stop_by_itself(world: World, latched: bool) -> None:
    """True on the topic means zero volts and inactive, and activate is refused with the reason until false arrives, latched or not."""
    from std_msgs.msg import Bool

    from xy_sysid.nodes.common import LATCHED_QOS

    blocks = world.blocks()
    world.machine(Integrator())
    stop = world.node.create_publisher(Bool, "stop", LATCHED_QOS if latched else 1)
    if latched:
        stop.publish(Bool(data=True))
    process = world.start(EXCITATION, {"watchdog": 2.0, "ramp": 0.0})
    assert world.transition("excitation", "configure")
    assert world.until(lambda: stop.get_subscription_count() >= 1 + latched)
    if latched:  # requested before the node existed
        assert world.until(lambda: "STOP is on (topic stop" in process.output(), 30.0)
        assert not world.transition("excitation", "activate")
        assert world.until(lambda: "STOP is on (topic stop, from test)" in process.output()) and "UNKNOWN" not in process.output()
        stop.publish(Bool(data=False))
        assert world.until(lambda: "STOP is released" in process.output())
    assert world.transition("excitation", "activate")
    assert world.until(lambda: len(blocks) > 10 and bool(blocks[-1].values.any()))
    begun = time.monotonic()
    stop.publish(Bool(data=True))
    assert world.until(lambda: not blocks[-1].values.any(), 1.0)
    assert time.monotonic() - begun < allowed(0.5)
    assert world.until(lambda: world.state("excitation") == "inactive", 2.0) and not blocks[-1].values.any()
    assert not world.transition("excitation", "activate") and "activate is refused until the same publisher sends false" in process.output()
    stop.publish(Bool(data=False))
    assert world.until(lambda: process.output().count("STOP is released") == 1 + latched)
    assert world.transition("excitation", "activate")


BREAKS: dict[str, Callable[[], str]] = {
    "identifier": lambda: "from xy_sysid.live.identifier import Identifier as Part",
    "diagnoser": lambda: "from xy_sysid.live.diagnoser import Diagnoser as Part",
}


@needs_ros
@pytest.mark.parametrize("node", sorted(BREAKS))
def test_a_message_that_breaks_a_callback_does_not_end_the_node(world: World, node: str) -> None:
    """Every callback is protected: an error is reported with its place in log and status, and later messages are still received."""
    code = f"""
import sys, itertools
{BREAKS[node]()}
count, honest = itertools.count(), Part.feed
def failing(self, kind, block):
    if next(count) == 3:
        raise RecursionError("a bug")
    return honest(self, kind, block)
Part.feed = failing
from xy_sysid.nodes.{node} import main
sys.exit(main())
"""
    from std_msgs.msg import Float64MultiArray

    from xy_sysid.nodes.common import DATA_QOS
    from xy_sysid.nodes.convert import to_message

    statuses = world.statuses()
    process = world.start(code)
    streams = [world.node.create_publisher(Float64MultiArray, topic, DATA_QOS) for topic in ("voltage", "position")]
    assert world.until(lambda: all(stream.get_subscription_count() for stream in streams), 60.0)
    for k in range(60):
        count = np.arange(20.0 * k, 20.0 * (k + 1))
        for stream in streams:
            stream.publish(to_message(Block(("x", "y"), count, count / 2000, np.ones((20, 2)))))
        world.spin(0.02)
    name = "streams" if node == "identifier" else node

    def values() -> dict[str, str]:
        own = [status for status in statuses if status.name == name]
        return {pair.key: pair.value for pair in own[-1].values} if own else {}

    assert world.until(lambda: values().get("errors of callbacks") == "1" and int(values()["samples paired"]) >= 1000, 10.0), values()
    assert "RecursionError: a bug, failing line 7" in process.output()
    assert process.process.poll() is None
