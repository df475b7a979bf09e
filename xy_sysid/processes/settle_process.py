"""A process that decides the steps towards a settled diagnosis, so that the process that receives data never waits for a design."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from xy_sysid.excitation.trajectory import Trajectory
from xy_sysid.files.effects import library
from xy_sysid.files.walk import plan_of, run_of, step_document
from xy_sysid.processes.deaf import deaf
from xy_sysid.processes.terminal import printable
from xy_sysid.story.attempt import Attempt

NICE = 10  # niceness of the process: receiving data has priority


@dataclass(frozen=True, slots=True)
class DecisionNews:
    """Report of the process. part: finished fraction of the design; step: document of the decided step; problem: why there is none.

    motion: of its experiment, for a robot that takes only trajectories
    """

    part: float = 0.0
    step: dict[str, Any] | None = None
    problem: str = ""
    motion: Trajectory | None = None


class Decider:
    """ask(bag) for each recording in turn, then ``news`` until it returns a step or a problem. The first news tells that it is loaded."""

    def __init__(self, plan: dict[str, Any], effect_files: tuple[str, ...] = ()) -> None:
        """plan: its document."""
        self._pipe, there = multiprocessing.Pipe()
        self._process = multiprocessing.get_context("spawn").Process(target=work, args=(there, plan, effect_files), name="settle", daemon=True)
        with deaf():
            self._process.start()
        there.close()

    def ask(self, bag: Path) -> None:
        """Decide after one more recording."""
        self._pipe.send(str(bag))

    def news(self) -> DecisionNews | None:
        """The newest report since the last call; None without one."""
        found: DecisionNews | None = None
        try:
            while self._pipe.poll():
                found = self._pipe.recv()
        except (EOFError, OSError):
            return DecisionNews(problem="The process that decides has ended. Start again; see the log.")
        return found

    def close(self) -> None:
        """End the process."""
        self._process.terminate()
        self._process.join(2.0)
        self._pipe.close()


def work(pipe: Connection, told: dict[str, Any], effect_files: tuple[str, ...]) -> None:
    """Main loop of the process: bags in, steps out, until its parent process has ended."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    os.nice(NICE)
    from xy_sysid.experiment_design.walk import step

    plan = plan_of(told, library([Path(file).expanduser() for file in effect_files]))
    runs, before = [], None
    try:
        pipe.send(DecisionNews())
        while True:
            bag = Path(pipe.recv())
            with Attempt() as attempt:
                runs.append(run_of(bag, plan))
                before = step(plan, runs, before, lambda part: pipe.send(DecisionNews(part)))
                pipe.send(DecisionNews(1.0, step_document(before), motion=before.motion))
            if attempt.detail:
                sys.stderr.write(printable(f"{bag}: {attempt.detail}") + "\n")
            if attempt.problem:
                pipe.send(DecisionNews(problem=attempt.problem))
    except (EOFError, OSError):
        return
