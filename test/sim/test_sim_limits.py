"""Each part agrees with its textbook limits: steady speeds, rest positions, thresholds, gaps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from xy_sim.dynamics import rates
from xy_sim.layout import BASE, BASE_SPEED, MOTOR_SPEED, STATES, numbers
from xy_sim.machine import Machine
from xy_sim.parts import PARTS
from xy_sysid.samples.block import FloatArray

GAIN = 0.097  # of axis x of rigid.yaml, m/s/V


def rigid(**parts: Any) -> Machine:
    """A rigid axis pair with parts, without encoder errors."""
    return Machine.from_file("rigid.yaml", clean=True).with_parts(parts)


def positions(machine: Machine, volts: float | FloatArray, seconds: float = 0.5) -> FloatArray:
    """Positions of axis x under a constant voltage, or a series of them."""
    series = np.full(int(seconds * machine.rate), volts) if isinstance(volts, float) else volts
    return machine.step(np.column_stack((series, np.zeros(series.size))))[:, 0]


def speed(machine: Machine, volts: float, seconds: float = 0.5) -> float:
    """Speed at the end of that, m/s."""
    return float((positions(machine, volts, seconds)[-2:] @ [-1.0, 1.0]) * machine.rate)


@pytest.mark.parametrize("machine", ["rigid.yaml", "paper.yaml"])
@pytest.mark.parametrize("volts", [0.01, -1.0])
def test_steady_speed_is_gain_times_voltage(machine: str, volts: float) -> None:
    """The velocity gain of the machine file is that of the encoder."""
    table = Machine.from_file(machine, clean=True)
    assert speed(table, volts, 1.0) == pytest.approx(GAIN * volts, rel=1e-6)
    assert table.truth("x")["velocity_gain"] == pytest.approx(GAIN, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "values", "volts", "eaten"),
    [
        ("coulomb_friction", {"coulomb": 0.3}, 1.0, 0.3),
        ("coulomb_friction", {"coulomb": 0.3}, -1.0, -0.3),
        ("stribeck_friction", {"excess": 0.2, "coulomb": 0.3}, 1.0, 0.3),
        ("presliding_hysteresis", {"coulomb": 0.3}, 1.0, 0.3),
        ("asymmetric_friction", {"asymmetry": 0.5, "coulomb": 0.2}, 1.0, 0.3),
        ("asymmetric_friction", {"asymmetry": 0.5, "coulomb": 0.2}, -1.0, -0.1),
        ("load_dependent_friction", {"share": 0.2}, 1.0, 0.2),
        ("load_dependent_friction", {"share": 0.2}, -2.0, -0.4),
        ("constant_load", {"load": 0.3}, 0.0, 0.3),
        ("constant_load", {"load": -0.3}, 1.0, -0.3),
        ("dead_zone", {"width": 0.2}, 1.0, 0.2),
        ("saturation", {"limit": 0.7}, -2.0, -1.3),
        ("viscous_friction", {"coefficient": 2.0}, 1.0, 2.0 * GAIN / (1 + 2.0 * GAIN)),
        ("gain_drift", {"rate": -0.5, "limit": 0.1}, 1.0, 0.1),
    ],
)
def test_steady_speed_shows_what_a_part_eats(name: str, values: dict[str, float], volts: float, eaten: float) -> None:
    """In steady motion the voltage minus friction is proportional to speed."""
    assert speed(rigid(**{name: values}), volts) == pytest.approx(GAIN * (volts - eaten), rel=1e-6)


@pytest.mark.parametrize(
    ("name", "values", "holds"),
    [
        ("coulomb_friction", {"coulomb": 0.3}, 0.3),
        ("stribeck_friction", {"excess": 0.2, "coulomb": 0.3}, 0.5),
        ("asymmetric_friction", {"asymmetry": 0.5, "coulomb": 0.2}, 0.3),
        ("dead_zone", {"width": 0.2}, 0.2),
    ],
)
@pytest.mark.parametrize("on_base", [False, True])
def test_nothing_moves_below_breakaway(name: str, values: dict[str, float], holds: float, on_base: bool) -> None:
    """At 99.9 % of the threshold the encoder is exactly still, at 100.1 % it moves."""
    more: dict[str, Any] = {"base_resonance": {}} if on_base else {}
    assert not positions(rigid(**{name: values}, **more), 0.999 * holds).any()
    assert positions(rigid(**{name: values}, **more), 1.001 * holds)[-1] > 0.0


def test_friction_that_grows_with_the_drive_adds_to_what_holds_the_table() -> None:
    """It holds while u <= coulomb + share u; the amplifier's lag comes before it."""
    others: tuple[dict[str, Any], ...] = ({}, {"amplifier_lag": {}})
    for more in others:
        parts: dict[str, Any] = {"load_dependent_friction": {"share": 0.2}, "coulomb_friction": {"coulomb": 0.3}, **more}
        assert not positions(rigid(**parts), 0.999 * 0.3 / 0.8).any()
        assert positions(rigid(**parts), 1.001 * 0.3 / 0.8)[-1] > 0.0


