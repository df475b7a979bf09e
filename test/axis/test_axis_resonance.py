"""Resonances inside the loop: friction acts on the motion that the encoder sees."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sysid.axis.model import FINE, AxisModel, Library, simulate, simulator
from xy_sysid.axis.resonant_loop import roots
from xy_sysid.diagnosis.refine import refine
from xy_sysid.effects import EFFECTS
from xy_sysid.effects._contract import law
from xy_sysid.excitation.lockstep import drive
from xy_sysid.greybox.free_run import AxisData, fit_base, fit_with, prepare
from xy_sysid.linear.simulate import simulate as exact
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings, build

RATE = 2000.0
BASE = AxisModel(0.097, 1.29e-3, 246.0)
NOTHING = {"coulomb_friction": (1e-12,), "stribeck_friction": (1e-12, 1e-12, 0.01), "presliding_hysteresis": (1e-12, 1e-5, 1e-12)}
SHAPES = [("base_resonance", (0.04, 46.2, 0.015, 0.02)), ("base_resonance", (0.3, 80.0, 0.015, 0.03)), ("screw_compliance", (0.4, 110.0, 0.02, 0.03))]
DRY = ("coulomb_friction", "asymmetric_friction", "stribeck_friction", "presliding_hysteresis")
SMALL = [EFFECTS[name] for name in (*DRY, "base_resonance", "screw_compliance")]


@cache
def noise(n: int = 10_001) -> FloatArray:
    """(n,) band noise of 1 V rms."""
    u = sosfilt(butter(4, 300, fs=RATE, output="sos"), np.random.default_rng(1).standard_normal(n))
    return np.asarray(u / u.std())


def apart(one: FloatArray, other: FloatArray) -> float:
    """rms of the difference over rms."""
    return float(np.std(one - other) / np.std(other))


def transfer(values: tuple[float, ...]) -> TransferFunction:
    """Base and resonance as one rational function."""
    split, frequency, damping, pole_damping = values
    zero = 2 * math.pi * frequency
    pole = zero * (1.0 + split)
    top = np.array([1.0, 2 * damping * zero, zero**2]) * BASE.gain * BASE.pole * (pole / zero) ** 2
    return TransferFunction(top, np.convolve([1.0, BASE.pole, 0.0], [1.0, 2 * pole_damping * pole, pole**2]), BASE.delay)


@pytest.mark.parametrize("friction", NOTHING)
@pytest.mark.parametrize(("name", "values"), SHAPES)
def test_without_friction_the_loop_is_the_linear_machine(name: str, values: tuple[float, ...], friction: str) -> None:
    """With hardly any friction the result is the transfer function, to rounding, and the sampled section, to a thousandth."""
    u = noise()
    alone = BASE.with_effect(name, values)
    found = simulate(alone.with_effect(friction, NOTHING[friction]), RATE, u, np.zeros_like(u))
    assert apart(found, np.diff(exact(transfer(values), RATE, u)) * RATE) < 1e-9
    assert apart(found, simulate(alone, RATE, u, np.zeros_like(u))) < 1e-3


def test_two_resonances_stand_in_one_loop() -> None:
    """Base and screw together: without friction, the same as one after the other."""
    u = noise()
    both = BASE.with_effect(*SHAPES[0]).with_effect(*SHAPES[2])
    found = simulate(both.with_effect("coulomb_friction", (1e-12,)), RATE, u, np.zeros_like(u))
    assert apart(found, simulate(both, RATE, u, np.zeros_like(u))) < 1e-3


def test_half_the_sub_step_changes_next_to_nothing() -> None:
    """Every friction with every resonance: below 1e-4 of the motion."""
    library, u = Library(SMALL), noise()
    for resonance in ("base_resonance", "screw_compliance"):
        for friction in DRY:
            model = AxisModel(0.097, 1.29e-3, 246.0, library=library).with_effect(friction).with_effect(resonance)
            row = np.array(list(model.values().values()))
            one, other = (simulator(library, (friction, resonance), RATE, u, np.zeros_like(u), fine)(row) for fine in (FINE, 2.0 * FINE))
            assert apart(one, other) < 1e-4, (resonance, friction)


@pytest.mark.parametrize("friction", DRY)
def test_a_vanishing_resonance_leaves_friction_alone(friction: str) -> None:
    """A split of 1e-4 moves the result by no more than a few times that."""
    u = noise()
    alone = BASE.with_effect(friction)
    found = simulate(alone.with_effect("base_resonance", (1e-4, 46.0, 0.1, 0.1)), RATE, u, np.zeros_like(u))
    assert apart(found, simulate(alone, RATE, u, np.zeros_like(u))) < 1e-3


def test_friction_holds_the_axis_while_the_base_swings_and_lets_go() -> None:
    """At rest at the encoder after the voltage is cut; a base whose force exceeds friction breaks the axis loose."""
    u = np.concatenate((np.full(2000, 3.0), np.zeros(4001)))
    swinging = BASE.with_effect("base_resonance", (0.2, 10.0, 0.03, 0.1))
    held = simulate(swinging.with_effect("coulomb_friction", (1.0,)), RATE, u, np.zeros_like(u))
    torn = simulate(swinging.with_effect("coulomb_friction", (0.1,)), RATE, u, np.zeros_like(u))
    assert np.all(held[2010:] == 0.0)
    moving = torn[2010:] != 0.0
    assert np.count_nonzero(np.diff(moving.astype(int))) >= 10
    assert not np.any(moving[-200:])


def test_the_sign_of_the_gain_turns_the_motion_round_with_a_resonance_too() -> None:
    """A drive with a negative gain has the same friction and the same frame."""
    u = noise()
    for friction in ("coulomb_friction", "stribeck_friction", "presliding_hysteresis"):
        one = simulate(BASE.with_effect(friction).with_effect("base_resonance"), RATE, u, np.zeros_like(u))
        other = simulate(AxisModel(-0.097, 1.29e-3, 246.0).with_effect(friction).with_effect("base_resonance"), RATE, u, np.zeros_like(u))
        assert other == pytest.approx(-one, abs=1e-9), friction


def test_a_fits_wild_trial_gives_numbers() -> None:
    """The bounds of the parameters do not make the loop overflow."""
    u = noise()
    for pole, values in ((1e5, (10.0, 90.0, 1.0, 1.0)), (1e-2, (1e-4, 1.0, 1e-4, 1e-4)), (50.0, (10.0, 90.0, 1e-4, 1.0))):
        for friction in DRY:
            model = AxisModel(0.097, 1.29e-3, pole).with_effect("base_resonance", values).with_effect(friction)
            assert np.all(np.isfinite(simulate(model, RATE, u, np.zeros_like(u)))), (pole, friction)


def test_a_section_without_roots_in_s_stays_behind_the_loop() -> None:
    """A user's mean of two samples is no resonance: it filters the sampled motion, friction or not."""

    @law
    def section(split: float) -> tuple[float, float, float, float, float]:
        return 1.0 - split, split, 0.0, 0.0, 0.0

    made = EFFECTS["base_resonance"]
    own = replace(
        made,
        name="two_samples",
        parameters=made.parameters[:1],
        functions={"section": section},
        guesses=None,
        joint=None,
        family="",
        mode_frequency="",
    )
    u, still = noise(), np.zeros_like(noise())
    library = Library([EFFECTS["coulomb_friction"], own])
    rigid = AxisModel(0.097, 1.29e-3, 246.0, library=library).with_effect("coulomb_friction")
    alone, found = simulate(rigid, RATE, u, still), simulate(rigid.with_effect("two_samples", (0.3,)), RATE, u, still)
    assert found[1:] == pytest.approx(0.7 * alone[1:] + 0.3 * alone[:-1], abs=1e-12)
    assert math.isnan(roots(0.5, 0.0, RATE)[0])


