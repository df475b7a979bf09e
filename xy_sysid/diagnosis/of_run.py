"""Two calls: which effect is missing in a run or several runs of one axis, and the steps from the rigid model to the final one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from threadpoolctl import threadpool_limits

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.diagnosis import diagnose as one
from xy_sysid.diagnosis.answer import Answer
from xy_sysid.diagnosis.refine import Effort, never
from xy_sysid.diagnosis.refine import refine as search
from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import longest, one_stretch
from xy_sysid.greybox.free_run import EPSILON
from xy_sysid.hypotheses.criteria import MOST_EFFECTS
from xy_sysid.hypotheses.enough_data import prepared
from xy_sysid.samples.recording import Recording, Run, one_run
from xy_sysid.units import over

Data = Run | Recording | Sequence[Run | Recording]


def diagnose(
    data: Data,
    library: Library = STANDARD,
    budget: float = math.inf,
    clock: Callable[[], float] = never,
    tolerance: float = EPSILON,
    first: tuple[str, ...] = (),
) -> Answer:
    """Which physical effects the rigid model misses, with evidence and runner-up; or that nothing is missing, or that none is known.

    data:   a run or several of one axis, or a recording of one axis with all its stretches, V and m
    library: with effects of your own (``files.effects.library``)
    budget: s of ``clock`` (for example ``time.process_time``) after which the search stops with its best set so far; without a clock it
            stops after a fixed amount of work, so that the same data give the same answer on a busy computer too
    tolerance: part of the motion that a model may leave
    first:  effects of an earlier recording of this axis. If they explain the data down to the noise floor, and no simpler set does as well,
            no other set is tried
    Too little data is an answer, ``not_enough_data``, and no error. Raises BadInput for runs that do not belong together.
    """
    runs = runs_together(data)
    rate, signals, units = runs[0].sampling_rate, [(run.voltage, run.position) for run in runs], runs[0].units
    with threadpool_limits(1, "blas"):  # as in commands and nodes
        ready = prepared(rate, signals, tolerance, units)
        found = one.not_enough(ready, units) if isinstance(ready, str) else one.diagnose_prepared(ready, library, budget, clock, first)
    return _about(runs, found)


def refine(
    data: Data,
    add: Iterable[str] = (),
    auto: bool = True,
    library: Library = STANDARD,
    budget: float = math.inf,
    clock: Callable[[], float] = never,
) -> Answer:
    """Add effects, fit everything together, and see the error on held-out data fall: a step for the rigid base and one for each effect.

    add:  effects to add first, in this order; auto: True to go on as long as another effect lowers the error; the rest as for ``diagnose``
    Raises BadInput for too little data, or for a name that is unknown, in every model, or given twice.
    """
    return refined(data, (add,) if isinstance(add, str) else tuple(add), library, Effort(MOST_EFFECTS if auto else 0, budget, clock))


def refined(data: Data, names: tuple[str, ...], library: Library, effort: Effort, tolerance: float = EPSILON) -> Answer:
    """``refine`` with another effort, or another part of the signal that a model at the floor may leave."""
    runs = runs_together(data)
    for name in names:
        if library[name].category == "base":
            raise BadInput("add", name, "an effect that is not in every model already", "Leave it out.")
        if names.count(name) > 1:
            raise BadInput("add", f"{name} {names.count(name)} times", "each effect once", "Leave the others out.")
    rate, signals, units = runs[0].sampling_rate, [(run.voltage, run.position) for run in runs], runs[0].units
    with threadpool_limits(1, "blas"):
        ready = prepared(rate, signals, tolerance, units)
        if isinstance(ready, str):
            raise BadInput(f"data of axis {runs[0].axis}", "not enough", "what a model can be fitted to and judged by", ready)
        if len(runs) == 1 or all(library[name].one_step is None for name in names):
            return _about(runs, search(ready, library, names, effort))
        place = longest(ready)
        return _about(runs, replace(search(one_stretch(ready, place), library, names, effort), stretch=place))


def _about(runs: tuple[Run, ...], found: Answer) -> Answer:
    """The answer with the runs that it is about; its models have the name of the axis and know the samples that they were fitted to."""
    runs = runs if found.stretch is None else (runs[found.stretch],)
    digests = tuple(run.digest for run in runs)
    rungs = tuple(
        replace(rung, made=replace(rung.model, axis=runs[0].axis, data=digests, sampling_rate=runs[0].sampling_rate)) for rung in found.rungs
    )
    return replace(found, runs=runs, rungs=rungs)


def _stretches(data: Run | Recording) -> tuple[Run, ...]:
    if isinstance(data, Recording) and len(data.axes) == 1 and len(data):
        return data.stretches(data.axes[0])
    return (one_run(data),)


def runs_together(data: Data) -> tuple[Run, ...]:
    """One or several runs of the same axis; of a recording all stretches that tell something."""
    runs = tuple(run for item in (data if isinstance(data, Sequence) else (data,)) for run in _stretches(item))
    if not runs:
        raise BadInput("data", "empty", "a run, or several of one axis", "Give at least one.")
    for what, values in (
        ("sampling rate", [f"{run.sampling_rate:g} Hz" for run in runs]),
        ("axis", [run.axis for run in runs]),
        ("units", [over(run.units.measured, run.units.input) for run in runs]),
    ):
        if len(set(values)) > 1:
            raise BadInput(f"{what} of the runs", " and ".join(dict.fromkeys(values)), "one and the same", "Give runs of one axis.")
    return runs
