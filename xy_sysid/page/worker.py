"""One recording in a separate process, so that a long fit does not block the page and can be cancelled.

Stories are immutable: after a cancelled fit the previous story is still there.
"""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

from xy_sysid.page.orders import Order, Reading, WorkerNews
from xy_sysid.processes.terminal import printable
from xy_sysid.story.attempt import BROKEN, Attempt

if TYPE_CHECKING:
    from xy_sysid.story.acts import Act, Job

ACTS: dict[str, Act] = {"next": "add_next", "auto": "auto"}
LEAVE = signal.SIGUSR1


class Left(BaseException):
    """The running fit was cancelled."""


class Desk:
    """The recording, its stories, and the orders on them. Runs in the worker's process."""

    def __init__(self, path: Path, reading: Reading, say: Callable[[WorkerNews], None]) -> None:
        from xy_sysid.files.effects import library
        from xy_sysid.imports import load
        from xy_sysid.page.responses import fitted_responses

        self._say = say
        self._library = library(reading.effect_files)
        responses = fitted_responses(path, reading.load)
        if responses is not None:
            say(WorkerNews("opened", content={"axes": [], "responses": responses, "effects": []}))
            return
        self._recording = load(path, **reading.load, progress=lambda part: say(WorkerNews("progress", words=f"reading {path.name}", part=part)))
        self._stories: dict[str, Any] = {}
        seconds, rate = self._recording.duration, self._recording.sampling_rate
        told = {
            "axes": list(self._recording.axes),
            "seconds": seconds,
            "rate": rate,
            "notes": [*self._recording.notes, *self._recording.left_out(self._recording.axes)],
        }
        told["effects"] = [effect.name for effect in self._library.acting]
        say(WorkerNews("opened", content=told))

    def do(self, order: Order) -> None:
        """Carry out one order, as the node and the replay do (``story.acts``). Raises XySysidError with a sentence, or Left."""
        from xy_sysid.greybox.axis_data import EPSILON
        from xy_sysid.samples.moves import several_moves
        from xy_sysid.story.acts import Job
        from xy_sysid.story.story import added, diagnosed, removed

        runs = self._recording.stretches(order.axis)
        several_moves(runs)
        story = None if order.act in ("begin", "reset") else self._stories.get(order.axis)
        if story is None:
            self._perform(order, Job(act="begin", run=runs[0], story=None, effects=(), tolerance=EPSILON, more=runs[1:]))
            story = self._stories[order.axis]
        if order.act == "diagnose":  # the data are the same as before: the model is kept
            self._keep(order, diagnosed(story, runs, self._library, time.process_time))
        elif order.act == "add":
            self._keep(order, added(story, runs, order.argument, self._library))
        elif order.act == "remove":
            self._keep(order, removed(story, runs, order.argument, self._library))
        elif order.act in ("next", "auto"):
            self._perform(order, Job(act=ACTS[order.act], run=runs[0], story=story, effects=story.effects, tolerance=EPSILON, more=runs[1:]))

    def _perform(self, order: Order, job: Job) -> None:
        """Perform a job, and report each step."""
        from xy_sysid.story.acts import perform

        for _, made in perform(job, self._library, time.process_time):
            if made is not None:
                self._keep(order, made)

    def _keep(self, order: Order, story: Any) -> None:
        from xy_sysid.story.document import document

        self._stories[order.axis] = story
        self._say(WorkerNews("story", order.number, order.axis, content=document(story)))


def main(path: str, reading: Reading, orders: Connection, words: Connection) -> None:
    """Main loop of the worker's process: orders in, news out, until its parent process has ended."""
    busy = [False]

    def leave(_number: int, _frame: FrameType | None) -> None:
        if busy[0]:
            busy[0] = False
            raise Left

    def say(news: WorkerNews) -> None:
        """Send completely: a cancellation must not leave half a message in the pipe."""
        at_work, busy[0] = busy[0], False
        words.send(news)
        busy[0] = at_work

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the page's; it closes the pipe
    signal.signal(LEAVE, leave)
    with Attempt(BROKEN) as opening:
        desk = Desk(Path(path), reading, say)
    if opening.problem:
        sys.stderr.write(printable(f"{path}: {opening.detail}") + "\n" if opening.detail else "")
        words.send(WorkerNews("closed", words=opening.problem))
        return
    while True:
        try:
            order: Order = orders.recv()
        except (EOFError, OSError):
            sys.exit(0)
        try:
            busy[0] = True
            with Attempt() as attempt:
                desk.do(order)
            busy[0] = False
        except Left:
            words.send(WorkerNews("failed", order.number, order.axis, "Left as it was."))
            continue
        if attempt.detail:
            sys.stderr.write(printable(f"axis {order.axis}, {order.act}: {attempt.detail}") + "\n")
        words.send(WorkerNews("failed" if attempt.problem else "done", order.number, order.axis, attempt.problem))
