"""Starts nodes as processes, watches them, and stops them in an order that leaves the machine at zero volts.

For machines without ``ros2 launch``. When a node ends, all others are stopped, unless it may be restarted or is optional.
"""

from __future__ import annotations

import os
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import FrameType
from typing import IO

from xy_sysid.bags.opening import text_of
from xy_sysid.errors import BadInput
from xy_sysid.files.package_files import find, share
from xy_sysid.files.ros_parameters import parameters
from xy_sysid.processes.run_plan import ProcessSpec, parameter_files, plan
from xy_sysid.processes.terminal import printable

INTERRUPTED = 130
TERMINATED = 143
GRACE = ((signal.SIGINT, 4.0), (signal.SIGTERM, 2.0), (signal.SIGKILL, 2.0))
"""How a process is asked to stop, and for how many seconds it may take its time before it is asked more firmly."""
RESTARTS, RESTART_SPAN, RESTART_PAUSE = 5, 60.0, 0.5
"""So often in so many seconds a process is started again; after that its death counts."""
LINE_LIMIT = 1 << 16
PROFILE = "FASTRTPS_DEFAULT_PROFILES_FILE"  # middleware profile that sets how soon a lost packet is requested again

# Ask the kernel to interrupt the node when the starter itself is killed, then become the node.
FOLLOW = (
    "import ctypes,os,signal,sys;ctypes.CDLL(None).prctl(1,signal.SIGINT);"
    "os.getppid()==int(sys.argv[1]) or sys.exit(1);os.execvp(sys.argv[2],sys.argv[2:])"
)


def load(name: str) -> list[ProcessSpec]:
    """The processes of a run file, given by path or by the name of one that comes with the package; its parameter files are checked.

    Raises BadInput.
    """
    path = find(name)
    text, folder = text_of(path, "a run file"), path.resolve().parent
    specs = plan(text, path.name, folder)
    for file, kinds in parameter_files(text, path.name):
        if not (folder / file).is_file():
            raise BadInput(f"{path.name}: params_file", repr(file), f"a file, relative to {folder}", "Give one that exists.")
        parameters(text_of(folder / file, "a parameter file"), file, kinds)
    return [replace(spec, env=tuple(_network(spec.env, folder, path.name))) for spec in specs]


def _network(env: Sequence[tuple[str, str]], folder: Path, where: str) -> Iterator[tuple[str, str]]:
    """The environment with the path of the network profile: next to the run file, or from the package. A variable that is set already is kept."""
    for key, value in env:
        if key != PROFILE:
            yield key, value
        elif not os.environ.get(PROFILE):
            places = (folder / value, share() / "config" / value)
            found = next((place for place in places if place.is_file()), None)
            if found is None:
                raise BadInput(f"{where}: env: {PROFILE}", repr(value), f"a file, relative to {folder}", "Give one that exists.")
            yield key, str(found.resolve())


def run(
    specs: Sequence[ProcessSpec],
    say: Callable[[str], None] | None = None,
    heard: Callable[[str, str], None] | None = None,
    enough: Callable[[], bool] | None = None,
    grace: Sequence[tuple[signal.Signals, float]] = GRACE,
) -> int:
    """Starts the processes and returns when all have ended: 0 in order, 1 after a death, 130 after Ctrl-C, 143 after SIGTERM.

    ``say`` receives each line for the user (default: standard output), ``heard`` each line that a process wrote, with its
    name; ``enough`` is called ten times a second and returns whether to stop.
    """
    crew = _Crew(say or _print, heard or (lambda name, line: None), grace)
    with _signals() as caught:
        try:
            for spec in specs:
                crew.start(spec)
            while not caught and not crew.over() and not (enough and enough()):
                crew.listen(0.1)
        finally:
            crew.stop()
    if caught:
        return INTERRUPTED if caught[0] == signal.SIGINT else TERMINATED
    return 1 if crew.died else 0


def _print(line: str) -> None:
    sys.stdout.write(printable(line) + "\n")
    sys.stdout.flush()


