"""The steps to a settled diagnosis, from recordings in bags, and again from the same bags."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers.cli_tools import cli

from campaigns.bench.settle_pairs import PAIRS, carry_out, first_recording, limits, machine
from xy_sysid.axis.model import STANDARD
from xy_sysid.errors import BadInput
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.loop import Budget, Decision, NextChoice, after
from xy_sysid.experiment_design.rivals import Standing, gained
from xy_sysid.experiment_design.walk import RobotJoint, WalkPlan, step, told
from xy_sysid.files.walk import plan_document, plan_of, replayed, step_document, write_walk
from xy_sysid.imports import save
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import AxisExcitation

LAG = next(pair for pair in PAIRS if "amplifier_lag" in pair.sets[1])
LOUD = Experiment(AxisExcitation(kind="noise", rms=1.0), 8.0)


def decision(left: tuple[tuple[str, ...], ...], then: Experiment | None) -> Decision:
    """A decision with these sets remaining of three."""
    every = (("coulomb_friction",), ("stribeck_friction",), ("dead_zone",))
    return Decision(Standing(names=every, fits=(), chosen=0, doubt=0.0), left, NextChoice(then))


def test_a_walk_settles_and_its_bags_decide_the_same_again(tmp_path: Path) -> None:
    """Two steps on the simulated machine: first the wrong set, then only the right one. A replay from the bags gives the same steps."""
    made, plan = machine(LAG, 1, 1), WalkPlan("x", limits(LAG), Budget(experiments=2, seconds=30.0, draws=1), LAG.sets)
    signals, before, done, runs = first_recording(LAG, made, 1), None, [], []
    for number in range(2):
        recording = Recording.from_arrays(made.rate, *signals, axes=("x",))
        save(recording, tmp_path / str(number))
        runs.append(recording.run("x"))
        before = step(plan, runs, before)
        done.append(step_document(before))
        if before.following is not None:
            signals = carry_out(made, before.following)
    write_walk(tmp_path, plan, done)
    assert [one["chosen"] for one in done] == [[], ["amplifier_lag"]]
    assert done[0]["words"] and done[0]["file"]["experiment"]["needs"]["voltage"] <= LAG.voltage
    assert done[1]["ending"] == "settled" and done[1]["sentence"].startswith("Settled: amplifier_lag. The recordings rule out the rigid model.")
    said = cli("next", "--replay", tmp_path)
    assert said.code == 0 and "step 1: Settled: amplifier_lag." in said.out and "It was" not in said.out, said


def test_a_plan_is_read_as_it_was_written() -> None:
    """Limits, budget and sets; missing limits stay missing."""
    plan = WalkPlan("x", limits(LAG), Budget(experiments=3), LAG.sets)
    assert plan_of(json.loads(json.dumps(plan_document(plan))), STANDARD) == plan


def test_the_plan_of_a_robot_is_read_as_it_was_written() -> None:
    """The joint, its topic and its trajectories; reach and highest frequency are limits like others."""
    asked = replace(limits(LAG), reach=0.3, highest=25.0)
    plan = WalkPlan("x", asked, Budget(), LAG.sets, robot=RobotJoint("elbow", "/joint_states", 200.0, 1))
    assert plan_of(json.loads(json.dumps(plan_document(plan))), STANDARD) == plan


def test_a_folder_that_is_no_walk_is_refused(tmp_path: Path) -> None:
    """One line with the required input."""
    with pytest.raises(BadInput, match="walk"):
        replayed(tmp_path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"plan": {"limits": [1]}}', "walk.json: plan.axis is "),
        (("limits", [1]), "walk.json: plan.limits is .1.; allowed: Input should be an object"),
        (("limits", {"voltage": "5"}), "walk.json: plan.limits.voltage is '5'; allowed: Input should be a valid number"),
        (("limits", {"voltage": 5.0, "travel": [-1.0, 1.0], "speeed": 1.0}), "walk.json: plan.limits.speeed is 1.0; allowed: Unexpected"),
        (("budget", {"seconds": []}), "walk.json: plan.budget.seconds is "),
        (("sets", ["gravity"]), "walk.json: plan.sets.0 is 'gravity'"),
        ("[" * 100_000, "walk.json is .* recursion limit"),
    ],
)
def test_a_walk_that_was_edited_by_hand_is_refused_in_one_line(tmp_path: Path, text: str | tuple[str, Any], words: str) -> None:
    """The error names the key, for any value."""
    plan = plan_document(WalkPlan("x", limits(LAG), Budget(), LAG.sets))
    whole = text if isinstance(text, str) else json.dumps({"plan": {**plan, text[0]: text[1]}, "steps": []})
    (tmp_path / "walk.json").write_text(whole)
    with pytest.raises(BadInput, match=words) as refusal:
        replayed(tmp_path)
    assert "\n" not in str(refusal.value) and len(str(refusal.value)) < 400


def test_nothing_follows_what_is_settled_or_a_budget_that_is_spent() -> None:
    """One set left, no helpful experiment, the largest number of experiments, no seconds: each ending has its name."""
    budget, two = Budget(experiments=2, seconds=20.0), (("coulomb_friction",), ("stribeck_friction",))
    assert after(decision(two[:1], None), budget, 0, 0.0) == "settled"
    assert after(decision(two, None), budget, 0, 0.0) == "impossible"
    assert after(decision(two, LOUD), budget, 2, 10.0) == "experiments"
    assert after(decision(two, LOUD), budget, 1, 19.5) == "seconds"
    assert after(decision(two, LOUD), budget, 1, 15.0) == LOUD.lasting(5.0)
    assert after(decision(two, LOUD), budget, 0, 0.0) == LOUD
    assert after(decision(two, LOUD), budget, 1, 8.0) == LOUD.lasting(12.0)  # the last experiment uses all remaining seconds


def test_the_end_is_told_in_a_sentence() -> None:
    """The settled and the excluded sets; otherwise the sets that are still possible."""
    assert told(decision((("coulomb_friction",),), None), "settled") == (
        "Settled: coulomb_friction. The recordings rule out stribeck_friction, dead_zone."
    )
    two = (("coulomb_friction",), ("stribeck_friction",))
    assert told(decision(two, LOUD), "experiments") == (
        "The budget of experiments is spent: coulomb_friction, stribeck_friction are still possible, coulomb_friction is the most probable."
    )


def test_a_gain_that_one_recording_alone_shows_is_no_less_sure() -> None:
    """Windows without evidence in the first recording do not weaken the clear windows of an experiment, as pooling would."""

    begins = np.array([0, 25, 50, 75, 100, 125, 150, 175])
    one: Any = SimpleNamespace(scores=np.zeros(8))
    other: Any = SimpleNamespace(scores=np.array([0.1, -0.1, 0.1, -0.1, 9.0, 11.0, 10.0, 12.0]))
    two: Any = SimpleNamespace(steps=[slice(0, 100), slice(100, 200)], held_out=SimpleNamespace(begins=begins))
    alone: Any = SimpleNamespace(steps=[slice(0, 200)], held_out=SimpleNamespace(begins=begins))
    both, pooled = gained(two, one, other), gained(alone, one, other)
    assert both.nats == pooled.nats == pytest.approx(42.0)
    assert both.is_sure and not pooled.is_sure
