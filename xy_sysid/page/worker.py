"""One recording in a process of its own: the page stays quick however long a fit takes, and a fit can be left.

Stories are values that do not change: whoever leaves a fit half way still has the story from before.
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from types import FrameType
from typing import Any

from xy_sysid.errors import XySysidError
from xy_sysid.page.wishes import News, Reading, Wish

LEAVE = signal.SIGUSR1


class Left(Exception):
    """The fit that runs is not wanted any more."""


class Desk:
    """The recording, its stories, and what is done with them. Runs in the worker's process."""

    def __init__(self, path: Path, reading: Reading, say: Callable[[News], None]) -> None:
        from xy_sysid.imports import load
        from xy_sysid.user_effects import library

        self._say = say
        self._library = library(reading.effect_files)
        self._recording = load(path, **reading.load, progress=lambda part: say(News("progress", words=f"reading {path.name}", part=part)))
        self._stories: dict[str, Any] = {}
        seconds, rate = self._recording.duration, self._recording.sampling_rate
        told = {"axes": list(self._recording.axes), "seconds": seconds, "rate": rate, "notes": list(self._recording.notes)}
        told["effects"] = [effect.name for effect in self._library.acting]
        say(News("opened", content=told))

    def do(self, wish: Wish) -> None:
        """One wish; raises XySysidError in a sentence, or Left."""
        from xy_sysid import story as core

        u, y = self._samples(wish.axis)
        if wish.act in ("begin", "reset") or wish.axis not in self._stories:
            units = self._recording.input_unit, self._recording.output_unit
            self._keep(wish, core.begin(wish.axis, self._recording.sampling_rate, u, y, self._library, units=units))
        now = self._stories[wish.axis]
        if wish.act == "diagnose":
            self._keep(wish, core.diagnosed(now, u, y, self._library))
        elif wish.act == "add":
            self._keep(wish, core.added(now, u, y, wish.argument, self._library))
        elif wish.act == "remove":
            self._keep(wish, core.removed(now, u, y, wish.argument, self._library))
        elif wish.act == "next":
            self._keep(wish, core.next_best(now, u, y, self._library))
        elif wish.act == "auto":
            while len((grown := core.next_best(now, u, y, self._library)).steps) > len(now.steps) and len(grown.effects) <= len(now.effects) + 1:
                now = grown
                self._keep(wish, now)  # each step is shown as it comes
            self._keep(wish, core.auto(now, u, y, self._library))

    def _keep(self, wish: Wish, story: Any) -> None:
        from xy_sysid.story_document import document

        self._stories[wish.axis] = story
        self._say(News("story", wish.number, wish.axis, content=document(story)))

    def _samples(self, axis: str) -> Any:
        """Input and output of the longest run without a gap."""
        run = max(self._recording.runs(), key=lambda part: part.stop - part.start)
        u, y = self._recording.axis(axis)
        return u[run], y[run]


def main(path: str, reading: Reading, orders: Connection, words: Connection) -> None:
    """The worker's process: wishes in, news out, until nobody is there any more."""
    busy = [False]

    def leave(_number: int, _frame: FrameType | None) -> None:
        if busy[0]:
            busy[0] = False
            raise Left

    def say(news: News) -> None:
        """Whole, or not at all: half a message would end all talk."""
        at_work, busy[0] = busy[0], False
        words.send(news)
        busy[0] = at_work

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the page's; it closes the pipe
    signal.signal(LEAVE, leave)
    try:
        desk = Desk(Path(path), reading, say)
    except XySysidError as problem:
        words.send(News("closed", words=str(problem)))
        return
    while True:
        try:
            wish: Wish = orders.recv()
        except (EOFError, OSError):
            sys.exit(0)
        try:
            busy[0] = True
            desk.do(wish)
            busy[0] = False
            words.send(News("done", wish.number, wish.axis))
        except Left:
            words.send(News("failed", wish.number, wish.axis, "Left as it was."))
        except (XySysidError, ArithmeticError, ValueError, MemoryError, OSError) as problem:
            busy[0] = False
            text = str(problem) if isinstance(problem, XySysidError) else f"{type(problem).__name__}: {problem}"
            words.send(News("failed", wish.number, wish.axis, text))
