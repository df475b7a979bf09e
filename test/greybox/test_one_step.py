"""Backlash and its companions: effects removed from a recording, judged by one-step prediction."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sysid.axis.model import STANDARD, AxisModel, simulate, undoer
from xy_sysid.diagnosis.rungs import with_one_more
from xy_sysid.effects import EFFECTS
from xy_sysid.effects._contract import Companions
from xy_sysid.effects.backlash.innovations import Innovations, View
from xy_sysid.errors import BadInput
from xy_sysid.excitation.lockstep import drive
from xy_sysid.greybox.axis_data import AxisData, prepare
from xy_sysid.greybox.free_run import GreyboxFit, fit_base, fit_with
from xy_sysid.greybox.one_step import one_step_fit
from xy_sysid.hypotheses.companions import extended
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings, build

RATE = 2000.0
BASE = (0.097, 1.29e-3, 246.0)


def noise(samples: int = 4001) -> FloatArray:
    return np.random.default_rng(1).standard_normal(samples)


def undone(name: str, values: tuple[float, ...], voltage: FloatArray, position: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, float]:
    undo = undoer(STANDARD, [name], RATE, voltage, position)
    return undo(np.array([*BASE, *values]), voltage.size - 1)


def test_a_dead_zone_is_taken_out_of_the_voltage() -> None:
    """The voltage behind the zone remains; position and forces are unchanged."""
    u, x = noise(), np.cumsum(noise()) * 1e-5
    held, where, against, through = undone("dead_zone", (0.3,), u, x)
    assert held == pytest.approx(np.where(np.abs(u) > 0.3, u - 0.3 * np.sign(u), 0.0)[:-1])
    assert where == pytest.approx(x)
    assert not against.any()
    assert through == 1.0


def test_a_scale_s_error_is_taken_out_of_the_position() -> None:
    """The computed position, with the scale's error added, is the measured one: to 1e-4 of the error."""
    x = np.linspace(-0.02, 0.03, 4001)
    _, where, _, _ = undone("lead_error", (8e-6, 0.005, 0.4), noise(), x)
    shown = where + 8e-6 * (np.sin(2.0 * np.pi * where / 0.005 + 0.4) - np.sin(0.4))
    assert np.max(np.abs(shown - x)) < 1e-9
    assert np.max(np.abs(where - x)) > 5e-6


def test_a_resonance_is_taken_out_of_the_motion_and_put_back() -> None:
    """Section and its inverse; the fraction of a jump that shows at once is the section's first coefficient."""
    values = (0.16, 46.2, 0.02, 0.03)
    x = np.cumsum(noise()) * 1e-5
    _, where, _, through = undone("base_resonance", values, noise(), x)
    b0, b1, b2, a1, a2 = EFFECTS["base_resonance"].functions["section"](*values, RATE)
    again = lfilter([b0, b1, b2], [1.0, a1, a2], np.diff(where))
    assert again == pytest.approx(np.diff(x), abs=1e-12)
    assert through == pytest.approx(b0)


def test_cogging_and_a_load_are_forces_against_the_drive() -> None:
    """At a position, in volts: one at the motor, the other on the table."""
    x = np.full(4001, 0.00125)
    assert undone("constant_load", (0.2,), noise(), x)[2][1] == pytest.approx(0.2)
    assert undone("cogging", (0.3, 0.005, 0.1), noise(), x)[2][0] == pytest.approx(0.3 * np.sin(2.0 * np.pi / 4.0 + 0.1))


def test_asymmetric_friction_is_coulomb_friction_under_a_load() -> None:
    """The same motion to rounding; joining and splitting give the same parameters."""
    whole = AxisModel(*BASE).with_effect("asymmetric_friction", (0.2, 0.4))
    parts = AxisModel(*BASE).with_effect("coulomb_friction", (0.2,)).with_effect("constant_load", (0.08,))
    u = noise()
    assert simulate(whole, RATE, u, np.zeros_like(u)) == pytest.approx(simulate(parts, RATE, u, np.zeros_like(u)), abs=1e-12)
    ((name, values),) = parts.joined().effects
    assert name == "asymmetric_friction"
    assert values == pytest.approx((0.2, 0.4))
    assert {part: pytest.approx(row) for part, row in whole.apart("asymmetric_friction").effects} == dict(parts.effects)
    assert parts.apart("coulomb_friction") is parts


