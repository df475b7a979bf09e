"""A job on one axis' story, step by step, and what goes on the topics: the node, the replay and the page do the same."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from xy_sysid.axis_model import Library
from xy_sysid.findings import Findings
from xy_sysid.messages import OK, STALE, WARN, ArrayMessage, StatusMessage
from xy_sysid.refinement import MOST_EFFECTS
from xy_sysid.story import Story, added, begin, diagnosed, next_best, pruned, removed
from xy_sysid.stream import FloatArray

Act = Literal["diagnose", "effects", "add_next", "auto"]
LADDER_COLUMNS = ("step", "train_error", "held_out_error", "noise_floor")


@dataclass(frozen=True, slots=True)
class Job:
    """What is to be done with one axis.

    act: ``diagnose`` begins anew with these samples and then has ``effects`` in the model, ``effects`` has them without asking
    what is missing, ``add_next`` adds the best one, ``auto`` all that help; voltage, position: (n,); story: so far, None to begin
    """

    act: Act
    axis: str
    sampling_rate: float
    voltage: FloatArray
    position: FloatArray
    story: Story | None
    effects: tuple[str, ...]
    tolerance: float


def perform(job: Job, library: Library) -> Iterator[tuple[str, Story | None]]:
    """(what is being done now, None), and (what was done, the story so far) after each step. Raises BadInput for a wrong effect."""
    u, y = job.voltage, job.position
    story = None if job.act == "diagnose" else job.story
    if story is None:
        yield "fitting the rigid model", None
        story = begin(job.axis, job.sampling_rate, u, y, library, job.tolerance)
        yield "the rigid model is fitted", story
    if not story.steps:
        return
    if job.act != "effects" and story.diagnosis is None:
        yield "looking for what is missing", None
        story = diagnosed(story, u, y, library)
        yield "diagnosed", story
    if job.act in ("diagnose", "effects"):
        for name in [name for name in story.effects if name not in job.effects]:
            yield f"taking {name} out", None
            story = removed(story, u, y, name, library)
            yield f"without {name}", story
        for name in [name for name in job.effects if name not in story.effects]:
            yield f"adding {name}", None
            story = added(story, u, y, name, library)
            yield f"with {name}", story
        return
    for _ in range(MOST_EFFECTS if job.act == "auto" else 1):
        yield "looking for the next effect", None
        before, story = len(story.steps), next_best(story, u, y, library)
        yield story.note or story.steps[-1].rung.label, story
        if len(story.steps) == before:
            break
    if job.act == "auto" and len(story.effects) > 1:
        yield "taking out what is not needed", None
        story = pruned(story, u, y, library)
        yield "done", story


def unheard(axis: str, sampling_rate: float, seconds: float, lacking: str, tolerance: float) -> Story:
    """The story of an axis of which too little was heard to begin."""
    told = Findings("not_enough_data", (), 1.0, tolerance, f"Not enough data: {lacking}", (), (), None, (), (), lacking)
    return Story(axis, sampling_rate, seconds, tolerance, ("V", "m"), None, (), told)


def sentence(story: Story) -> str:
    """What is known of the axis, in words."""
    told = story.diagnosis.sentence if story.diagnosis is not None else "Not diagnosed yet."
    now = story.now
    if story.diagnosis is not None and story.diagnosis.verdict == "nothing_missing" and not story.effects:
        return f"axis {story.axis}: {told}"
    if now is None or not now.effects:
        return f"axis {story.axis}: {told}{f' {story.note}' if story.note else ''}"
    error = f"held-out error {1e3 * now.held_out_error:.3g} mm/s (floor {1e3 * now.noise_floor:.3g})"
    return f"axis {story.axis}: {told} In the model: {', '.join(now.effects)}; {error}.{f' {story.note}' if story.note else ''}"


def ladder_message(story: Story) -> ArrayMessage:
    """``error_ladder/<axis>``: one row per step, m/s."""
    rungs = [step.rung for step in story.steps]
    rows = np.array([(k, rung.train_error, rung.held_out_error, rung.noise_floor) for k, rung in enumerate(rungs)], dtype=np.float64)
    return ArrayMessage(f"error_ladder/{story.axis}", ("step", ",".join(LADDER_COLUMNS)), (len(rungs), len(LADDER_COLUMNS)), rows.ravel())


def diagnosis_status(story: Story) -> StatusMessage:
    """``diagnosis``: verdict, errors and ranking of one axis; OK if the model explains it or nothing is missing, else WARN."""
    values: dict[str, str] = {"seconds of data (s)": f"{story.seconds:.6g}", "tolerance (1)": f"{story.tolerance:.3g}"}
    found, now = story.diagnosis, story.now
    if found is not None:
        values |= {
            "verdict": found.verdict,
            "effect": found.effect or "",
            "effects": ", ".join(found.effects),
            "confidence (1)": f"{found.confidence:.3f}",
        }
    if now is not None:
        values |= {
            "error of the rigid model (m/s)": f"{story.steps[0].rung.held_out_error:.6g}",
            "error now (m/s)": f"{now.held_out_error:.6g}",
            "training error now (m/s)": f"{now.train_error:.6g}",
            "noise floor (m/s)": f"{now.noise_floor:.6g}",
            "effects in the model": ", ".join(now.effects),
            "explained": str(now.explained).lower(),
        }
        for item in now.parameters:
            values[f"{item.name} ({item.unit or '1'})"] = f"{item.value:.9g}"
            values[f"{item.name} 95 % low"], values[f"{item.name} 95 % high"] = f"{item.low:.9g}", f"{item.high:.9g}"
    if found is not None:
        values |= {f"candidate {k}": f"{one.effect}: {one.evidence}" for k, one in enumerate(found.candidates, start=1)}
        values |= {"runner-up": found.runner_up[1]} if found.runner_up else {}
        values |= {f"look-alike {one.effect}": one.sentence for one in found.look_alikes}
        values |= {f"fails {k}": place.sentence for k, place in enumerate(found.where[:5], start=1)}
        values["next experiment"] = found.next_experiment
    well = (now is not None and now.explained) or (found is not None and found.verdict == "nothing_missing")
    level = OK if well else STALE if found is not None and found.verdict == "not_enough_data" else WARN
    return StatusMessage(f"axis {story.axis}", level, sentence(story), tuple(values.items()))