@cache
def table(machine: str, effects: tuple[str, ...]) -> AxisData:
    """60 s of the other package's machine."""
    made = with_effects(Machine.from_file(machine, 11), effects)
    axes = {axis: build(AxisExcitation, {"seed": 12 + k}) for k, axis in enumerate(made.axes)}
    settings = build(ExcitationSettings, {"rate": made.rate, "lockstep": True, "speed": 0.0, "block": 100, "ahead": 1, "axes": axes})
    recording = drive(made, settings, 60.0, lambda _: None)
    return prepare(recording.sampling_rate, *recording.axis("x"))


CASES = [
    ("paper.yaml", ("coulomb_friction=0.2",), ("base_resonance", "coulomb_friction"), 46.2),
    ("paper.yaml", ("presliding_hysteresis=0.25",), ("base_resonance", "presliding_hysteresis"), 46.2),
    ("rigid.yaml", ("screw_compliance", "asymmetric_friction"), ("screw_compliance", "asymmetric_friction"), 110.0),
]


@pytest.mark.parametrize(("machine", "effects", "names", "frequency"), CASES)
def test_friction_and_resonance_reach_the_floor(machine: str, effects: tuple[str, ...], names: tuple[str, ...], frequency: float) -> None:
    """Held-out error within 1.1 of the floor, and the antiresonance and the level of the machine."""
    data = table(machine, effects)
    found = fit_with(data, fit_base(data), names)
    assert found.excess < 0.05
    assert found.held_out_error < 1.1 * found.noise_floor
    assert found.parameter(f"{names[0]}.frequency").value == pytest.approx(frequency, rel=2e-3)
    level = 0.25 if "presliding" in names[1] else 0.2
    assert found.parameter(f"{names[1]}.coulomb").value == pytest.approx(level, rel=2e-3)


def test_refining_by_itself_finds_friction_on_the_default_machine() -> None:
    """The table of the paper with Coulomb friction: both effects are named, and the residual error is at the floor."""
    ladder = refine(table(*CASES[0][:2]))
    assert ladder.explained
    assert set(ladder.effects) == {"base_resonance", "coulomb_friction"}