@contextmanager
def _signals() -> Iterator[list[int]]:
    """Collects Ctrl-C and SIGTERM instead of exiting; a second Ctrl-C does not shorten the orderly stop."""
    caught: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        caught.append(number)

    before = {number: signal.signal(number, note) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield caught
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@dataclass
class _Member:
    spec: ProcessSpec
    process: subprocess.Popen[bytes]
    rest: bytes = b""
    starts: list[float] = field(default_factory=list)


class _Crew:
    """The running processes and their output."""

    def __init__(self, say: Callable[[str], None], heard: Callable[[str, str], None], grace: Sequence[tuple[signal.Signals, float]]) -> None:
        self.say, self.heard, self.grace = say, heard, grace
        self.members: list[_Member] = []
        self.due: list[tuple[float, ProcessSpec, list[float]]] = []
        self.selector = selectors.DefaultSelector()
        self.width = 0
        self.died = False
        self.ended = False

    def start(self, spec: ProcessSpec, starts: list[float] | None = None) -> None:
        environment = {**os.environ, "PYTHONUNBUFFERED": "1", **dict(spec.env)}
        command = list(spec.command)
        if sys.platform == "linux":
            command = [sys.executable, "-S", "-c", FOLLOW, str(os.getpid()), *command]
        try:
            process = subprocess.Popen(
                command,
                bufsize=0,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        except OSError as error:
            raise BadInput(f"{spec.name}: command", command[0], "a program that can be started", f"It says: {error.strerror}.") from None
        member = _Member(spec, process, starts=[*(starts or []), time.monotonic()])
        pipe = _pipe(process)
        os.set_blocking(pipe.fileno(), False)
        self.selector.register(pipe, selectors.EVENT_READ, member)
        self.members.append(member)
        self.width = max(self.width, len(spec.name))

    def over(self) -> bool:
        return self.ended or not (self.members or self.due)

    def listen(self, seconds: float) -> None:
        """Forward the output for at most this many seconds, and check which processes have ended."""
        if self.selector.get_map():
            for key, _ in self.selector.select(seconds):
                self._read(key.data)
        else:
            time.sleep(seconds)
        for member in [member for member in self.members if member.process.poll() is not None]:
            self._bury(member)
        now = time.monotonic()
        for entry in [entry for entry in self.due if entry[0] <= now]:
            self.due.remove(entry)
            self.start(entry[1], entry[2])

    def stop(self) -> None:
        """Stop all processes, rank after rank; each is first asked, then killed."""
        self.ended, self.due = True, []
        for rank in sorted({member.spec.stop_rank for member in self.members}):
            for number, seconds in self.grace:
                group = [member for member in self.members if member.spec.stop_rank == rank]
                for member in group:
                    if number != signal.SIGINT:
                        self.say(f"{member.spec.name} does not stop; sending {number.name}")
                    self._send(member, number)
                until = time.monotonic() + seconds
                while any(member in self.members for member in group) and time.monotonic() < until:
                    self.listen(0.02)
        self.selector.close()

    def _send(self, member: _Member, number: signal.Signals) -> None:
        if number == signal.SIGKILL:
            os.killpg(member.process.pid, number)
        else:
            member.process.send_signal(number)

    def _read(self, member: _Member) -> None:
        chunk = _pipe(member.process).read(LINE_LIMIT)
        if chunk == b"":
            self.selector.unregister(_pipe(member.process))
        *lines, member.rest = (member.rest + (chunk or b"")).split(b"\n")
        if len(member.rest) > LINE_LIMIT:
            lines, member.rest = [*lines, member.rest], b""
        for line in lines:
            self._tell(member, line)

    def _tell(self, member: _Member, line: bytes) -> None:
        text = line.decode("utf-8", "replace").rstrip("\r")
        self.say(f"{member.spec.name:<{self.width}} | {text}")
        self.heard(member.spec.name, text)

    def _bury(self, member: _Member) -> None:
        """Print the remaining output of an ended process, and decide whether to restart it or stop the others."""
        pipe = _pipe(member.process)
        while chunk := pipe.read(LINE_LIMIT):
            member.rest += chunk
        for line in member.rest.splitlines():
            self._tell(member, line)
        if pipe in self.selector.get_map():
            self.selector.unregister(pipe)
        pipe.close()
        self.members.remove(member)
        code = member.process.returncode
        if self.ended:
            if code == -signal.SIGKILL and member.spec.stop_rank == 0:
                self.say(f"{member.spec.name} had to be killed and could not publish zero volts: check that the machine stands still")
            return
        why = "ended" if code == 0 else f"died: {_why(code)}"
        recent = [start for start in member.starts if start > time.monotonic() - RESTART_SPAN]
        if member.spec.restart and code != 0 and len(recent) <= RESTARTS:
            self.say(f"{member.spec.name} {why}; starting it again")
            self.due.append((time.monotonic() + RESTART_PAUSE, member.spec, recent))
        elif member.spec.optional:
            self.say(f"{member.spec.name} {why}; the others continue")
        else:
            self.say(f"{member.spec.name} {why}; stopping the others")
            self.ended, self.died = True, self.died or code != 0


def _pipe(process: subprocess.Popen[bytes]) -> IO[bytes]:
    assert process.stdout is not None
    return process.stdout


def _why(code: int) -> str:
    return f"exit code {code}" if code > 0 else f"signal {signal.Signals(-code).name}"


def main(file: Path | str) -> int:
    """Implements ``xy-sysid run``: the nodes of a run file, until one ends or Ctrl-C."""
    return run(load(str(file)))
