"""The folder of a series of experiments towards a settled diagnosis: a bag per recording, a file per experiment, and all decisions.

0, 1, 2, ... are the bags; next_1.yaml, ... the experiments; walk.json holds the plan and every step.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.bags.atomic import write_text
from xy_sysid.bags.opening import text_of
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.loop import Budget
from xy_sysid.experiment_design.walk import RobotJoint, WalkPlan, WalkStep, steps
from xy_sysid.files.experiment import document
from xy_sysid.imports import Reading, load
from xy_sysid.samples.recording import Run
from xy_sysid.settings import AnySettings, Settings

NAME = "walk.json"
LONGEST = 1 << 24  # bytes of it; a step takes some thousand
SHOWN = 60  # characters of a value shown in an error message
UNKNOWN = "Give the folder of a walk: xy-sysid demo --settle and the page make them."


def step_document(step: WalkStep) -> dict[str, Any]:
    """A step as JSON: the diagnosis, the remaining sets of effects, and the next experiment."""
    answer = step.answer if step.following is not None else None
    words = answer.experiment.said(answer.limits.units) if answer is not None and answer.experiment is not None else ""
    return {
        "diagnosis": step.diagnosis,
        "chosen": list(step.decision.chosen),
        "left": [list(names) for names in step.decision.left],
        "compared": [list(names) for names in step.decision.standing.names],
        "sentence": step.sentence,
        "ending": step.ending,
        "experiments": step.experiments,
        "seconds": step.seconds,
        "words": f"the motion of {words}" if step.motion is not None else words,
        "lasts": answer.seconds if answer is not None else 0.0,
        "file": document(answer) if answer is not None else None,
    }


def plan_document(plan: WalkPlan) -> dict[str, Any]:
    """A plan as JSON, without limits that are not set."""
    limits = {name: value for name, value in asdict(plan.limits).items() if value != math.inf}
    return {
        "axis": plan.axis,
        "limits": {**limits, "units": list(plan.limits.units)},
        "budget": asdict(plan.budget),
        "sets": [list(names) for names in plan.sets],
        "tolerance": plan.tolerance,
        **({} if plan.robot is None else {"robot": asdict(plan.robot)}),
    }


class _Plan(Settings):
    """A plan as stored in JSON."""

    axis: str
    limits: MachineLimits
    budget: Budget
    sets: tuple[tuple[str, ...], ...]
    tolerance: float
    robot: RobotJoint | None = None


class _Walk(Settings):
    """The content of the file ``NAME``."""

    plan: _Plan
    steps: list[dict[str, Any]]


def plan_of(told: dict[str, Any], library: Library = STANDARD) -> WalkPlan:
    """The plan of a document."""
    return _plan(_read(_Plan, json.dumps(told), "plan"), library)


def _plan(told: _Plan, library: Library) -> WalkPlan:
    return WalkPlan(
        axis=told.axis, limits=told.limits, budget=told.budget, sets=told.sets, library=library, tolerance=told.tolerance, robot=told.robot
    )


def _read(kind: type[AnySettings], text: str, where: str) -> AnySettings:
    """The content of a JSON text. Raises BadInput that names the first wrong key."""
    try:
        return kind.model_validate_json(text, strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise BadInput(f"{where}: {key}" if key else where, repr(first["input"])[:SHOWN], first["msg"], UNKNOWN) from None


def write_walk(folder: Path, plan: WalkPlan, done: Iterable[dict[str, Any]]) -> None:
    """The plan and the steps so far. done: their documents."""
    write_text(folder / NAME, json.dumps({"plan": plan_document(plan), "steps": list(done)}, indent=1))


def run_of(path: Path, plan: WalkPlan) -> Run:
    """The longest gap-free run of the axis in one of the bags; of a robot's joint, its effort and position."""
    if plan.robot is None:
        return load(path).run(plan.axis)
    robot = plan.robot
    joints = (f"{plan.axis}={robot.joint}",)
    reading = Reading(joint_topic=robot.topic, effort_as_voltage=True, joints=joints, effort_lag=robot.effort_lag, axes=(plan.axis,))
    return load(path, reading).run(plan.axis)


def replayed(folder: Path, library: Library = STANDARD) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Each step of a walk as decided then, and as decided now from its bags; both are equal if nothing has changed.

    A stopped step is compared with the step that would have followed. Raises BadInput for a folder without a walk.
    """
    try:
        text = text_of(folder / NAME, "the plan of a walk", LONGEST)
    except BadRecording as problem:
        raise BadInput("walk", f"{folder}: {problem.problem}", f"a folder with {NAME}", UNKNOWN) from None
    told = _read(_Walk, text, f"walk {folder / NAME}")
    plan, kept = _plan(told.plan, library), told.steps
    recordings = [run_of(folder / str(number), plan) for number in range(len(kept))]
    again = [json.loads(json.dumps(step_document(one))) for one in steps(plan, recordings)]
    return list(zip(kept, again, strict=False))
