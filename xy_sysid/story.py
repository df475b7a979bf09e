"""One axis from the rigid base to the noise floor: see where the model fails, name what is missing, add it, watch the error fall.

Each function takes a story and gives the next one. A story holds plain numbers and short pictures only: it can be sent to
another process, and written as a document (``story_document``).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.axis_model import STANDARD, AxisModel, Library, simulate
from xy_sysid.diagnosis import diagnose, lacking
from xy_sysid.errors import BadInput
from xy_sysid.findings import Findings, Rung, findings, rung
from xy_sysid.greybox import EPSILON, AxisData, GreyboxFit, fit, fit_base, prepare
from xy_sysid.one_step import one_step_fit
from xy_sysid.refinement import MOST_EFFECTS, advance, settle
from xy_sysid.refinement import added as fitted_with
from xy_sysid.settings import unknown_name
from xy_sysid.story_pictures import Measured, Pictures, measured, pictures
from xy_sysid.stream import FloatArray


@dataclass(frozen=True, slots=True)
class StoryStep:
    """One fit and its pictures."""

    rung: Rung
    pictures: Pictures


@dataclass(frozen=True, slots=True)
class Story:
    """One axis' story.

    steps: the fits so far, the rigid base first; empty if the data do not suffice (``diagnosis`` then says what lacks)
    diagnosis: what is missing in the base, None before it was asked; tolerance: of the signal, in the noise floor
    note: what the last act could not do; empty if it did
    """

    axis: str
    sampling_rate: float
    seconds: float
    tolerance: float
    units: tuple[str, str]
    measured: Measured | None
    steps: tuple[StoryStep, ...]
    diagnosis: Findings | None = None
    note: str = ""

    @property
    def now(self) -> Rung | None:
        """The newest fit."""
        return self.steps[-1].rung if self.steps else None

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects in the model."""
        return self.now.effects if self.now is not None else ()


def begin(
    axis: str,
    sampling_rate: float,
    voltage: FloatArray,
    position: FloatArray,
    library: Library = STANDARD,
    tolerance: float = EPSILON,
    units: tuple[str, str] = ("V", "m"),
) -> Story:
    """The rigid base, fitted to gap-free samples (n,); without steps, but with a diagnosis, if the data do not suffice."""
    empty = Story(axis, sampling_rate, voltage.size / sampling_rate, tolerance, units, None, ())
    if lacking(sampling_rate, voltage, position):
        return replace(empty, diagnosis=findings(diagnose(sampling_rate, voltage, position, library), library))
    data = prepare(sampling_rate, voltage, position, tolerance)
    base = fit_base(data, library)
    shown = measured(data, base)
    return replace(empty, measured=shown, steps=(StoryStep(rung(base), pictures(data, base, shown)),))


def diagnosed(story: Story, voltage: FloatArray, position: FloatArray, library: Library = STANDARD) -> Story:
    """With the answer to: which effect is missing in the rigid base? The model stays what it is.

    A story that is still at its base takes over the tolerance of the answer if that is looser.
    """
    found = findings(diagnose(story.sampling_rate, voltage, position, library), library)
    told = replace(story, diagnosis=found, note="")
    if len(story.steps) != 1 or not found.ladder or found.tolerance <= story.tolerance:
        return told
    data = prepare(story.sampling_rate, voltage, position, found.tolerance)
    return _shown(replace(told, tolerance=found.tolerance, steps=()), data, found.ladder[0], library)


def added(story: Story, voltage: FloatArray, position: FloatArray, name: str, library: Library = STANDARD) -> Story:
    """With one more effect, everything refitted together; a relative of the same family is replaced.

    Raises BadInput for a name that is unknown, in every model, or in this one.
    """
    allowed(name, library)
    if name in story.effects:
        raise BadInput("effect", repr(name), "one that is not in the model yet", f"It has {', '.join(story.effects)}.")
    data = prepare(story.sampling_rate, voltage, position, story.tolerance)
    now = _fit_of(story, data, library)
    relative = next((own for own in story.effects if library[own].family and library[own].family == library[name].family), None)
    try:
        before = now if relative is None else fit(data, now.model.without(relative))
        found = fitted_with(data, before, name)
    except np.linalg.LinAlgError:
        return replace(story, note=f"{name} could not be fitted to these data.")
    return _grown(story, data, found, name, relative)


def removed(story: Story, voltage: FloatArray, position: FloatArray, name: str, library: Library = STANDARD) -> Story:
    """Without one effect, the rest refitted; raises BadInput if it is not in the model."""
    if name not in story.effects:
        raise BadInput("effect", repr(name), ", ".join(story.effects) or "none, the model is the rigid base", "Choose one that is in the model.")
    data = prepare(story.sampling_rate, voltage, position, story.tolerance)
    return _grown(story, data, fit(data, _model(story, library).without(name)), None, name)


def with_effects(story: Story, voltage: FloatArray, position: FloatArray, names: Iterable[str], library: Library = STANDARD) -> Story:
    """With exactly these effects: what is not among them goes, what is new comes, one step each.

    Raises BadInput for a name that is unknown or in every model, before anything is fitted.
    """
    wanted = tuple(dict.fromkeys(names))
    for name in wanted:
        allowed(name, library)
    for name in story.effects:
        if name not in wanted:
            story = removed(story, voltage, position, name, library)
    for name in wanted:
        if name not in story.effects:
            story = added(story, voltage, position, name, library)
    return story


