"""The story of one axis, from the rigid model to the noise floor: where the model fails, the missing effect, and the error after each step.

Each function takes a story and returns the next one. ``run`` is a run of the axis, or all of its runs. A story holds plain numbers and short
pictures only: it can be sent to another process, and written as a document (``document``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from xy_sysid.axis.model import STANDARD, AxisModel, Library, simulate
from xy_sysid.diagnosis.answer import Answer, Rung
from xy_sysid.diagnosis.diagnose import not_enough
from xy_sysid.diagnosis.of_run import Data, diagnose, runs_together
from xy_sysid.diagnosis.refine import Effort, never, refine, settle
from xy_sysid.diagnosis.rungs import with_one_more
from xy_sysid.diagnosis.words import about_longest
from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import longest
from xy_sysid.greybox.free_run import EPSILON, AxisData, GreyboxFit, fit, fit_base, prepare_all
from xy_sysid.greybox.one_step import one_step_effect, one_step_fit
from xy_sysid.hypotheses.criteria import MOST_EFFECTS
from xy_sysid.hypotheses.enough_data import prepared
from xy_sysid.settings import unknown_name
from xy_sysid.story.pictures import Measured, Pictures, measured, pictures
from xy_sysid.units import Units

HELPS_NO_MORE = "No effect of the library helps any further."


@dataclass(frozen=True, slots=True)
class Story:
    """The story of one axis.

    rungs: the fits so far, the rigid base first; empty if the data do not suffice (``diagnosis`` gives the reason); pictures: of each fit
    diagnosis: of the rigid base, None before it was requested; tolerance: fraction of the signal that is part of the noise floor
    stretch: the place of the stretch that the story is about, if it is about one of several
    note: why the last action failed, or which part of the data it used; empty otherwise
    """

    axis: str
    sampling_rate: float
    seconds: float
    tolerance: float
    units: Units
    measured: Measured | None = None
    rungs: tuple[Rung, ...] = ()
    pictures: tuple[Pictures, ...] = ()
    diagnosis: Answer | None = None
    stretch: int | None = None
    note: str = ""

    @property
    def now(self) -> Rung | None:
        """The newest fit."""
        return self.rungs[-1] if self.rungs else None

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects in the model."""
        return self.now.effects if self.now is not None else ()

    def only_base(self) -> Story:
        """The story with the rigid model only; the diagnosis is kept."""
        return replace(self, rungs=self.rungs[:1], pictures=self.pictures[:1], note="")


def begin(run: Data, library: Library = STANDARD, tolerance: float = EPSILON) -> Story:
    """The rigid model, fitted to gap-free samples; no steps but a diagnosis if the data do not suffice."""
    runs, story = runs_together(run), _none(run, tolerance)
    data = prepared(story.sampling_rate, [(one.voltage, one.position) for one in runs], tolerance, story.units)
    if isinstance(data, str):
        return replace(story, diagnosis=not_enough(data, story.units))
    return _based(story, data, fit_base(data, library))


def diagnosed(story: Story, run: Data, library: Library = STANDARD, clock: Callable[[], float] = never, budget: float = math.inf) -> Story:
    """The story with the diagnosis of the rigid model: the missing effect. The model is unchanged. budget, clock: see ``diagnosis.of_run``."""
    found = diagnose(run, library, budget, clock, tolerance=story.tolerance)
    story = replace(_narrowed(story, run, library, found.stretch), note="")
    return replace(story, diagnosis=found.plain())