def test_coulomb_friction_stops_a_coasting_table_for_good() -> None:
    """After the voltage is off, speed reaches zero at the time of m v' = -drag v - friction, and stays zero."""
    machine = rigid(coulomb_friction={"coulomb": 0.3})
    positions(machine, 1.0)
    start = speed(machine, 1.0, 0.05)
    y = positions(machine, 0.0, 0.2)
    still = np.flatnonzero(np.diff(y) == 0.0)[0] / machine.rate
    expected = 0.00129 + math.log(1 + start / (GAIN * 0.3)) / 246.0
    assert expected <= still <= expected + 1.01 / machine.rate
    assert np.ptp(y[-200:]) == 0.0


def test_stribeck_friction_lets_go_with_a_jerk() -> None:
    """Slightly above breakaway the table reaches the speed of the lower friction, not near zero."""
    final = speed(rigid(stribeck_friction={"excess": 0.2, "coulomb": 0.3, "velocity": 0.01}), 0.52)
    left = 0.52 - 0.3 - 0.2 * math.exp(-((final / 0.01) ** 2))
    assert final > 0.015
    assert final == pytest.approx(GAIN * left, rel=1e-5)


def test_presliding_is_a_spring_that_keeps_a_permanent_set() -> None:
    """A slow ramp to half the level moves by length ln 2; back at zero volts a part of it remains."""
    machine = rigid(presliding_hysteresis={"coulomb": 0.3, "length": 10e-6})
    up = positions(machine, np.linspace(0.0, 0.15, 4000))[-1]
    back = positions(machine, np.linspace(0.15, 0.0, 4000))[-1]
    assert up == pytest.approx(10e-6 * math.log(2.0), rel=2e-2)
    assert 0.1e-6 < back < 0.5 * up


def test_a_load_is_held_by_its_voltage() -> None:
    """If the voltage acts before the load, without delay there is no motion."""
    assert np.abs(positions(rigid(constant_load={"load": 0.3}, time_delay=0.0), 0.3)).max() < 1e-15


def test_cogging_holds_a_voltage_below_its_amplitude_and_repeats_along_the_travel() -> None:
    """At rest A sin(k q) = V; in motion, the speed's ripple has the period lead / per_revolution."""
    parts: dict[str, Any] = {"cogging": {"amplitude": 0.2, "per_revolution": 4.0}}
    k = 2 * math.pi * 4 / 0.005
    assert positions(rigid(**parts), np.r_[np.linspace(0, 0.1, 2000), np.full(1000, 0.1)])[-1] == pytest.approx(math.asin(0.5) / k, rel=1e-6)
    y = positions(rigid(**parts), 0.4, 2.0)[1000:]
    ripple = np.diff(y) - np.mean(np.diff(y))
    waves = np.linspace(0.5, 1.5, 201) * k
    power = [abs(np.sum(ripple * np.exp(-1j * wave * y[1:]))) for wave in waves]
    assert waves[int(np.argmax(power))] == pytest.approx(k, rel=0.011)


