"""Records a bag from the page: runs ``xy-sysid record`` as a separate process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from xy_sysid.page.facts import seconds_text
from xy_sysid.processes.starter import FOLLOW

ORDERLY = 8.0  # s that the recorder may take to finish the bag


class Recorder:
    """At most one recording at a time."""

    def __init__(self) -> None:
        self.path: Path | None = None
        self.last: Path | None = None
        self._process: subprocess.Popen[str] | None = None
        self._begun = 0.0

    @property
    def running(self) -> bool:
        """True while it records."""
        return self._process is not None and self._process.poll() is None

    def start(self, path: Path, namespace: str) -> None:
        """Start a new bag at this path."""
        command = [sys.executable, "-m", "xy_sysid", "record", str(path), "--namespace", namespace]
        if sys.platform == "linux":
            command = [sys.executable, "-S", "-c", FOLLOW, str(os.getpid()), *command]
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
        )
        self.path, self._begun = path, time.monotonic()

    def stop(self) -> str:
        """Finish the bag and return the result. Waits for the recorder: call it outside the page's loop."""
        process = self._process
        if process is None or self.path is None:
            return "nothing is being recorded"
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            _, said = process.communicate(timeout=ORDERLY)
        except subprocess.TimeoutExpired:
            process.kill()
            _, said = process.communicate()
        self._process = None
        if process.returncode == 0 and self.path.is_dir():
            self.last = self.path
            return f"recorded {self.path.name}, {seconds_text(time.monotonic() - self._begun)}"
        lines = [line for line in said.splitlines() if line.strip()]
        return f"{self.path.name} was not recorded: {lines[-1] if lines else f'exit code {process.returncode}'}"

    def words(self) -> str:
        """The current state in words."""
        if self.running and self.path is not None:
            return f"recording {self.path.name}, {seconds_text(time.monotonic() - self._begun)}"
        if self._process is not None and self.path is not None:
            return f"recording {self.path.name} ended by itself"
        return ""
