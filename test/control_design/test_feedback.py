"""The sampled loop, its margins, and controllers that keep them for every sample of the parameters."""

from __future__ import annotations

import control
import numpy as np
import pytest
from helpers.known_models import DELAY, axis, known
from helpers.sampled import simulate_alone

from xy_sysid.control_design.closed_loop import Controller, Encoder, follow_path
from xy_sysid.control_design.feedback import GAIN_MARGIN, PHASE_MARGIN, Asked, feedback, margins, margins_of
from xy_sysid.control_design.path import Bounds, s_curve
from xy_sysid.control_design.sampled import closed_poles, controller_response, controller_system, noise_to_voltage, sampled
from xy_sysid.control_design.uncertain import samples
from xy_sysid.control_design.use import use
from xy_sysid.errors import BadInput

RATE = 2000.0
LINEAR = (), ("base_resonance",), ("screw_compliance", "amplifier_lag")


def test_the_sampled_plant_is_the_model_sample_by_sample() -> None:
    """Base, resonances, lag, hold and a delay of any length: the matrices give the same positions as the simulation."""
    voltage = np.random.default_rng(1).standard_normal(400)
    for names in LINEAR:
        system = sampled(axis(*names), RATE)
        a, b, c = system.whole_system()
        state, shown = np.zeros(b.size), []
        for volts in voltage:
            shown.append(c @ state)
            state = a @ state + b * volts
        alone = simulate_alone(axis(*names), RATE, voltage)
        assert np.max(np.abs(np.array(shown) - alone)) < 1e-4 * np.ptp(alone), names


def test_margins_are_those_of_python_control() -> None:
    """Another library reads the same phase and gain margins from the same loop."""
    system = sampled(axis("base_resonance"), RATE)
    controller = feedback(known("base_resonance"), RATE).controller
    w = np.geomspace(1.0, 0.999 * np.pi * RATE, 20_000)
    loop = system.response(w / (2 * np.pi)) * controller_response(controller, w / (2 * np.pi), RATE)
    theirs = control.stability_margins(control.FRD(loop, w))
    ours = margins(system, controller)
    assert ours.phase == pytest.approx(theirs[1], abs=2.0) and ours.gain == pytest.approx(theirs[0], rel=0.05)
    assert 1.0 / ours.sensitivity == pytest.approx(theirs[2], rel=0.02)
    assert at_crossings(loop) == pytest.approx((theirs[1], theirs[0]), rel=2e-3)


def at_crossings(loop: np.ndarray) -> tuple[float, float]:
    """(phase margin, degrees, gain margin) on the lines next to the crossings of 1 and of the negative real axis."""
    ones, reals = (np.flatnonzero(np.diff(np.sign(value))) for value in (np.abs(loop) - 1.0, loop.imag))
    beyond = np.abs(loop[reals[loop[reals].real < 0.0]])
    return float(np.degrees(np.min(np.abs(np.angle(-loop[ones]))))), float(np.min(np.maximum(beyond, 1.0 / beyond)))


@pytest.mark.parametrize("damping", [0.03, 3e-3, 3e-4])
def test_the_margins_see_a_lightly_damped_mode(damping: float) -> None:
    """For a resonance of any sharpness the margins equal those of 400000 lines around it; 600 log-spaced lines would give 3.3 instead of 2.1."""
    system = sampled(axis().with_effect("base_resonance", (2.0 * damping, 150.0, damping, damping)), RATE)
    controller = feedback(known(), RATE, Asked(bandwidth=20.0)).controller
    fine = np.unique(
        np.concatenate((np.geomspace(0.5, 0.499 * RATE, 20_000), 150.0 * (1.0 + 2.0 * damping) * (1.0 + np.linspace(-0.02, 0.02, 400_001))))
    )
    loop = np.concatenate([system.response(part) * controller_response(controller, part, RATE) for part in np.array_split(fine, 20)])
    theirs, ours = margins_of(loop, fine, closed_poles(system, controller)), margins(system, controller)
    assert ours.stable and ours.gain == pytest.approx(theirs.gain, rel=0.01) and ours.phase == pytest.approx(theirs.phase, abs=0.5)
    assert ours.sensitivity == pytest.approx(theirs.sensitivity, rel=0.02)


def test_a_controllers_matrices_are_its_response() -> None:
    """PID, derivative filter and a section: state space and response agree at every frequency."""
    own = Controller(300.0, 2000.0, 5.0, 1e-3, sections=np.array([[0.9, -1.2, 0.5, -1.1, 0.4]]))
    a, b, c, d = controller_system(own, RATE)
    for f in (3.0, 50.0, 700.0):
        z = np.exp(2j * np.pi * f / RATE)
        found = c @ np.linalg.solve(z * np.eye(b.size) - a, b) + d
        assert found == pytest.approx(controller_response(own, np.array([f]), RATE)[0], rel=1e-9)


def test_every_sample_of_the_parameters_keeps_the_margins() -> None:
    """The worst case over the intervals counts: wider intervals reduce the bandwidth, and each sample's loop has the requested margins."""
    sure, unsure = feedback(known("base_resonance", spread=0.01), RATE), feedback(known("base_resonance", spread=0.3, delay=0.5), RATE)
    assert unsure.crossover < sure.crossover
    for item in samples(known("base_resonance", spread=0.3, delay=0.5), 24):
        found = margins(sampled(item, RATE), unsure.controller)
        assert found.stable and found.phase >= PHASE_MARGIN and found.gain >= GAIN_MARGIN


