"""The process starter, with small stand-ins for nodes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from helpers import ROOT
from helpers.busy import allowed

from xy_sysid.processes.run_plan import ProcessSpec
from xy_sysid.processes.starter import run

QUICK = ((signal.SIGINT, 1.0), (signal.SIGTERM, 0.3), (signal.SIGKILL, 1.0))
POLITE = "import signal,sys;signal.signal(2,lambda *a:(print('zero'),sys.exit(0)));print('up');signal.pause()"
DEAF = "import signal;signal.signal(2,signal.SIG_IGN);signal.signal(15,signal.SIG_IGN);print('up')\nwhile True: signal.pause()"


def stand_in(name: str, code: str, rank: int = 0, restart: bool = False, optional: bool = False) -> ProcessSpec:
    return ProcessSpec(name, (sys.executable, "-S", "-c", code), (("NAME", name),), rank, restart, optional)


class Ears:
    """Stores the output, and stops the run after a number of occurrences of a line."""

    def __init__(self, wait_for: str = "", times: int = 1) -> None:
        self.lines: list[str] = []
        self.wait_for, self.times = wait_for, times

    def say(self, line: str) -> None:
        self.lines.append(line)

    def enough(self) -> bool:
        return bool(self.wait_for) and sum(self.wait_for in line for line in self.lines) >= self.times

    def index(self, text: str) -> int:
        return next(index for index, line in enumerate(self.lines) if text in line)


def test_each_line_says_which_node_wrote_it() -> None:
    """Output lines have the node's name, aligned; a last line without an end is not lost; bad bytes are accepted."""
    ears = Ears()
    heard: list[tuple[str, str]] = []
    talk = "import sys,os;print('hello');sys.stdout.flush();os.write(1,b'\\xff half a line')"
    code = run([stand_in("a", talk), stand_in("longer", POLITE, 1)], ears.say, lambda name, line: heard.append((name, line)))
    assert code == 0
    assert "a      | hello" in ears.lines
    assert "a      | \ufffd half a line" in ears.lines
    assert ("a", "hello") in heard


def test_what_a_node_writes_cannot_steer_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    """A name from the network in a node's output is shown without setting title or colours."""
    assert run([stand_in("a", "print('joint \\x1b]0;mine\\x07 is not there')")]) == 0
    assert "a | joint ␛]0;mine␇ is not there" in capsys.readouterr().out.splitlines()


def test_the_excitation_is_stopped_first_and_the_machine_last() -> None:
    """Nodes stop rank by rank: none is asked to stop before all of a lower rank have ended."""
    ears = Ears("up", 3)
    specs = [stand_in("machine", POLITE, 3), stand_in("identifier", POLITE, 1), stand_in("excitation", POLITE, 0)]
    assert run(specs, ears.say, enough=ears.enough, grace=QUICK) == 0
    zeros = [line.split()[0] for line in ears.lines if line.endswith("| zero")]
    assert zeros == ["excitation", "identifier", "machine"]


def test_a_death_stops_the_others_and_says_which_and_why() -> None:
    """A node that dies of an error or a signal ends the run with code 1, and the line names it and the reason."""
    for code, why in (("import sys;sys.exit(3)", "exit code 3"), ("import os;os.kill(os.getpid(),9)", "signal SIGKILL")):
        ears = Ears()
        assert run([stand_in("calm", POLITE, 1), stand_in("doomed", code)], ears.say, grace=QUICK) == 1
        assert f"doomed died: {why}; stopping the others" in ears.lines
        assert not any(line.startswith("calm died") for line in ears.lines)


def test_a_stubborn_node_is_asked_more_firmly_and_killed_in_the_end() -> None:
    """SIGINT, then SIGTERM, then SIGKILL; for the one that drives, a warning that zero volts were not published."""
    ears = Ears("up")
    before = time.monotonic()
    assert run([stand_in("excitation", DEAF)], ears.say, enough=ears.enough, grace=QUICK) == 0
    assert time.monotonic() - before < allowed(4.0)
    assert ears.index("sending SIGTERM") < ears.index("sending SIGKILL") < ears.index("check that the machine stands still")


def test_a_node_that_may_restart_does_and_keeps_the_others_running() -> None:
    """restart: a node that dies is started again, and the run continues."""
    ears = Ears("once more", 2)
    phoenix = stand_in("phoenix", "print('once more');raise SystemExit(1)", restart=True)
    assert run([stand_in("calm", POLITE, 1), phoenix], ears.say, enough=ears.enough, grace=QUICK) == 0
    assert "phoenix died: exit code 1; starting it again" in ears.lines
    assert not any("stopping the others" in line for line in ears.lines)


def test_an_optional_node_may_end() -> None:
    """optional: the others continue, and the run ends on request."""
    ears = Ears("the others continue")
    assert run([stand_in("calm", POLITE, 1), stand_in("brief", "print('done')", optional=True)], ears.say, enough=ears.enough, grace=QUICK) == 0
    assert "brief ended; the others continue" in ears.lines


def test_a_program_that_does_not_exist_stops_what_was_started() -> None:
    """A command that cannot start ends the run with code 1 and its name; no process is left."""
    ears = Ears()
    assert run([stand_in("calm", POLITE, 1), ProcessSpec("ghost", ("/nonexistent/program",))], ears.say, grace=QUICK) == 1
    assert any(line.startswith("ghost died") for line in ears.lines)


@pytest.mark.parametrize(("number", "expected"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_ctrl_c_and_sigterm_end_in_order_with_their_code(number: signal.Signals, expected: int, tmp_path: Path) -> None:
    """Ctrl-C returns 130, SIGTERM 143; the node's last output is shown and no process is left; a second Ctrl-C changes nothing."""
    starter = subprocess.Popen(
        [sys.executable, "-c", f"{_script()}\nsys.exit(run([ProcessSpec('node',(sys.executable,'-S','-c',{POLITE!r}))]))"],
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    assert starter.stdout is not None
    assert starter.stdout.readline() == "node | up\n"
    starter.send_signal(number)
    starter.send_signal(signal.SIGINT if number == signal.SIGINT else number)
    output, _ = starter.communicate(timeout=60)
    assert starter.returncode == expected
    assert "node | zero" in output


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's help is asked for on Linux only")
def test_nodes_stop_when_the_starter_is_killed() -> None:
    """kill -9 of the starter still interrupts the nodes, so that none drives unattended."""
    code = "import os,signal,time;print(os.getpid());signal.pause()"
    starter = subprocess.Popen(
        [sys.executable, "-c", f"{_script()}\nrun([ProcessSpec('node',(sys.executable,'-S','-c',{code!r}))])"],
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    assert starter.stdout is not None
    node = int(starter.stdout.readline().split("|")[1])
    starter.kill()
    starter.communicate(timeout=60)
    until = time.monotonic() + 20.0
    while _runs(node) and time.monotonic() < until:
        time.sleep(0.05)
    assert not _runs(node)


def _script() -> str:
    return "import sys\nfrom xy_sysid.processes.starter import run\nfrom xy_sysid.processes.run_plan import ProcessSpec"


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    return status.rpartition(")")[2].split()[0] != "Z"
