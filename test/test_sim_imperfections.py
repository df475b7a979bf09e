"""Dirt: each kind follows its law, and machines without it are unchanged."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from xy_sim.hidden import draw
from xy_sim.layout import numbers, slot
from xy_sim.machine import Machine
from xy_sim.parts import PARTS, cable_pull, chance, curve, uneven_lines
from xy_sysid.samples.block import FloatArray

GAIN, POLE, RATE = 0.097, 246.0, 2000.0  # of axis x of rigid.yaml: m/s/V, rad/s, Hz
OLD_PARTS = [  # of axis x, before dirt was introduced
    ["hardening_stiffness"],
    ["dead_zone", "stribeck_friction", "hardening_stiffness"],
    ["saturation"],
    ["backlash", "dead_zone", "asymmetric_friction"],
    ["coulomb_friction"],
]
OLD_LAST = [-0.0004745054294131418, -0.003311213669539962]  # m
DIRT = [name for name, part in PARTS.items() if part.group == "imperfection"]


def axis(**parts: Any) -> Machine:
    """Axis x of a rigid table with parts, without encoder errors."""
    machine = Machine.from_file("rigid.yaml", clean=True)
    return Machine(replace(machine.spec, axes=machine.spec.axes[:1]), clean=True).with_parts(parts)


def moved(machine: Machine, volts: FloatArray) -> FloatArray:
    """Positions, m."""
    return machine.step(volts[:, None])[:, 0]


def curve_of(machine: Machine, part: str) -> tuple[FloatArray, int]:
    """The numbers of the axis, and the index of the part's curve in them."""
    own = machine.spec.axes[0]
    return numbers(own.drive, own.parts), slot(f"{part}.curve.0")


def crawl(machine: Machine, volts: float = 0.1, seconds: float = 2.0) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time (s), position (m) and speed (m/s), once it has settled, under a constant voltage."""
    y = moved(machine, np.full(round(seconds * RATE), volts))
    time = np.arange(y.size) / RATE
    return time[200:-1], y[200:-1], (y[201:] - y[199:-2]) * RATE / 2.0


def test_a_curve_is_smooth_and_has_mean_zero_and_rms_one() -> None:
    """Periodic, with continuous curvature; another seed gives another curve."""
    heights, fine = curve.heights(7), np.arange(0.0, curve.KNOTS, 0.01)
    values = np.array([curve.value(heights, 0, x) for x in fine])
    assert values.mean() == pytest.approx(0.0, abs=1e-9) and values.std() == pytest.approx(1.0, rel=1e-3)
    assert np.abs(np.diff(values, 3)).max() < 2e-4  # a jump of the curvature by 2 would do that
    assert curve.value(heights, 0, -0.3) == pytest.approx(curve.value(heights, 0, curve.KNOTS - 0.3), rel=1e-9)
    assert not np.allclose(heights, curve.heights(8))


def test_chance_is_white_and_uniform() -> None:
    """Mean 0, variance 1/3, no correlation from sample to sample, within three standard errors."""
    drawn = np.array([chance.centred(5.0, k) for k in range(20_000)])
    assert abs(drawn.mean()) < 0.012 and drawn.var() == pytest.approx(1 / 3, abs=0.007)
    assert all(abs(np.corrcoef(drawn[:-lag], drawn[lag:])[0, 1]) < 0.022 for lag in (1, 2, 3, 7))
    assert np.abs(drawn).max() <= 1.0


def test_speed_follows_the_uneven_drag() -> None:
    """At slow speed it is gain times voltage over the drag's factor, within 0.5 % for the lag of the axis."""
    machine = axis(uneven_drag={"depth": 0.1})
    p, first = curve_of(machine, "uneven_drag")
    _, y, v = crawl(machine, 0.05, 4.0)
    factor = np.array([curve.around_one(p, first, 0.1, q / 3e-3) for q in y])
    assert np.ptp(factor) > 0.2
    assert np.abs(v * factor / (GAIN * 0.05) - 1.0).max() < 5e-3


def test_speed_falls_where_the_motor_constant_is_high() -> None:
    """Back-EMF grows with its square: speed is gain times voltage over the factor."""
    machine = axis(uneven_gain={"depth": 0.1})
    p, first = curve_of(machine, "uneven_gain")
    _, y, v = crawl(machine)
    factor = np.array([curve.around_one(p, first, 0.1, q / 3e-3) for q in y])
    assert np.abs(v * factor / (GAIN * 0.1) - 1.0).max() < 5e-3


