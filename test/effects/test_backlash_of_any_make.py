"""A gap is found with any contact: linear or stiffening, lightly or well damped, with friction on either side."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.gap_machines import GapMachine, driven

from xy_sysid.diagnosis.diagnose import diagnose
from xy_sysid.effects import EFFECTS
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import fit_base
from xy_sysid.greybox.one_step import error_without, filter_fit

GAP = EFFECTS["backlash"]


@pytest.mark.parametrize(
    "machine",
    [
        GapMachine(gap=30.0, contact=650.0, damping=0.05),
        GapMachine(gap=20.0, contact=500.0, damping=0.05, hertz=True, share=0.65),
        GapMachine(gap=8.0, contact=350.0, damping=0.4, share=0.35, table_rubs=0.15),
        GapMachine(gap=50.0, contact=1000.0, damping=0.1, hertz=True, share=0.45, motor_rubs=0.1),
    ],
    ids=["lightly damped", "Hertz", "a few counts before a table that rubs", "Hertz behind a motor that rubs"],
)
def test_the_gap_and_the_masses_come_out_right(machine: GapMachine) -> None:
    """To 10 % and 0.03, and the same filter without a gap has at least twice the innovations."""
    data = prepare(machine.fs, *driven(machine, 1))
    fit, found = filter_fit(data, fit_base(data), GAP)
    assert fit.parameter("backlash.gap").value == pytest.approx(machine.gap * machine.count, rel=0.1)
    assert fit.parameter("backlash.share").value == pytest.approx(machine.share, abs=0.03)
    assert error_without(data, found) > 2.0 * fit.held_out_error


def test_the_contact_comes_out_right_too() -> None:
    """For a linear contact, frequency and damping, and no stiffening."""
    machine = GapMachine(gap=30.0, contact=650.0, damping=0.05)
    data = prepare(machine.fs, *driven(machine, 2))
    fit = filter_fit(data, fit_base(data), GAP)[0]
    assert fit.parameter("backlash.rate").value == pytest.approx(2.0 * np.pi * 650.0, rel=0.05)
    assert fit.parameter("backlash.damping").value == pytest.approx(0.05, abs=0.02)
    assert fit.parameter("backlash.hertz").value < 0.1


def test_a_gap_is_named_at_a_low_sampling_rate() -> None:
    """Friction that explains most of the error does not hide the gap."""
    machine = GapMachine(gap=7.4, contact=678.0, damping=0.38, share=0.51, motor_rubs=0.2, fs=1000.0)
    found = diagnose(machine.fs, *driven(machine, 1))
    assert "backlash" in found.effects
    assert found.final.parameter("backlash.gap").value == pytest.approx(machine.gap * machine.count, rel=0.1)


def test_the_answer_is_the_same_in_other_units() -> None:
    """The search for a start does not depend on metres or volts."""
    machine = GapMachine(gap=30.0, contact=650.0, damping=0.05)
    u, y = driven(machine, 1)
    gaps = [_gap(prepare(machine.fs, u * volts, y * length)) / length for volts, length in ((1.0, 1.0), (300.0, 2000.0))]
    assert gaps[1] == pytest.approx(gaps[0], rel=1e-3)


def _gap(data: AxisData) -> float:
    return filter_fit(data, fit_base(data), GAP)[0].parameter("backlash.gap").value
