"""One more process that works while this one does, as Python lets one thread at a time calculate.

It is begun early and imports what it needs meanwhile. Should it die, as of an error, its work is done here: answer and error are the same.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any

from xy_sysid.processes.deaf import deaf


class Helper:
    """``begin`` a function of a module with its arguments and get what waits for its result; on a computer with one core it is made then."""

    def __init__(self, module: str) -> None:
        """module: what the process imports at once."""
        self._ended = False
        self._asks: ThreadPoolExecutor | None = None
        if os.environ.get("NUMBA_NUM_THREADS") == "1" or os.cpu_count() == 1:
            return
        self._pipe, there = multiprocessing.Pipe()
        self._process = multiprocessing.get_context("spawn").Process(target=serve, args=(there, module), name="helper", daemon=True)
        with deaf():
            self._process.start()
            there.close()
            self._asks = ThreadPoolExecutor(1, thread_name_prefix="helper")

    def __enter__(self) -> Helper:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._ended = True
        if self._asks is not None:
            self._process.terminate()
            self._asks.shutdown(cancel_futures=True)

    def begin(self, function: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
        """One after the other, in the order of the calls; the result raises what the function raises."""
        if self._asks is None:
            return lambda: function(*arguments)
        return self._asks.submit(self._ask, function, arguments).result

    def _ask(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        try:
            self._pipe.send((function, arguments))
            return self._pipe.recv()
        except (EOFError, OSError):
            if self._ended:
                raise
            return function(*arguments)


def serve(pipe: Connection, module: str) -> None:
    """What the process does: work in, results out, until its parent process has ended."""
    threading.Thread(target=importlib.import_module, args=(module,), daemon=True).start()
    try:
        while True:
            function, arguments = pipe.recv()
            pipe.send(function(*arguments))
    except (EOFError, OSError):
        return
