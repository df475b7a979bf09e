"""A recording that is open on the page: its worker, its stories so far, and the waiting orders."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from xy_sysid.errors import BadInput
from xy_sysid.page import worker
from xy_sysid.page.orders import Order, OrderKind, OrderState, Reading, WorkerNews

KEYS = itertools.count(1)
ENDED = "its process has ended. Open it again; the log may say why."


class OpenRecording:
    """A Source whose fits run in a separate process."""

    live = False

    def __init__(self, path: Path, title: str = "", say: Callable[[str], None] | None = None, reading: Reading | None = None) -> None:
        self.key, self.title, self.path = f"rec{next(KEYS)}", title or path.name, path
        self.how = reading or Reading()
        self.about: dict[str, Any] = {}
        self.reading: float | None = 0.0
        self._say = say or (lambda text: None)
        self._documents: dict[str, dict[str, Any]] = {}
        self._jobs: dict[str, OrderState] = {}
        self._stamps: dict[str, int] = {}
        self._problem = ""
        self._numbers = itertools.count(1)
        context = multiprocessing.get_context("spawn")
        theirs, self._orders = context.Pipe(duplex=False)
        self._words, mine = context.Pipe(duplex=False)
        self._process = context.Process(target=worker.main, args=(str(path), self.how, theirs, mine), name=f"recording {self.title}", daemon=True)
        self._process.start()
        theirs.close()
        mine.close()
        threading.Thread(target=self._listen, args=(self._words,), name=self.title, daemon=True).start()

    def axes(self) -> tuple[str, ...]:
        """As the recording names them; empty until it is read."""
        return tuple(self.about.get("axes", ()))

    def document(self, axis: str) -> dict[str, Any] | None:
        """The story as it is now."""
        return self._documents.get(axis)

    def stamp(self, axis: str) -> int:
        """Counter that grows with each change."""
        return self._stamps.get(axis, 0) + self._stamps.get("", 0)

    def job(self, axis: str) -> OrderState | None:
        """The current or waiting order of the axis."""
        return self._jobs.get(axis)

    def ready(self, axis: str) -> bool:
        """True if an order is possible: the rigid model is fitted and the worker runs."""
        return axis in self._documents and not self._problem

    def words(self, axis: str) -> str:
        """The text to show while there is no story."""
        return "" if self._problem else "The rigid model is being fitted ..."

    def effects(self) -> tuple[str, ...]:
        """Effects of the worker's library, including the user's own files."""
        return tuple(self.about.get("effects", ()))

    def problem(self) -> str:
        """Why the recording is closed; empty while it is open."""
        return self._problem

    def ask(self, act: OrderKind, axis: str, argument: str = "") -> None:
        """Order something for an axis; one order per axis at a time."""
        if axis not in self.axes():
            raise BadInput("axis", repr(axis), ", ".join(self.axes()) or "none yet", "Wait until the recording has been read.")
        if axis in self._jobs:
            raise BadInput(f"axis {axis}", f"busy {self._jobs[axis].order.words}", "one thing at a time", "Wait, or cancel it.")
        order = Order(next(self._numbers), act, axis, argument)
        self._jobs[axis] = OrderState(order, time.monotonic(), running=not self._jobs)
        self._changed(axis)
        self._send(order)

    def used(self, axis: str) -> str:
        """Empty: a story uses the full recording."""
        return ""

    def awaits(self, axis: str) -> bool:
        """True while the recording is open: the rigid model is fitted automatically."""
        return not self._problem

    def newer(self, axis: str) -> bool:
        """False: a recording gets no newer data."""
        return False

    def cancel(self, axis: str) -> None:
        """Cancel the running order of this axis. An order that waits for another axis is kept, and a message says so."""
        job = self._jobs.get(axis)
        if job is None or self._process.pid is None or not self._process.is_alive():
            return
        first = min(list(self._jobs.values()), key=lambda item: item.order.number)
        if first is job:
            os.kill(self._process.pid, worker.LEAVE)
        else:
            self._say(f"{self.title}: axis {axis} waits for axis {first.order.axis}; cancel that one first")

    def close(self) -> None:
        """End the worker process."""
        self._problem = self._problem or "closed"
        self._orders.close()
        self._process.join(0.5)
        if self._process.is_alive():
            self._process.kill()

    def _send(self, order: Order) -> None:
        try:
            self._orders.send(order)
        except OSError:
            self._lost(ENDED)

    def _listen(self, words: Connection) -> None:
        while True:
            try:
                self._hear(words.recv())
            except (EOFError, OSError):
                self._lost(ENDED)
                return

    def _hear(self, news: WorkerNews) -> None:
        if news.kind == "opened":
            self.about, self.reading = news.content, None
            self._changed("")
            for axis in self.axes():
                self.ask("begin", axis)
        elif news.kind == "progress":
            self.reading = news.part
            self._changed("")
        elif news.kind == "story":
            self._documents[news.axis] = news.content
            self._changed(news.axis)
        elif news.kind == "closed":
            self._lost(news.words)
        else:
            self._jobs.pop(news.axis, None)
            if news.kind == "failed":
                self._say(f"{self.title}, axis {news.axis}: {news.words}")
            self._changed(news.axis)
        waiting = list(self._jobs.items())  # another thread may add orders meanwhile
        for axis, job in waiting:
            running = job.order.number == min(item.order.number for _, item in waiting)
            if running != job.running:
                self._jobs[axis] = replace(job, running=running, begun=time.monotonic())

    def _lost(self, why: str) -> None:
        if not self._problem:
            self._problem = why
            self._say(f"{self.title} is closed: {why}")
        self.reading = None
        self._jobs.clear()
        self._changed("")

    def _changed(self, axis: str) -> None:
        self._stamps[axis] = self._stamps.get(axis, 0) + 1
