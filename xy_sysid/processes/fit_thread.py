"""One thread that fits while another hears data: requests go in, updates come out, in order.

The core knows no threads; this is the adapters' own.
"""

from __future__ import annotations

import queue
import threading

from xy_sysid.live.fitter import LiveFitter, Update
from xy_sysid.live.identifier import FitRequest

MOST_WAITING = 64  # requests that may wait; beyond, the oldest is given up and counted (the bit-for-bit promise then ends)


class FitWorker:
    """Runs a LiveFitter beside the data path."""

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
        """Updates that are ready, in order; raises what stopped the thread, if something did."""
        if self.failure is not None:
            raise self.failure
        found: list[Update] = []
        while True:
            try:
                found.append(self._updates.get_nowait())
            except queue.Empty:
                return found

    def change(self, fitter: LiveFitter) -> None:
        """Go on with another fitter, after the request under way."""
        with self._lock:
            self._fitter = fitter

    @property
    def fitter(self) -> LiveFitter:
        """The fitter in use."""
        return self._fitter

    def close(self, timeout: float = 5.0) -> list[Update]:
        """Finish what waits and end the thread; the updates that were still to come."""
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
