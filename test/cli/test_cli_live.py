"""demo, run and record over real DDS, each in its own domain: their answers, and no remains after Ctrl-C."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from helpers.busy import PATIENCE, allowed
from helpers.cli_tools import bare, cli, refused
from helpers.ros_tools import needs_ros, new_domain

pytestmark = needs_ros

FIRST_RUN = """\
nodes:
  - executable: ballscrew
    parameters: {machine: rigid.yaml, realtime: true}
  - executable: excitation
    parameters: {watchdog: 1.0, "x": {rms: 0.3}, "y": {rms: 0.3}}
"""


class Command:
    """xy-sysid as a process, whose children can be found by a mark in their environment."""

    def __init__(self, log: Path, *arguments: object) -> None:
        self.mark = uuid.uuid4().hex
        environment = bare(ROS_DOMAIN_ID=str(new_domain()), XY_SYSID_TEST_MARK=self.mark, ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST")
        self.log = log
        with log.open("wb") as err:
            words = [sys.executable, "-m", "xy_sysid", *map(str, arguments)]
            self.process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=err, env=environment)

    def heard(self, words: str, seconds: float = 30.0) -> bool:
        """Wait for words on stderr."""
        until = time.monotonic() + PATIENCE * seconds
        while words not in self.log.read_text(errors="replace") and time.monotonic() < until and self.process.poll() is None:
            time.sleep(0.05)
        return words in self.log.read_text(errors="replace")

    def end(self, seconds: float = 60.0) -> tuple[int, str, str]:
        """Exit code, stdout and stderr."""
        out, _ = self.process.communicate(timeout=PATIENCE * seconds)
        return self.process.returncode, out.decode(), self.log.read_text(errors="replace")

    def left_over(self) -> list[str]:
        """Processes with the mark that are still running."""
        return list(self.living().values())

    def living(self) -> dict[int, str]:
        """The same, by their numbers."""
        found = {}
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                if f"XY_SYSID_TEST_MARK={self.mark}".encode() in (folder / "environ").read_bytes():
                    found[int(folder.name)] = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode()
            except OSError:
                continue  # it has just ended, or belongs to another user
        return found


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Command]]:
    """Start a command; its remaining processes are ended after the test."""
    started: list[Command] = []

    def make(*arguments: object) -> Command:
        started.append(Command(tmp_path / f"{len(started)}.log", *arguments))
        return started[-1]

    yield make
    for command in started:
        if command.process.poll() is None:
            command.process.kill()
            command.process.wait(10)


def test_the_demo_identifies_both_axes_live(start: Callable[..., Command]) -> None:
    """12 s of data: delay within 20 us, the 47 Hz pair within 0.2 Hz, error below 1.5 %, no window lost, nothing left running."""
    command = start("demo", "--seconds", 12, "--speed", 0, "--json")
    code, out, err = command.end()
    assert code == 0, err
    answer = json.loads(out)
    for axis in ("x", "y"):
        found = answer["axes"][axis]
        assert all(found[name]["within"] for name in ("delay", "velocity_gain", "antiresonance", "resonance", "relative_error")), found
        assert found["windows"] >= 10 and found["dropped_windows"] == 0
    assert answer["wall_seconds"] < allowed(60) and "Traceback" not in err
    assert command.left_over() == []


def test_ctrl_c_ends_the_demo_cleanly(start: Callable[..., Command]) -> None:
    """During a long demo: 130, one document of the results so far, no process left."""
    command = start("demo", "--seconds", 3600, "--speed", 4, "--json")
    assert command.heard("relative error"), command.end()
    assert len(command.left_over()) == 7  # the command, four nodes, and the process in which the diagnoser calculates, with Python's tracker
    command.process.send_signal(signal.SIGINT)
    code, out, err = command.end(15)
    assert code == 130 and json.loads(out)["exit_code"] == 130 and "Traceback" not in err
    assert json.loads(out)["axes"]["x"]["relative_error"]["value"] < 0.1
    assert command.left_over() == []


@pytest.mark.parametrize(("number", "expected"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_run_starts_what_a_file_names_and_a_signal_ends_it(
    start: Callable[..., Command], tmp_path: Path, number: signal.Signals, expected: int
) -> None:
    """The nodes' lines come with their names; 130 after Ctrl-C, 143 after SIGTERM; no process left."""
    (tmp_path / "run.yaml").write_text("nodes:\n  - executable: ballscrew\n  - executable: identifier\n")
    command = start("run", "--params", tmp_path / "run.yaml", "--json")
    assert command.heard("ballscrew  | ") and len(command.left_over()) == 3
    command.process.send_signal(number)
    code, out, err = command.end(15)
    assert code == expected and json.loads(out)["exit_code"] == expected and "Traceback" not in err
    assert command.left_over() == []