def test_it_is_so_of_a_drive_that_is_wired_the_other_way_round_too() -> None:
    """A load has the sign of the drive, friction that of the motion; recordings with a negative gain exist."""
    gain, delay, pole = BASE
    whole = AxisModel(-gain, delay, pole).with_effect("asymmetric_friction", (0.2, 0.4))
    parts, u = AxisModel(-gain, delay, pole).with_effect("coulomb_friction", (0.2,)).with_effect("constant_load", (-0.08,)), noise()
    assert simulate(whole, RATE, u, np.zeros_like(u)) == pytest.approx(simulate(parts, RATE, u, np.zeros_like(u)), abs=1e-12)
    assert dict(parts.joined().effects)["asymmetric_friction"] == pytest.approx((0.2, 0.4))
    assert dict(whole.apart("asymmetric_friction").effects)["constant_load"] == pytest.approx((-0.08,))


def test_a_load_larger_than_the_friction_is_not_called_asymmetric_friction() -> None:
    """There is no such friction: both effects are kept."""
    model = AxisModel(*BASE).with_effect("coulomb_friction", (0.1,)).with_effect("constant_load", (0.3,))
    assert model.joined() is model


@cache
def machine(*effects: str) -> tuple[AxisData, GreyboxFit]:
    own = build(AxisExcitation, {"seed": 5})
    both = {"x": own, "y": build(AxisExcitation, {"seed": 6})}
    settings = build(ExcitationSettings, {"rate": RATE, "lockstep": True, "speed": 0.0, "block": 100, "ahead": 1, "axes": both})
    recording = drive(with_effects(Machine.from_file("rigid.yaml", 11), effects), settings, 16.0, lambda _: None)
    data = prepare(RATE, *recording.axis("x"))
    return data, fit_base(data)


def test_friction_that_differs_between_directions_is_found_beside_backlash() -> None:
    """Coulomb friction is already in the filter; a law with two levels replaces it, without a load on the table."""
    data, base = machine("backlash=30e-6", "asymmetric_friction=0.3,coulomb=0.2")
    start = fit_with(data, base, ["coulomb_friction"], screening=True)
    rungs = extended(data, start, EFFECTS["backlash"]).rungs
    name, last = rungs[-1]
    assert [rungs[0][0], name, len(rungs)] == ["backlash", "asymmetric_friction", 2]
    assert last.excess == 0.0
    assert last.parameter("backlash.gap").value == pytest.approx(30e-6, rel=0.02)
    assert last.parameter("asymmetric_friction.coulomb").value == pytest.approx(0.2, rel=0.03)
    assert last.parameter("asymmetric_friction.asymmetry").value == pytest.approx(0.3, rel=0.05)


def test_a_load_on_the_table_is_told_from_friction_that_differs_between_directions() -> None:
    """Across a gap only one acts on the motor; both numbers are right."""
    data, base = machine("backlash=30e-6", "constant_load=0.15", "coulomb_friction=0.2")
    start = fit_with(data, base, ["coulomb_friction"], screening=True)
    rungs = extended(data, start, EFFECTS["backlash"]).rungs
    assert [name for name, _ in rungs] == ["backlash", "constant_load"]
    last = rungs[-1][1]
    assert last.excess == 0.0
    assert last.parameter("constant_load.load").value == pytest.approx(0.15, rel=0.01)
    assert last.parameter("coulomb_friction.coulomb").value == pytest.approx(0.2, rel=0.03)
    assert last.parameter("backlash.gap").value == pytest.approx(30e-6, rel=0.02)


