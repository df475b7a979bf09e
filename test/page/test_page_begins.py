"""The first half minute of the demo in a real browser, frame by frame: no overlaps, and no card moves."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from helpers.browser_tools import Tab, browser, needs_browser
from helpers.busy import allowed
from helpers.cli_tools import bare
from helpers.ros_tools import needs_ros, new_domain

pytestmark = [needs_browser, needs_ros]

EVERY = 125  # ms between two frames, of one tab and then of the other
STILL = 6.0  # px that a card may move
SLOW = 0.4  # times real time, so that the page is open long before the verdict, also on a busy computer
SOON = 5.5  # s from 10 s of data to the verdict on the rigid model, on a quiet machine: 8 s from the first sample of the demo, which runs 4 times
# faster than real time


@dataclass
class Frames:
    """Observations: overlapping words, moved cards, headline and sentence of each frame, and s since the first."""

    tab: Tab
    over: list[str] = field(default_factory=list)
    moved: list[str] = field(default_factory=list)
    said: list[tuple[float, str, str]] = field(default_factory=list)
    begun: float = field(default_factory=time.monotonic)
    first: dict[str, tuple[float, float]] = field(default_factory=dict)

    def look(self) -> None:
        """One frame."""
        now = time.monotonic() - self.begun
        said = self.tab.said()
        if said is not None:
            self.said.append((now, *said))
        self.over += [f"{now:.1f} s: {pair}" for pair in self.tab.over_each_other()]
        for name, (left, top) in self.tab.places().items():
            before = self.first.setdefault(name, (left, top))
            if max(abs(left - before[0]), abs(top - before[1])) > STILL:
                self.moved.append(f"{now:.1f} s: {name} from {before} to {(left, top)}")
        self.tab.page.wait_for_timeout(EVERY)

    def since(self, words: str) -> float:
        """s of the first frame whose headline or sentence contains this text."""
        return next(at for at, headline, sentence in self.said if words in headline or words in sentence)


@pytest.fixture
def chromium() -> Iterator[Any]:
    """It runs before the demo begins, like a user's browser."""
    with browser() as made:
        yield made


@pytest.fixture
def address(tmp_path: Path, chromium: Any) -> Iterator[str]:
    environment = bare(ROS_DOMAIN_ID=str(new_domain()))
    environment.pop("DISPLAY", None)
    command = [sys.executable, "-m", "xy_sysid", "demo", "--page", "--port", "0", "--no-browser", "--speed", str(SLOW)]
    log = (tmp_path / "log").open("w")
    demo = subprocess.Popen(command, cwd=tmp_path, env=environment, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log)
    try:
        assert demo.stdout is not None
        found = re.search(r"http://\S+/", demo.stdout.readline())
        assert found
        yield found.group()
    finally:
        demo.send_signal(signal.SIGINT)
        try:
            demo.wait(60)
        except subprocess.TimeoutExpired:
            demo.kill()
            demo.wait(5)


def test_the_demo_begins_without_a_jump_and_says_what_is_awaited(address: str, chromium: Any) -> None:
    """Every 0.25 s until the rigid model is drawn and the coupling is known, and a while after: no two words overlap, each
    card keeps its first place, on a wide and on a narrow screen. The text names what is awaited, never a disabled button, and
    the verdict comes soon after its data."""
    tabs = [Tab(chromium, address, width) for width in (1400, 400)]
    tabs[0].until(lambda: all(tab.page.locator(".panel").count() == 1 and tab.places() for tab in tabs), 30)
    seen = [Frames(tab) for tab in tabs]

    def drawn() -> bool:
        for frames in seen:
            frames.look()
        return all(tab.headline().startswith("Something is missing: ") and tab.over_floor() > 4 and tab.ladder() for tab in tabs)

    tabs[0].until(drawn, 60, "no verdict on the rigid model")
    coupling = [tab.page.locator("[data-part=coupling]") for tab in tabs]
    tabs[0].until(lambda: drawn() and all("x and y" in str(words.text_content()) for words in coupling), 60, "no verdict on the coupling")
    for _ in range(12):
        drawn()
    for frames in seen:
        assert frames.over == [] and frames.moved == []
        awaited = [sentence for _, headline, sentence in frames.said if not headline.startswith("Something is missing")]
        assert awaited and [sentence for sentence in awaited if not re.search("does not answer|Waiting|of data have arrived", sentence)] == []
        last = max(at for at, _, sentence in frames.said if re.search("of 10 s of data have arrived", sentence))
        assert frames.since("Something is missing") - last < allowed(SOON)
    for tab in tabs:
        newer_data_can_be_used(tab)
        tab.close()


def newer_data_can_be_used(tab: Tab) -> None:
    """It shows the used seconds, and that there are newer ones; the button uses these."""
    used = tab.page.locator("[data-part=used]")
    tab.until(lambda: "newer data have come" in str(used.text_content()), 30)
    assert "Fitted to seconds " in str(used.text_content())
    before = str(used.text_content()).partition(" of the data")[0]
    tab.press_until("renew", lambda: not str(used.text_content()).startswith(before), 60, "the newest are not used")
    assert tab.errors == []