def test_a_bandwidth_that_cannot_be_had_is_refused() -> None:
    """A bandwidth beyond delay and margins gives an error with the resulting margins, and no gains."""
    with pytest.raises(BadInput, match=r"bandwidth is 400 Hz: .*Ask for less"):
        feedback(known(), RATE, Asked(bandwidth=400.0))
    asked = feedback(known(), RATE, Asked(bandwidth=10.0))
    assert asked.nominal.crossover == pytest.approx(10.0, rel=0.02) and asked.worst.phase > PHASE_MARGIN


def test_a_period_of_calculation_is_part_of_every_margin_and_of_the_simulation() -> None:
    """By default the voltage is written one period after the reading: the test closes that loop independently, also for samples of the parameters."""
    model = known("base_resonance", spread=0.05)
    used, at_once = (use(model, rate=RATE, limit=5.0, travel=(-0.02, 0.02), calculation=periods) for periods in (1.0, 0.0))
    assert used.calculation == 1.0 and used.feedback is not None and at_once.feedback is not None and used.allowed is not None
    assert used.feedback.crossover < at_once.feedback.crossover
    w = np.geomspace(1.0, 0.999 * np.pi * RATE, 20_000)
    for item in (model.model, *samples(model, 60)[30:]):
        loop = sampled(item, RATE).response(w / (2 * np.pi)) * controller_response(used.feedback.controller, w / (2 * np.pi), RATE)
        phase, gain = at_crossings(loop * np.exp(-1j * w / RATE))
        assert phase > PHASE_MARGIN - 2.0 and gain > 0.95 * GAIN_MARGIN
    cost = next(item for item in used.allowed.costs if item.part == "calculation")
    assert cost.phase == pytest.approx(360.0 * used.feedback.nominal.crossover / RATE, rel=0.01) and cost.without > used.allowed.crossover
    assert used.in_loop.model.delay == pytest.approx(model.model.delay + 1.0 / RATE)
    delays = [(item.value, item.low, item.high) for item in used.in_loop.parameters if item.name == "delay"]
    assert delays == [pytest.approx([one + 1.0 / RATE for one in (DELAY, 0.95 * DELAY, 1.05 * DELAY)])]
    assert used.tracking[0].compensated < 0.1 * used.tracking[0].feedback, "the feedforward looks ahead of the calculation, too"
    with pytest.raises(BadInput, match=r"calculation is 20 periods.*0 to 10"):
        use(model, calculation=20.0)


def test_gains_of_an_undetermined_axis_are_refused() -> None:
    """A gain or a pole with an uncertainty of more than a factor of two gives no controller."""
    with pytest.raises(BadInput, match=r"gain is known to worse than a factor of two"):
        feedback(known(gain=0.9), RATE)


def test_a_drive_that_is_wired_backwards_gets_negative_gains() -> None:
    """The loop of an axis with a negative gain is stable, too."""
    from dataclasses import replace

    model = known()
    turned = replace(model, model=replace(model.model, gain=-model.model.gain), known=())
    found = feedback(turned, RATE)
    assert found.controller.kp < 0.0 and found.nominal.stable


def test_the_same_gains_are_a_pid_and_a_servo_drives_cascade() -> None:
    """kd (s + position gain) (s + 1 / integral time) / s: the fields of a drive give the same controller."""
    found = feedback(known(), RATE)
    product = np.polymul([1.0, found.position_gain], [1.0, 1.0 / found.integral_time]) * found.velocity_gain
    assert product == pytest.approx([found.controller.kd, found.controller.kp, found.controller.ki])


def test_encoder_noise_makes_as_much_voltage_as_is_said() -> None:
    """At rest under encoder noise, the rms of the simulated voltage is the predicted one."""
    model = known()
    found = feedback(model, RATE, Asked(bandwidth=30.0), encoder=Encoder(noise=1e-6))
    still = s_curve([0.0, 0.0], Bounds(1.0, 1.0, 1.0), RATE, settle=10.0)
    run = follow_path(model.model, still, found.controller, encoder=Encoder(noise=1e-6), seed=3)
    predicted = 1e-6 * noise_to_voltage(sampled(model.model, RATE), found.controller)
    assert float(np.std(run.voltage[1000:])) == pytest.approx(predicted, rel=0.03) and found.noise == pytest.approx(predicted, rel=0.1)


def test_the_integral_stands_still_while_the_drive_is_at_its_limit() -> None:
    """A step far beyond the drive's limit overshoots little: no integral windup."""
    model = known()
    found = feedback(model, RATE, Asked(bandwidth=20.0), limit=1.0)
    step = s_curve([0.0, 0.05], Bounds(1e3, 1e6, 1e9), RATE, settle=3.0)
    run = follow_path(model.model, step, found.controller)
    assert np.max(np.abs(run.voltage)) == 1.0 and np.max(run.position) < 1.25 * 0.05
    assert abs(run.error[-1]) < 1e-5


def test_the_poles_of_the_closed_loop_tell_an_unstable_one() -> None:
    """With ten times the gains, poles are outside the unit circle."""
    found = feedback(known(), RATE)
    wild = Controller(10 * found.controller.kp, 10 * found.controller.ki, 10 * found.controller.kd, found.controller.derivative_time)
    assert np.max(np.abs(closed_poles(sampled(axis(), RATE), wild))) > 1.0 and not margins(sampled(axis(), RATE), wild).stable
