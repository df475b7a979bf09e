"""The full machine: blocks, seeds, encoder, end stops, changes."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from xy_sim.machine import Machine
from xy_sim.parts import PARTS
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

EVERYTHING: dict[str, dict[str, float]] = {name: {} for name in PARTS if name not in ("presliding_hysteresis", "base_loosening")}


def noise(n: int, rms: float = 1.0, seed: int = 5) -> FloatArray:
    """(n, 2) white voltages, V."""
    return rms * np.random.default_rng(seed).standard_normal((n, 2))


@pytest.mark.parametrize("effects", [{}, EVERYTHING, {"presliding_hysteresis": {}}], ids=["paper", "everything", "presliding"])
@pytest.mark.parametrize("seed", [1, 2])
def test_any_split_into_blocks_gives_the_same_positions_bit_for_bit(effects: dict[str, dict[str, float]], seed: int) -> None:
    """The result is independent of chunking."""
    machine = Machine.from_file("paper.yaml", seed=3).with_parts(effects)
    u = noise(700)
    whole = machine.step(u)
    cuts = np.sort(np.random.default_rng(seed).integers(0, 700, 40))
    machine.reset()
    assert np.array_equal(np.concatenate([machine.step(block) for block in np.split(u, cuts)]), whole)
    machine.reset()
    assert np.array_equal(np.concatenate([machine.step(u[k : k + 1]) for k in range(700)]), whole)


def test_a_seed_repeats_its_noise_and_another_seed_does_not() -> None:
    """Deterministic in the seed; the motion itself does not depend on it."""
    u = noise(400)
    first, again, other = (Machine.from_file("paper.yaml", seed=seed).step(u) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert np.abs(first - other).max() <= 3 * 0.5e-6


def test_the_encoder_counts_half_a_micrometre_and_clean_does_not() -> None:
    """Quantization rounds to whole counts; sub-count noise moves it by a count at most here; clean is the exact motion."""
    u = noise(400)
    counted, clean = Machine.from_file("paper.yaml").step(u), Machine.from_file("paper.yaml", clean=True).step(u)
    assert np.allclose(counted / 0.5e-6, np.round(counted / 0.5e-6), atol=1e-6)
    assert np.abs(counted - clean).max() < 0.5 * 0.5e-6 + 5 * 0.1e-6
    assert np.unique(np.round(clean / 0.5e-6 % 1.0, 6)).size > 100


def test_a_row_is_read_before_its_voltage_acts() -> None:
    """Row k of the answer belongs to the start of the hold of row k of the voltage."""
    machine = Machine.from_file("rigid.yaml", clean=True).with_parts({"time_delay": 0.0})
    y = machine.step(np.ones((3, 2)))
    assert y[0].tolist() == [0.0, 0.0]
    assert (y[1] > 0.0).all()
    assert machine.samples == 3


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_end_stops_hold_the_table_and_lose_energy(direction: float) -> None:
    """Driven into a stop it stays within the compliance of the contact, and settles there."""
    machine = Machine.from_file("rigid.yaml", clean=True)
    y = machine.step(np.full((9000, 2), 5.0 * direction))[:, 0] * direction
    force = 5.0 * machine.truth("x")["force_per_volt"]
    assert y.max() < 0.151
    assert y[-1] == pytest.approx(0.15 + force / 1e7, abs=1e-7)
    assert np.ptp(y[-100:]) < 1e-9


def test_the_rate_is_a_parameter() -> None:
    """At half the rate, the same voltage gives the same motion at the same times."""
    machine = Machine.from_file("paper.yaml", clean=True)
    slow = Machine(replace(machine.spec, rate=1000.0), clean=True)
    u = noise(200)
    assert np.allclose(machine.step(np.repeat(u, 2, axis=0))[::2], slow.step(u), rtol=0.0, atol=1e-12)


def test_parts_can_be_added_replaced_and_taken_away_without_touching_the_first_machine() -> None:
    """with_parts gives another machine."""
    machine = Machine.from_file("paper.yaml")
    other = machine.with_parts({"coulomb_friction": 0.3, "base_resonance": False}, axes=["x"])
    names = [part["name"] for part in other.truth("x")["parts"]]
    assert names == ["time_delay", "coulomb_friction"]
    assert other.truth("x")["parts"][1]["parameters"]["coulomb"] == {"value": 0.3, "unit": "V"}
    assert other.truth("y") == machine.truth("y")
    assert [part["name"] for part in machine.truth("x")["parts"]] == ["time_delay", "base_resonance"]


def test_the_truth_is_json() -> None:
    """Every machine's truth survives a round trip through JSON."""
    truth = Machine.from_file("paper.yaml").with_parts(EVERYTHING).truth("x")
    assert json.loads(json.dumps(truth)) == truth


def test_a_machine_too_fast_for_its_inner_step_is_refused() -> None:
    """Instead of meaningless numbers, an error gives the least inner rate, with which the machine is stable."""
    machine = Machine.from_file("rigid.yaml", clean=True)
    with pytest.raises(BadInput, match=r"inner_rate is 40000; allowed: at least 6\.67e\+04 Hz"):
        machine.with_parts({"amplifier_lag": 1e-5})
    finer = Machine(replace(machine.spec, inner_rate=1e5), clean=True).with_parts({"amplifier_lag": 1e-5})
    assert np.abs(finer.step(noise(400)) - machine.step(noise(400))).max() < 1e-5


@pytest.mark.parametrize("voltage", [np.zeros(3), np.zeros((3, 3)), np.full((2, 2), np.nan)], ids=["flat", "wide", "nan"])
def test_voltages_of_the_wrong_shape_are_refused(voltage: FloatArray) -> None:
    """One line, and the machine has not moved."""
    machine = Machine.from_file("rigid.yaml")
    with pytest.raises(BadInput, match="one column per axis"):
        machine.step(voltage)
    assert machine.samples == 0
