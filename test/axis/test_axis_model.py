"""The simulation of one axis: exact where a closed form exists, and independent of how it is called."""

from __future__ import annotations

import math
import subprocess
import sys
import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers import ROOT
from scipy.signal import butter, sosfilt

from xy_sysid.axis.model import STANDARD, AxisModel, Library, simulate, simulator
from xy_sysid.effects import EFFECTS
from xy_sysid.errors import BadInput
from xy_sysid.linear.simulate import simulate as exact
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.samples.block import FloatArray

RATE = 2000.0
BASE = AxisModel(0.097, 1.29e-3, 246.0)


@cache
def noise(n: int = 20_001) -> FloatArray:
    """(n,) band noise of 1 V rms."""
    u = sosfilt(butter(4, 300, fs=RATE, output="sos"), np.random.default_rng(1).standard_normal(n))
    return np.asarray(u / u.std())


def mean_velocity(tf: TransferFunction, u: FloatArray) -> FloatArray:
    """Differences of the exact position, m/s."""
    return np.asarray(np.diff(exact(tf, RATE, u)) * RATE)


@pytest.mark.parametrize("delay", [0.0, 0.5e-3, 1.29e-3, 1.2999e-3])
def test_the_base_alone_is_the_exact_transfer_function(delay: float) -> None:
    """K p / (s (s + p)) behind a hold, with a delay of any fraction of a sample."""
    tf = TransferFunction(np.array([0.097 * 246.0]), np.array([1.0, 246.0, 0.0]), delay)
    u = noise()
    found = simulate(AxisModel(0.097, delay, 246.0), RATE, u, np.zeros_like(u))
    assert found == pytest.approx(mean_velocity(tf, u), abs=1e-12)


def test_a_lag_is_one_more_pole() -> None:
    """To a thousandth: the lag is exact, and within a sub-step its mean is used."""
    lag = 1e-3
    tf = TransferFunction(np.array([0.097 * 246.0 / lag]), np.convolve([1.0, 246.0, 0.0], [1.0, 1.0 / lag]), 1.29e-3)
    u = noise()
    found = simulate(BASE.with_effect("amplifier_lag", (lag,)), RATE, u, np.zeros_like(u))
    wanted = mean_velocity(tf, u)
    assert np.std(found - wanted) < 1e-3 * np.std(wanted)


def test_a_resonance_is_a_pole_zero_pair() -> None:
    """At 46 Hz to a thousandth of the motion."""
    zero, pole = 2 * math.pi * 46.2, 2 * math.pi * 47.5
    top = np.array([1.0, 2 * 0.015 * zero, zero**2]) * 0.097 * 246.0 * (pole / zero) ** 2
    bottom = np.convolve([1.0, 246.0, 0.0], [1.0, 2 * 0.02 * pole, pole**2])
    u = noise()
    model = BASE.with_effect("base_resonance", (47.5 / 46.2 - 1.0, 46.2, 0.015, 0.02))
    wanted = mean_velocity(TransferFunction(top, bottom, 1.29e-3), u)
    assert np.std(simulate(model, RATE, u, np.zeros_like(u)) - wanted) < 1e-3 * np.std(wanted)


def test_dry_friction_holds_what_is_below_it() -> None:
    """Under a voltage below the level nothing moves at all; above it, speed settles at gain (u - level)."""
    model = BASE.with_effect("coulomb_friction", (0.2,))
    for voltage, speed in ((0.19, 0.0), (-0.19, 0.0), (0.5, 0.097 * 0.3), (-0.5, -0.097 * 0.3)):
        u = np.full(4001, voltage)
        assert simulate(model, RATE, u, np.zeros_like(u))[-1] == pytest.approx(speed, abs=1e-12)


def test_dry_friction_stops_a_moving_axis_at_the_right_instant() -> None:
    """Distance after the voltage is cut: (v0 - w) stop / ... in closed form, to rounding."""
    level, pole, gain = 0.2, 246.0, 0.097
    u = np.concatenate((np.ones(2000), np.zeros(2001)))
    found = simulate(AxisModel(gain, 0.0, pole).with_effect("coulomb_friction", (level,)), RATE, u, np.zeros_like(u))
    v0, w = gain * (1.0 - level), gain * level
    stop = math.log1p(v0 / w) / pole
    assert np.sum(found[2000:]) / RATE == pytest.approx(v0 / pole - w * stop, rel=1e-9)
    assert np.all(found[2000 + math.ceil(stop * RATE) :] == 0.0)


def test_the_sign_of_the_gain_only_turns_the_motion_round() -> None:
    """A drive with a negative gain has the same friction."""
    u = noise()
    for name in ("coulomb_friction", "stribeck_friction", "presliding_hysteresis"):
        one = simulate(BASE.with_effect(name), RATE, u, np.zeros_like(u))
        other = simulate(AxisModel(-0.097, 1.29e-3, 246.0).with_effect(name), RATE, u, np.zeros_like(u))
        assert other == pytest.approx(-one, abs=1e-9), name