def test_nothing_is_put_beside_backlash_that_stands_alone() -> None:
    """One rung."""
    data, base = machine("backlash=30e-6")
    assert [name for name, _ in extended(data, base, EFFECTS["backlash"]).rungs] == ["backlash"]


def test_a_dead_zone_can_be_added_to_backlash_by_name() -> None:
    """The gap is kept, the dead zone gets its width; effects that depend on speed, or friction that depends on the input, are refused."""
    data, base = machine("backlash=30e-6", "dead_zone=0.15")
    alone = one_step_fit(data, base, EFFECTS["backlash"])
    both = with_one_more(data, STANDARD, base, alone, "dead_zone")
    assert both.held_out_error < 0.5 * alone.held_out_error
    assert both.parameter("dead_zone.width").value == pytest.approx(0.15, rel=0.05)
    for name in ("asymmetric_viscous_friction", "load_dependent_friction"):
        with pytest.raises(BadInput, match=f"effects is backlash with {name}; allowed: backlash with dry friction"):
            with_one_more(data, STANDARD, base, alone, name)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("coulomb_friction", (0.2,)),
        ("asymmetric_friction", (0.2, 0.4)),
        ("stribeck_friction", (0.12, 0.15, 0.01)),
        ("presliding_hysteresis", (0.2, 12e-6, 1.5)),
    ],
)
def test_friction_inside_the_filter_is_the_law_of_its_effect(name: str, values: tuple[float, ...]) -> None:
    """Without a gap and with a negligible weight of the encoder, the filter moves like the simulation; dry friction is smoothed near rest."""
    u = 3.0 * lfilter([0.3], [1.0, -0.7], noise())
    velocity = simulate(AxisModel(*BASE).with_effect(name, values), RATE, u, np.zeros_like(u))
    position = np.concatenate(([0.0], np.cumsum(velocity))) / RATE
    fit = Innovations(RATE, BASE, 1e6, beside_nothing(u, position), (EFFECTS[name],)).with_soft_contact(10.0)
    closed = fit.start(BASE, (1e-10, 0.4, 30e3, 0.5, 0.0, 0.0, 0.0, 0.0), values)
    fit.high[5] = closed[5]  # a contact far stiffer than the bounds of a fit
    out = fit.innovations(closed, View(u.size - 1, process_noise_factor=0.0, sub_steps=800)) * 1e6
    bent = name == "presliding_hysteresis"
    assert float(np.std(np.diff(out))) * RATE < (0.002 if bent else 0.01) * float(np.std(velocity))


def beside_nothing(voltage: FloatArray, position: FloatArray) -> Companions:
    none = np.zeros(0)
    return Companions(none, none, none, none, none.astype(np.bool_), lambda _, n: (voltage[:n], position[: n + 1], np.zeros((2, n)), 1.0))


@pytest.mark.parametrize(
    ("effect", "name", "values", "within"),
    [
        ("stribeck_friction=0.15,coulomb=0.12,velocity=0.01", "stribeck_friction", (0.12, 0.15, 0.01), 0.35),
        ("presliding_hysteresis=0.2,length=12e-6,damping=1.5", "presliding_hysteresis", (0.2, 12e-6, 1.5), 0.05),
    ],
)
def test_friction_that_bends_or_sticks_is_told_from_coulomb_friction_beside_a_gap(
    effect: str, name: str, values: tuple[float, ...], within: float
) -> None:
    """It replaces Coulomb friction in the filter, and the innovations fall; Stribeck's parameters stay uncertain, because sticking is smoothed."""
    data, base = machine("backlash=5e-6", effect)
    alone = one_step_fit(data, fit_with(data, base, ["coulomb_friction"], screening=True), EFFECTS["backlash"])
    both = with_one_more(data, STANDARD, base, alone, name)
    assert name in both.model
    assert "coulomb_friction" not in both.model
    assert both.held_out_error < 0.7 * alone.held_out_error
    assert dict(both.model.effects)[name][:2] == pytest.approx(values[:2], rel=within)
    assert both.parameter("backlash.gap").value == pytest.approx(5e-6, rel=0.1)