def test_speed_follows_the_wandering_gain_and_friction() -> None:
    """Gain times its factor; minus the friction times its factor, including a constant Coulomb level."""
    machine = axis(gain_wander={"depth": 0.1, "time": 0.5})
    p, first = curve_of(machine, "gain_wander")
    t, _, v = crawl(machine, 1.0, 1.0)
    assert v == pytest.approx(GAIN * np.array([curve.around_one(p, first, 0.1, x / 0.5) for x in t - 1 / POLE]), rel=2e-3)
    machine = axis(friction_wander={"depth": 0.1, "time": 0.5}, coulomb_friction=0.3)
    p, first = curve_of(machine, "friction_wander")
    t, _, v = crawl(machine, 1.0, 1.0)
    factor = np.array([curve.around_one(p, first, 0.1, x / 0.5) for x in t])
    assert v == pytest.approx(GAIN * (1.0 / factor - 0.3), rel=5e-3)


def test_wandering_friction_moves_the_breakaway_and_the_bristles() -> None:
    """A mean level of 0.3 V does not hold 0.3 V at a factor below one; with bristles the sliding level also follows."""
    seed = next(k for k in range(1, 50) if curve.value(curve.heights(k), 0, 0.0) < -0.5)
    wander = {"depth": 0.2, "time": 1e3, "seed": seed}
    volts = np.full(400, 0.295)
    assert moved(axis(coulomb_friction=0.3), volts)[-1] == 0.0
    assert moved(axis(coulomb_friction=0.3, friction_wander=wander), volts)[-1] > 1e-4
    machine = axis(presliding_hysteresis=0.3, friction_wander=wander)
    p, first = curve_of(machine, "friction_wander")
    factor = curve.around_one(p, first, 0.2, 0.5 / 1e3)
    assert crawl(machine, 1.0, 1.0)[2][-1] == pytest.approx(GAIN * (1.0 / factor - 0.3), rel=2e-3)


def test_a_cable_pulls_by_place_and_the_other_way_on_the_way_back() -> None:
    """Forth and back differ by twice its level at one position; the position-dependent part is the curve."""
    machine = axis(cable_pull={"pull": 0.05})
    p, first = curve_of(machine, "cable_pull")
    forth = cable_pull.force(p, first, 0.05, 1e-3, 5e-3, 0.01, 1e-3)
    back = cable_pull.force(p, first, 0.05, 1e-3, 5e-3, 0.01, -1e-3)
    assert back - forth == pytest.approx(0.1)
    _, y, v = crawl(machine, 0.2)
    late = y > 8e-3
    expected = [0.2 + cable_pull.force(p, first, 0.05, 1e-3, 5e-3, q, 1e-3) for q in y[late]]
    assert v[late] / GAIN == pytest.approx(np.array(expected), rel=5e-3)


def test_weak_modes_are_where_they_say() -> None:
    """Two antiresonances at the frequencies of the masses alone, each just below a resonance (the motion: test_sim_physics)."""
    truth = axis(weak_modes={}).truth("x")
    assert truth["antiresonances_hz"] == pytest.approx([70.0, 190.0], rel=1e-6)
    assert all(1.0 < high / low < 1.01 for low, high in zip(truth["antiresonances_hz"], truth["resonances_hz"], strict=True))


def test_jitter_adds_speed_times_a_random_instant() -> None:
    """At constant speed the reading's error is white, uniform, of speed times the largest error."""
    volts = np.full(8000, 0.3)
    error = (moved(axis(sample_jitter={"largest": 10e-6}), volts) - moved(axis(), volts))[200:]
    assert np.abs(error).max() <= 0.3 * GAIN * 10e-6 * (1 + 1e-9)
    assert error.std() == pytest.approx(0.3 * GAIN * 10e-6 / np.sqrt(3.0), rel=0.03)
    assert abs(np.corrcoef(error[1:], error[:-1])[0, 1]) < 0.04


def test_uneven_lines_read_the_same_error_at_the_same_place() -> None:
    """Reading minus position is the law, independent of the path; zero at the origin; the motion is not affected."""
    volts = np.repeat([1.0, -1.0, 0.5], 1000)
    machine = axis(uneven_lines={})
    p, first = curve_of(machine, "uneven_lines")
    own = machine.spec.axes[0].parts["uneven_lines"]
    read, exact = moved(machine, volts), moved(axis(), volts)
    law = [uneven_lines.error(p, first, own["fine"], own["wave"], own["period"], own["length"], q) for q in exact]
    assert read - exact == pytest.approx(np.array(law), abs=1e-15)
    assert read[0] == 0.0 and np.ptp(read - exact) > 5e-6