def added(story: Story, run: Data, name: str, library: Library = STANDARD) -> Story:
    """The story with one more effect and a full refit, taken from the diagnosis if it is its next step; a relative of the same family is replaced.

    Raises BadInput for a name that is unknown, in every model, or in this one.
    """
    allowed(name, library)
    if name in story.effects:
        raise BadInput("effect", repr(name), "one that is not in the model yet", f"It has {', '.join(story.effects)}.")
    data = _data(story, run)
    if library[name].one_step is not None and len(data.starts) > 1:
        alone = added(_narrowed(story, run, library, longest(data)), run, name, library)
        return replace(alone, note=about_longest(name, alone.seconds))
    planned = _planned(story)
    if planned is not None and planned.added == name:
        return _shown(story, data, planned, _fit_of(story, data, library, planned))
    now = _fit_of(story, data, library)
    relative = next((own for own in story.effects if library[own].family and library[own].family == library[name].family), None)
    before = now if relative is None else fit(data, now.model.without(relative))
    found = with_one_more(data, library, _fit_of(story, data, library, story.rungs[0]), before, name)
    if not np.isfinite(found.excess):
        return replace(story, note=f"{name} could not be fitted to these data.")
    return _grown(story, data, found, (name,), () if relative is None else (relative,))


def removed(story: Story, run: Data, name: str, library: Library = STANDARD) -> Story:
    """The story without one effect, the rest refitted; raises BadInput if it is not in the model."""
    if name not in story.effects:
        raise BadInput("effect", repr(name), ", ".join(story.effects) or "none, the model is the rigid base", "Choose one that is in the model.")
    data = _data(story, run)
    return _grown(story, data, fit(data, _model(story.rungs[-1], library).without(name)), went=(name,))


def next_best(story: Story, run: Data, library: Library = STANDARD) -> Story:
    """The story with the effect that helps most; with a note instead if there is nothing to explain, or nothing helps."""
    if story.now is None:
        return story
    planned = _planned(story)
    if planned is None and story.now.explained:
        return replace(story, note="Nothing is left to explain: the held-out error is at the noise floor.")
    if planned is None and _searched(story):
        return replace(story, note=HELPS_NO_MORE)
    data = _data(story, run)
    if planned is not None:
        return _shown(story, data, planned, _fit_of(story, data, library, planned))
    found = refine(data, library, story.effects, Effort(most=MOST_EFFECTS - len(story.effects)))
    story = _narrowed(story, run, library, found.stretch)
    data = _data(story, run)
    new = [rung for rung in found.rungs if not {*rung.came} <= {*story.effects}]
    return _grown(story, data, new[0].fit, new[0].came) if new else replace(story, note=HELPS_NO_MORE)


def auto(story: Story, run: Data, library: Library = STANDARD) -> Story:
    """Add the best effect until the floor is reached or nothing helps, then remove effects that are no longer needed."""
    while len(story.effects) < MOST_EFFECTS:
        before, story = len(story.rungs), next_best(story, run, library)
        if len(story.rungs) == before:
            break
    return pruned(story, run, library)


def pruned(story: Story, run: Data, library: Library = STANDARD) -> Story:
    """Remove effects that are no longer needed, and use simpler relatives that fit as well; returns the same story if nothing changes."""
    if len(story.effects) < 2:
        return story
    data = _data(story, run)
    found = settle(data, _fit_of(story, data, library))
    gone = [name for name in story.effects if name not in found.model]
    new = [name for name, _ in found.model.effects if name not in story.effects]
    return _grown(story, data, found, new, gone) if gone else story


def tell(run: Data, library: Library = STANDARD, clock: Callable[[], float] = never, budget: float = math.inf) -> Story:
    """The full story of one axis: diagnosis, its rigid model, and every needed effect. budget, clock: see ``diagnosis.of_run``."""
    found = diagnose(run, library, budget, clock)
    story = replace(_none(found.runs, EPSILON), diagnosis=found.plain(), stretch=found.stretch)
    return auto(_based(story, _data(story, run), found.base), run, library) if found.rungs else story


def allowed(name: str, library: Library = STANDARD) -> None:
    """Raises BadInput, with the names of the effects that may be added, for any other name."""
    names = [effect.name for effect in library.acting]
    if name in library.effects and name not in names:
        raise BadInput("effect", repr(name), ", ".join(names), "This one is part of every model; leave it out.")
    if name not in names:
        raise unknown_name(name, names, "effect")


def _none(run: Data, tolerance: float) -> Story:
    """A story before its first fit."""
    runs = runs_together(run)
    first, seconds = runs[0], sum(one.seconds for one in runs)
    return Story(axis=first.axis, sampling_rate=first.sampling_rate, seconds=seconds, tolerance=tolerance, units=first.units)


