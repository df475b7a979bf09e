"""The sequence of a live diagnosis: requests come in, jobs go out one at a time, stories come back. No thread, no clock, no IO.

A story keeps the samples that it started with, so that its errors are comparable; ``diagnose`` and ``renew`` start again. Each axis
can be requested separately: work for one axis does not affect the others.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

from xy_sysid.axis.model import Library
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import Block
from xy_sysid.samples.newest import Newest
from xy_sysid.samples.pairing import Quantity
from xy_sysid.samples.recording import Run
from xy_sysid.settings import DiagnoserSettings
from xy_sysid.story.acts import ANEW, Act, Job, perform, sentence, unheard
from xy_sysid.story.story import Story

WAITS = "waits"  # state of an axis whose request has not started
BEGINS: dict[Act, str] = {
    "begin": "fitting the rigid model",
    "diagnose": "fitting the rigid model",
    "renew": "fitting the rigid model",
    "effects": "changing the effects",
    "add_next": "searching for the next effect",
    "auto": "searching for the next effect",
}


@dataclass(frozen=True, slots=True)
class Reply:
    """The result of a request: its number, whether it succeeded, and a sentence for each axis."""

    request: int
    done: bool
    text: str


@dataclass(slots=True)
class _Request:
    number: int
    act: Act
    axes: deque[str]
    whole: tuple[str, ...]  # all requested axes; empty after a reset of the received data
    told: list[str] = field(default_factory=list)
    done: bool = True


class Diagnoser:
    """Call ask(..), then start() -> Job; progress(..) and finish(..) with the worker's reports; answers() for replies."""

    def __init__(self, settings: DiagnoserSettings, axes: tuple[str, ...]) -> None:
        self.axes = axes
        self.stories: dict[str, Story] = {}
        self.effects: dict[str, tuple[str, ...]] = {axis: settings.chosen(axis) for axis in axes}
        self.doing = ""
        self._settings = settings
        self._queue: deque[_Request] = deque()
        self._answers: list[Reply] = []
        self._data: dict[str, Run] = {}
        self._ends: dict[str, tuple[Newest, float]] = {}  # for each axis the received data, and their end in s when its samples were taken
        self.under_way = ""  # the axis of the current job
        self._number = 0
        self.reset()

    def reset(self) -> None:
        """Delete received data; keep the stories."""
        for request in self._queue:
            request.whole = ()
        self.hearing = Newest(self.axes, self._settings.memory, self._settings.minimum, self._settings.reorder)
        self._next_time = self._settings.interval

    def change(self, settings: DiagnoserSettings) -> None:
        """Use other settings from now on; changed memory settings delete the received data."""
        before, self._settings = self._settings, settings
        if (before.memory, before.minimum, before.reorder) != (settings.memory, settings.minimum, settings.reorder):
            self.reset()

    @property
    def busy(self) -> bool:
        """True if a job runs or waits."""
        return bool(self._queue)

    def feed(self, kind: Quantity, block: Block) -> None:
        """Read one block of one stream; request a diagnosis if the interval is over."""
        self.hearing.feed(kind, block)
        interval, rate = self._settings.interval, self.hearing.sampling_rate
        if interval > 0.0 and rate and self.hearing.total >= self._next_time * rate:
            self._next_time = self.hearing.total / rate + interval
            if not self._queue and not self.hearing.lacking():
                self.ask("diagnose")

    def ask(self, act: Act, axes: Iterable[str] | None = None) -> int:
        """Queue a request for all or some axes; returns its number. An equal request that waits, or a diagnosis that runs, is joined instead:
        a request that is repeated because its answer was lost runs only once."""
        chosen = self.axes if axes is None else tuple(axes)
        for place, known in enumerate(self._queue):
            if known.act == act and known.whole == chosen and (place > 0 or act in ANEW):
                return known.number
        self._number += 1
        self._queue.append(_Request(number=self._number, act=act, axes=deque(chosen), whole=chosen))
        return self._number

    def have(self, axis: str, effects: tuple[str, ...]) -> None:
        """The model of an axis shall have these effects; it is fitted as soon as there are data."""
        self.effects[axis] = effects
        story = self.stories.get(axis)
        if (story.effects if story is not None else ()) != effects or self.under_way == axis:
            self.ask("effects", [axis])

    def reset_model(self, axes: Iterable[str] | None = None) -> None:
        """Return to the rigid model without a new fit; keep the diagnosis. Raises BadInput while there is a job for one of these axes."""
        chosen = self.axes if axes is None else tuple(axes)
        busy = [axis for axis in chosen if axis in self.doings()]
        if busy:
            raise BadInput("reset_model", f"while axis {busy[0]} is worked for", "an axis without running work", "Call cancel first.")
        for axis in chosen:
            if axis in self.stories:
                self.stories[axis] = self.stories[axis].only_base()
            self.effects[axis] = ()

    def doings(self) -> dict[str, str]:
        """The current activity for each axis with a running or waiting job."""
        found = {axis: WAITS for request in self._queue for axis in request.axes}
        if self.under_way:
            found[self.under_way] = self.doing.partition(": ")[2]
        return found

    def used(self, axis: str) -> tuple[float, float] | None:
        """(from, to), s since the first received sample, of the data in the axis's story; None if they are from before a reset."""
        hearing, end = self._ends.get(axis, (None, 0.0))
        if hearing is not self.hearing or axis not in self._data:
            return None
        return max(end - self._data[axis].seconds, 0.0), end

    def _heard(self) -> float:
        """s of samples since the first received one."""
        return self.hearing.total / self.hearing.sampling_rate if self.hearing.sampling_rate else 0.0

    def start(self) -> Job | None:
        """The next job, once the previous one is finished; None without one."""
        while self._queue and not self.under_way:
            request = self._queue[0]
            if not request.axes:
                self._answers.append(Reply(request.number, request.done, " ".join(request.told)))
                self._queue.popleft()
                continue
            axis = request.axes.popleft()
            story = self.stories.get(axis)
            if request.act in ANEW or axis not in self._data or story is None or not story.rungs:
                lacking, story = self.hearing.lacking(), None
                if lacking:
                    self._lacks(request, axis, lacking)
                    continue
                heard, column = self.hearing.newest(), self.axes.index(axis)
                self._ends[axis] = self.hearing, self._heard()
                self._data[axis] = Run(
                    axis=axis,
                    sampling_rate=heard.sampling_rate,
                    voltage=heard.voltage[:, column].copy(),
                    position=heard.position[:, column].copy(),
                    input_unit=self._settings.units.input,
                    output_unit=self._settings.units.output,
                )
            self.under_way, self.doing = axis, f"axis {axis}: {BEGINS[request.act]}"
            return Job(
                act=request.act,
                run=self._data[axis],
                story=story,
                effects=self.effects[axis],
                tolerance=self._settings.tolerance,
            )
        return None

    def progress(self, doing: str, story: Story | None) -> None:
        """Read a progress report of the worker."""
        self.doing = f"axis {self.under_way}: {doing}"
        if story is not None:
            self.stories[self.under_way] = story

    def finish(self, problem: str = "") -> None:
        """The current job has ended; ``problem`` if it failed."""
        axis, request = self.under_way, self._queue[0]
        self.under_way, self.doing = "", ""
        story = self.stories.get(axis)
        if not any(waiting.act == "effects" and axis in waiting.axes for waiting in self._queue):
            self.effects[axis] = story.effects if story is not None else ()
        if problem or story is None:
            request.done = False
            request.told.append(f"axis {axis}: {problem}")
        else:
            request.done &= bool(story.rungs)
            request.told.append(sentence(story))

    def cancel(self, axes: Iterable[str] | None = None) -> str:
        """Cancel running and waiting jobs of all or some axes; returns what was cancelled, in words."""
        chosen = self.axes if axes is None else tuple(axes)
        doing = self.doings()
        given_up = [f"axis {axis}: {doing[axis]}" for axis in chosen if axis in doing]
        running = self.under_way in chosen
        if running:
            self.under_way, self.doing = "", ""
        for place, request in enumerate(list(self._queue)):
            kept = deque(axis for axis in request.axes if axis not in chosen)
            if len(kept) < len(request.axes) or (running and place == 0):
                request.axes, request.done, request.whole = kept, False, ()
                if not kept and not (place == 0 and self.under_way):
                    self._answers.append(Reply(request.number, False, "cancelled"))
                    self._queue.remove(request)
        for axis, story in self.stories.items():
            if axis in chosen:
                self.effects[axis] = story.effects
        return f"cancelled {given_up[0]}" if given_up else "nothing was running"

    def answers(self) -> list[Reply]:
        """Replies to the requests that have ended since the last call."""
        found, self._answers = self._answers, []
        return found

    def _lacks(self, request: _Request, axis: str, lacking: str) -> None:
        rate = self.hearing.sampling_rate or 0.0
        told = unheard(axis, rate, self.hearing.seconds, lacking, self._settings.tolerance, self._settings.units)
        if axis not in self.stories or not self.stories[axis].rungs:
            self.stories[axis] = told
        request.done = False
        request.told.append(sentence(told))


def all_at_once(diagnoser: Diagnoser, library: Library) -> dict[str, Story]:
    """Each axis's story from the received data, with every effect that helps: the service ``auto`` without a worker."""
    diagnoser.ask("auto")
    while (job := diagnoser.start()) is not None:
        for doing, story in perform(job, library):
            diagnoser.progress(doing, story)
        diagnoser.finish()
    return dict(diagnoser.stories)
