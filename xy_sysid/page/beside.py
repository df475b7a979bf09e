"""Work outside the page's event loop. An error becomes a sentence on the page, and its traceback goes to the log."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Awaitable, Callable, Sequence
from typing import Any, TypeVar

from nicegui import run, ui

from xy_sysid.errors import BadInput, XySysidError
from xy_sysid.page.session import Session
from xy_sysid.processes.terminal import printable
from xy_sysid.story.attempt import BROKEN, Attempt

Made = TypeVar("Made")


async def beside(session: Session, work: Callable[[], Awaitable[Made | Exception]]) -> Made | None:
    """The result of the work; None if it fails. The failure, raised or returned, is shown on every page."""
    try:
        with Attempt(BROKEN) as attempt:
            made = await work()
            if isinstance(made, Exception):
                raise made
            return made
        problem = attempt.problem
    except OSError as error:
        problem = f"{f'{error.filename}: ' if error.filename else ''}{error.strerror or BROKEN}"
    if attempt.detail:
        sys.stderr.write(printable(attempt.detail) + "\n")
    session.say(problem)
    return None


async def waited(session: Session, words: str, work: Callable[..., Any], *arguments: object) -> Any:
    """As ``beside``, the result of the work in a thread; the page shows these words until it ends."""
    waiting = ui.notification(words, spinner=True, timeout=None)
    try:
        return await beside(session, lambda: run.io_bound(work, *arguments))
    finally:
        waiting.dismiss()


class OneCommand:
    """Runs the commands of a card, one at a time."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.running = False

    async def run(self, command: str, work: Callable[..., Any], *arguments: object) -> Any:
        """As ``waited``; None also while another command runs."""
        if self.running:
            return None
        self.running = True
        try:
            return await waited(self._session, f"xy-sysid {command} is running ...", work, *arguments)
        finally:
            self.running = False


def returned(work: Callable[..., Made], *arguments: object) -> Made | XySysidError | OSError:
    """The result or the error of a call. For another process: of an error that is raised there, NiceGUI hands on only the text."""
    try:
        return work(*arguments)
    except (XySysidError, OSError) as error:
        return error


def asked(arguments: Sequence[str], what: tuple[str, str, str]) -> str:
    """The output of a command of this program. what: name, value and allowed range, for the error. Raises BadInput with the command's error."""
    command = [sys.executable, "-m", "xy_sysid", *arguments]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return done.stdout
    lines = [line for line in done.stderr.splitlines() if line.strip()]
    refused = bool(lines) and lines[-1].startswith("xy-sysid: ")
    if not refused:
        sys.stderr.write(printable(done.stderr))
    raise BadInput(*what, lines[-1] if refused else BROKEN)
