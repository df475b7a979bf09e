"""The encoder on the load, behind a spring: a resonance without an antiresonance."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.real_data import data
from helpers.simulated import recorded

import xy_sysid as xy
from xy_sysid.axis.linear_part import linear_part
from xy_sysid.axis.loop_source import undoable
from xy_sysid.axis.model import AxisModel
from xy_sysid.effects import EFFECTS

NAME = "load_side_resonance"


@pytest.mark.parametrize("hertz", [30, 110])
def test_a_screw_that_gives_is_named_as_the_encoder_sees_it(hertz: int) -> None:
    """The same machine with the encoder on the table, and on the motor: the antiresonance distinguishes them."""
    screw = f"screw_compliance,frequency={hertz}"
    seen_from_table = xy.diagnose(recorded(screw, encoder_on="table").run("x"))
    assert seen_from_table.effects == (NAME,)
    assert seen_from_table.explained > 0.98
    assert xy.diagnose(recorded(screw).run("x")).effects[0] in ("screw_compliance", "base_resonance")


def test_its_linear_part_has_two_poles_and_no_zeros() -> None:
    """A resonance of 60 Hz with damping 0.05, behind the base."""
    found = linear_part(AxisModel(0.1, 1e-3, 200.0).with_effect(NAME, (60.0, 0.05)))
    assert found.numerator.size == 1
    pair = next(root for root in np.roots(found.denominator) if root.imag > 0.0)
    assert abs(pair) == pytest.approx(2.0 * np.pi * 60.0, rel=1e-3)
    assert -pair.real / abs(pair) == pytest.approx(0.05, rel=1e-2)


def test_what_goes_in_does_not_follow_from_what_comes_out() -> None:
    """The load filters fast motion of the motor: unlike a pole-zero pair, the section cannot be removed from a recording."""
    assert not undoable(EFFECTS[NAME])
    assert undoable(EFFECTS["base_resonance"])


def test_the_two_mass_bench_is_explained() -> None:
    """Its authors give 58.9 Hz and no zero; a two-mass model has a training error of 8.9 rad/s."""
    file = data("tue_bench/load_side.mat")
    run = xy.load(file, columns={"input": "1", "output": "2"}, rate=4000.0, units={"output": "rad"}).run("x").until(40.0)
    found = xy.diagnose(run)
    assert found.effects[0] == NAME
    assert found.explained > 0.85
    assert found.final.parameter(f"{NAME}.frequency").value == pytest.approx(58.9, rel=0.01)
