"""What an effect pushed is taken over by the others that push by place: exactly, where they are the same law together."""

from __future__ import annotations

import numpy as np
import pytest

from xy_sysid.axis.model import AxisModel
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.forces import force_of, pushing, taken_over

RATE = 1000.0


@pytest.fixture(scope="module")
def data() -> AxisData:
    """A slow motion to and fro over a centimetre; what drives it does not matter here."""
    t = np.arange(20000) / RATE
    return prepare(RATE, np.random.default_rng(1).normal(size=t.size), 5e-3 * np.sin(2.0 * np.pi * 0.7 * t) + 1e-3 * np.sin(2.0 * np.pi * 3.1 * t))


def test_a_spring_takes_over_a_load_by_resting_elsewhere(data: AxisData) -> None:
    both = AxisModel(0.1, 1e-3, 100.0).with_effect("return_spring", (100.0, 2e-4, 8.7)).with_effect("constant_load", (5.0,))
    spring = taken_over(data, both.with_effect("coulomb_friction", (0.2,)), "constant_load")
    assert dict(spring.effects)["coulomb_friction"] == (0.2,)
    stiffness, rest, softening = dict(spring.effects)["return_spring"]
    assert stiffness == pytest.approx(100.0, rel=2e-3)
    assert rest == pytest.approx(-0.05, rel=5e-3)
    assert abs(softening) * rest**2 < 0.01
    counts = data.counts(early=True)
    wanted = force_of(data, both, "return_spring", counts) + 5.0
    assert force_of(data, spring, "return_spring", counts) == pytest.approx(wanted, abs=1e-4)


def test_what_alone_pushes_by_place_leaves_the_others_as_they_are(data: AxisData) -> None:
    model = AxisModel(0.1, 1e-3, 100.0).with_effect("coulomb_friction", (0.2,)).with_effect("constant_load", (5.0,))
    assert pushing(model) == ["constant_load"]
    assert taken_over(data, model, "constant_load") == model.without("constant_load")


def test_friction_is_not_taken_over_by_a_load(data: AxisData) -> None:
    model = AxisModel(0.1, 1e-3, 100.0).with_effect("coulomb_friction", (0.2,)).with_effect("constant_load", (5.0,))
    assert taken_over(data, model, "coulomb_friction") == model.without("coulomb_friction")


def test_a_law_that_gives_no_number_takes_nothing_over(data: AxisData) -> None:
    model = AxisModel(0.1, 1e-3, 100.0).with_effect("hardening_stiffness", (np.nan, 0.0)).with_effect("constant_load", (5.0,))
    assert dict(taken_over(data, model, "constant_load").effects).keys() == {"hardening_stiffness"}