def test_lead_error_is_what_the_encoder_reads_beyond_the_motion() -> None:
    """Reading minus motion is amplitude sin(2 pi q / lead), and the motion is not affected."""
    machine, plain = rigid(lead_error={"amplitude": 8e-6, "per_revolution": 1.0}), rigid()
    read, moved = positions(machine, 1.0), positions(plain, 1.0)
    assert np.allclose(read - moved, 8e-6 * np.sin(2 * np.pi * moved / 0.005), rtol=0.0, atol=1e-15)


def test_backlash_is_as_wide_as_its_gap() -> None:
    """After a reversal, motor minus table changes by the gap and the flanks' compliance."""
    machine = rigid(backlash={"gap": 20e-6})
    sides = []
    for volts in (1.0, -1.0):
        positions(machine, volts)
        state = machine.state("x")
        sides.append(state["motor"] - state["table"])
    drive = machine.spec.axes[0].drive
    give = drive.guide_share * drive.drag * GAIN / 2e7
    assert sides == pytest.approx([10e-6 + give, -10e-6 - give], rel=1e-6)


def test_inside_the_gap_the_motor_moves_alone() -> None:
    """Before contact the table does not move and the motor has only its own mass."""
    machine = rigid(backlash={"gap": 1e-3}, time_delay=0.0)
    y = positions(machine, 1.0, 0.0055)
    drive = machine.spec.axes[0].drive
    drag = (1 - drive.guide_share) * drive.drag
    tau, final = drive.rotor_mass / drag, drive.force_per_volt / drag
    t = np.arange(y.size) / machine.rate
    assert np.allclose(y, final * (t - tau * (1 - np.exp(-t / tau))), rtol=1e-6, atol=1e-15)
    assert machine.state("x")["table"] == 0.0


def test_a_soft_screw_winds_up_by_force_over_stiffness_and_shows_its_antiresonance() -> None:
    """The deflection in steady motion is guide drag over stiffness; the antiresonance at the motor encoder is the table on the screw."""
    machine = rigid(screw_compliance={"frequency": 110.0, "damping": 0.0})
    positions(machine, 1.0, 1.0)
    drive, state = machine.spec.axes[0].drive, machine.state("x")
    stiffness = drive.table_mass * (2 * math.pi * 110.0) ** 2
    assert state["motor"] - state["table"] == pytest.approx(drive.guide_share * drive.drag * GAIN / stiffness, rel=1e-3)
    assert machine.truth("x")["antiresonance_hz"] == pytest.approx(110.0, rel=1e-9)


def ringing(machine: Machine) -> float:
    """Frequency of the base over the next second, from its zero crossings, Hz."""
    series = []
    for _ in range(2000):
        machine.step(np.zeros((1, 2)))
        series.append(machine.state("x")["base"])
    base = np.array(series)
    rising = np.flatnonzero((base[:-1] < 0.0) & (base[1:] >= 0.0))
    exact = rising - base[rising] / (base[rising + 1] - base[rising])
    return float((exact.size - 1) / (exact[-1] - exact[0]) * machine.rate)


def test_a_base_rings_at_its_frequency_while_friction_locks_the_screw_and_falls_as_bolts_loosen() -> None:
    """The antiresonance is the base with the table locked; base_loosening lowers it by its drop, at its start."""
    machine = rigid(
        base_resonance={"frequency": 46.2, "damping": 1e-4}, coulomb_friction=1.0, base_loosening={"drop": 2.0, "start": 2.0, "rate": 100.0}
    )
    positions(machine, np.r_[np.full(40, 8.0), np.zeros(300)])
    assert ringing(machine) == pytest.approx(46.2, abs=0.01)
    positions(machine, 0.0, 1.0)
    assert ringing(machine) == pytest.approx(44.2, abs=0.01)
    assert machine.truth("x")["antiresonance_hz"] == pytest.approx(46.2, rel=1e-6)
    assert machine.truth("x", time=3.0)["antiresonance_hz"] == pytest.approx(44.2, rel=1e-6)


