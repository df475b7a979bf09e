"""A job on one axis's story, step by step; shared by the node, the replay and the page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

from xy_sysid.axis.model import Library
from xy_sysid.diagnosis.diagnose import not_enough
from xy_sysid.diagnosis.refine import never
from xy_sysid.hypotheses.criteria import MOST_EFFECTS
from xy_sysid.samples.recording import Run
from xy_sysid.story.story import Story, added, begin, diagnosed, next_best, pruned, removed
from xy_sysid.units import Units, bare, moved

Act = Literal["begin", "diagnose", "renew", "effects", "add_next", "auto"]
ANEW: tuple[Act, ...] = ("diagnose", "renew")  # acts that start a new story


@dataclass(frozen=True, slots=True)
class Job:
    """A job for one axis.

    act: ``begin`` fits the rigid model if there is no story yet; ``diagnose`` starts again with these samples and then adds ``effects`` to
    the model; ``renew`` does this without a diagnosis; ``effects`` changes the effects and keeps the samples; ``add_next`` adds the
    best effect, ``auto`` all that help
    run: of the axis; story: its present story, None to begin; more: further stretches of the same axis
    """

    act: Act
    run: Run
    story: Story | None
    effects: tuple[str, ...]
    tolerance: float
    more: tuple[Run, ...] = ()


def perform(job: Job, library: Library, clock: Callable[[], float] = never) -> Iterator[tuple[str, Story | None]]:
    """(current activity, None), and (finished activity, story so far) after each step. Raises BadInput for a wrong effect."""
    run = (job.run, *job.more)
    story = None if job.act in ANEW else job.story
    if story is None:
        yield "fitting the rigid model", None
        story = begin(run, library, job.tolerance)
        yield "the rigid model is fitted", story
    if not story.rungs or job.act == "begin":
        return
    if job.act not in ("renew", "effects") and story.diagnosis is None:
        yield "searching for missing effects", None
        story = diagnosed(story, run, library, clock)
        yield "diagnosed", story
    if job.act in ("diagnose", "renew", "effects"):
        for name in [name for name in story.effects if name not in job.effects]:
            yield f"removing {name}", None
            story = removed(story, run, name, library)
            yield f"without {name}", story
        for name in [name for name in job.effects if name not in story.effects]:
            yield f"adding {name}", None
            story = added(story, run, name, library)
            yield f"with {name}", story
        return
    for _ in range(MOST_EFFECTS if job.act == "auto" else 1):
        yield "searching for the next effect", None
        before, story = len(story.rungs), next_best(story, run, library)
        yield story.note or story.rungs[-1].label, story
        if len(story.rungs) == before:
            break
    if job.act == "auto" and len(story.effects) > 1:
        yield "removing effects that are not needed", None
        story = pruned(story, run, library)
        yield "done", story


def unheard(axis: str, sampling_rate: float, seconds: float, lacking: str, tolerance: float, units: Units) -> Story:
    """The story of an axis with too few data for a start."""
    told = not_enough(lacking, units)
    return Story(axis=axis, sampling_rate=sampling_rate, seconds=seconds, tolerance=tolerance, units=units, diagnosis=told)


def sentence(story: Story) -> str:
    """The state of the axis's story in words."""
    told = story.diagnosis.sentence if story.diagnosis is not None else "Not diagnosed yet."
    now = story.now
    if story.diagnosis is not None and story.diagnosis.verdict == "nothing_missing" and not story.effects:
        return f"axis {story.axis}: {told}"
    if now is None or not now.effects:
        return f"axis {story.axis}: {told}{f' {story.note}' if story.note else ''}"
    error = f"held-out error {moved(now.held_out_error, story.units.judged)} (floor {bare(now.noise_floor, story.units.judged)})"
    return f"axis {story.axis}: {told} In the model: {', '.join(now.effects)}; {error}.{f' {story.note}' if story.note else ''}"
