"""What a live diagnosis does when: requests come in, jobs go out one at a time, stories come back. No thread, no clock, no IO.

A story stays with the samples it began with, so that its ladder compares like with like; ``diagnose`` begins anew.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from xy_sysid.axis.model import Library
from xy_sysid.samples.block import Block
from xy_sysid.samples.newest import Newest
from xy_sysid.samples.pairing import Quantity
from xy_sysid.samples.recording import Run
from xy_sysid.settings import DiagnoserSettings
from xy_sysid.story.acts import Act, Job, perform, sentence, unheard
from xy_sysid.story.story import Story


@dataclass(frozen=True, slots=True)
class Answer:
    """What became of a request: its number, whether it was done, and a sentence for each axis."""

    request: int
    done: bool
    text: str


@dataclass(slots=True)
class _Request:
    number: int
    act: Act
    axes: deque[str]
    whole: tuple[str, ...]  # all axes that were asked for; none after what was heard has been forgotten
    told: list[str] = field(default_factory=list)
    done: bool = True


class Diagnoser:
    """ask(..) and start() -> Job; progress(..) and finish(..) with what the worker says; answers()."""

    def __init__(self, settings: DiagnoserSettings, axes: tuple[str, ...]) -> None:
        self.axes = axes
        self.stories: dict[str, Story] = {}
        self.effects: dict[str, tuple[str, ...]] = {axis: settings.chosen(axis) for axis in axes}
        self.doing = ""
        self._settings = settings
        self._queue: deque[_Request] = deque()
        self._answers: list[Answer] = []
        self._data: dict[str, Run] = {}
        self._under_way = ""
        self._number = 0
        self.reset()

    def reset(self) -> None:
        """Forget what was heard; stories stay."""
        for request in self._queue:
            request.whole = ()
        self.hearing = Newest(self.axes, self._settings.memory, self._settings.minimum, self._settings.reorder)
        self._next_time = self._settings.interval

    def change(self, settings: DiagnoserSettings) -> None:
        """Use other settings from now on; those of the memory start it anew."""
        before, self._settings = self._settings, settings
        if (before.memory, before.minimum, before.reorder) != (settings.memory, settings.minimum, settings.reorder):
            self.reset()

    @property
    def busy(self) -> bool:
        """Something is done or waits to be done."""
        return bool(self._queue)

    def feed(self, kind: Quantity, block: Block) -> None:
        """Take one block of one stream; the diagnosis that falls due by the interval is asked for."""
        self.hearing.feed(kind, block)
        interval, rate = self._settings.interval, self.hearing.sampling_rate
        if interval > 0.0 and rate and self.hearing.total >= self._next_time * rate:
            self._next_time = self.hearing.total / rate + interval
            if not self._queue and not self.hearing.lacking():
                self.ask("diagnose")

    def ask(self, act: Act, axes: Iterable[str] | None = None) -> int:
        """Queue a request, for all axes or some; its number. One like it that has not begun is joined, and a diagnosis that is under way,
        too: who asks twice, as where answers get lost, has it once."""
        chosen = self.axes if axes is None else tuple(axes)
        for place, known in enumerate(self._queue):
            if known.act == act and known.whole == chosen and (place > 0 or act == "diagnose"):
                return known.number
        self._number += 1
        self._queue.append(_Request(number=self._number, act=act, axes=deque(chosen), whole=chosen))
        return self._number

    def have(self, axis: str, effects: tuple[str, ...]) -> None:
        """The model of an axis is to have these effects; fitted as soon as there are data."""
        self.effects[axis] = effects
        story = self.stories.get(axis)
        if (story.effects if story is not None else ()) != effects or self._under_way == axis:
            self.ask("effects", [axis])

    def reset_model(self) -> None:
        """Back to the rigid model, without a new fit; the diagnosis stays."""
        for axis, story in self.stories.items():
            self.stories[axis] = replace(story, steps=story.steps[:1], note="")
        self.effects = dict.fromkeys(self.axes, ())

    def start(self) -> Job | None:
        """The next job, once the one before is finished."""
        while self._queue and not self._under_way:
            request = self._queue[0]
            if not request.axes:
                self._answers.append(Answer(request.number, request.done, " ".join(request.told)))
                self._queue.popleft()
                continue
            axis = request.axes.popleft()
            story = self.stories.get(axis)
            if request.act == "diagnose" or axis not in self._data or story is None or not story.steps:
                lacking, story = self.hearing.lacking(), None
                if lacking:
                    self._lacks(request, axis, lacking)
                    continue
                heard, column = self.hearing.newest(), self.axes.index(axis)
                self._data[axis] = Run(
                    axis=axis,
                    sampling_rate=heard.sampling_rate,
                    voltage=heard.voltage[:, column].copy(),
                    position=heard.position[:, column].copy(),
                    input_unit=self._settings.units.input,
                    output_unit=self._settings.units.output,
                )
            self._under_way, self.doing = axis, f"axis {axis}: {request.act}"
            return Job(
                act=request.act,
                run=self._data[axis],
                story=story,
                effects=self.effects[axis],
                tolerance=self._settings.tolerance,
            )
        return None

    def progress(self, doing: str, story: Story | None) -> None:
        """The worker has got so far."""
        self.doing = f"axis {self._under_way}: {doing}"
        if story is not None:
            self.stories[self._under_way] = story

    def finish(self, problem: str = "") -> None:
        """The job under way has ended; ``problem`` if it failed."""
        axis, request = self._under_way, self._queue[0]
        self._under_way, self.doing = "", ""
        story = self.stories.get(axis)
        if not any(waiting.act == "effects" and axis in waiting.axes for waiting in self._queue):
            self.effects[axis] = story.effects if story is not None else ()
        if problem or story is None:
            request.done = False
            request.told.append(f"axis {axis}: {problem}")
        else:
            request.done &= bool(story.steps)
            request.told.append(sentence(story))

    def cancel(self) -> str:
        """Give up all requests, running and waiting; what was given up, in words."""
        given_up = self.doing
        for request in self._queue:
            self._answers.append(Answer(request.number, False, "cancelled"))
        self._queue.clear()
        self._under_way, self.doing = "", ""
        for axis, story in self.stories.items():
            self.effects[axis] = story.effects
        return f"cancelled {given_up}" if given_up else "nothing was running"

    def answers(self) -> list[Answer]:
        """The requests that have ended since the last call."""
        found, self._answers = self._answers, []
        return found

    def _lacks(self, request: _Request, axis: str, lacking: str) -> None:
        rate = self.hearing.sampling_rate or 0.0
        told = unheard(axis, rate, self.hearing.seconds, lacking, self._settings.tolerance, self._settings.units)
        if axis not in self.stories or not self.stories[axis].steps:
            self.stories[axis] = told
        request.done = False
        request.told.append(sentence(told))


def all_at_once(diagnoser: Diagnoser, library: Library) -> dict[str, Story]:
    """Each axis' story from what was heard, with every effect that helps: the service ``auto`` without a worker."""
    diagnoser.ask("auto")
    while (job := diagnoser.start()) is not None:
        for doing, story in perform(job, library):
            diagnoser.progress(doing, story)
        diagnoser.finish()
    return dict(diagnoser.stories)
