"""The man page docs/xy-sysid.1, made from the commands: python -m campaigns.documents.man --write; read it with man ./docs/xy-sysid.1"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from typer.main import get_command

from xy_sysid.cli.app import app

PAGE = Path(__file__).parents[2] / "docs" / "xy-sysid.1"
EXIT = {
    "0": "The command gave its answer.",
    "1": "A check failed, for example a model that does not predict the recording; or a node has died.",
    "2": "Wrong use or invalid input. One line on standard error says what to change.",
    "130": "Ended by Ctrl-C.",
    "143": "Ended by SIGTERM.",
}


def plain(text: str) -> str:
    """Text for troff: escaped backslashes and hyphens, and no line that begins like a request."""
    text = " ".join(text.split()).replace("\\", "\\e").replace("-", "\\-")
    return f"\\&{text}" if text.startswith((".", "'")) else text


def document() -> str:
    """The page in the macros of man(7)."""
    return "\n".join(line for line in _lines() if line) + "\n"


def _lines() -> Iterator[str]:
    program: Any = get_command(app)
    yield '.TH XY\\-SYSID 1 "" "xy_sysid" "User Commands"'
    yield from (".SH NAME", f"xy\\-sysid \\- {plain('identify machine axes and name missing physical effects')}")
    yield from (".SH SYNOPSIS", ".B xy\\-sysid", "\\fICOMMAND\\fR [\\fIOPTIONS\\fR] [\\fIARGUMENTS\\fR]", ".SH DESCRIPTION", plain(program.help))
    yield ".SH COMMANDS"
    for name, command in program.commands.items():
        yield from (f".SS {plain(name)}", plain(command.help or ""))
        for one in [item for item in command.params if not getattr(item, "hidden", False)]:
            option = str(one.opts[0]).startswith("-")
            words = ", ".join(f"\\fB{plain(word)}\\fR" for word in (*one.opts, *one.secondary_opts)) if option else ""
            value = f"\\fI{plain(one.metavar or one.name.upper().rstrip('_'))}\\fR" if not getattr(one, "is_flag", False) else ""
            yield from (".TP", " ".join(part for part in (words, value) if part), plain(one.help or ""))
    yield ".SH EXIT STATUS"
    for code, meaning in EXIT.items():
        yield from (".TP", code, plain(meaning))


if __name__ == "__main__":
    if sys.argv[1:] == ["--write"]:
        PAGE.write_text(document(), encoding="utf-8")
    else:
        sys.stdout.write(document())
