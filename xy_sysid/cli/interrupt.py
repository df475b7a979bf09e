"""Ctrl-C and SIGTERM always end a command: an interrupt that was swallowed is raised again.

Python raises KeyboardInterrupt wherever it is at that moment. In a callback of its own (of a weak reference, in the middle of an import)
it is printed and ignored, and the command would continue.
"""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType, TracebackType

AGAIN = 0.2  # s from an interrupt to the next, as long as it is not on its way through the program


class Interrupts:
    """Within it, SIGINT and SIGTERM raise KeyboardInterrupt until it is left.

    came: one did; terminated: a SIGTERM was one of them; code: the exit code, once it is known
    """

    def __init__(self) -> None:
        self.terminated, self.came = False, False
        self.code: int | None = None

    def __enter__(self) -> None:
        self._hook = sys.unraisablehook
        sys.unraisablehook = self._forgotten
        signal.signal(signal.SIGALRM, self._again)
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else the shell wants it ignored
            signal.signal(signal.SIGINT, self._first)
        if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            signal.signal(signal.SIGTERM, self._first)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        sys.unraisablehook = self._hook

    def leave(self) -> None:
        """All is done and said, and others' last acts are behind: end, with nothing more to be interrupted.

        To free piece by piece what numba and scipy hold would take a third of a second; and an interrupt that came in the middle of an
        ``exec`` (every dataclass is made by one) would make ``python -m`` end by SIGINT, whatever the exit code and whoever caught it.
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
        """What is half written may be cleared away in peace: while an interrupt is being handled, there is no other."""
        error = sys.exc_info()[1]
        while error is not None:
            if isinstance(error, KeyboardInterrupt):
                return
            error = error.__context__
        raise KeyboardInterrupt

    def _forgotten(self, lost: sys.UnraisableHookArgs) -> None:
        """No traceback for an interrupt that comes again."""
        if not issubclass(lost.exc_type, KeyboardInterrupt):
            self._hook(lost)
