"""Fits of the base and one effect: exact for our own simulations, and near the floor for data of ``xy_sim``."""

from __future__ import annotations

import functools
import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sim.parts import PARTS
from xy_sysid import jit
from xy_sysid.axis.model import STANDARD, AxisModel, simulate
from xy_sysid.errors import BadInput
from xy_sysid.excitation.lockstep import drive
from xy_sysid.greybox.floor import bands, count_size, encoder_noise
from xy_sysid.greybox.free_run import AxisData, GreyboxFit, fit_base, fit_with, look, prepare
from xy_sysid.greybox.one_step import one_step_fit
from xy_sysid.hypotheses.criteria import AT_FLOOR
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings, build

RATE = 2000.0
BASE = AxisModel(0.097, 1.29e-3, 246.0)
SIMULABLE = [effect.name for effect in STANDARD.acting if effect.simulable]
MADE = [name for name in SIMULABLE if name in PARTS and PARTS[name].group == "effect"]  # parts of the machines of xy_sim
SIZES: dict[str, tuple[float, ...]] = {  # if the typical size is hardly visible in 30 s, or outside the travel
    "hardening_stiffness": (3e4, 0.0),
    "position_dependent_gain": (0.1, 4e-3, 0.3),
    "cogging": (0.15, 2.5e-3, 0.3),
    "lead_error": (8e-6, 5e-3, 0.3),
    "gravity": (0.5, 0.3),
    "return_spring": (10.0, 0.004, 2000.0),
    "position_dependent_drag": (20.0,),
}
BASES = {"gravity": replace(BASE, gain=3.0)}  # a joint, which turns by tenths of a radian
MACHINES = {"gravity": ("joint.yaml", {"travel_min": -2.9, "travel_max": 2.9, "brake": 0.1, "centring": 0.0, "high": 100.0})}
LOOSE = {"hardening_stiffness.linear", "presliding_hysteresis.damping"}  # nearly zero, or nearly invisible


@functools.cache
def voltage(seconds: float, seed: int = 5) -> FloatArray:
    """Band noise of 1 V rms up to 300 Hz, and slow waves that make the axis travel."""
    n = int(seconds * RATE) + 1
    u = sosfilt(butter(4, 300, fs=RATE, output="sos"), np.random.default_rng(seed).standard_normal(n))
    return np.asarray(0.9 * u / u.std() + 0.5 * np.cos(2 * np.pi * 0.7 * np.arange(n) / RATE))


def own(name: str, seconds: float = 20.0) -> tuple[AxisModel, AxisData]:
    """A recording by this package's simulation; position-dependent laws use the position of the base's motion."""
    base = BASES.get(name, BASE)
    model = base.with_effect(name, SIZES.get(name))
    u = voltage(seconds)
    place = np.concatenate(([0.0], np.cumsum(simulate(base, RATE, u, np.zeros_like(u))) / RATE))
    x = np.concatenate(([0.0], np.cumsum(simulate(model, RATE, u, place)) / RATE))
    data = prepare(RATE, u, x + 1e-7 * np.random.default_rng(6).standard_normal(u.size))
    return model, replace(data, position=place)


@pytest.mark.parametrize("name", SIMULABLE)
def test_an_effect_is_fitted_back_from_its_own_simulation(name: str) -> None:
    """Every parameter within 2 % of the truth, without given start values; no error above the floor."""
    truth, data = own(name)
    found = fit_with(data, fit_base(data), [name])
    assert found.excess < AT_FLOOR
    for key, value in truth.values().items():
        estimate = found.parameter(key)
        if key not in LOOSE:
            assert estimate.value == pytest.approx(value, rel=0.02, abs=0.02 if key.endswith("phase") else 0.0), key


@pytest.mark.parametrize("name", ["gravity", "return_spring"])
def test_a_drive_that_is_wired_the_other_way_round_meets_the_same_spring(name: str) -> None:
    """With inverted voltage, the gain changes its sign, and restoring forces do not; as on a guide with two encoders."""
    truth, data = own(name)
    turned = replace(data, voltage=-data.voltage)
    found = fit_with(turned, fit_base(turned), [name])
    assert found.parameter("gain").value == pytest.approx(-truth.gain, rel=0.02)
    for key in (f"{name}.{item}" for item in STANDARD[name].names):
        assert found.parameter(key).value == pytest.approx(truth.values()[key], rel=0.05), key