def test_hum_is_at_the_mains_frequency_and_its_double() -> None:
    """Without a command the axis vibrates only at 50 and 100 Hz, with gain and pole of the drive."""
    y = moved(axis(mains_hum={"ripple": 0.02, "rectified": 0.01}), np.zeros(6000))[2000:]
    size = 2.0 * np.abs(np.fft.rfft(np.hanning(4000) * (y - y.mean()))) / 2000.0
    for frequency, volts in ((50.0, 0.02), (100.0, 0.01)):
        w = 2.0 * np.pi * frequency
        assert size[round(frequency * 2)] == pytest.approx(volts * GAIN / w / np.hypot(1.0, w / POLE), rel=1e-2)
    rest = np.delete(size, [*range(6), *range(96, 105), *range(196, 205)])
    assert rest.max() < 1e-3 * size[100]


@pytest.mark.parametrize("delay", [1.29e-3, 1.0e-3, 0.2e-3])
@pytest.mark.parametrize("sample", [3, 4, 5, 6])
def test_a_late_step_moves_as_one_with_another_delay(sample: int, delay: float) -> None:
    """To rounding, early or late, across the edge of a sample or not."""
    volts = np.zeros(40)
    volts[sample:] = 1.0
    steady = axis(time_delay=delay)
    late = delay + 150e-6 * chance.centred(7.0, sample)
    assert moved(steady.with_parts({"late_drive": {"largest": 150e-6}}), volts) == pytest.approx(
        moved(axis(time_delay=max(late, 0.0)), volts), abs=1e-13
    )


def test_first_order_steps_err_in_proportion_to_their_size() -> None:
    """Half the step gives half the error, in smooth motion and with stops; at 25 us it is below 3 % of the motion."""
    volts = np.random.default_rng(2).standard_normal(4000)
    cases: list[dict[str, Any]] = [{}, {"coulomb_friction": 0.2}, {"presliding_hysteresis": {}}, {"screw_compliance": {}}]
    for parts in cases:
        exact = moved(axis(**parts), volts)
        one, half = (moved(axis(**parts, first_order_steps=step), volts) - exact for step in (25e-6, 12.5e-6))
        speed = np.diff(exact).std()
        assert 1e-4 * speed < np.diff(one).std() < 3e-2 * speed, parts
        assert np.diff(half).std() / np.diff(one).std() == pytest.approx(0.5, abs=0.1), parts


def test_first_order_steps_find_a_stop_at_the_end_of_a_step_only() -> None:
    """An axis that friction stops stays at rest."""
    volts = np.repeat([1.0, 0.0], 200)
    y = moved(axis(coulomb_friction=0.2, first_order_steps={}), volts)
    exact = moved(axis(coulomb_friction=0.2), volts)
    assert np.ptp(y[-100:]) == 0.0
    assert 1e-9 < abs(y[-1] - exact[-1]) < 1e-4


@pytest.mark.parametrize("name", [name for name in DIRT if name != "first_order_steps"])
def test_halving_the_inner_step_changes_no_dirt(name: str) -> None:
    """Less than a tenth of an encoder count over 2 s."""
    volts = np.random.default_rng(0).standard_normal(4000)
    machine = axis(**{name: {}})
    finer = Machine(replace(machine.spec, inner_rate=2 * machine.spec.inner_rate), clean=True)
    assert np.abs(moved(machine, volts) - moved(finer, volts)).max() < 0.05e-6


def test_dirt_is_never_drawn_and_old_seeds_give_their_old_machines() -> None:
    """As before dirt was introduced: parts, sizes and motion."""
    for seed in range(40):
        assert not {name for own in draw(seed, (1, 3)).spec.axes for name in own.parts} & set(DIRT)
    assert [list(draw(seed, (1, 3)).spec.axes[0].parts)[1:] for seed in range(5)] == OLD_PARTS
    last = draw(0, (1, 3), clean=True).step(np.random.default_rng(0).standard_normal((4000, 2)))[-1]
    assert last == pytest.approx(OLD_LAST, rel=1e-9)
