"""The command line: ``xy-sysid COMMAND``."""

from __future__ import annotations

import atexit
import io
import os
import sys
from collections.abc import Callable, Sequence
from functools import cache
from typing import TextIO

from xy_sysid.cli.interrupt import Interrupts
from xy_sysid.processes.terminal import printable

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # results repeat bit for bit with one thread, and small matrices gain nothing from two

INTERRUPTED, TERMINATED, WRONG = 130, 143, 2
_interrupts = Interrupts()
LONGEST = 800  # characters of an error message; the wrong value in it may be very long


def run(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code: 0 answer, 1 failed check, 2 wrong use or bad input, 130 Ctrl-C, 143 SIGTERM."""
    from xy_sysid.errors import ReaderGone, XySysidError
    from xy_sysid.files.blame import blamed
    from xy_sysid.processes.memory import keep_freed_memory

    keep_freed_memory()
    try:
        with blamed():
            return _command(arguments)
    except XySysidError as problem:
        return _refuse(str(problem))
    except KeyboardInterrupt:
        return _stopped()
    except (BrokenPipeError, ReaderGone):
        _discard(sys.stdout)  # the reader of the pipe has closed it
        return 0
    except OSError as problem:
        place = f"{problem.filename}: " if problem.filename else ""
        return _refuse(f"{place}{problem.strerror or problem}. Check the path, the permissions and the free disk space.")
    except MemoryError:
        return _refuse("Not enough memory. Give a shorter part with --span, or a shorter window with --set length=.")
    except Exception:
        if _interrupts.came:  # an interrupt in the import of a compiled module, or of a class with descriptors, becomes another error
            return _stopped()
        raise


def _command(arguments: Sequence[str]) -> int:
    """The exit code of a command, or of typer's error."""
    import typer
    from typer.exceptions import TyperException

    from xy_sysid.cli.app import app

    names = [command.name for command in app.registered_commands if command.name]
    known = arguments[0] if arguments and arguments[0] in names else ""
    try:
        code = _commands()(list(arguments) or ["--help"], prog_name="xy-sysid", standalone_mode=False)
    except typer.Abort:
        return _stopped()
    except typer.Exit as end:
        return _unless_terminated(end.exit_code)
    except TyperException as problem:
        text = problem.format_message() if hasattr(problem, "format_message") else str(problem)
        return _refuse(f"{text}{'' if text.endswith(('?', '.')) else '.'} See xy-sysid {known} --help.")
    if not arguments:
        return _refuse("Give a command, for example xy-sysid demo.")
    sys.stdout.flush()
    return _unless_terminated(code)


@cache
def _commands() -> Callable[..., object]:
    """The parser of the arguments of all commands, cached."""
    from typer.main import get_command

    from xy_sysid.cli.app import app

    return get_command(app)


def _refuse(text: str) -> int:
    line = " ".join(text.split())
    if len(line) > LONGEST:
        line = f"{line[: LONGEST // 2]} ... {line[-LONGEST // 2 :]}"
    _say(f"xy-sysid: {line}\n")
    return WRONG


def _stopped() -> int:
    _say("xy-sysid: stopped.\n")
    return TERMINATED if _interrupts.terminated else INTERRUPTED


def _unless_terminated(code: object) -> int:
    """The exit code of a command; typer turns every interrupt into 130."""
    found = code if isinstance(code, int) else 0
    return TERMINATED if found == INTERRUPTED and _interrupts.terminated else found


def _say(line: str) -> None:
    """Write a line to stderr; if this fails, only the exit code remains."""
    try:
        sys.stderr.write(printable(line))
        sys.stderr.flush()
    except OSError:
        _discard(sys.stderr)


def _discard(stream: TextIO) -> None:
    """Discard the buffer of the stream and all further output."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def _ended(code: int) -> int:
    """The exit code after all output was flushed: an error in writing is handled here, not in the last flush of the interpreter."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _discard(sys.stdout)
    except OSError as problem:
        _discard(sys.stdout)
        if code == 0:
            code = _refuse(f"The answer cannot be written: {problem.strerror}. Free some disk space, or write it elsewhere.")
    _say("")
    return code


def _nowhere() -> TextIO:
    """A stream that discards its input, for one that the caller has closed."""
    return os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")


def main() -> None:
    """Entry point of the console script."""
    atexit.register(_interrupts.leave)  # registered first, called last: then the exit code is final
    sys.stdout = sys.stdout or _nowhere()
    sys.stderr = sys.stderr or _nowhere()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # the name of a file may contain characters that the terminal cannot show
    with _interrupts:
        code = run(sys.argv[1:])
    _interrupts.code = _ended(code)
    sys.exit(_interrupts.code)
