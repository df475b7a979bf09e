"""What is tried by one-step prediction leaves the search as it is."""

from __future__ import annotations

from dataclasses import replace

from helpers.foreign import Joint, driven

from xy_sysid.axis.model import STANDARD
from xy_sysid.hypotheses.criteria import SIZE
from xy_sysid.diagnosis.refine import never
from xy_sysid.greybox.axis_data import prepare
from xy_sysid.greybox.free_run import GreyboxFit, fit_with
from xy_sysid.judge.axis_judge import AxisJudge
from xy_sysid.search.best_first import Node, Search
from xy_sysid.search.one_step_trials import OneStepTrials

RUBS = Joint(fs=1000.0, seconds=20.0, count=1e-6, mass=1.0, drag=20.0, coulomb=1.0, shake=3.0)


def test_a_set_beside_which_a_gap_is_tried_and_that_is_not_worth_its_names_stays_as_it_is() -> None:
    """Were it known on all data, nobody would ask any more whether these show what the beginning does not."""
    judge = AxisJudge(prepare(RUBS.fs, *driven(RUBS, 1)), STANDARD)
    rigid = judge.begin()
    search: Search[GreyboxFit] = Search(judge, never, 10.0, 4, SIZE)
    search.nodes[frozenset()] = Node(frozenset(), rigid, rigid, 0, whole=True)
    faint = frozenset({"constant_load"})
    fit = fit_with(judge.data, rigid, ["constant_load"], brief=True)
    search.nodes[faint] = Node(faint, replace(fit, excess=0.5 * rigid.excess), fit, 1, whole=False, leads=False)
    trials = OneStepTrials(judge, search)
    trials.look("backlash", search.best, last=True)
    assert {effects for _, effects in trials.fitted} == {frozenset(), faint}
    assert not search.nodes[faint].whole and trials.found is None
