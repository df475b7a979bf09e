"""A process that performs jobs on stories, so that the process that receives data never waits for a fit; cancelling ends the process.

It starts at once, so that the first job need not wait for it, and stays idle for the next ones. The core uses no processes; this one belongs
to the adapters.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import queue
import signal
import sys
import threading
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

from xy_sysid.files.effects import library
from xy_sysid.processes.deaf import deaf
from xy_sysid.processes.terminal import printable
from xy_sysid.story.acts import Job, perform
from xy_sysid.story.attempt import Attempt
from xy_sysid.story.document import document
from xy_sysid.story.story import Story

NICE = 10  # niceness of the worker: receiving data has priority
POLL = 0.1  # s between two checks whether a job was cancelled


@dataclass(frozen=True, slots=True)
class JobNews:
    """A report of a job: a step (``text`` is the story's document in JSON), or its end, with the problem if it failed."""

    job: int
    doing: str
    story: Story | None = None
    text: str = ""
    ended: bool = False
    problem: str = ""


class StoryWorker:
    """ask(job), then news() until one has ended; one job at a time."""

    def __init__(self, effect_files: tuple[str, ...] = ()) -> None:
        self._files = effect_files
        self._jobs: queue.Queue[tuple[int, Job] | None] = queue.Queue()
        self._news: queue.Queue[JobNews] = queue.Queue()
        self._number = 0
        self._thread = threading.Thread(target=self._run, name="story", daemon=True)
        self._thread.start()

    def ask(self, job: Job) -> int:
        """Start a job; returns its number."""
        self._number += 1
        self._jobs.put((self._number, job))
        return self._number

    def news(self) -> list[JobNews]:
        """Reports of the newest job since the last call."""
        found: list[JobNews] = []
        while True:
            try:
                item = self._news.get_nowait()
            except queue.Empty:
                return found
            if item.job == self._number:
                found.append(item)

    def cancel(self) -> None:
        """Cancel the current job, if any; it sends no more reports."""
        self._number += 1

    def close(self) -> None:
        """End the process and the thread."""
        self.cancel()
        self._jobs.put(None)
        self._thread.join(3.0)

    def _run(self) -> None:
        process: BaseProcess | None
        process, pipe = _begin(self._files)
        while (item := self._jobs.get()) is not None:
            number, job = item
            if number != self._number:
                continue
            if process is None or not process.is_alive():
                process, pipe = _begin(self._files)
            try:
                pipe.send((number, job))
                while not self._ended(number, pipe):
                    if number != self._number:
                        process.terminate()
            except (EOFError, OSError):
                process.join(2.0)
                text = f"The process that calculates has ended (exit code {process.exitcode}); the model stays as it was. Ask again; see the log."
                self._news.put(JobNews(number, "", ended=True, problem=text))
                process = None
        if process is not None:
            process.terminate()
            process.join(2.0)

    def _ended(self, number: int, pipe: Connection) -> bool:
        """Forward reports that arrive within a moment; returns True after the last one."""
        if not pipe.poll(POLL):
            return False
        news: JobNews = pipe.recv()
        self._news.put(news)
        return news.ended


def _begin(effect_files: tuple[str, ...]) -> tuple[BaseProcess, Connection]:
    here, there = multiprocessing.Pipe()
    process = multiprocessing.get_context("spawn").Process(target=work, args=(there, effect_files), name="story", daemon=True)
    with deaf():
        process.start()
    there.close()
    return process, here


def work(pipe: Connection, effect_files: tuple[str, ...]) -> None:
    """Main loop of the process: jobs in, reports out, until its parent process has ended."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    os.nice(NICE)
    try:
        known = library([Path(file).expanduser() for file in effect_files])
        while True:
            number, job = pipe.recv()
            with Attempt() as attempt:
                for doing, story in perform(job, known, time.process_time):
                    text = "" if story is None else json.dumps(document(story), allow_nan=False, separators=(",", ":"))
                    pipe.send(JobNews(number, doing, story, text))
            if attempt.detail:
                sys.stderr.write(printable(f"axis {job.run.axis}, {job.act}: {attempt.detail}") + "\n")
            pipe.send(JobNews(number, "", ended=True, problem=attempt.problem))
    except (EOFError, OSError):
        return
