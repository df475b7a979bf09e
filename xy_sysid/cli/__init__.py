"""The command line: ``xy-sysid COMMAND``."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # results repeat bit for bit with one thread, and small matrices gain nothing from two

INTERRUPTED, WRONG = 130, 2


def run(arguments: Sequence[str]) -> int:
    """Run one command; 0 is an answer, 2 wrong use or bad input, 130 Ctrl-C."""
    import typer
    from typer.exceptions import TyperException

    from xy_sysid.cli.app import app
    from xy_sysid.errors import XySysidError

    try:
        code = app(list(arguments), prog_name="xy-sysid", standalone_mode=False)
        return int(code) if isinstance(code, int) else 0
    except XySysidError as problem:
        return _refuse(str(problem))
    except (KeyboardInterrupt, typer.Abort):
        sys.stderr.write("xy-sysid: stopped.\n")
        return INTERRUPTED
    except typer.Exit as end:
        return int(end.exit_code)
    except TyperException as problem:
        text = problem.format_message() if hasattr(problem, "format_message") else str(problem)
        return _refuse(f"{text.rstrip('.')}. See xy-sysid {' '.join(arguments[:1])} --help.".replace("  ", " "))
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # the reader went away: nothing more to say to it
        return 0


def _refuse(text: str) -> int:
    sys.stderr.write(f"xy-sysid: {' '.join(text.split())}\n")
    return WRONG


def main() -> None:
    """Entry point of the console script."""
    sys.exit(run(sys.argv[1:]))
