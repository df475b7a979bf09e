"""The refined model sample by sample, its inverse, and the numbers and tables that follow from it."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from helpers.known_models import DELAY, GAIN, POLE, axis, known, unknown
from helpers.sampled import simulate_alone
from scipy import signal

from xy_sysid.axis.model import STANDARD, Library, simulate
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design import closed_loop, inverse, sample_step
from xy_sysid.control_design.closed_loop import _loop_of
from xy_sysid.control_design.gains import gains, simple_feedforward
from xy_sysid.control_design.inverse import _run_of, ahead_of, feedforward, not_undone
from xy_sysid.control_design.limits import fastest
from xy_sysid.control_design.path import Bounds, SampledPath, recorded, s_curve
from xy_sysid.control_design.sample_step import step_of
from xy_sysid.control_design.tables import friction_table, position_tables
from xy_sysid.control_design.uncertain import samples, undetermined
from xy_sysid.control_design.use import use
from xy_sysid.errors import BadInput
from xy_sysid.response.estimate import Estimate
from xy_sysid.samples.block import FloatArray

RATE = 2000.0
EFFECTS = [effect.name for effect in STANDARD.acting if effect.name != "load_side_resonance"]
LEFT = {"gain_drift", "backlash"}  # effects that no feedforward along a path undoes


def noise(count: int = 6000, rms: float = 1.0) -> FloatArray:
    """(count,) V, up to 300 Hz."""
    raw = np.random.default_rng(5).standard_normal(count)
    shaped = signal.lfilter(*signal.butter(2, 300.0, fs=RATE), raw)
    return np.asarray(rms * shaped / np.std(shaped))


def path() -> SampledPath:
    return s_curve([0.0, 0.03, -0.02, 0.0], Bounds(0.1, 2.0, 100.0), RATE)


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_the_model_moves_alone_as_it_does_along_a_recording_of_itself() -> None:
    """Consistency: the sampled model with its own position moves like ``axis.model`` along the measured position."""
    for names in [
        (),
        *((name,) for name in EFFECTS),
        ("coulomb_friction", "base_resonance"),
        ("screw_compliance", "base_resonance", "amplifier_lag"),
    ]:
        model, voltage = axis(*names), noise()
        position = simulate_alone(model, RATE, voltage)
        alone, along = np.diff(position) * RATE, simulate(model, RATE, voltage, position)
        assert rms(alone - along) < 2e-4 * rms(along), names


def test_the_whole_feedforward_brings_the_model_along_the_path_without_any_feedback() -> None:
    """Delay, hold, lag, resonances, friction, forces, encoder and amplifier are compensated: below 0.5 % of the error with the base alone."""
    wanted = path()
    simple = feedforward(axis(), wanted).voltage
    for name in [name for name in EFFECTS if name not in LEFT]:
        model = axis(name)
        error = rms(simulate_alone(model, RATE, feedforward(model, wanted).voltage) - wanted.position)
        without = rms(simulate_alone(model, RATE, simple) - wanted.position)
        assert error < max(0.005 * without, 1.5e-6), name


def test_what_is_not_undone_is_named() -> None:
    """A change with time and a gap are not compensated, and the answer says so."""
    assert {name for name, _ in not_undone(axis("gain_drift", "backlash", "coulomb_friction"))} == LEFT


def test_ks_kv_ka_follow_from_the_parameters_with_their_intervals() -> None:
    """kV is 1 / gain, kA is 1 / (gain pole), kS the friction; each interval follows from those of the parameters, and names the main contribution."""
    found = gains(known("coulomb_friction", pole=0.1))
    coulomb = STANDARD["coulomb_friction"].typical[0]
    assert found["kS"].value == pytest.approx(coulomb) and (found["kS"].low, found["kS"].high) == pytest.approx((0.98 * coulomb, 1.02 * coulomb))
    assert found["kV"].value == pytest.approx(1.0 / GAIN) and found["kV"].high == pytest.approx(1.0 / (0.98 * GAIN))
    assert found["kA"].value == pytest.approx(1.0 / (GAIN * POLE)) and found["kA"].because[0][0] == "pole"
    assert found["kA"].low == pytest.approx(
        found["kA"].value - math.hypot(1 / (GAIN * POLE) * (1 - 1 / 1.02), 1 / (GAIN * POLE) * (1 - 1 / 1.1)), rel=1e-6
    )


def test_what_differs_by_direction_and_what_a_load_holds_have_gains_of_their_own() -> None:
    """kS and kV forth and back, breakaway, kG and kCos appear only if the model has them."""
    names = {item.name for item in gains(known("coulomb_friction")).items}
    assert names == {"kS", "kV", "kA"}
    assert {"kS forth", "kS back"} <= {item.name for item in gains(known("asymmetric_friction")).items}
    assert {"kV forth", "kV back"} <= {item.name for item in gains(known("asymmetric_viscous_friction")).items}
    assert "breakaway" in {item.name for item in gains(known("stribeck_friction")).items}
    assert gains(known("constant_load"))["kG"].value == pytest.approx(0.15)
    arm = gains(known("gravity"))
    angle = arm["zero"].value
    held = [arm["kCos"].value * math.cos(x - angle) for x in (0.3, 2.0)]
    assert held == pytest.approx([0.5 * math.sin(x) for x in (0.3, 2.0)])


def test_friction_that_grows_with_the_input_makes_every_gain_larger() -> None:
    """Of the voltage only 1 - share drives the axis: kS, kV and kA are divided by it, and hold a speed with Coulomb friction."""
    share, coulomb = (STANDARD[name].typical[0] for name in ("load_dependent_friction", "coulomb_friction"))
    both = gains(known("load_dependent_friction", "coulomb_friction"))
    assert both["kS"].value == pytest.approx(coulomb / (1.0 - share))
    assert both["kV"].value == pytest.approx(1.0 / (GAIN * (1.0 - share)))
    assert both["kA"].value == pytest.approx(1.0 / (GAIN * POLE * (1.0 - share)))
    assert {item.name for item in both.items} == {"kS", "kV", "kA"}
    voltage = np.full(1000, both["kS"].value + 0.05 * both["kV"].value)
    position = simulate_alone(axis("load_dependent_friction", "coulomb_friction"), RATE, voltage)
    assert (position[-1] - position[-2]) * RATE == pytest.approx(0.05, rel=1e-6)


def test_a_number_that_the_data_do_not_determine_says_so() -> None:
    """A gain with an uncertainty above a factor of two, or without an interval, is marked."""
    wide = gains(known("coulomb_friction", coulomb_friction__coulomb=1.5))["kS"]
    assert not wide.determined and "coulomb_friction.coulomb" in wide.doubt
    assert not any(item.determined for item in gains(unknown("coulomb_friction")).items)
    assert undetermined(known(gain=0.8), ("gain", "pole")) == ("gain",)


def test_an_angle_is_judged_by_the_width_of_its_interval() -> None:
    """An angle may be 0 or pi. If its interval reaches more than 60 degrees to each side, neither the angle nor kCos is written."""
    for phase in (0.5 * math.pi, -0.5 * math.pi, 6.0):  # the arm is level at 0, at pi, and at pi / 2 - 6 rad
        model = PhysicalModel(axis().with_effect("gravity", (0.5, phase)))
        for half, sure in ((0.02, True), (1.0, True), (1.1, False), (2.0 * math.pi, False), (math.inf, False)):
            estimates = [
                Estimate(name=name, value=value, unit="", low=0.99 * value, high=1.01 * value) for name, value in model.model.values().items()
            ]
            known_so = [replace(one, low=phase - half, high=phase + half) if one.name == "gravity.phase" else one for one in estimates]
            arm = gains(replace(model, known=tuple(known_so)))
            assert arm["zero"].determined is sure, (phase, half)
            assert ("kCos" in arm.unsure) is not sure and (arm.value("kCos") > 0.0) is sure
            assert 0.5 * (arm["zero"].high - arm["zero"].low) == pytest.approx(half, rel=1e-6), "also past half a turn"


def test_the_simple_feedforward_leaves_friction_where_ks_is_known_nothing() -> None:
    """kS sign(v) + kV v + kA a, advanced by the delay, is the full feedforward of an axis with Coulomb friction."""
    model, wanted = known("coulomb_friction"), path()
    early = wanted.ahead(DELAY + 0.5 / RATE)
    simple, whole = simple_feedforward(gains(model), early), feedforward(model.model, wanted).voltage
    moving = np.abs(early.speed) > 1e-3
    assert rms((simple - whole)[moving]) < 1e-3 * rms(whole)


def test_a_path_keeps_its_bounds_and_stands_at_its_ends() -> None:
    """Speed, acceleration and jerk stay within their bounds, and each position is reached."""
    bounds = Bounds(0.1, 2.0, 100.0)
    wanted = s_curve([0.0, 0.03, -0.02], bounds, RATE)
    assert np.max(np.abs(wanted.speed)) <= 1.0001 * bounds.speed
    assert np.max(np.abs(wanted.acceleration)) <= 1.0001 * bounds.acceleration
    assert np.max(np.abs(np.diff(wanted.acceleration))) * RATE <= 1.001 * bounds.jerk
    assert wanted.position[-1] == pytest.approx(-0.02) and np.max(wanted.position) == pytest.approx(0.03)


def test_the_fastest_path_uses_what_the_drive_has_and_not_more() -> None:
    """Its voltage stays below the limit less the reserve, for every sample of the parameters; a weaker drive takes longer."""
    models = samples(known("coulomb_friction"), 4)
    strong, weak = (fastest(models, [0.0, 0.05], limit, RATE) for limit in (6.0, 3.0))
    for found, limit in ((strong, 6.0), (weak, 3.0)):
        assert 0.6 * limit < max(float(np.max(np.abs(feedforward(model, found.path).voltage))) for model in models) <= 0.8 * limit + 1e-9
    assert strong.path.seconds < weak.path.seconds
    with pytest.raises(BadInput, match=r"which friction and load need"):
        fastest(samples(known("coulomb_friction"), 1), [0.0, 0.05], 0.1, RATE)


def test_tables_hold_the_laws_and_what_their_intervals_leave() -> None:
    """Tables of force and scale error by position, and of friction by speed: values of the laws, their intervals, and units in the header."""
    model = known("cogging", "lead_error", "stribeck_friction", spread=0.01)
    found = {item.name: item for item in position_tables(model, (-0.01, 0.01))}
    assert set(found) == {"force", "scale"}
    amplitude, period, phase = STANDARD["cogging"].typical
    assert found["force"].value == pytest.approx(amplitude * np.sin(2 * np.pi * found["force"].at / period + phase), abs=1e-9)
    assert found["force"].after < 0.1 * found["force"].before
    rows = list(csv.DictReader(io.StringIO(found["scale"].csv())))
    assert list(rows[0]) == ["position_m", "scale_m", "low", "high"] and len(rows) == found["scale"].at.size
    rubbing = friction_table(model, 0.2)
    assert rubbing is not None
    assert rubbing.value[-1] == pytest.approx(0.15) and max(rubbing.value) == pytest.approx(0.35) and min(rubbing.value) == pytest.approx(-0.35)
    assert friction_table(known("cogging"), 0.2) is None


def test_a_recorded_motion_becomes_a_path_without_delay() -> None:
    """Below the given frequency, position, speed and acceleration are those of the recording."""
    t = np.arange(4000) / RATE
    wanted = recorded(0.01 * np.sin(2 * np.pi * 3.0 * t), RATE, 50.0)
    inside = slice(400, -400)
    assert wanted.position[inside] == pytest.approx(0.01 * np.sin(2 * np.pi * 3.0 * t[inside]), abs=1e-5)
    assert wanted.speed[inside] == pytest.approx(0.01 * 6 * np.pi * np.cos(2 * np.pi * 3.0 * t[inside]), abs=1e-3)
    with pytest.raises(BadInput, match="64 or more"):
        recorded(np.zeros(10), RATE, 50.0)


def test_a_resonance_that_only_the_load_shows_is_refused_in_one_line() -> None:
    """A feedforward to the motor does not compensate it."""
    with pytest.raises(BadInput, match=r"load_side_resonance is a spring between motor and encoder.*an encoder at the motor"):
        feedforward(axis().with_effect("load_side_resonance", (60.0, 0.05)), path())


def test_with_an_encoder_on_the_load_there_are_gains_and_no_loops() -> None:
    """kV and kA are those of both masses together; a loop around a spring without a design here is refused with a reason."""
    model = PhysicalModel(axis().with_effect("load_side_resonance", (60.0, 0.05)))
    used = use(model, rate=2000.0, limit=5.0)
    assert [gain.name for gain in used.gains.items[1:3]] == ["kV", "kA"]
    assert used.feedback is None and used.states is None and used.modes == ()
    assert {what for what, _ in used.refused} >= {"feedback", "state feedback", "filters"}


def test_a_lag_is_looked_ahead_of_by_what_its_inverse_leaves() -> None:
    """A lag far below a sample has no effect, and one of many samples adds half a sample."""
    h = 1.0 / RATE
    for lag, ahead in ((1e-3 * h, 1e-3), (100.0 * h, 0.5), (h, 1.0 - 1.0 / np.expm1(1.0))):
        model = replace(axis(), effects=(("amplifier_lag", (lag,)),))
        assert (ahead_of(model, RATE) - ahead_of(axis(), RATE)) / h == pytest.approx(ahead, abs=2e-3)


@pytest.mark.parametrize("loop", [step_of, _run_of, _loop_of])
def test_a_new_library_never_runs_in_the_loop_of_one_that_is_gone(loop: Callable[[Library], object], monkeypatch: pytest.MonkeyPatch) -> None:
    """A new library may get the memory address of a deleted one; each has its own loop nevertheless, and an existing library keeps its loop."""
    for module in (sample_step, inverse, closed_loop):
        monkeypatch.setattr(module, "compiled_text", lambda *_: lambda: None)
    made = []
    for _ in range(5):
        library = Library([STANDARD["coulomb_friction"]])
        made.append(loop(library))
        assert loop(library) is made[-1]
    assert len(set(map(id, made))) == 5