@functools.cache
def machine_data(name: str, seconds: float = 30.0) -> AxisData:
    """The rigid machine of the other package, or its joint, with one effect of its default size."""
    file, excite = MACHINES.get(name, ("rigid.yaml", {}))
    machine = with_effects(Machine.from_file(file, 11), [] if name == "none" else [f"x:{name}"])
    axes = {axis: build(AxisExcitation, {"seed": 12 + k, **excite}) for k, axis in enumerate(machine.axes)}
    settings = build(ExcitationSettings, {"rate": machine.rate, "lockstep": True, "speed": 0.0, "block": 100, "ahead": 1, "axes": axes})
    recording = drive(machine, settings, seconds, lambda _: None)
    return prepare(recording.sampling_rate, *recording.axis("x"))


@functools.cache
def machine_base(name: str) -> GreyboxFit:
    return fit_base(machine_data(name))


def test_nothing_is_left_of_a_clean_machine() -> None:
    """Base parameters to 0.1 per cent, held-out error at the floor."""
    found = machine_base("none")
    assert found.excess < 0.02
    assert found.held_out_error < 1.04 * machine_data("none").noise  # the encoder alone; laws are accurate to a thousandth of the motion
    for key, value in {"gain": 0.097, "delay": 1.29e-3, "pole": 246.0}.items():
        assert found.parameter(key).value == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize("name", MADE)
def test_the_right_effect_explains_the_other_machine(name: str) -> None:
    """With independent physics code the excess falls below 0.05, and the held-out error to 1.05 times the floor."""
    base = machine_base(name)
    found = fit_with(machine_data(name), base, [name])
    assert found.excess < AT_FLOOR
    assert found.held_out_error < 1.06 * machine_data(name).noise
    assert found.excess <= base.excess


def test_backlash_is_measured_by_one_step_prediction_rather_than_by_free_simulation() -> None:
    """For this small gap free simulation of contact is close, but more than 1 % wrong; one-step prediction less than 0.5 %."""
    base, data, effect = machine_base("backlash"), machine_data("backlash"), STANDARD["backlash"]
    assert not effect.simulable
    free, followed = fit_with(data, base, ["backlash"]), one_step_fit(data, base, effect)
    far, near = (abs(found.parameter("backlash.gap").value / 20e-6 - 1.0) for found in (free, followed))
    assert followed.excess == 0.0
    assert near < 0.005
    assert far > 0.01


def test_the_wrong_effect_does_not_reach_the_floor() -> None:
    """Coulomb friction is not taken for a dead zone, nor a dead zone for Coulomb friction."""
    for true, wrong in (("coulomb_friction", "dead_zone"), ("dead_zone", "coulomb_friction"), ("cogging", "coulomb_friction")):
        assert fit_with(machine_data(true), machine_base(true), [wrong]).excess > 1.0


def test_traces_rank_most_effects_first_by_themselves() -> None:
    """The score test alone names at least 9 of 12 unmistakable effects."""
    names = [name for name in MADE if name not in ("stribeck_friction", "presliding_hysteresis", "screw_compliance")]
    right = [name for name in names if look(machine_data(name), machine_base(name), STANDARD.acting)[0].effect == name]
    assert len(right) >= 9, right


def test_intervals_hold_the_truth() -> None:
    """95 % intervals of base and Coulomb friction, 12 draws of noise: at least 8 in 10 hold, and none is absurdly wide."""
    model = BASE.with_effect("coulomb_friction", (0.2,))
    u = voltage(12.0)
    velocity = simulate(model, RATE, u, np.zeros_like(u))
    clean = np.concatenate(([0.0], np.cumsum(velocity) / RATE))
    held = total = 0
    for seed in range(12):
        data = prepare(RATE, u, clean + 1e-6 * np.random.default_rng(seed).standard_normal(u.size))
        found = fit_with(data, fit_base(data), ["coulomb_friction"])
        for key, value in model.values().items():
            estimate = found.parameter(key)
            held += estimate.low <= value <= estimate.high
            total += 1
            assert estimate.high - estimate.low < 0.05 * abs(value)
    assert held >= 0.8 * total


