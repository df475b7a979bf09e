"""State that all open pages share: the machine, the recordings, the messages. One session per server."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xy_sysid.errors import BadInput, XySysidError
from xy_sysid.page.address import PageView
from xy_sysid.page.orders import Reading, Source, read_so
from xy_sysid.page.recorder import Recorder
from xy_sysid.page.recordings import OpenRecording
from xy_sysid.page.settling import Settling
from xy_sysid.page.shelf import Shelf
from xy_sysid.page.topics_state import TopicsState

if TYPE_CHECKING:
    from xy_sysid.page.link import Link
    from xy_sysid.page.live import Live

MOST_OPEN = 6  # recordings at a time
MESSAGES = 50
ONCE = 3.0  # s in which the same text is shown only once
DRAWN = 200  # cached figures, so that a second page does not redraw them


@dataclass(frozen=True, slots=True)
class Message:
    """One message, with the time of day; at: s on the clock of this process."""

    number: int
    clock: str
    at: float
    words: str
    good: bool


class Session:
    """The server's state. Methods may be called from any thread."""

    def __init__(self, shelf: Shelf, live: bool, namespace: str = "/xy", reading: Reading | None = None) -> None:
        self.shelf, self.namespace, self.reading = shelf, namespace, reading or Reading()
        self.heard = TopicsState()
        self.recordings: list[OpenRecording] = []
        self.recorder = Recorder()
        self.messages: deque[Message] = deque(maxlen=MESSAGES)
        self.stopping = False
        self._opening = threading.Lock()
        self._count = 0
        self._figures: dict[tuple[object, ...], dict[str, Any]] = {}
        self.link: Link | None = None
        self.live: Live | None = None
        self.settling: Settling | None = Settling(shelf.folder, namespace, self.say, tuple(map(str, self.reading.effect_files))) if live else None
        if live:  # only the live machine needs ROS 2
            from xy_sysid.page.link import Link
            from xy_sysid.page.live import Live

            self.link = Link(self.heard, namespace, self.say)
            self.live = Live(self.heard, self.link, self.say)

    def sources(self) -> list[Source]:
        """The machine first, then the recordings."""
        return [*([self.live] if self.live else []), *self.recordings]

    def say(self, words: str, good: bool = False) -> None:
        """Show a message on every page. The same text within ONCE seconds is dropped, for example after the button and the key of one STOP."""
        now = time.monotonic()
        if any(message.words == words and now - message.at < ONCE for message in list(self.messages)):
            return
        self._count += 1
        self.messages.append(Message(number=self._count, clock=time.strftime("%H:%M:%S"), at=now, words=words, good=good))

    def open(self, path: Path, title: str = "", reading: Reading | None = None) -> OpenRecording:
        """Open one more recording. reading: how it is read, if not by the session's default."""
        if len(self.recordings) >= MOST_OPEN:
            raise BadInput("recordings", f"{MOST_OPEN} already", f"at most {MOST_OPEN}", "Close one first.")
        made = OpenRecording(path, title, self.say, reading or self.reading)
        self.recordings.append(made)
        return made

    def name_of(self, one: OpenRecording) -> str:
        """The name of an open recording in an address: its name on the shelf, or its title if it is from elsewhere."""
        path = one.path.resolve()
        return str(path.relative_to(self.shelf.folder)) if path.is_relative_to(self.shelf.folder) else one.title

    def own_words(self, one: OpenRecording) -> tuple[str, ...]:
        """Reading options of an open recording beyond the session's default."""
        return one.how.words[len(self.reading.words) :]

    def open_view(self, view: PageView) -> None:
        """Open the recordings of a view that are not open yet; every page shows an error for one that cannot be opened."""
        with self._opening:
            for wanted in view.sources:
                there = {(self.name_of(one), self.own_words(one)) for one in self.recordings}
                if not wanted.name or (wanted.name, wanted.words) in there:
                    continue
                try:
                    path, reading = self.shelf.find(wanted.name), read_so(self.reading, wanted.words)
                    self.shelf.beside(path, reading.load.get("columns", {}) if wanted.words else {})
                    self.open(path, wanted.name, reading)
                except XySysidError as problem:
                    self.say(str(problem))

    def close_recording(self, key: str) -> None:
        """Close one recording."""
        for one in [one for one in self.recordings if one.key == key]:
            self.recordings.remove(one)
            one.close()

    def stop(self, patience: float = 0.0) -> tuple[bool, str]:
        """Command zero volts. Returns whether the machine has confirmed it within ``patience`` seconds, and a sentence."""
        if self.link is None:
            return False, "this page drives no machine"
        self.stopping = True
        if self.settling is not None:
            self.settling.end()
        answered = threading.Event()
        answer = [(False, "not confirmed yet: look at the machine, and use its emergency stop")]

        def told(done: bool, words: str) -> None:
            self.stopping = False
            answer[0] = done, words
            answered.set()
            self.say(words, done)

        self.link.stop(told)
        answered.wait(patience)
        return answer[0]

    def figure(self, key: tuple[object, ...], make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
        """The figure with this key, drawn once for all pages."""
        found = self._figures.get(key)
        if found is None:
            found = self._figures[key] = make()
            while len(self._figures) > DRAWN:
                self._figures.pop(next(iter(list(self._figures))), None)
        return found

    def close(self) -> None:
        """End all processes and threads that the session started."""
        if self.recorder.running:
            self.recorder.stop()
        for one in self.recordings:
            one.close()
        if self.settling is not None:
            self.settling.close()
        if self.link is not None:
            self.link.close()
