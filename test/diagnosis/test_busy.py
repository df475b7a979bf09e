"""What is named does not depend on how busy the computer is."""

from __future__ import annotations

from itertools import count

import pytest
from helpers.simulated import recorded

from xy_sysid.diagnosis.findings import answer, findings
from xy_sysid.diagnosis.of_run import diagnose
from xy_sysid.files.effects import library
from xy_sysid.samples.recording import Run
from xy_sysid.story.story import begin, diagnosed


@pytest.fixture(scope="module")
def run() -> Run:
    return recorded("x:coulomb_friction", seconds=4.0).run("x")


def test_a_computer_that_stands_still_between_two_steps_gives_the_same_answer(run: Run) -> None:
    """A clock that leaps by an hour each time it is asked, and one that stands: the same document, unless somebody gave a budget."""
    hours = count(0, 3600)
    slow, quick = diagnose(run, clock=lambda: float(next(hours))), diagnose(run)
    assert answer(findings(slow, library())) == answer(findings(quick, library())) and not slow.stopped
    story = diagnosed(begin(run), run, clock=lambda: float(next(hours)))
    assert story.diagnosis is not None and story.diagnosis.sentence == quick.sentence and not story.diagnosis.stopped
    assert diagnose(run, budget=1.0, clock=lambda: float(next(hours))).stopped
