"""Commands as processes: Ctrl-C, pipes that close, closed streams, names that no terminal can show."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cli_tools import cli

ROOT = Path(__file__).parents[1]
COMMAND = (sys.executable, "-m", "xy_sysid")


def environment(**changes: str) -> dict[str, str]:
    """This process' own, with the project on the path."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH")))), **changes}


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A minute of the paper's table: work for a second."""
    path = tmp_path_factory.mktemp("bag") / "bag"
    assert cli("simulate", path, "--duration", 60).code == 0
    return path


def test_json_goes_through_a_pipe_alone(bag: Path) -> None:
    """A script reads stdout as one document; stderr is empty when all is well."""
    done = subprocess.run([*COMMAND, "frf", str(bag), "--json"], capture_output=True, env=environment(), check=False, timeout=60)
    assert done.returncode == 0 and done.stderr == b"" and set(json.loads(done.stdout)["axes"]) == {"x", "y"}


def test_a_refusal_of_a_process_is_code_2_and_one_line(tmp_path: Path) -> None:
    """As in this process, so in the shell."""
    done = subprocess.run([*COMMAND, "fit", str(tmp_path / "none")], capture_output=True, env=environment(), check=False, timeout=60)
    assert done.returncode == 2 and done.stdout == b"" and done.stderr.count(b"\n") == 1 and done.stderr.startswith(b"xy-sysid: ")


@pytest.mark.parametrize("arguments", [("simulate", "OUT", "--duration", "100000"), ("replay", "BAG", "--json"), ("fit", "BAG", "--json")])
def test_ctrl_c_in_the_middle_of_long_work_is_130_without_a_traceback(arguments: tuple[str, ...], bag: Path, tmp_path: Path) -> None:
    """The work stops within a second, says nothing on stdout, and leaves no half-written output."""
    places = {"OUT": str(tmp_path / "out"), "BAG": str(bag)}
    words = [places.get(word, word) for word in arguments]
    process = subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment())
    time.sleep(0.8)
    process.send_signal(signal.SIGINT)
    begun = time.monotonic()
    try:
        out, err = process.communicate(timeout=20)
    finally:
        process.kill()  # nothing is left over when it does not heed
    assert process.returncode in (130, -signal.SIGINT) and out == b"", err  # either is 130 to a shell
    assert b"Traceback" not in err and time.monotonic() - begun < 5
    assert not (tmp_path / "out").exists()


def test_a_reader_that_goes_away_ends_a_command_in_peace(bag: Path) -> None:
    """xy-sysid frf REC | head -1: code 0 and no words, for a table and for a document."""
    for extra in ((), ("--json",)):
        process = subprocess.Popen([*COMMAND, "frf", str(bag), *extra], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment())
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.read(1)
        process.stdout.close()
        assert process.stderr.read() == b"" and process.wait(30) == 0
        process.stderr.close()


def test_closed_streams_do_not_matter(bag: Path) -> None:
    """A caller may close stdout or stderr: the exit code still tells."""
    for line, code in (('"$@" >&-', 0), ('"$@.none" 2>&-', 2)):
        done = subprocess.run(["sh", "-c", line, "sh", *COMMAND, "frf", str(bag)], capture_output=True, env=environment(), check=False, timeout=60)
        assert done.returncode == code, (line, done)


def test_a_full_disk_is_one_line(bag: Path) -> None:
    """What the system says, and not a traceback."""
    with open("/dev/full", "wb") as full:
        done = subprocess.run([*COMMAND, "frf", str(bag)], stdout=full, stderr=subprocess.PIPE, env=environment(), check=False, timeout=60)
    assert done.returncode == 2 and done.stderr.count(b"\n") == 1 and b"No space left" in done.stderr


def test_names_that_are_no_text_are_read_written_and_shown(tmp_path: Path) -> None:
    """A path of bytes, on a terminal that knows ASCII only."""
    folder = tmp_path / os.fsdecode(b"b\xff\xc3\xbc")
    folder.mkdir()
    ascii_only = environment(PYTHONIOENCODING="ascii")
    recording, model = str(folder / "r"), str(folder / "m.yaml")
    made = subprocess.run([*COMMAND, "simulate", recording, "--duration", "10"], capture_output=True, env=ascii_only, check=False, timeout=60)
    assert made.returncode == 0 and b"20000 samples" in made.stdout, made.stderr
    command = [*COMMAND, "fit", recording, "--axis", "x", "--model", model]
    fitted = subprocess.run(command, capture_output=True, env=ascii_only, check=False, timeout=60)
    assert fitted.returncode == 0 and b"delay" in fitted.stdout, fitted.stderr
    assert b"source: " in Path(model).read_bytes()