def test_the_first_run_says_what_it_finds_before_it_goes_on(start: Callable[..., Command], tmp_path: Path) -> None:
    """run --first on the simulated table in real time: small steps, gain and delay of each axis measured, machine at rest, no process left."""
    (tmp_path / "run.yaml").write_text(FIRST_RUN)
    for _ in range(3):  # a computer that stalls for a second stops the drive or loses messages, and the run reports this instead of a number
        command = start("run", "--first", "--params", tmp_path / "run.yaml", "--json")
        code, out, err = command.end(180)
        if not ("without all its messages" in err or "the excitation stopped: no position" in err):
            break
    assert code == 0, err
    answer = json.loads(out)
    assert answer["problem"] is None and "Traceback" not in err
    for axis, gain in (("x", 0.097), ("y", 0.0965)):
        found = answer["axes"][axis]
        assert abs(found["velocity_gain"] / gain - 1) < 0.1 and found["lag"] < 0.03
        assert f"first run: {axis} at 0.05 V: +" in err and f"first run: {axis}: plus is plus" in err
    assert command.left_over() == []


def test_a_first_run_whose_machine_falls_silent_says_why_the_drive_stopped(start: Callable[..., Command], tmp_path: Path) -> None:
    """Half of a step is not judged: the problem is what the excitation reported, not the rest of the samples."""
    (tmp_path / "run.yaml").write_text(FIRST_RUN)
    command = start("run", "--first", "--params", tmp_path / "run.yaml", "--json")
    assert command.heard("first run: x at 0.05 V")
    machine = next(number for number, words in command.living().items() if "ballscrew" in words)
    os.kill(machine, signal.SIGSTOP)
    assert command.heard("first run: the excitation stopped: ")
    os.kill(machine, signal.SIGCONT)
    code, out, err = command.end(30)
    assert code == 1 and "no position from the machine for 1000 ms" in json.loads(out)["problem"] and "Traceback" not in err
    assert command.left_over() == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_recording_as_a_whole_bag(start: Callable[..., Command], tmp_path: Path, number: signal.Signals) -> None:
    """For record, Ctrl-C or SIGTERM is the normal end: 0, and the content of the bag."""
    command = start("record", tmp_path / "bag", "--json")
    assert command.heard("recording to")
    command.process.send_signal(number)
    code, out, _ = command.end(15)
    assert code == 0 and json.loads(out) == {"output": str(tmp_path / "bag"), "topics": {}}
    assert (tmp_path / "bag" / "metadata.yaml").is_file()
    assert cli("replay", tmp_path / "bag").code == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("demo", "--machine", "papr"), "paper.yaml"),
        (("demo", "--seconds", "1"), "greater than or equal to 5"),
        (("run", "--params", "nope"), "demo.yaml"),
        (("record", "OUT", "--namespace", "9bad"), "names after slashes"),
        (("record", "OUT", "--seconds", "-1"), "greater than or equal to 0"),
    ],
)
def test_a_wrong_use_of_a_live_command_is_one_line(arguments: tuple[str, ...], words: str, tmp_path: Path) -> None:
    """Before any node is started."""
    assert words in refused(*(str(tmp_path / "out") if word == "OUT" else word for word in arguments))


@pytest.mark.parametrize("domain", ["abc", "500", "-3", "1.5"])
def test_a_wrong_domain_is_one_line(domain: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The message of ROS itself would be a page long."""
    monkeypatch.setenv("ROS_DOMAIN_ID", domain)
    for arguments in (("demo",), ("run",), ("record", tmp_path / "out")):
        assert "ROS_DOMAIN_ID" in refused(*arguments)
