"""A search from given effects: they are kept, and no model without them is tested."""

from __future__ import annotations

import pytest
from helpers.simulated import recorded

from xy_sysid.axis.model import STANDARD
from xy_sysid.diagnosis.of_run import refine as refine_run
from xy_sysid.diagnosis.refine import Effort, refine
from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.samples.recording import Run

MODES = [effect.name for effect in STANDARD.acting if effect.category == "motion"]


@pytest.fixture(scope="module")
def data() -> AxisData:
    """An axis with a mode and dry friction."""
    return prepare(2000.0, *recorded("base_resonance+coulomb_friction", seconds=8.0).axis("x"))


@pytest.mark.parametrize("mode", MODES)
def test_a_search_goes_on_from_a_mode_that_was_given(mode: str, data: AxisData) -> None:
    """The mode keeps its name and its place; the friction is found in addition."""
    found = refine(data, given=[mode], effort=Effort(most=1))
    assert found.effects == (mode, "coulomb_friction")
    assert [rung.added for rung in found.rungs] == [None, *found.effects]


@pytest.mark.parametrize("mode", MODES)
def test_a_mode_that_was_given_stays_where_nothing_else_was_fitted(mode: str, data: AxisData) -> None:
    """Without a budget there is no set without the mode, and none is needed."""
    found = refine(data, given=[mode], effort=Effort(budget=-1.0, clock=lambda: 0.0))
    assert found.effects == (mode,) and found.stopped


def test_an_effect_that_is_given_twice_is_refused(data: AxisData) -> None:
    """Two steps of the ladder with one name would be the same model, fitted twice."""
    with pytest.raises(BadInput, match=r"coulomb_friction 2 times.*each effect once"):
        refine_run(Run("x", data.sampling_rate, data.voltage, data.position), ["coulomb_friction", "coulomb_friction"], auto=False)
