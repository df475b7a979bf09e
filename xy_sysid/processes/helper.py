"""A process that works in parallel with this one, because only one Python thread calculates at a time.

It starts early and does its imports meanwhile. If it dies, for example of an error, its work is done here, with the same result or error.
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
    """``begin`` starts a function and returns a function that waits for its result; with a single core, that call does the work."""

    def __init__(self, module: str) -> None:
        """module: imported by the process at its start."""
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
        """Start a call; calls run one after the other. The returned function gives the result, or raises the call's error."""
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
    """Main loop of the process: work in, results out, until its parent process has ended."""
    threading.Thread(target=importlib.import_module, args=(module,), daemon=True).start()
    try:
        while True:
            function, arguments = pipe.recv()
            pipe.send(function(*arguments))
    except (EOFError, OSError):
        return
