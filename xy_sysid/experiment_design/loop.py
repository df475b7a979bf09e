"""Design, run, compare, and again, until one set of effects is left.

A pure function of the recordings that the experiments bring: with the same recordings it takes the same decisions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from xy_sysid.axis.model import Library
from xy_sysid.experiment_design.beliefs import Belief
from xy_sysid.experiment_design.design import Design, design
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.prediction import Setting
from xy_sysid.experiment_design.rivals import Standing, beliefs_of, standing
from xy_sysid.greybox.axis_data import EPSILON, prepare_all
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import USUAL, Units

Ending = Literal["settled", "impossible", "experiments", "seconds", "stopped"]
Signals = tuple[FloatArray, FloatArray]  # voltage and position, (n,) each
CarryOut = Callable[[Experiment], Signals | None]  # carries an experiment out; None if somebody stopped it
Choose = Callable[[Setting, Sequence[Belief], MachineLimits], Experiment | None]


@dataclass(frozen=True, slots=True)
class Budget:
    """experiments, seconds: of motion, at most; draws: of the parameters of each set."""

    experiments: int = 2
    seconds: float = 60.0
    draws: int = 6


@dataclass(frozen=True)
class Decision:
    """standing: how the sets explain all recordings so far; left: those that are still possible, the chosen one first; then: what comes next."""

    standing: Standing
    left: tuple[tuple[str, ...], ...]
    then: Experiment | None


@dataclass(frozen=True)
class Settled:
    """ended: why; steps: each decision, after the first recordings and after each experiment; recordings: of the experiments; seconds: of motion."""

    ended: Ending
    steps: tuple[Decision, ...]
    recordings: tuple[Signals, ...]
    seconds: float

    @property
    def effects(self) -> tuple[str, ...]:
        """The set that explains all recordings best."""
        last = self.steps[-1].standing
        return last.names[last.chosen]


@dataclass(frozen=True)
class Question:
    """sets: of effects that are to be distinguished; sampling_rate: Hz; recordings: voltage and position of those there are."""

    sampling_rate: float
    recordings: Sequence[Signals]
    sets: Sequence[Sequence[str]]
    library: Library
    tolerance: float = EPSILON
    units: Units = USUAL


def best_design(setting: Setting, beliefs: Sequence[Belief], limits: MachineLimits) -> Experiment | None:
    """The experiment of ``design``; None where none is more likely than not to tell."""
    found: Design = design(setting, beliefs, limits)
    return found.best.experiment if found.best is not None and found.helps else None


def decide(
    question: Question, more: Sequence[Signals], limits: MachineLimits, choose: Choose, before: Standing | None = None, draws: int = 6
) -> Decision:
    """What the recordings say, and what to measure next."""
    data = prepare_all(question.sampling_rate, [*question.recordings, *more], question.tolerance, question.units)
    known = tuple(found.model for found in before.fits) if before is not None else ()
    now = standing(data, question.library, question.sets, known)
    beliefs = beliefs_of(data, question.library, now, draws)
    then = choose(Setting.of(data), beliefs, limits) if len(beliefs) > 1 else None
    return Decision(now, tuple(item.effects for item in beliefs), then)


def settle(question: Question, limits: MachineLimits, run: CarryOut, budget: Budget | None = None, choose: Choose = best_design) -> Settled:
    """Go on until one set is left, no experiment can tell, or the budget is spent."""
    budget = budget or Budget()
    recordings: list[Signals] = []
    steps: list[Decision] = []
    spent = 0.0
    while True:
        steps.append(decide(question, recordings, limits, choose, steps[-1].standing if steps else None, budget.draws))
        last = steps[-1]
        if len(last.left) == 1:
            return Settled("settled", tuple(steps), tuple(recordings), spent)
        if last.then is None:
            return Settled("impossible", tuple(steps), tuple(recordings), spent)
        if len(recordings) >= budget.experiments:
            return Settled("experiments", tuple(steps), tuple(recordings), spent)
        room = budget.seconds - spent
        if room < MINIMUM:
            return Settled("seconds", tuple(steps), tuple(recordings), spent)
        experiment = last.then.lasting(min(last.then.seconds, room))
        found = run(experiment)
        if found is None:
            return Settled("stopped", tuple(steps), tuple(recordings), spent)
        recordings.append(found)
        spent += experiment.seconds


MINIMUM = 2.0  # s of motion that are worth an experiment