def test_the_encoder_is_read_from_the_data() -> None:
    """Its count exactly, its noise within a tenth."""
    x = np.cumsum(simulate(BASE, RATE, voltage(12.0), np.zeros_like(voltage(12.0)))) / RATE
    counted = np.round(x / 5e-7) * 5e-7
    assert count_size(counted) == pytest.approx(5e-7, rel=1e-6)
    assert count_size(x) == 0.0
    noisy = x + 2e-6 * np.random.default_rng(0).standard_normal(x.size)
    assert encoder_noise(RATE, noisy) == pytest.approx(2e-6, rel=0.1)
    assert encoder_noise(RATE, np.round(noisy / 5e-7) * 5e-7) == pytest.approx(2e-6, rel=0.1)


def test_the_same_data_give_the_same_fit_bit_for_bit() -> None:
    """No hidden randomness."""
    data = machine_data("none")
    assert fit_base(data).parameters == fit_base(data).parameters


def test_a_fit_is_the_same_on_one_core_and_on_three(monkeypatch: pytest.MonkeyPatch) -> None:
    """Derivatives computed on all cores equal sequential ones bit for bit, also for effects with states."""
    _, data = own("presliding_hysteresis", 8.0)
    fits = []
    for cores in (1, 3):
        monkeypatch.setattr(jit, "cores", functools.partial(int, cores))
        fits.append(fit_with(data, fit_base(data), ["presliding_hysteresis"]))
    assert fits[0].model == fits[1].model and fits[0].runs == fits[1].runs
    assert np.array_equal(fits[0].error, fits[1].error)


def test_data_that_cannot_be_fitted_are_refused() -> None:
    """Too short, not finite, not of one length."""
    with pytest.raises(BadInput, match="number of samples is 100"):
        prepare(RATE, np.zeros(100), np.zeros(100))
    with pytest.raises(BadInput, match="not finite"):
        prepare(RATE, np.zeros(1000), np.full(1000, np.nan))
    with pytest.raises(BadInput, match="one and the same"):
        prepare(RATE, np.zeros(1000), np.zeros(900))
    with pytest.raises(BadInput, match=r"sampling rate is 0\.0005 Hz; allowed: 3 Hz or more. Check the unit of time"):
        prepare(0.0005, np.zeros(1000), np.zeros(1000))  # microseconds instead of seconds: endless sub-steps


def test_friction_is_told_from_drag_where_the_base_alone_is_led_astray() -> None:
    """A slow machine under slow moves: the base fits friction as drag, and the fit with friction must leave that minimum."""
    rate, n = 1000.0, 20_001
    t = np.arange(n) / rate
    u = np.asarray(1.5 * np.sign(np.sin(2 * np.pi * 0.25 * t)) * (1.0 + 0.3 * np.sin(2 * np.pi * 0.11 * t)) + 0.1 * np.sin(2 * np.pi * 7.0 * t))
    truth = AxisModel(0.17, 0.4e-3, 2.2).with_effect("coulomb_friction", (0.58,))
    x = np.concatenate(([0.0], np.cumsum(simulate(truth, rate, u, np.zeros(n))) / rate))
    data = prepare(rate, u, x + 1e-7 * np.random.default_rng(2).standard_normal(n))
    base = fit_base(data)
    assert base.model.pole > 2.5
    found = fit_with(data, base, ["coulomb_friction"])
    for key in ("gain", "pole", "coulomb_friction.coulomb"):
        assert found.parameter(key).value == pytest.approx(truth.values()[key], rel=0.02)


def test_a_parameter_that_nothing_shows_has_no_interval() -> None:
    """A limit that the voltage never reaches has an infinite interval, and is not an error."""
    data = machine_data("none")
    found = fit_with(data, machine_base("none"), ["saturation"], {"saturation": (50.0,)})
    assert found.parameter("saturation.limit").high == np.inf
    assert found.parameter("gain").high < 0.0971


def test_a_trial_that_runs_away_has_infinite_power_and_warns_nobody() -> None:
    """An overflow of squares prints no warning."""
    layout = bands(RATE, 4096)
    spectrum = np.full((3, layout.band.size), 1e200 + 0.0j)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isinf(layout.power(spectrum)).all() and np.isinf(layout.powers(spectrum)).all()
