"""Dry friction whose level depends on the input: it takes its share, brakes, and sticks together with other dry friction."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from xy_sim.machine import Machine
from xy_sysid.axis.model import STANDARD, AxisModel, simulate, simulator
from xy_sysid.samples.block import FloatArray

RATE = 2000.0
BASE = AxisModel(0.097, 1.29e-3, 246.0)
SHARE = 0.2


def noise(count: int = 4001) -> FloatArray:
    """(count,) V, 1 V rms up to 300 Hz."""
    u = sosfilt(butter(4, 300, fs=RATE, output="sos"), np.random.default_rng(0).standard_normal(count))
    return np.asarray(u / u.std())


def speeds(model: AxisModel, voltage: FloatArray, start: float = 0.0) -> FloatArray:
    """(n - 1,) m/s."""
    run = simulator(model.library, [name for name, _ in model.effects], RATE, voltage, np.zeros(voltage.size))
    return run(model.row, start)


@pytest.mark.parametrize("gain", [0.097, -0.097])
@pytest.mark.parametrize("voltage", [1.0, -3.0])
def test_it_takes_its_share_of_a_constant_input(gain: float, voltage: float) -> None:
    """The steady speed is gain (1 - share) u, in both directions and for both signs of the gain."""
    model = AxisModel(gain, 1e-3, 246.0).with_effect("load_dependent_friction", (SHARE,))
    assert speeds(model, np.full(1000, voltage))[-1] == pytest.approx(gain * (1.0 - SHARE) * voltage, rel=1e-9)


def test_an_input_against_the_motion_brakes_with_the_friction() -> None:
    """The speed falls towards -gain (1 + share) |u|, and behind the reversal towards -gain (1 - share) |u|."""
    model = AxisModel(0.097, 0.0, 246.0).with_effect("load_dependent_friction", (SHARE,))
    start, u = 0.1, 0.5
    against, along = 0.097 * (1.0 + SHARE) * u, 0.097 * (1.0 - SHARE) * u
    turned = math.log1p(start / against) / 246.0
    end = 0.03
    shown = speeds(model, np.full(int(end * RATE) + 2, -u), start)
    position = float(np.sum(shown[: int(end * RATE)])) / RATE
    braking = -against * turned + (start + against) * -math.expm1(-246.0 * turned) / 246.0
    driving = -along * ((end - turned) - -math.expm1(-246.0 * (end - turned)) / 246.0)
    assert position == pytest.approx(braking + driving, rel=1e-9)


def test_with_coulomb_friction_the_axis_sticks_up_to_both_levels() -> None:
    """It holds exactly while |u| <= coulomb + share |u|, and moves above."""
    model = BASE.with_effect("load_dependent_friction", (SHARE,)).with_effect("coulomb_friction", (0.2,))
    threshold = 0.2 / (1.0 - SHARE)
    assert not speeds(model, np.full(400, 0.999 * threshold)).any()
    assert speeds(model, np.full(400, -1.001 * threshold))[-1] < 0.0


def test_alone_it_never_holds_the_axis() -> None:
    """The smallest input moves it."""
    model = BASE.with_effect("load_dependent_friction", (0.8,))
    assert speeds(model, np.full(400, 1e-6))[-1] == pytest.approx(0.2e-6 * 0.097, rel=1e-6)


def test_the_motion_doubles_with_the_input() -> None:
    """The law has no level of its own, so the response does not depend on the amplitude."""
    model, u = BASE.with_effect("load_dependent_friction", (SHARE,)), noise()
    assert speeds(model, 2.0 * u) == pytest.approx(2.0 * speeds(model, u), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("other", [("quadratic_drag", (1e-9,)), ("base_resonance", (1e-7, 60.0, 0.02, 0.02))])
def test_every_path_of_the_loop_gives_the_same_motion(other: tuple[str, tuple[float, ...]]) -> None:
    """In sub-steps, and with a resonance in the loop, as between switching instants."""
    model = BASE.with_effect("load_dependent_friction", (SHARE,)).with_effect("coulomb_friction", (0.2,))
    exact = speeds(model, noise())
    assert np.std(speeds(model.with_effect(*other), noise()) - exact) < 1e-5 * np.std(exact)


@pytest.mark.parametrize(
    ("more", "close"),
    [
        ((), 1e-5),
        (("coulomb_friction",), 1e-5),
        (("amplifier_lag", "coulomb_friction"), 5e-4),
        (("stribeck_friction",), 2e-4),
        (("presliding_hysteresis",), 2e-4),
    ],
)
def test_the_model_moves_as_the_simulated_machine(more: tuple[str, ...], close: float) -> None:
    """The machine has its own laws and numerics; behind an amplifier's lag the friction follows the lagged voltage."""
    machine = Machine.from_file("rigid.yaml", clean=True).with_parts({"load_dependent_friction": {"share": SHARE}, **{name: {} for name in more}})
    voltage = noise()
    position = machine.step(np.column_stack((voltage, np.zeros(voltage.size))))[:, 0]
    model = BASE
    for name in ("load_dependent_friction", *more):
        own = machine.spec.axes[0].parts[name]
        model = model.with_effect(name, [own[key] for key in STANDARD[name].names])
    measured = np.diff(position) * RATE
    assert np.std(simulate(model, RATE, voltage, position) - measured) < close * np.std(measured)