def test_the_base_gives_way_against_the_push() -> None:
    """With a negligible spring, the momentum of table and base is conserved."""
    machine = rigid(base_resonance={"frequency": 1.0, "damping": 0.0}, time_delay=0.0)
    positions(machine, 5.0, 0.002)
    state, base = machine.state("x"), machine.spec.axes[0].parts["base_resonance"]["mass"]
    table = machine.spec.axes[0].drive.table_mass * (state["motor_speed"] + state["base_speed"])
    assert table == pytest.approx(-base * state["base_speed"], rel=1e-3)
    assert table > 0.0


def test_friction_must_hold_a_resting_table_against_its_inertia_on_a_swinging_base() -> None:
    """With the table held by friction, table and base are one mass on the spring."""
    axis = rigid(base_resonance={"frequency": 46.2, "mass": 120.0, "damping": 0.0}, coulomb_friction=1.0).spec.axes[0]
    states = np.zeros((2, len(STATES)))
    states[0, BASE] = 1e-4
    needed = rates(numbers(axis.drive, axis.parts), states, 0, 0.0, 0.0, 0, 1)
    acceleration = -((2 * math.pi * 46.2) ** 2) * 1e-4
    assert states[1, BASE_SPEED] == pytest.approx(acceleration, rel=1e-12)
    assert needed == pytest.approx(-axis.drive.table_mass * acceleration, rel=1e-12)
    assert states[1, MOTOR_SPEED] == 0.0


def test_a_hardening_spring_balances_the_voltage_at_the_cube_root() -> None:
    """At rest cubic q^3 = V."""
    assert positions(rigid(hardening_stiffness={"cubic": 3000.0}), 0.5, 6.0)[-1] == pytest.approx((0.5 / 3000.0) ** (1 / 3), rel=1e-4)


@pytest.mark.parametrize(("volts", "values", "where"), [(0.5, {}, 0.05), (0.5, {"rest": 0.02}, 0.07), (0.0, {"rest": 0.02, "softening": 30.0}, 0.02)])
def test_a_return_spring_balances_the_voltage_by_its_stretch(volts: float, values: dict[str, float], where: float) -> None:
    """At rest stiffness (q - rest) = V; without voltage the table returns to the rest position."""
    assert positions(rigid(return_spring={"stiffness": 10.0, **values}), volts, 12.0)[-1] == pytest.approx(where, rel=1e-4)


def test_a_softening_spring_gives_way_further() -> None:
    """At rest stiffness q (1 - softening q^2) = V."""
    q = positions(rigid(return_spring={"stiffness": 10.0, "softening": 30.0}), 0.5, 20.0)[-1]
    assert q > 0.051
    assert 10.0 * q * (1.0 - 30.0 * q**2) == pytest.approx(0.5, rel=1e-4)


@pytest.mark.parametrize(("volts", "phase", "where"), [(0.5, 0.0, np.pi / 6), (-0.5, 0.0, -np.pi / 6), (0.0, 0.7, -0.7), (0.5, -1.0, 1 + np.pi / 6)])
def test_a_weight_is_held_by_its_sine_and_hangs_without_a_voltage(volts: float, phase: float, where: float) -> None:
    """At rest amplitude sin(q + phase) = V, on a joint with large rotation."""
    joint = Machine.from_file("joint.yaml", clean=True).with_parts({"gravity": {"amplitude": 1.0, "phase": phase}})
    assert joint.step(np.full((10_000, 1), volts))[-1, 0] == pytest.approx(where, rel=1e-6)


def test_drag_that_rises_along_the_travel_divides_the_speed_there() -> None:
    """At 1.3 times the drag of the middle the steady speed is 1.3 times lower."""
    y = positions(rigid(position_dependent_drag=3.0), 0.1, 13.0)
    there = int(np.argmin(np.abs(y - 0.1)))
    assert (y[there + 1] - y[there]) * 2000.0 == pytest.approx(0.1 * GAIN / 1.3, rel=1e-3)