def _based(story: Story, data: AxisData, base: GreyboxFit) -> Story:
    """The story with its first fit."""
    return _grown(replace(story, measured=measured(data, base)), data, base)


def _data(story: Story, run: Data) -> AxisData:
    runs = runs_together(run)
    runs = runs if story.stretch is None else (runs[story.stretch],)
    return prepare_all(story.sampling_rate, [(one.voltage, one.position) for one in runs], story.tolerance, story.units)


def _narrowed(story: Story, run: Data, library: Library, stretch: int | None) -> Story:
    """The story told again of one stretch, with the same effects; the same story if it is about that stretch already, or if there is none."""
    if stretch is None or story.stretch == stretch:
        return story
    told = begin(runs_together(run)[stretch], library, story.tolerance)
    if not told.rungs:
        lacking = told.diagnosis.sentence if told.diagnosis is not None else ""
        raise BadInput("longest stretch without a gap", f"{told.seconds:.3g} s", "one that is long enough for a model", lacking)
    told = replace(told, diagnosis=story.diagnosis, stretch=stretch)
    for name in story.effects:
        told = added(told, run, name, library)
    return told


def _planned(story: Story) -> Rung | None:
    """The next step from here, if the diagnosis has already fitted it; else None."""
    rungs = story.diagnosis.rungs if story.diagnosis is not None else ()
    return next((after for here, after in pairwise(rungs) if after.came and _stands_on(story, here)), None)


def _searched(story: Story) -> bool:
    """True if the diagnosis has searched from this model without finding more: another search would give the same result."""
    rungs = story.diagnosis.rungs if story.diagnosis is not None else ()
    return bool(rungs) and _stands_on(story, rungs[-1])


def _stands_on(story: Story, here: Rung) -> bool:
    return story.now is not None and here.values == story.now.values


def _grown(story: Story, data: AxisData, found: GreyboxFit, came: Sequence[str] = (), went: Sequence[str] = ()) -> Story:
    """The story with one more fit."""
    return _shown(story, data, Rung.of(found, came, went).plain(), found)


def _shown(story: Story, data: AxisData, rung: Rung, found: GreyboxFit) -> Story:
    """The story with one more step, and the figure data of its fit."""
    assert story.measured is not None
    return replace(story, rungs=(*story.rungs, rung), pictures=(*story.pictures, pictures(data, found, story.measured)), note="")


def _model(rung: Rung, library: Library) -> AxisModel:
    own = tuple((item.name, tuple(one.value for one in item.recordings)) for item in rung.parameters if item.recordings)
    return AxisModel(gain=rung.gain, delay=rung.delay, pole=rung.pole, effects=rung.values, library=library, per_recording=own)


def _fit_of(story: Story, data: AxisData, library: Library, rung: Rung | None = None) -> GreyboxFit:
    """The fit of a step (default: the newest), recomputed by one simulation, or by one-step prediction if the step was judged so."""
    rung = rung or story.rungs[-1]
    model = _model(rung, library)
    alone = one_step_effect(model)
    if alone is not None:
        rigid = _fit_of(story, data, library, story.rungs[0])
        others = tuple((name, values) for name, values in rung.values if name != alone.name)
        return one_step_fit(data, replace(rigid, model=replace(rigid.model, effects=others)), alone)
    each = (simulate(model.in_recording(k), data.sampling_rate, data.voltage[part], data.position[part]) for k, part in enumerate(data.runs))
    simulated = np.concatenate(list(each))
    return GreyboxFit(
        model=model,
        parameters=rung.parameters,
        training_error=rung.training_error,
        held_out_error=rung.held_out_error,
        noise_floor=rung.noise_floor,
        excess=rung.excess,
        scores=np.zeros(data.held_out.begins.size),
        forced=0.0,
        force=0.0,
        simulated=simulated,
        error=data.velocity - simulated,
        runs=0,
        converged=True,
        held_out_powers=data.layout.powers(data.held_out.spectrum(data.velocity - simulated)),
        units=data.units,
    )
