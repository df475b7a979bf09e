"""Two simulated axes that move each other, with known truth, and the verdict on whether two single-axis models suffice."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from xy_sim.couplings import Couplings
from xy_sim.machine import Machine
from xy_sysid.errors import BadInput
from xy_sysid.excitation.lockstep import drive
from xy_sysid.response.coupling import Coupling, coupling
from xy_sysid.response.frf import ComplexArray
from xy_sysid.response.windows import WindowShape
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings

SHAPE, BAND, SECONDS = WindowShape.of("hann", 1024, 0.5), (2.0, 200.0), 40.0


def machine(**values: float) -> Machine:
    """The rigid table with these couplings."""
    return Machine(replace(Machine.from_file("rigid.yaml").spec, rate=1000.0, inner_rate=10_000.0, coupling=Couplings(**values)))


def measured(table: Machine) -> Coupling:
    """The result of a minute with two independent noises."""
    axes = {name: AxisExcitation(seed=11 + k) for k, name in enumerate(table.axes)}
    recording = drive(table, ExcitationSettings(rate=table.rate, lockstep=True, speed=0.0, axes=axes), SECONDS)
    return coupling(recording, SHAPE, BAND)


def truth(table: Machine, frequency: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """(n,) reading of each axis of the other's motion, over the other's reading of its own."""
    mix = table.mixing(frequency)
    return mix[:, 0, 1] / mix[:, 1, 1], mix[:, 1, 0] / mix[:, 0, 0]


@pytest.mark.parametrize("what", [{"skew": 0.05}, {"skew": -0.02, "base_mass": 500.0, "base_direction": 0.4}])
def test_coupled_axes_are_found_with_their_size(what: dict[str, float]) -> None:
    """Each cross response over the other's own is the truth within its standard error; the verdict is that two models do not suffice."""
    table = machine(**what)
    found = measured(table)
    assert not found.suffice and "two single-axis models do not suffice there" in found.sentence
    for (i, j), true in zip(((0, 1), (1, 0)), truth(table, found.frequency), strict=True):
        own = found.response[:, j, j]
        error = np.abs(found.response[:, i, j] / own - true) / (found.sigma[:, i, j] / np.abs(own))
        assert float(np.sqrt(np.mean(error**2))) < 1.6 and float(np.median(error)) < 1.2
        assert float(np.mean(np.abs(found.response[:, i, j] / own - true) ** 2)) <= 0.1 * float(np.mean(np.abs(true) ** 2)) + 1e-5


def test_the_largest_coupling_is_where_the_base_swings() -> None:
    """A base at 60 Hz: the named band contains that frequency."""
    found = measured(machine(base_mass=300.0, base_frequency=60.0, base_damping=0.02))
    worst = int(np.argmax(found.coupling))
    assert found.band_edges[worst] <= 60.0 <= found.band_edges[worst + 1]


@pytest.mark.parametrize("what", [{}, {"skew": 0.001, "base_mass": 60_000.0}])
def test_axes_that_hardly_move_each_other_need_no_common_model(what: dict[str, float]) -> None:
    """None, a milliradian, a base of 60 t: an upper limit in per cent, not below the truth, and two single-axis models suffice."""
    table = machine(**what)
    found = measured(table)
    assert found.suffice and "two single-axis models suffice" in found.sentence, found.sentence
    assert max(float(np.max(np.abs(one))) for one in truth(table, found.frequency)) < 2.0 * found.largest


def test_any_blocks_give_the_same_positions() -> None:
    """The base's oscillation continues from block to block, bit for bit, and reset starts again."""
    table = machine(skew=0.05, base_mass=100.0)
    volts = np.random.default_rng(1).normal(size=(500, 2))
    whole = table.step(volts)
    table.reset()
    pieces = [table.step(volts[first : first + 7]) for first in range(0, 500, 7)]
    np.testing.assert_array_equal(np.concatenate(pieces), whole)


def test_one_axis_cannot_be_coupled(tmp_path: Path) -> None:
    """A machine file with coupling needs two axes; one of the package has them."""
    assert Machine.from_file("coupled.yaml").spec.coupling.any
    path = tmp_path / "one.yaml"
    path.write_text("base: joint.yaml\ncoupling: {skew: 0.1}\n")
    with pytest.raises(BadInput, match="two axes"):
        Machine.from_file(path)
