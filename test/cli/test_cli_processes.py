"""Commands as processes: Ctrl-C, closed pipes, closed streams, names that a terminal cannot show."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
from helpers.busy import allowed
from helpers.cli_tools import COMMAND, bare
from helpers.live_streams import recorded

from campaigns.faults.strange import GOOD_EFFECT
from xy_sysid.imports import save


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A minute of the paper's table: a second of work."""
    path = tmp_path_factory.mktemp("bag") / "bag"
    save(recorded("paper.yaml", 60.0), path)
    return path


def test_json_goes_through_a_pipe_alone(bag: Path) -> None:
    """A script reads stdout as one document; stderr is empty without a problem."""
    done = subprocess.run([*COMMAND, "frf", str(bag), "--json"], capture_output=True, env=bare(), check=False, timeout=60)
    assert done.returncode == 0 and done.stderr == b"" and set(json.loads(done.stdout)["axes"]) == {"x", "y"}


def test_a_refusal_of_a_process_is_code_2_and_one_line(tmp_path: Path) -> None:
    """The same result as in this process."""
    done = subprocess.run([*COMMAND, "fit", str(tmp_path / "none")], capture_output=True, env=bare(), check=False, timeout=60)
    assert done.returncode == 2 and done.stdout == b"" and done.stderr.count(b"\n") == 1 and done.stderr.startswith(b"xy-sysid: ")


@pytest.mark.parametrize(
    ("arguments", "number", "code"),
    [
        (("simulate", "OUT", "--duration", "100000"), signal.SIGINT, 130),
        (("simulate", "OUT", "--duration", "100000"), signal.SIGTERM, 143),
        (("replay", "BAG", "--json"), signal.SIGINT, 130),
        (("fit", "BAG", "--json"), signal.SIGTERM, 143),
    ],
)
def test_a_signal_in_the_middle_of_long_work_is_its_code_without_a_traceback(
    arguments: tuple[str, ...], number: signal.Signals, code: int, bag: Path, tmp_path: Path
) -> None:
    """The work stops within a second, prints nothing on stdout, and leaves no partial output."""
    places = {"OUT": str(tmp_path / "out"), "BAG": str(bag)}
    words = [places.get(word, word) for word in arguments]
    process = subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=bare())
    time.sleep(0.8)
    process.send_signal(number)
    begun = time.monotonic()
    try:
        out, err = process.communicate(timeout=120)
    finally:
        process.kill()  # no process is left if it does not react
    assert process.returncode in (code, -number) and out == b"", err  # before the command has started; a shell treats both alike
    assert b"Traceback" not in err and time.monotonic() - begun < allowed(5)
    assert not (tmp_path / "out").exists()


INTERRUPTED_IMPORT = """
import os, signal
from xy_sysid import cli
def run(words):
    try:
        exec("os.kill(os.getpid(), int(words[0]))\\nwhile True: pass")
    except KeyboardInterrupt:
        return 143 if words[0] == "15" else 130
cli.run = run
cli.main()
"""


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_in_the_middle_of_an_import_is_its_code(number: signal.Signals, code: int, tmp_path: Path) -> None:
    """Every dataclass uses an exec; after an interrupt in one, ``python -m`` would end by SIGINT, even if the interrupt was caught."""
    (tmp_path / "interrupted.py").write_text(INTERRUPTED_IMPORT)
    command = [*COMMAND[:-1], "interrupted", str(number.value)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, env=bare(), check=False, timeout=60)
    assert (done.returncode, done.stderr) == (code, b"")


