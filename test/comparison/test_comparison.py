"""Where a model fails: each kind of place is found on a simulated axis that fails there, and none on an exact one."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import xy_sysid as xy
from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sim.parts import PARTS
from xy_sysid.comparison.where_it_fails import Comparison, Unseen, by_chance, compare_motion, compare_velocity
from xy_sysid.errors import BadInput
from xy_sysid.excitation.lockstep import drive
from xy_sysid.fitting import Structure, identify
from xy_sysid.fitting.of_recording import estimate, split
from xy_sysid.front_door.simulated_recording import simulate
from xy_sysid.greybox.axis_data import prepare
from xy_sysid.linear.simulate import simulate as motion_of
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings, IdentifierSettings
from xy_sysid.units import Units


def compare(tf: TransferFunction, u: FloatArray, y: FloatArray, sampling_rate: float) -> Comparison:
    """A transfer function against input and output (n,) of a gap-free run. Raises BadInput if it is too short."""
    return compare_velocity(np.diff(motion_of(tf, sampling_rate, u)) * sampling_rate, u, y, sampling_rate, Units(tf.input_unit, tf.output_unit))


@functools.cache
def compared(effect: str) -> Comparison:
    """A linear model fitted to 30 s of a rigid axis with an effect, against the next 15 s."""
    machine = Machine.from_file("rigid.yaml", 3)
    machine = with_effects(machine, [effect]) if effect else machine
    axes = {axis: AxisExcitation(seed=4 + k) for k, axis in enumerate(machine.axes)}
    recording = drive(machine, ExcitationSettings(lockstep=True, speed=0.0, block=100, ahead=1, axes=axes), 45.0, lambda _: None)
    training, unseen = split(recording, 1 / 3)
    fit = identify(estimate(training, "x", IdentifierSettings()).frf, Structure(0, 2, 1))
    u, y = unseen.axis("x")
    return compare(fit.tf, u, y, recording.sampling_rate)


def test_a_linear_axis_stands_at_the_noise_floor() -> None:
    """No place at all, error between half and one and a half times the floor."""
    found = compared("")
    assert found.places == ()
    assert 0.5 < found.error / found.noise_floor < 1.5
    assert "nothing stands out" in found.sentence


@pytest.mark.parametrize(
    ("effect", "low", "high"), [("base_resonance", 40.0, 50.0), ("cogging", 2.0, 12.0), ("coulomb_friction", 0.3, 2.0), ("backlash", 100.0, 330.0)]
)
def test_the_worst_frequency_is_where_the_effect_acts(effect: str, low: float, high: float) -> None:
    """A base resonance at its own frequency, friction at the lowest, a gap at the highest."""
    found = compared(effect)
    assert any(place.kind == "frequency" for place in found.places)
    worst = found.frequency[int(np.nanargmax(found.error_over_floor))]
    assert low <= worst <= high


def test_what_chance_gives_a_band_of_few_lines_is_exceeded_once_in_a_thousand() -> None:
    """Simulated: the mean power of 1 to 30 lines of noise."""
    rng = np.random.default_rng(5)
    for lines in (1, 2, 5, 30):
        drawn = rng.standard_normal((200_000, 2 * lines)) ** 2
        (limit,) = by_chance(np.array([float(lines)]))
        assert np.mean(np.sqrt(drawn.mean(axis=1)) > limit) == pytest.approx(1e-3, rel=0.3)


def test_cogging_repeats_with_its_period() -> None:
    """The spatial period is named within 3 %."""
    per_revolution = PARTS["cogging"].parameters[1].default
    period = 5e-3 / per_revolution  # the lead of the screw is 5 mm
    place = next(place for place in compared("cogging").places if "repeating" in place.sentence)
    assert place.low == pytest.approx(period, rel=0.03)


def test_a_constant_load_is_a_constant_error() -> None:
    """And nothing else."""
    found = compared("constant_load")
    assert [place.low for place in found.places if place.kind == "frequency"] == [0.0]
    assert "constant error" in found.sentence


def test_saturation_shows_at_large_amplitudes() -> None:
    """The input's envelope distinguishes it from friction."""
    place = next(place for place in compared("saturation").places if place.kind == "amplitude")
    assert place.low > 0.9


def test_a_gain_that_depends_on_position_shows_there() -> None:
    """At one end of the travel."""
    assert any(place.kind == "position" for place in compared("position_dependent_gain").places)


def test_every_place_says_its_size_in_words() -> None:
    """Multiples of the floor, worst first."""
    for effect in ("coulomb_friction", "saturation", "asymmetric_friction"):
        found = compared(effect)
        sizes = [place.error_over_floor for place in found.places]
        assert sizes == sorted(sizes, reverse=True)
        assert all("floor" in place.sentence for place in found.places)


def test_too_short_a_recording_is_refused() -> None:
    """The error names what is needed."""
    with pytest.raises(BadInput, match="number of samples is 100"):
        compare(TransferFunction(np.array([1.0]), np.array([1.0, 1.0, 0.0])), np.zeros(100), np.zeros(100), 2000.0)


def test_the_floor_is_that_of_a_diagnosis() -> None:
    """The floor is that of the fit, from the full recording, for any compared part: within 1 %, also for a model fitted here."""
    recording = simulate(20.0, effects=["coulomb_friction"], machine="rigid.yaml")
    run = recording.run("x")
    data = prepare(run.sampling_rate, run.voltage, run.position)
    known = data.layout.rms(data.floor.power)
    assert xy.compare(run).noise_floor == pytest.approx(known, rel=0.01)


def test_a_short_run_can_be_compared() -> None:
    """1,200 samples."""
    run = simulate(2.0, machine="rigid.yaml").run("x")
    model = TransferFunction(np.array([0.1]), np.array([1.0, 0.0]))
    found = compare(model, run.voltage[:1200], run.position[:1200], run.sampling_rate)
    assert found.error > found.noise_floor > 0.0


def test_of_a_model_that_runs_away_nothing_else_is_said() -> None:
    """Its velocity overflows: no place, no warning, one sentence."""
    random = np.random.default_rng(3)
    voltage, position = random.normal(size=4000), np.cumsum(random.normal(size=4000)) * 1e-4
    with np.errstate(over="ignore", invalid="ignore"):
        found = compare_motion(np.exp(np.linspace(0.0, 700.0, 3999)) * 1e100, Unseen(voltage, position, 1000.0))
    assert found.places == ()
    assert found.sentence == "the simulation diverges: the model is not stable."
