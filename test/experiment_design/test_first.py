"""A first experiment for an axis with known limits only."""

from __future__ import annotations

import numpy as np
import pytest

from xy_sim.machine import Machine
from xy_sysid.excitation.lockstep import drive
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.first import _draws, first_experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.of_run import NextExperiment
from xy_sysid.settings import ExcitationSettings

LIMITS = MachineLimits(voltage=5.0, travel=(-0.14, 0.14))


@pytest.fixture(scope="module")
def found() -> NextExperiment:
    return first_experiment("x", 500.0, LIMITS)


def test_it_says_how_loud_which_band_and_how_long(found: NextExperiment) -> None:
    """Within the voltage and the travel, with margin, for every possible axis."""
    assert isinstance(found.experiment, Experiment)
    needs = found.needs
    assert needs is not None and 0.0 < needs.voltage <= 5.0 and found.seconds >= 30.0
    assert -0.14 <= needs.travel[0] < needs.reach[0] < needs.start == LIMITS.start < needs.reach[1] < needs.travel[1] <= 0.14
    assert needs.within == LIMITS.travel and needs.speed > 0.0 < needs.acceleration
    assert "known to 5 %" in found.sentence


def test_a_table_that_nobody_described_stays_within_its_limits(found: NextExperiment) -> None:
    """On the simulated table, voltage and travel stay within their limits, and no guard trips."""
    assert found.experiment is not None and found.needs is not None
    made = Machine.from_file("rigid.yaml")
    axes = dict.fromkeys(made.axes, found.experiment.excitation)
    record = drive(made, ExcitationSettings(rate=made.rate, lockstep=True, speed=0.0, axes=axes), 10.0)
    assert float(np.max(np.abs(record.voltage))) <= 5.0
    low, high = found.needs.travel
    assert low <= float(record.position.min()) and float(record.position.max()) <= high


def test_an_axis_that_its_friction_holds_may_carry_a_load() -> None:
    """A load to either side: the axis drifts during the experiment, but stays within the travel."""
    loads = [dict(model.effects)["constant_load"][0] / dict(model.effects)["coulomb_friction"][0] for model in _draws(LIMITS)]
    assert min(loads) < -0.3 and max(loads) > 0.3 and max(map(abs, loads)) <= 1.0


def test_where_no_experiment_is_safe_it_says_what_to_do() -> None:
    """A travel that the fastest axis leaves at once: no experiment, but a reference to the first run."""
    tight = MachineLimits(voltage=5.0, travel=(-0.14, 0.14), speed=1e-9)
    none = first_experiment("x", 500.0, tight)
    assert none.experiment is None and "run --first" in none.sentence
