"""The diagnosis does not depend on the load of the computer."""

from __future__ import annotations

from itertools import count

import numpy as np
import pytest
from helpers.simulated import recorded

from xy_sysid.diagnosis.as_json import answer_document
from xy_sysid.diagnosis.of_run import diagnose
from xy_sysid.samples.recording import Run
from xy_sysid.story.story import begin, diagnosed


@pytest.fixture(scope="module")
def run() -> Run:
    return recorded("x:coulomb_friction", seconds=4.0).run("x")


def test_a_computer_that_stands_still_between_two_steps_gives_the_same_answer(run: Run) -> None:
    """A clock that advances by an hour at each reading, and a stopped one, give the same document without a budget."""
    hours = count(0, 3600)
    slow, quick = diagnose(run, clock=lambda: float(next(hours))), diagnose(run)
    assert answer_document(slow) == answer_document(quick) and not slow.stopped
    story = diagnosed(begin(run), run, clock=lambda: float(next(hours)))
    assert story.diagnosis is not None and story.diagnosis.sentence == quick.sentence and not story.diagnosis.stopped
    assert diagnose(run, budget=1.0, clock=lambda: float(next(hours))).stopped


def test_wherever_the_time_is_up_an_answer_comes() -> None:
    """A gap with friction and a spring, which needs every kind of trial: a budget that ends at any of them gives a verdict."""
    gap = recorded("backlash+coulomb_friction+return_spring", seconds=4.0).run("x")
    looks: list[int] = []

    def clock() -> float:
        """A clock that advances by a second at each reading."""
        looks.append(1)
        return float(len(looks))

    diagnose(gap, budget=1e9, clock=clock)
    for last in np.linspace(1, len(looks) - 1, 12):
        looks.clear()
        found = diagnose(gap, budget=float(last), clock=clock)
        assert found.verdict in ("missing_effect", "not_in_library", "nothing_missing") and found.stopped == (found.sentence.find("stopped") > 0)
