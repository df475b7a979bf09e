"""A thread that fits while another receives data: requests in, updates out, in order.

The core uses no threads; this one belongs to the adapters.
"""

from __future__ import annotations

import queue
import threading

from xy_sysid.live.fitter import LiveFitter, Update
from xy_sysid.live.identifier import FitRequest

MOST_WAITING = 64  # most waiting requests; above, the oldest is dropped and counted (results are then no longer bit-for-bit reproducible)


class FitWorker:
    """Runs a LiveFitter in parallel with the data path."""

    def __init__(self, fitter: LiveFitter) -> None:
        self.skipped = 0
        self.failure: BaseException | None = None
        self._fitter = fitter
        self._requests: queue.Queue[FitRequest | None] = queue.Queue()
        self._updates: queue.Queue[Update] = queue.Queue()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="fit", daemon=True)
        self._thread.start()

    def ask(self, request: FitRequest) -> None:
        """Queue a request."""
        while self._requests.qsize() >= MOST_WAITING:
            try:
                self._requests.get_nowait()
                self.skipped += 1
            except queue.Empty:
                break
        self._requests.put(request)

    def done(self) -> list[Update]:
        """Finished updates, in order; raises the error that stopped the thread, if any."""
        if self.failure is not None:
            raise self.failure
        found: list[Update] = []
        while True:
            try:
                found.append(self._updates.get_nowait())
            except queue.Empty:
                return found

    def change(self, fitter: LiveFitter) -> None:
        """Continue with another fitter, after the current request."""
        with self._lock:
            self._fitter = fitter

    @property
    def fitter(self) -> LiveFitter:
        """The fitter in use."""
        return self._fitter

    def close(self, timeout: float = 5.0) -> list[Update]:
        """Finish waiting requests and end the thread; returns the remaining updates."""
        self._requests.put(None)
        self._thread.join(timeout)
        return self.done()

    def _run(self) -> None:
        try:
            while (request := self._requests.get()) is not None:
                with self._lock:
                    self._updates.put(self._fitter.fit(request))
        except BaseException as problem:
            self.failure = problem
            raise