def next_best(story: Story, voltage: FloatArray, position: FloatArray, library: Library = STANDARD) -> Story:
    """With the effect that helps most now; with a note instead if nothing is left to explain, or nothing helps."""
    if story.now is None:
        return story
    planned = _planned(story)
    data = prepare(story.sampling_rate, voltage, position, story.tolerance)
    if planned is not None:
        return _shown(story, data, planned, library)
    move = advance(data, _fit_of(story, data, library), library)
    if not move.steps and story.now.explained:
        return replace(story, note="Nothing is left to explain: the held-out error is at the noise floor.")
    if not move.steps:
        return replace(story, note="No effect of the library helps any further.")
    for step in move.steps:
        story = _grown(story, data, step.fit, step.added, None)
    return story


def auto(story: Story, voltage: FloatArray, position: FloatArray, library: Library = STANDARD) -> Story:
    """Add the next best until the floor is reached or nothing helps, then take out what is no longer needed."""
    while len(story.effects) < MOST_EFFECTS:
        grown = next_best(story, voltage, position, library)
        if len(grown.steps) == len(story.steps):
            story = grown
            break
        story = grown
    return pruned(story, voltage, position, library)


def pruned(story: Story, voltage: FloatArray, position: FloatArray, library: Library = STANDARD) -> Story:
    """Without the effects that are no longer needed, and with simpler relatives that do as well; the same story if all stay."""
    if len(story.effects) < 2:
        return story
    data = prepare(story.sampling_rate, voltage, position, story.tolerance)
    found = settle(data, _fit_of(story, data, library))
    gone = [name for name in story.effects if name not in found.model]
    new = [name for name, _ in found.model.effects if name not in story.effects]
    return _grown(story, data, found, " and ".join(new) or None, " and ".join(gone)) if gone else story


def tell(
    axis: str,
    sampling_rate: float,
    voltage: FloatArray,
    position: FloatArray,
    library: Library = STANDARD,
    units: tuple[str, str] = ("V", "m"),
) -> Story:
    """The whole story of one axis: base, diagnosis, and every effect that it needs."""
    story = begin(axis, sampling_rate, voltage, position, library, units=units)
    return auto(diagnosed(story, voltage, position, library), voltage, position, library) if story.steps else story


def allowed(name: str, library: Library = STANDARD) -> None:
    """Raises BadInput, which names the effects that may be added, for a name that may not."""
    names = [effect.name for effect in library.acting]
    if name in library.effects and name not in names:
        raise BadInput("effect", repr(name), ", ".join(names), "This one is part of every model; leave it out.")
    if name not in names:
        raise unknown_name(name, names, "effect")


def _planned(story: Story) -> Rung | None:
    """What the diagnosis has fitted already as the next step from here."""
    found = story.diagnosis
    if found is None or found.tolerance != story.tolerance:
        return None
    for here, following in zip(found.ladder, found.ladder[1:], strict=False):
        if following.added is not None and here.effects == story.effects and here.values == story.steps[-1].rung.values:
            return following
    return None


def _shown(story: Story, data: AxisData, step: Rung, library: Library) -> Story:
    """The story with a step whose fit is known."""
    again = _simulated(data, step, story.steps[0].rung if story.steps else step, library)
    shown = story.measured or measured(data, again)
    return replace(story, measured=shown, steps=(*story.steps, StoryStep(step, pictures(data, again, shown))), note="")


def _grown(story: Story, data: AxisData, found: GreyboxFit, name: str | None, gone: str | None) -> Story:
    assert story.measured is not None
    step = StoryStep(rung(found, name, gone), pictures(data, found, story.measured))
    return replace(story, steps=(*story.steps, step), note="")


def _model(story: Story, library: Library) -> AxisModel:
    assert story.now is not None
    return AxisModel(story.now.gain, story.now.delay, story.now.pole, story.now.values, library)


def _fit_of(story: Story, data: AxisData, library: Library) -> GreyboxFit:
    assert story.now is not None
    return _simulated(data, story.now, story.steps[0].rung, library)


def _simulated(data: AxisData, step: Rung, base: Rung, library: Library) -> GreyboxFit:
    """The fit of a step again: by one simulation, or as it was made where free simulation cannot judge it."""
    alone = next((library[name] for name in step.effects if library[name].one_step is not None), None)
    if alone is not None:
        rigid = _simulated(data, base, base, library)
        others = tuple((name, values) for name, values in step.values if name != alone.name)
        return one_step_fit(data, replace(rigid, model=replace(rigid.model, effects=others)), alone)
    model = AxisModel(step.gain, step.delay, step.pole, step.values, library)
    simulated = simulate(model, data.sampling_rate, data.voltage, data.position)
    errors = step.train_error, step.held_out_error, step.noise_floor, step.excess
    return GreyboxFit(model, step.parameters, *errors, simulated, data.velocity - simulated, 0, True)
