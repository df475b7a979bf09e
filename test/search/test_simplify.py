"""From a set to a simpler one: what is known of that one may have gone astray from elsewhere."""

from __future__ import annotations

from dataclasses import replace

import pytest
from helpers.foreign import Joint, driven

from xy_sysid.axis.model import STANDARD
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import GreyboxFit, fit, fit_base, fit_with
from xy_sysid.judge.axis_judge import AxisJudge
from xy_sysid.search.best_first import Node, Search
from xy_sysid.search.simplify import Simplifying

SLIDE = Joint(fs=1000.0, seconds=20.0, count=1e-6, mass=0.1, drag=10.0, coulomb=0.2, shake=1.0, band=(0.5, 60.0))


@pytest.fixture(scope="module")
def data() -> AxisData:
    """An axis with dry friction."""
    return prepare(SLIDE.fs, *driven(SLIDE, 1))


def settled(data: AxisData, found: GreyboxFit, known: GreyboxFit) -> Simplifying:
    """Gone to its end, from a set, with what the search knows of a simpler one."""
    judge = AxisJudge(data, STANDARD)
    search: Search[GreyboxFit] = Search(judge, lambda: 0.0, 10.0, 4, 0.25)
    for one in (fit_base(data), known, found):
        names = frozenset(name for name, _ in one.model.effects)
        search.nodes[names] = Node(effects=names, fit=one, brief=one, parameters=sum(len(values) for _, values in one.model.effects), whole=True)
    settling = Simplifying(judge, search, frozenset())
    while settling.step():
        pass
    return settling


def test_a_law_of_no_size_does_not_stay_because_the_set_without_it_went_astray(data: AxisData) -> None:
    """Friction alone was left with a hundredth of its size, and the load of nothing beside it made up for that."""
    right = fit_with(data, fit_base(data), ["coulomb_friction"])
    loaded = fit(data, right.model.with_effect("constant_load", (1e-4,)))
    lost = replace(fit_base(data), model=right.model.with_effect("coulomb_friction", (0.002,)))
    end = settled(data, loaded, lost).now
    assert end.effects == {"coulomb_friction"}
    assert end.fit.excess < right.excess + 0.03
    assert dict(end.fit.model.effects)["coulomb_friction"][0] == pytest.approx(0.2, rel=0.01)


def test_what_is_known_and_right_is_not_fitted_again(data: AxisData) -> None:
    """The very fit that the search has."""
    right = fit_with(data, fit_base(data), ["coulomb_friction"])
    loaded = fit(data, right.model.with_effect("constant_load", (1e-4,)))
    assert settled(data, loaded, right).now.fit is right


def test_an_effect_has_a_size_though_the_rigid_model_is_refused(data: AxisData) -> None:
    """Its delay may be at the bound; the model that a search began from is what every effect is compared with."""
    right = fit_with(data, fit_base(data), ["coulomb_friction"])
    settling = settled(data, right, right)
    settling.search.nodes[frozenset()].refused = "time_delay: 0.1 s is at its bound"
    assert settling.sizes()["coulomb_friction"] > 1.0
