"""Wrapper of every callback: an error is reported once, and the node continues with the next message.

Each callback is wrapped and not the executor, because after an error in a callback rclpy's EventsExecutor drops the waiting
messages (7.1.6).
"""

from __future__ import annotations

import functools
import traceback
from collections.abc import Callable
from types import TracebackType
from typing import Any

from xy_sysid.processes.terminal import printable

LONGEST = 200  # most characters of an error in a report


class Wall:
    """``with wall: ...`` catches errors and reports them. count: errors so far; told: the last one, empty if there was none."""

    def __init__(self, say: Callable[[str], None], what: str = "a message or request could not be handled") -> None:
        """say: called with the sentence, once for repeated equal errors; what: its first words."""
        self.count, self.told = 0, ""
        self._say, self._what = say, what

    def __enter__(self) -> Wall:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> bool:
        if not isinstance(error, Exception):
            return False
        self.count += 1
        words = f"{self._what} ({words_of(error)})"
        if words != self.told:
            self.told = words
            self._say(words)
        return True

    def around(self, callback: Callable[..., Any]) -> Callable[..., Any]:
        """The wrapped callback; after an error it returns its last argument, which for a service is the response."""

        @functools.wraps(callback)
        def walled(*arguments: Any) -> Any:
            with self:
                return callback(*arguments)
            return arguments[-1] if arguments else None

        return walled


def words_of(error: BaseException) -> str:
    """Kind, text and place of an error in one short line."""
    text = printable(" ".join(str(error).split())[:LONGEST])
    frames = traceback.extract_tb(error.__traceback__)
    place = f", {frames[-1].name} line {frames[-1].lineno}" if frames else ""
    return f"{type(error).__name__}{': ' if text else ''}{text}{place}"