@pytest.mark.parametrize(
    ("words", "number", "code"),
    [
        (("simulate", "OUT", "--duration", "20"), signal.SIGINT, 130),
        (("simulate", "CSV", "--duration", "20"), signal.SIGTERM, 143),
        (("replay", "BAG", "--out", "OUT"), signal.SIGINT, 130),
        (("replay", "BAG", "--out", "OUT"), signal.SIGTERM, 143),
    ],
)
def test_what_ends_a_command_while_it_writes_leaves_no_partial_file(
    words: tuple[str, ...], number: int, code: int, bag: Path, tmp_path: Path
) -> None:
    """Ctrl-C and SIGTERM after the first output on the disk: code 130 or 143, and an empty folder."""
    places = {"OUT": str(tmp_path / "out"), "CSV": str(tmp_path / "out.csv"), "BAG": str(bag)}
    process = subprocess.Popen([*COMMAND, *(places.get(word, word) for word in words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=bare())
    try:
        while not any(tmp_path.iterdir()):
            assert process.poll() is None, process.communicate()
            time.sleep(0.001)
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert (process.returncode, out) == (code, b"") and err in (b"", b"xy-sysid: stopped.\n")
    assert not list(tmp_path.iterdir())


SWALLOWED = """
import os, signal, time, weakref

class Thing:
    pass

def end(*_):
    os.kill(os.getpid(), signal.NUMBER)
    time.sleep(1)

thing = Thing()
gone = weakref.ref(thing, end)
del thing
"""
CAUGHT = """
import os, signal, time

try:
    os.kill(os.getpid(), signal.NUMBER)
    time.sleep(1)
except BaseException:
    pass
"""
CLEARED = """
import os, signal, time

try:
    os.kill(os.getpid(), signal.NUMBER)
finally:
    time.sleep(1)
    open(__file__ + ".cleared", "w").close()
"""


@pytest.mark.parametrize(
    ("first", "name", "code"),
    [(SWALLOWED, "SIGINT", 130), (SWALLOWED, "SIGTERM", 143), (CAUGHT, "SIGINT", 130), (CLEARED, "SIGTERM", 143)],
    ids=["swallowed", "swallowed by SIGTERM", "caught", "cleared"],
)
def test_an_interrupt_that_is_swallowed_is_raised_again(first: str, name: str, code: int, tmp_path: Path) -> None:
    """In a callback of a weak reference (importlib has them), or caught by other code: the command ends, and its cleanup is not interrupted."""
    file = tmp_path / "own.py"
    file.write_text(first.replace("NUMBER", name) + "while True:\n    time.sleep(0.01)\n")
    done = subprocess.run([*COMMAND, "effects", "--effect-file", str(file)], capture_output=True, env=bare(), check=False, timeout=60)
    assert (done.returncode, done.stdout) == (code, b"") and b"Traceback" not in done.stderr, done
    assert (tmp_path / "own.py.cleared").exists() == (first is CLEARED)


LATE = """
import os, signal, sys

class Late:
    def __del__(self, kill=os.kill, own=os.getpid(), number=signal.NUMBER):
        kill(own, number)

sys.late = Late()
"""


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_signal_after_the_answer_changes_nothing(name: str, tmp_path: Path) -> None:
    """An interrupt during the exit of the interpreter, after all output: the exit code is that of the answer."""
    file = tmp_path / "own.py"
    file.write_text(GOOD_EFFECT + LATE.replace("NUMBER", name))
    done = subprocess.run([*COMMAND, "effects", "--effect-file", str(file)], capture_output=True, env=bare(), check=False, timeout=60)
    assert (done.returncode, done.stderr) == (0, b""), done
    assert b"own_drag" in done.stdout


def test_a_reader_that_goes_away_ends_a_command_in_peace(bag: Path) -> None:
    """xy-sysid frf REC | head -1: code 0 and no message, for a table and for a document."""
    for extra in ((), ("--json",)):
        process = subprocess.Popen([*COMMAND, "frf", str(bag), *extra], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=bare())
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.read(1)
        process.stdout.close()
        assert process.stderr.read() == b"" and process.wait(30) == 0
        process.stderr.close()


def test_closed_streams_do_not_matter(bag: Path) -> None:
    """A caller may close stdout or stderr: the exit code is still right."""
    for line, code in (('"$@" >&-', 0), ('"$@.none" 2>&-', 2)):
        done = subprocess.run(["sh", "-c", line, "sh", *COMMAND, "frf", str(bag)], capture_output=True, env=bare(), check=False, timeout=60)
        assert done.returncode == code, (line, done)


def test_a_full_disk_is_one_line(bag: Path) -> None:
    """The message of the system, without a traceback."""
    for words in (("frf", str(bag)), ("frf", str(bag), "--json"), ("--help",)):
        with open("/dev/full", "wb") as full:
            done = subprocess.run([*COMMAND, *words], stdout=full, stderr=subprocess.PIPE, env=bare(), check=False, timeout=60)
        assert done.returncode == 2 and done.stderr.count(b"\n") == 1 and b"No space left" in done.stderr, done


def test_where_not_even_a_refusal_can_be_written_the_exit_code_tells(bag: Path) -> None:
    """stdout and stderr on a full disk: code 2, not that of the interpreter."""
    with open("/dev/full", "wb") as full:
        for words in (("frf", str(bag)), ("fit", f"{bag}.none")):
            assert subprocess.run([*COMMAND, *words], stdout=full, stderr=full, env=bare(), check=False, timeout=60).returncode == 2


def test_names_that_are_no_text_are_read_written_and_shown(tmp_path: Path) -> None:
    """A path with arbitrary bytes, on an ASCII terminal."""
    folder = tmp_path / os.fsdecode(b"b\xff\xc3\xbc")
    folder.mkdir()
    ascii_only = bare(PYTHONIOENCODING="ascii")
    recording, model = str(folder / "r"), str(folder / "m.yaml")
    made = subprocess.run([*COMMAND, "simulate", recording, "--duration", "10"], capture_output=True, env=ascii_only, check=False, timeout=60)
    assert made.returncode == 0 and b"20000 samples" in made.stdout, made.stderr
    command = [*COMMAND, "fit", recording, "--axis", "x", "--model", model]
    fitted = subprocess.run(command, capture_output=True, env=ascii_only, check=False, timeout=60)
    assert fitted.returncode == 0 and b"delay" in fitted.stdout, fitted.stderr
    assert b"source: " in Path(model).read_bytes()


@pytest.mark.parametrize("made", ['ImportError("initialization failed")', 'RuntimeError("Error calling __set_name__")'])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_while_a_module_is_imported_is_its_code(number: signal.Signals, code: int, made: str) -> None:
    """Compiled modules convert an interrupt to "initialization failed", and classes with descriptors to another error: no traceback."""
    program = f"""
import os
import xy_sysid.cli as cli
def importing(arguments):
    try:
        os.kill(os.getpid(), {int(number)})
    except KeyboardInterrupt:
        raise {made} from None
cli._command = importing
cli.main()
"""
    done = subprocess.run([COMMAND[0], "-c", program], capture_output=True, env=bare(), check=False, timeout=60)
    assert (done.returncode, done.stderr) == (code, b"xy-sysid: stopped.\n")
