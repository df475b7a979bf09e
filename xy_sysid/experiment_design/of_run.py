"""One call for a diagnosis: what to measure next, and the expected result."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from xy_sysid.axis.forward import move
from xy_sysid.axis.model import STANDARD, AxisModel, Library
from xy_sysid.diagnosis.answer import Answer
from xy_sysid.diagnosis.equal_laws import equals
from xy_sysid.errors import BadInput
from xy_sysid.excitation.designed import Needs
from xy_sysid.experiment_design.beliefs import Evidence, believed
from xy_sysid.experiment_design.criteria import COARSE, DRAWN
from xy_sysid.experiment_design.design import Design, design, expects
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits, as_recorded, fastest
from xy_sysid.experiment_design.precision import Precision, sharpest
from xy_sysid.experiment_design.prediction import Setting
from xy_sysid.experiment_design.rivals import beliefs_of, names_of, possible, standing
from xy_sysid.greybox.axis_data import EPSILON, AxisData, prepare_all

Tell = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class NextExperiment:
    """The next experiment for one axis.

    experiment: None if none helps; sentence: its expected result; sets: the sets of effects that it should distinguish
    probability: of a decision; settles: True if it is 95 % or more; ask: changes that the user would have to make, or empty
    needs: required voltage and travel; limits: for which it was designed, with the units of the axis
    """

    axis: str
    sampling_rate: float
    sentence: str
    limits: MachineLimits
    experiment: Experiment | None = None
    sets: tuple[tuple[str, ...], ...] = ()
    probability: float = 0.0
    settles: bool = False
    ask: str = ""
    needs: Needs | None = None

    @property
    def seconds(self) -> float:
        """s of motion; 0 without an experiment."""
        return self.experiment.seconds if self.experiment is not None else 0.0

    def __repr__(self) -> str:
        what = self.experiment.said(self.limits.units) if self.experiment is not None else "none"
        return f"<Next experiment of axis {self.axis}: {what}. {self.sentence}>"


def next_experiment(
    found: Answer,
    limits: MachineLimits | None = None,
    between: Sequence[Sequence[str]] = (),
    library: Library = STANDARD,
    tolerance: float = EPSILON,
    tell: Tell = lambda part: None,
) -> NextExperiment:
    """The experiment that best distinguishes the sets of effects that a diagnosis left open.

    found:   result of ``diagnose``; limits: of the machine, None: those seen in the recordings; the experiment begins where the last
             recording ends
    between: sets of effects to distinguish, instead of those that the diagnosis did not rule out
    Raises BadInput for a diagnosis without enough data, and for effects that free simulation cannot predict.
    """
    data = _data(found, tolerance)
    limits = _limits(found, limits)
    axis, rate = found.runs[0].axis, data.sampling_rate
    sets = [tuple(each) for each in between] or possible(data, library, found)
    with threadpool_limits(1, "blas"):
        now = standing(data, library, sets)
        beliefs = beliefs_of(data, library, now, limits.travel)
        if len(beliefs) < 2:
            chosen = names_of([now.names[now.chosen]])
            sentence = f"Nothing is left to settle: of {names_of(sets)} these data leave only {chosen}."
            return NextExperiment(axis=axis, sampling_rate=rate, sentence=sentence, limits=limits, sets=tuple(sets))
        made = design(Setting.of(data), beliefs, limits, tell)
    return answered(axis, rate, made, library)


def sharpen(found: Answer, parameter: str, width: float, limits: MachineLimits | None = None, tolerance: float = EPSILON) -> NextExperiment:
    """The shortest experiment that determines a parameter of the diagnosed model with the given precision.

    parameter: ``gain``, ``pole`` or ``effect.parameter``; width: half width of the 95 % interval, fraction of the value (0.02: 2 %)
    Raises BadInput as ``next_experiment``, and for a parameter that the model does not have.
    """
    if not 0.0 < width < math.inf:
        raise BadInput("width", width, "above 0", "Give half of the interval, for example 0.02 for 2 %.")
    data = _data(found, tolerance)
    limits = _limits(found, limits)
    with threadpool_limits(1, "blas"):
        final = found.final
        best = sharpest(data, final, limits, Precision(parameter, width))
        beliefs = [believed(Evidence(data, limits.travel), final, DRAWN)] if best.experiment is not None else []
    to = f"{100.0 * best.width:.2g} %"
    if best.experiment is None and best.possible:
        sentence = f"No experiment is needed: {parameter} is known to {to} (95 %)."
    elif best.experiment is None:
        sentence = f"No experiment is within the limits; {parameter} is known to {100.0 * best.before:.2g} %."
    elif best.possible:
        sentence = f"After {best.experiment.seconds:.0f} s, {parameter} is known to {to} (95 %), now {100.0 * best.before:.2g} %."
    else:
        sentence = f"No experiment within the limits makes {parameter} known to {100.0 * width:.2g} %: the best reaches {to}."
    return with_needs(
        NextExperiment(
            axis=found.runs[0].axis,
            sampling_rate=data.sampling_rate,
            sentence=sentence,
            limits=limits,
            experiment=best.experiment,
            settles=best.possible,
        ),
        [model for belief in beliefs for model in belief.draws],
    )


def _data(found: Answer, tolerance: float) -> AxisData:
    check_enough(found)
    runs = found.runs
    return prepare_all(runs[0].sampling_rate, [(run.voltage, run.position) for run in runs], tolerance, runs[0].units)


def _limits(found: Answer, limits: MachineLimits | None) -> MachineLimits:
    """The given limits, in the units of the recordings, starting at the end of the last one; by default, limits from the recordings."""
    last = found.runs[-1]
    return as_recorded(found.runs) if limits is None else replace(limits, units=last.units, start=float(last.position[-1]))


def check_enough(found: Answer) -> None:
    """Raises BadInput for a diagnosis with too little data."""
    if not found.rungs or not found.runs:
        raise BadInput("diagnosis", found.verdict, "one of data that suffice", "Record for longer, or ask for a first experiment (--for nothing).")


def answered(axis: str, rate: float, made: Design, library: Library, following: Experiment | None = None) -> NextExperiment:
    """A design as an answer: the experiment with its requirements, its expected result, and the changes that the user would have to make.

    following: the experiment that will be run in any case; None: the best one, if it helps
    """
    if following is None and made.best is not None and made.helps:
        following = made.best.experiment
    found = NextExperiment(
        axis=axis,
        sampling_rate=rate,
        sentence=expects(made),
        limits=made.limits,
        experiment=following,
        sets=tuple(item.effects for item in made.beliefs),
        probability=made.best.probability if made.best is not None else 0.0,
        settles=made.possible,
        ask=_ask(library, made),
    )
    return with_needs(found, [model for belief in made.beliefs for model in belief.draws])


def _ask(library: Library, made: Design) -> str:
    """The changes that the user would have to make if no experiment can decide."""
    if made.helps:
        return ""
    own, other = made.beliefs[0].effects, made.beliefs[1].effects
    new = [name for name in own if name not in other] or [name for name in other if name not in own]
    same = [name for name in new if any(one.name in other for one in equals(library, name))]
    if same:
        return "Their equations are the same. Change the payload and record again: the mode that moves with it belongs to the table."
    return f"{library[new[0]].experiment[:1].upper()}{library[new[0]].experiment[1:]}." if new else ""


def with_needs(found: NextExperiment, models: Sequence[AxisModel]) -> NextExperiment:
    """The answer with the experiment's requirements over all models: voltage, travel, speed, acceleration with the margin, and start position."""
    if found.experiment is None:
        return found
    limits, rate = found.limits, found.sampling_rate
    drive = found.experiment.drive(rate, found.seconds, limits.start)
    motions = [move(model, rate, drive, COARSE) for model in models]
    quick, free = [fastest(motion) for motion in motions], 1.0 - limits.margin
    low = min(float(np.min(motion.position)) for motion in motions)
    high = max(float(np.max(motion.position)) for motion in motions)
    needs = Needs(
        voltage=max(float(np.max(np.abs(motion.voltage))) for motion in motions),
        travel=limits.needed(low, high),
        start=limits.start,
        reach=(low - limits.start, high - limits.start),
        within=limits.travel,
        speed=min(max(speed for speed, _ in quick) / free, limits.speed),
        acceleration=min(max(acceleration for _, acceleration in quick) / free, limits.acceleration),
    )
    return replace(found, needs=needs)
