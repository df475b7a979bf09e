"""The command line: ``xy-sysid COMMAND``."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Sequence
from typing import TextIO

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # results repeat bit for bit with one thread, and small matrices gain nothing from two

INTERRUPTED, WRONG = 130, 2
LONGEST = 800  # characters of a refusal; somebody may give a whole file as a value


def run(arguments: Sequence[str]) -> int:
    """Run one command; 0 is an answer, 2 wrong use or bad input, 130 Ctrl-C."""
    from xy_sysid.errors import ReaderGone, XySysidError

    try:
        return _command(arguments)
    except XySysidError as problem:
        return _refuse(str(problem))
    except KeyboardInterrupt:
        return _stopped()
    except (BrokenPipeError, ReaderGone):
        return _nobody_reads()
    except OSError as problem:
        place = f"{problem.filename}: " if problem.filename else ""
        return _refuse(f"{place}{problem.strerror or problem}. Check the path, the permissions and the space that is left.")
    except MemoryError:
        return _refuse("There is not enough memory for this. Give a shorter part with --span, or a shorter window with --set length=.")


def _command(arguments: Sequence[str]) -> int:
    """The exit code of a command that was used rightly, or that typer refuses."""
    import typer
    from typer.exceptions import TyperException

    from xy_sysid.cli.app import app

    names = [command.name for command in app.registered_commands if command.name]
    known = arguments[0] if arguments and arguments[0] in names else ""
    try:
        code = app(list(arguments) or ["--help"], prog_name="xy-sysid", standalone_mode=False)
    except typer.Abort:
        return _stopped()
    except typer.Exit as end:
        return int(end.exit_code)
    except TyperException as problem:
        text = problem.format_message() if hasattr(problem, "format_message") else str(problem)
        return _refuse(f"{text}{'' if text.endswith(('?', '.')) else '.'} See xy-sysid {known} --help.")
    if not arguments:
        return _refuse("Give a command, for example xy-sysid demo.")
    sys.stdout.flush()
    return int(code) if isinstance(code, int) else 0


def _refuse(text: str) -> int:
    line = " ".join(text.split())
    if len(line) > LONGEST:
        line = f"{line[: LONGEST // 2]} ... {line[-LONGEST // 2 :]}"
    sys.stderr.write(f"xy-sysid: {line}\n")
    return WRONG


def _stopped() -> int:
    sys.stderr.write("xy-sysid: stopped.\n")
    return INTERRUPTED


def _nobody_reads() -> int:
    """The reader of a pipe went away: nothing more to say to it."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _nowhere() -> TextIO:
    """Stands for a stream that the caller has closed."""
    return os.fdopen(os.open(os.devnull, os.O_WRONLY), "w", encoding="utf-8")


def main() -> None:
    """Entry point of the console script."""
    sys.stdout = sys.stdout or _nowhere()
    sys.stderr = sys.stderr or _nowhere()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a file's name may hold what the terminal cannot show
    sys.exit(run(sys.argv[1:]))
