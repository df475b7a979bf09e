"""The folder of a walk to a settled diagnosis: a bag of each recording, the file of each experiment, and what was decided when.

0, 1, 2, ... are the bags; next_1.yaml, ... the experiments; walk.json holds the plan and every step.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.bags.atomic import write_text
from xy_sysid.bags.opening import text_of
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.loop import Budget
from xy_sysid.experiment_design.walk import WalkPlan, WalkStep, steps
from xy_sysid.files.experiment import document
from xy_sysid.imports import load
from xy_sysid.samples.recording import Run
from xy_sysid.units import Units

NAME = "walk.json"
LONGEST = 1 << 24  # bytes of it; a step takes some thousand
UNKNOWN = "Give the folder of a walk: xy-sysid demo --settle and the page make them."


def step_document(step: WalkStep) -> dict[str, Any]:
    """A step as JSON: the diagnosis, the remaining sets of effects, and the next experiment."""
    answer = step.answer if step.following is not None else None
    return {
        "diagnosis": step.diagnosis,
        "chosen": list(step.decision.chosen),
        "left": [list(names) for names in step.decision.left],
        "compared": [list(names) for names in step.decision.standing.names],
        "sentence": step.sentence,
        "ending": step.ending,
        "experiments": step.experiments,
        "seconds": step.seconds,
        "words": answer.experiment.said(answer.limits.units) if answer is not None and answer.experiment is not None else "",
        "lasts": answer.seconds if answer is not None else 0.0,
        "file": document(answer) if answer is not None else None,
    }


def plan_document(plan: WalkPlan) -> dict[str, Any]:
    """A plan as JSON."""
    limits = {name: None if value in (float("inf"),) else value for name, value in asdict(plan.limits).items() if name != "units"}
    return {
        "axis": plan.axis,
        "limits": {**limits, "units": list(plan.limits.units)},
        "budget": asdict(plan.budget),
        "sets": [list(names) for names in plan.sets],
        "tolerance": plan.tolerance,
    }


def plan_of(told: dict[str, Any], library: Library = STANDARD) -> WalkPlan:
    """The plan of a document."""
    limits = {name: float("inf") if value is None else value for name, value in told["limits"].items() if name not in ("units", "travel")}
    return WalkPlan(
        axis=told["axis"],
        limits=MachineLimits(travel=(told["limits"]["travel"][0], told["limits"]["travel"][1]), units=Units(*told["limits"]["units"]), **limits),
        budget=Budget(**told["budget"]),
        sets=tuple(tuple(names) for names in told["sets"]),
        library=library,
        tolerance=told["tolerance"],
    )


def write_walk(folder: Path, plan: WalkPlan, done: Iterable[dict[str, Any]]) -> None:
    """The plan and the steps so far. done: their documents."""
    write_text(folder / NAME, json.dumps({"plan": plan_document(plan), "steps": list(done)}, indent=1))


def run_of(path: Path, axis: str) -> Run:
    """The longest stretch of an axis without a gap in one of the bags."""
    return load(path).run(axis)


def replayed(folder: Path, library: Library = STANDARD) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Each step of a walk as it was decided, and as its bags decide it now; the same pairs where nothing has changed.

    A step that somebody stopped is compared with what would have followed. Raises BadInput for a folder that is none.
    """
    try:
        told = json.loads(text_of(folder / NAME, "the plan of a walk", LONGEST))
        plan, kept = plan_of(told["plan"], library), list(told["steps"])
    except (BadRecording, ValueError, KeyError, TypeError, RecursionError) as problem:
        raise BadInput("walk", f"{folder}: {getattr(problem, 'problem', problem)}", f"a folder with {NAME}", UNKNOWN) from None
    recordings = [run_of(folder / str(number), plan.axis) for number in range(len(kept))]
    again = [json.loads(json.dumps(step_document(one))) for one in steps(plan, recordings)]
    return list(zip(kept, again, strict=False))