@pytest.mark.parametrize("gain", [0.097, -0.097])
@pytest.mark.parametrize(
    "beside", [{}, {"coulomb_friction": (0.2,)}, {"coulomb_friction": (0.2,), "constant_load": (0.1,)}], ids=lambda made: "+".join(made)
)
def test_drag_that_is_a_straight_line_each_way_needs_no_sub_steps(gain: float, beside: dict[str, tuple[float, ...]]) -> None:
    """Sub-steps converge as they get shorter: at 1 us within 3e-7 of the motion."""
    straight = EFFECTS["asymmetric_viscous_friction"]
    library = Library([replace(straight, straight=False), *(EFFECTS[name] for name in beside)])
    names, row = [straight.name, *beside], np.array([gain, 1.29e-3, 20.0, -0.6, *(value for values in beside.values() for value in values)])
    u, x = noise(4001), np.zeros(4001)
    exactly = simulator(STANDARD, names, RATE, u, x)(row, 0.01)
    apart = [float(np.max(np.abs(simulator(library, names, RATE, u, x, fine)(row, 0.01) - exactly))) for fine in (1.6e4, 1e6)]
    assert apart[1] < 3e-7 * np.std(exactly)
    assert apart[0] < 1e-3 * np.std(exactly)


def test_an_axis_that_drags_more_one_way_settles_at_two_speeds() -> None:
    """gain u / (1 + asymmetry) forth, gain u / (1 - asymmetry) back."""
    model = BASE.with_effect("asymmetric_viscous_friction", (0.3,))
    for voltage, speed in ((0.5, 0.097 * 0.5 / 1.3), (-0.5, -0.097 * 0.5 / 0.7)):
        u = np.full(4001, voltage)
        assert simulate(model, RATE, u, np.zeros_like(u))[-1] == pytest.approx(speed, abs=1e-12)


def test_the_result_has_no_jump_as_the_delay_passes_whole_samples() -> None:
    """The result is continuous in the delay, as a fit needs: 1e-9 s changes hardly anything, for exact and for stepped laws."""
    u = noise()
    for name in ("coulomb_friction", "stribeck_friction"):
        values = [simulate(AxisModel(0.097, 1e-3 + shift, 246.0).with_effect(name), RATE, u, np.zeros_like(u)) for shift in (-1e-9, 1e-9)]
        assert np.std(values[0] - values[1]) < 1e-3 * np.std(values[0])


def test_another_library_gives_the_same_numbers() -> None:
    """Other effects in the loop do not change the result."""
    u = noise()
    alone = Library([EFFECTS["coulomb_friction"]])
    one = simulate(AxisModel(0.097, 1.29e-3, 246.0, library=alone).with_effect("coulomb_friction"), RATE, u, np.zeros_like(u))
    assert np.array_equal(one, simulate(BASE.with_effect("coulomb_friction"), RATE, u, np.zeros_like(u)))


def test_a_new_process_takes_the_compiled_loop_from_the_disk() -> None:
    """Once compiled, it is loaded in half a second of processor time (two allowed)."""
    simulate(BASE, RATE, noise(), np.zeros_like(noise()))
    code = (
        "import time, numpy as np\n"
        "from xy_sysid.axis.model import AxisModel, simulate\n"
        "start = time.process_time()\n"
        "simulate(AxisModel(0.1, 0.0, 200.0), 2000.0, np.ones(100), np.zeros(100))\n"
        "print(time.process_time() - start)\n"
    )
    root = ROOT
    ran = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
    assert float(ran.stdout) < 2.0


def test_a_minute_of_data_is_simulated_in_milliseconds() -> None:
    """60 s at 2 kHz with friction: 5 ms of processor time as measured, 100 ms allowed."""
    u = np.tile(noise(), 6)[:120_001]
    model, still = BASE.with_effect("coulomb_friction"), np.zeros_like(u)
    simulate(model, RATE, u, still)
    took = []
    for _ in range(3):
        start = time.process_time()
        simulate(model, RATE, u, still)
        took.append(time.process_time() - start)
    assert min(took) < 0.1


@pytest.mark.parametrize("effect", [effect.name for effect in STANDARD.acting if effect.simulable])
def test_a_trial_without_gain_is_no_error(effect: str) -> None:
    """A step of a fit may reach a gain of exactly zero: laws that divide by it give NaN, not an error."""
    voltage = np.random.default_rng(1).normal(size=600)
    values = tuple(item.high if not item.positive and math.isfinite(item.high) else item.typical for item in STANDARD[effect].parameters)
    model = AxisModel(0.0, 1e-3, 200.0, ((effect, values),))
    assert np.all(np.isnan(simulate(model, 2000.0, voltage, np.zeros(voltage.size))))


def test_a_model_that_cannot_be_is_refused() -> None:
    """The error names the value and what is allowed."""
    with pytest.raises(BadInput, match=r"delay is -0\.001"):
        AxisModel(0.1, -1e-3, 200.0)
    with pytest.raises(BadInput, match="2 values; allowed: 1: coulomb"):
        BASE.with_effect("coulomb_friction", (0.1, 0.2))
    with pytest.raises(BadInput, match="in every model already"):
        BASE.with_effect("time_delay", (0.1,))
    with pytest.raises(BadInput, match="one and the same"):
        simulate(BASE, RATE, np.zeros(5), np.zeros(6))


def test_a_model_tells_its_parameters_by_name() -> None:
    """And knows what is in it."""
    model = BASE.with_effect("cogging").with_effect("constant_load", (0.1,)).without("cogging")
    assert model.values() == {"gain": 0.097, "delay": 1.29e-3, "pole": 246.0, "constant_load.load": 0.1}
    assert "constant_load" in model
    assert "cogging" not in model
    assert STANDARD["cogging"].parameters[1].unit == "m"