def test_amplifier_lag_and_delay_each_cost_gain_times_their_time() -> None:
    """Long after a step the position is late by the sum of all time constants."""
    y = positions(rigid(amplifier_lag=1e-3), 1.0)
    assert (y.size - 1) / 2000.0 - y[-1] / GAIN == pytest.approx(0.00129 + 1e-3 + 1 / 246.0, rel=1e-9)


@pytest.mark.parametrize(("voltage", "over_mean"), [(1.0, 1.2), (-1.0, 0.8)])
def test_drag_that_differs_by_direction_divides_the_steady_speed(voltage: float, over_mean: float) -> None:
    """Forth at 1 / 1.2 of the mean's speed, back at 1 / 0.8."""
    assert speed(rigid(asymmetric_viscous_friction=0.2), voltage) == pytest.approx(voltage * GAIN / over_mean, rel=1e-9)


def test_quadratic_drag_solves_its_quadratic() -> None:
    """V = v / gain + coefficient v^2."""
    v = speed(rigid(quadratic_drag=40.0), 1.0)
    assert v / GAIN + 40.0 * v * v == pytest.approx(1.0, rel=1e-9)


def test_a_stronger_motor_constant_brakes_more_than_it_pushes() -> None:
    """At 1.5 times the mean motor constant the steady speed is 1.5 times lower, because back-EMF grows with its square."""
    y = positions(rigid(position_dependent_gain={"depth": 0.5, "period": 0.4}), 0.5, 3.0)
    peak = int(np.argmin(np.abs(y - 0.1)))
    assert (y[peak + 1] - y[peak - 1]) * 1000.0 == pytest.approx(GAIN * 0.5 / 1.5, rel=1e-3)


def test_a_loose_mass_is_not_felt_inside_its_gap_and_is_beyond() -> None:
    """Motion below half the gap is that of the machine without it; larger motion is not."""
    u = np.where(np.arange(400) < 2, 0.1, np.where(np.arange(400) < 4, -0.1, 0.0))
    parts = {"loose_mode": {"gap": 50e-6}}
    assert np.array_equal(positions(rigid(**parts), u), positions(rigid(), u))
    assert np.abs(positions(rigid(**parts), 40.0 * u) - positions(rigid(), 40.0 * u)).max() > 1e-6
    assert len(rigid(loose_mode={"gap": 0.0}).truth("x")["resonances_hz"]) == 1


def test_warm_grease_drags_less() -> None:
    """At the reference speed, after many time constants, half of depth is gone."""
    machine = rigid(thermal_viscosity={"depth": 0.4, "time": 0.05, "speed": 0.1})
    v = speed(machine, 1.0, 1.0)
    heat = (v / 0.1) ** 2
    assert machine.state("x")["heat"] == pytest.approx(heat, rel=1e-6)
    assert v == pytest.approx(GAIN / (1 - 0.4 * heat / (1 + heat)), rel=1e-6)


@pytest.mark.parametrize("name", PARTS)
def test_every_part_says_what_it_is(name: str) -> None:
    """Law, meaning, source and parameters with units, ranges that contain their defaults; and the default size has an effect."""
    part = PARTS[name]
    assert part.law and part.meaning and part.source
    for item in part.parameters:
        assert item.minimum <= item.default <= item.maximum and item.low <= item.high
        assert item.meaning and (item.unit or item.name in {"damping", "depth", "per_revolution", "asymmetry", "limit", "seed", "share"})
    u = np.random.default_rng(0).standard_normal((4000, 2))
    plain = Machine.from_file("paper.yaml", clean=True)
    with_it = plain.with_parts({name: {"start": 1.0} if name == "base_loosening" else {}})
    same = name in {"base_resonance", "time_delay"}  # the paper's table has them, of that size
    assert np.abs(plain.step(u) - with_it.step(u))[:, 0].max() > 1e-6 or same
