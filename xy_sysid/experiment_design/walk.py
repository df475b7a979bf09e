"""A series of experiments: after each recording all recordings are diagnosed together, and the next experiment is designed.

Each step is a pure function of the recordings so far and the step before, so that a walk can be replayed from its recordings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.diagnosis.of_run import diagnose
from xy_sysid.excitation.trajectory import Trajectory
from xy_sysid.experiment_design.as_trajectory import as_trajectory
from xy_sysid.experiment_design.design import expects
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.loop import Budget, Decision, Ending, Question, after, best_design, decide
from xy_sysid.experiment_design.of_run import NextExperiment, Tell, answered, check_enough
from xy_sysid.experiment_design.rivals import names_of, possible
from xy_sysid.greybox.axis_data import EPSILON, prepare_all
from xy_sysid.samples.joint_states import SAME_RATE
from xy_sysid.samples.recording import Run


@dataclass(frozen=True, slots=True)
class RobotJoint:
    """A joint of a robot that takes only trajectories: its effort is the input of the axis.

    joint: its name; topic: of its joint states; effort_lag: samples by which the effort is older than its stamp
    points: of a trajectory per second
    """

    joint: str
    topic: str
    points: float
    effort_lag: int = 0


@dataclass(frozen=True)
class WalkPlan:
    """axis: its name; limits: of the axis; budget: of the whole walk
    sets: of effects to distinguish; empty: those that the diagnosis leaves possible
    tolerance: part of the motion that a model may miss
    robot: None if the axis is driven with voltages; with it no predicted effort is larger than the largest recorded one
    """

    axis: str
    limits: MachineLimits
    budget: Budget = field(default_factory=lambda: Budget(experiments=4))
    sets: tuple[tuple[str, ...], ...] = ()
    library: Library = STANDARD
    tolerance: float = EPSILON
    robot: RobotJoint | None = None


@dataclass(frozen=True)
class WalkStep:
    """The state after some recordings, and the next step.

    diagnosis: of all recordings, in a sentence; decision: which sets are left; following: the next experiment, None at the end; ending: why
    answer: the same experiment with its requirements; experiments, seconds: used so far, s of motion
    motion: of the experiment, for a robot that takes only trajectories
    """

    diagnosis: str
    decision: Decision
    following: Experiment | None
    ending: Ending | None
    answer: NextExperiment | None
    experiments: int = 0
    seconds: float = 0.0
    motion: Trajectory | None = None

    @property
    def sentence(self) -> str:
        """The answer, or the expected result of the next experiment."""
        if self.ending is None:
            return self.answer.sentence if self.answer is not None else ""
        return told(self.decision, self.ending, self.answer)


def step(plan: WalkPlan, runs: Sequence[Run], before: WalkStep | None = None, tell: Tell = lambda part: None) -> WalkStep:
    """The diagnosis of all recordings so far, and the next experiment. tell: called with the progress of the design, 0..1.

    runs: the first recording, and one of each experiment so far; before: the step before the last experiment, None at the first
    Raises BadInput if the recordings do not suffice for a diagnosis, or if the last one ends outside the travel.
    """
    if plan.robot is not None:  # rates from jittering stamps of joint states differ a little
        rate = runs[0].sampling_rate
        runs = [replace(run, sampling_rate=rate) if abs(run.sampling_rate / rate - 1.0) <= SAME_RATE else run for run in runs]
    found = diagnose(list(runs), plan.library, tolerance=plan.tolerance)
    check_enough(found)
    rate, signals, units = runs[0].sampling_rate, [(run.voltage, run.position) for run in runs], runs[0].units
    limits = replace(plan.limits, start=float(runs[-1].position[-1]), units=units)
    if plan.robot is not None:
        limits = replace(limits, voltage=min(limits.voltage, max(float(np.max(np.abs(run.voltage))) for run in runs)))
    with threadpool_limits(1, "blas"):
        sets = plan.sets or possible(prepare_all(rate, signals, plan.tolerance, units), plan.library, found)
        question = Question(sampling_rate=rate, recordings=signals, sets=sets, library=plan.library, tolerance=plan.tolerance, units=units)
        decision = decide(
            question, (), limits, partial(best_design, tell=tell), before.decision.standing if before is not None else None, plan.budget.draws
        )
        experiments = before.experiments + 1 if before is not None else 0
        seconds = before.seconds + before.following.seconds if before is not None and before.following is not None else 0.0
        follows = after(decision, plan.budget, experiments, seconds)
        made = decision.choice.found if decision.choice is not None else None
        following = None if isinstance(follows, str) else follows
        if made is not None and made.best is not None and following is not None:  # the budget may have made it shorter, or longer
            now, wanted = made.lasting(following.seconds), made.best.experiment.seconds
            answer: NextExperiment | None = replace(answered(plan.axis, rate, now, plan.library, following), sentence=expects(now, wanted))
        else:
            answer = answered(plan.axis, rate, made, plan.library) if made is not None else None
        motion = None
        if plan.robot is not None and following is not None and answer is not None:
            best = decision.standing.fits[decision.standing.chosen].model
            motion = as_trajectory(answer, best, plan.robot.points)
    return WalkStep(
        diagnosis=found.sentence.rstrip(),
        decision=decision,
        following=following,
        ending=follows if isinstance(follows, str) else None,
        answer=answer,
        experiments=experiments,
        seconds=seconds,
        motion=motion,
    )


def steps(plan: WalkPlan, recordings: Sequence[Run]) -> Iterator[WalkStep]:
    """The steps of a walk with these recordings, in order; it ends with the last recording, or with a step after which nothing follows."""
    before: WalkStep | None = None
    for count in range(1, len(recordings) + 1):
        before = step(plan, recordings[:count], before)
        yield before
        if before.ending is not None:
            return


def told(decision: Decision, ending: Ending, answer: NextExperiment | None = None) -> str:
    """How a walk ended, in a sentence."""
    others = names_of([names for names in decision.standing.names if names not in decision.left])
    if ending == "settled":
        return f"Settled: {names_of([decision.chosen])}." + (f" The recordings rule out {others}." if others else "")
    if ending in ("alike", "impossible") and answer is not None:
        return f"{answer.sentence} {answer.ask}".rstrip()
    return still_open(ending, decision.left, decision.chosen)


def still_open(ending: Ending, left: Sequence[Sequence[str]], chosen: Sequence[str]) -> str:
    """Why no experiment follows although several sets are left, in a sentence."""
    why = {"experiments": "The budget of experiments is spent", "seconds": "The budget of seconds is spent", "stopped": "Stopped"}
    return f"{why.get(ending, 'Ended')}: {names_of(left)} are still possible, {names_of([chosen])} is the most probable."
