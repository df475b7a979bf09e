"""Ctrl-C and SIGTERM always end a command: a lost interrupt is raised again.

Python raises KeyboardInterrupt in the code that runs at that moment. In an internal callback (of a weak reference, during an import)
it is printed and ignored, and the command would continue.
"""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType, TracebackType

AGAIN = 0.2  # s between repetitions of an interrupt that is not being handled


class Interrupts:
    """Context in which SIGINT and SIGTERM raise KeyboardInterrupt, again and again until it ends.

    came: True after an interrupt; terminated: True after a SIGTERM; code: the exit code, once it is known
    """

    def __init__(self) -> None:
        self.terminated, self.came = False, False
        self.code: int | None = None

    def __enter__(self) -> None:
        self._hook = sys.unraisablehook
        sys.unraisablehook = self._forgotten
        signal.signal(signal.SIGALRM, self._again)
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # otherwise the shell has requested to ignore it
            signal.signal(signal.SIGINT, self._first)
        if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            signal.signal(signal.SIGTERM, self._first)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        sys.unraisablehook = self._hook

    def leave(self) -> None:
        """End the process with the exit code; called after all output and all other exit handlers.

        A normal exit would take a third of a second to free the memory of numba and scipy. And after an interrupt within an
        ``exec`` (every dataclass uses one), ``python -m`` would end by SIGINT although the interrupt was caught.
        """
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_IGN)
        if self.code is not None:
            os._exit(self.code)

    def _first(self, number: int, frame: FrameType | None) -> None:
        self.came = True
        self.terminated = self.terminated or number == signal.SIGTERM
        signal.setitimer(signal.ITIMER_REAL, AGAIN, AGAIN)
        raise KeyboardInterrupt

    def _again(self, number: int, frame: FrameType | None) -> None:
        """Raise the interrupt again, unless one is being handled: partial files are then removed without interruption."""
        error = sys.exc_info()[1]
        while error is not None:
            if isinstance(error, KeyboardInterrupt):
                return
            error = error.__context__
        raise KeyboardInterrupt

    def _forgotten(self, lost: sys.UnraisableHookArgs) -> None:
        """Print no traceback for an interrupt, which is raised again."""
        if not issubclass(lost.exc_type, KeyboardInterrupt):
            self._hook(lost)
