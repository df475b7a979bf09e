"""The series of experiments that settles a diagnosis, started from the page and shared by all tabs: at most one at a time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xy_sysid.errors import BadInput

if TYPE_CHECKING:
    from xy_sysid.nodes.settle import Settler
    from xy_sysid.page.live import Live

JOIN = 3.0  # s for the walk to end when the page closes


class Settling:
    """Call start, then go; ``steps`` and ``doing`` report progress."""

    def __init__(self, folder: Path, namespace: str, say: Callable[[str, bool], None], effect_files: tuple[str, ...] = ()) -> None:
        """folder: of recordings; say: receives a sentence for every page, and whether it is good news; effect_files: the user's own effects."""
        self._folder, self._namespace, self._say, self._effect_files = folder, namespace, say, effect_files
        self._thread: threading.Thread | None = None
        self._settler: Settler | None = None
        self._ended, self._go = threading.Event(), threading.Event()
        self.axis, self.folder, self.wished = "", folder, ""  # wished: axis for which experiments start automatically
        self.first = False  # True if its card is placed above the story
        self.sets: tuple[tuple[str, ...], ...] = ()  # sets of effects to distinguish; empty: those that the diagnosis leaves possible

    @property
    def running(self) -> bool:
        """True while a walk is in progress."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def going(self) -> bool:
        """True if it continues without confirmation."""
        return self._go.is_set()

    @property
    def waits(self) -> bool:
        """True if an experiment is designed and a user must confirm the run."""
        return self.running and not self.going and bool(self.steps) and not self.steps[-1]["ending"]

    @property
    def steps(self) -> tuple[dict[str, Any], ...]:
        """Documents of the steps so far."""
        return self._settler.steps if self._settler is not None else ()

    @property
    def doing(self) -> str:
        """The current activity in words."""
        return self._settler.doing if self._settler is not None and self.running else ""

    @property
    def part(self) -> float:
        """Fraction of the design that is done."""
        return self._settler.part if self._settler is not None else 0.0

    @property
    def problem(self) -> str:
        """The error, or that it was stopped; empty if there is no problem."""
        if self._settler is None or self.running:
            return ""
        return self._settler.outcome if self._settler.problem or self._settler.ending == "stopped" else ""

    def start(self, axis: str, alone: bool = False) -> None:
        """Record, and design the first experiment; alone: drive and continue automatically. Raises BadInput while a walk is under way."""
        from xy_sysid.nodes.settle import Settler, Wishes

        if self.running:
            raise BadInput("experiment", f"axis {self.axis} is being settled", "one axis at a time", "Wait, or end it first.")
        self._ended.clear()
        self._go.clear()
        if alone:
            self._go.set()
        self.axis, self.folder = axis, self._folder / f"settle_{axis}_{time.strftime('%Y-%m-%d_%H-%M-%S')}"
        wishes = Wishes(axis, self.folder, sets=self.sets, alone=alone, effect_files=self._effect_files)
        settler = Settler(wishes, lambda words: None, self._ended.is_set, self._go.is_set, self._namespace)

        def walk() -> None:
            try:
                settler.run()
            finally:
                settler.close()
            self._say(f"axis {axis}: {settler.outcome}", settler.ending in ("settled", "alike"))

        self._settler = settler
        self._thread = threading.Thread(target=walk, name="settle", daemon=True)
        self._thread.start()

    def attend(self, live: Live | None) -> None:
        """Start once the wished axis is driven and has a rigid model; at the end request ``auto`` for its story."""
        if live is None or not self.wished:
            return
        if not self.steps and not self.running and live.heard.driving() and live.document(self.wished) is not None:
            self.start(self.wished, alone=True)
        elif self.steps and not self.running:
            axis, self.wished = self.wished, ""
            live.ask("auto", axis)

    def go(self) -> None:
        """Run the designed experiment, and continue until the diagnosis is settled."""
        self._go.set()

    def end(self) -> None:
        """Stop the machine and the walk."""
        self._ended.set()

    def close(self) -> None:
        """End the walk because the page closes."""
        self.end()
        if self._thread is not None:
            self._thread.join(JOIN)
