"""One step of the way to one set of effects: compare the sets on all recordings, and design the next experiment.

Pure functions of the recordings: the same recordings give the same decisions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from xy_sysid.axis.model import Library
from xy_sysid.experiment_design.beliefs import Belief
from xy_sysid.experiment_design.criteria import DRAWS, MINIMUM
from xy_sysid.experiment_design.design import Design, design
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.prediction import Setting
from xy_sysid.experiment_design.rivals import Standing, beliefs_of, standing
from xy_sysid.greybox.axis_data import EPSILON, prepare_all
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import USUAL, Units

Ending = Literal["settled", "alike", "impossible", "experiments", "seconds", "stopped"]
Signals = tuple[FloatArray, FloatArray]  # voltage and position, (n,) each


@dataclass(frozen=True)
class NextChoice:
    """experiment: the next one, None if none helps; found: its design, if any."""

    experiment: Experiment | None
    found: Design | None = None


Choose = Callable[[Setting, Sequence[Belief], MachineLimits], NextChoice]


@dataclass(frozen=True, slots=True)
class Budget:
    """experiments, seconds: maximum number, and maximum s of motion; draws: of the parameters of each set."""

    experiments: int = 2
    seconds: float = 60.0
    draws: int = DRAWS


@dataclass(frozen=True)
class Decision:
    """standing: how the sets explain all recordings so far; left: possible sets, the chosen one first
    choice: the next experiment; None if one set remains
    """

    standing: Standing
    left: tuple[tuple[str, ...], ...]
    choice: NextChoice | None = None

    @property
    def then(self) -> Experiment | None:
        """The next experiment; None if none is needed, or none helps."""
        return self.choice.experiment if self.choice is not None else None

    @property
    def chosen(self) -> tuple[str, ...]:
        """The set that explains all recordings best."""
        return self.standing.names[self.standing.chosen]

    def over(self) -> Ending | None:
        """Why no experiment follows, independent of the budget; None if one follows."""
        if len(self.left) == 1:
            return "settled"
        if self.then is not None:
            return None
        return "alike" if self.choice is not None and self.choice.found is not None and self.choice.found.alike else "impossible"


@dataclass(frozen=True)
class Question:
    """sampling_rate: Hz; recordings: the existing ones; sets: of effects to distinguish; tolerance: part of the motion that models may miss."""

    sampling_rate: float
    recordings: Sequence[Signals]
    sets: Sequence[Sequence[str]]
    library: Library
    tolerance: float = EPSILON
    units: Units = USUAL


def best_design(setting: Setting, beliefs: Sequence[Belief], limits: MachineLimits, tell: Callable[[float], None] = lambda part: None) -> NextChoice:
    """The experiment of ``design``; none if no experiment helps. tell: called with the progress, 0..1."""
    found = design(setting, beliefs, limits, tell)
    return NextChoice(found.best.experiment if found.best is not None and found.helps else None, found)


def decide(
    question: Question, more: Sequence[Signals], limits: MachineLimits, choose: Choose, before: Standing | None = None, draws: int = DRAWS
) -> Decision:
    """The comparison of the sets on the recordings, and the next experiment."""
    data = prepare_all(question.sampling_rate, [*question.recordings, *more], question.tolerance, question.units)
    models = {names: found.model for names, found in zip(before.names, before.fits, strict=True)} if before is not None else {}
    now = standing(data, question.library, question.sets, [models.get(tuple(each)) for each in question.sets])
    beliefs = beliefs_of(data, question.library, now, limits.travel, draws)
    choice = choose(Setting.of(data), beliefs, limits) if len(beliefs) > 1 else None
    return Decision(now, tuple(item.effects for item in beliefs), choice)


def after(last: Decision, budget: Budget, experiments: int, seconds: float) -> Experiment | Ending:
    """The next experiment after a decision, or why there is none. experiments, seconds: used so far, s of motion."""
    over = last.over()
    if over is not None or last.then is None:
        return over or "impossible"
    if experiments >= budget.experiments:
        return "experiments"
    room = budget.seconds - seconds
    if room < MINIMUM:
        return "seconds"
    if experiments and experiments + 1 == budget.experiments:  # the earlier ones gave less than expected, and this is the last one
        longer, made = last.then.lasting(room), last.choice.found if last.choice is not None else None
        if made is None or not made.broken(longer):
            return longer
    unsure = last.choice is not None and last.choice.found is not None and not last.choice.found.possible
    if unsure and experiments + 1 < budget.experiments:  # it prepares a better experiment, which needs time too
        room = max(0.5 * room, MINIMUM)
    return last.then.lasting(min(last.then.seconds, room))
