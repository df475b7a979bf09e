"""Input shapers and notches for the modes of a model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.known_models import known
from scipy import signal

from xy_sysid.axis.model import STANDARD
from xy_sysid.control_design.bandwidth import HOLD, UNCERTAIN, bandwidth_of, with_filter
from xy_sysid.control_design.closed_loop import Controller
from xy_sysid.control_design.feedback import feedback, margins
from xy_sysid.control_design.filters import best_shaper, low_pass, modes, notch, shapers, vibration
from xy_sysid.control_design.path import Bounds, s_curve
from xy_sysid.control_design.sampled import coefficients, controller_response, sampled
from xy_sysid.control_design.uncertain import samples
from xy_sysid.control_design.use import use
from xy_sysid.errors import BadInput

RATE = 2000.0


def test_a_mode_is_the_models_resonance_with_its_interval() -> None:
    """Antiresonance: the encoder's side held; resonance: the free axis; in Hz. A rigid axis has none."""
    split, frequency, damping, pole_damping = STANDARD["base_resonance"].typical
    (mode,) = modes(known("base_resonance"))
    assert mode.held.value == pytest.approx(frequency, rel=1e-4) and mode.held.high == pytest.approx(1.02 * frequency, rel=1e-3)
    assert mode.free.value == pytest.approx(frequency * (1 + split), rel=1e-4)
    assert (mode.held_damping, mode.free_damping) == pytest.approx((damping, pole_damping), rel=1e-3)
    assert modes(known("coulomb_friction")) == ()
    heavy = known("base_resonance")
    damped = replace(heavy, model=heavy.model.with_effect("base_resonance", (0.06, 46.0, 1.0, 1.0)))
    assert modes(damped) == (), "what is damped so much does not swing"


def test_shapers_leave_what_their_names_promise() -> None:
    """ZV, ZVD and MZV remove the vibration at their frequency, EI leaves a twentieth; over an interval ZVD and EI leave less than ZV."""
    (mode,) = modes(known("base_resonance", spread=0.1))
    found = {item.name: item for item in shapers(mode)}
    assert set(found) == {"zv", "mzv", "zvd", "ei"}
    for item in found.values():
        assert sum(item.amplitudes) == pytest.approx(1.0) and min(item.amplitudes) > 0.0
    assert found["zv"].vibration < 1e-6 and found["zvd"].vibration < 1e-6 and found["mzv"].vibration < 0.01
    assert found["ei"].vibration == pytest.approx(0.05, abs=0.01)
    assert found["zvd"].worst < found["zv"].worst and found["ei"].worst < found["zv"].worst
    assert found["zv"].duration < found["mzv"].duration < found["zvd"].duration
    assert best_shaper(tuple(found.values())).worst <= 0.05
    assert vibration((1.0,), (0.0,), mode.held.value, mode.held_damping) == pytest.approx(1.0)


def test_a_frequency_whose_interval_has_no_end_may_be_any() -> None:
    """The worst case of each shaper is then the full vibration, not the residual at the best value."""
    (mode,) = modes(known("base_resonance"))
    endless = replace(mode, held=replace(mode.held, high=float("inf")))
    assert [item.worst for item in shapers(endless)] == [1.0] * 4 and shapers(endless)[0].vibration < 1e-6


def test_a_shaped_path_arrives_and_excites_less() -> None:
    """A fast move through the shaper ends at the same position, and a mass on a spring vibrates a twentieth as much afterwards."""
    (mode,) = modes(known("screw_compliance"))
    quick = s_curve([0.0, 0.01], Bounds(0.2, 20.0, 1e4), RATE, settle=0.1)
    shaped = best_shaper(shapers(mode)).shape(quick)
    assert shaped.position[-1] == pytest.approx(0.01)
    w = 2 * np.pi * mode.held.value
    carried = [2 * mode.held_damping * w, w * w], [1.0, 2 * mode.held_damping * w, w * w]
    rings = []
    for path in (quick, shaped):
        _, place, _ = signal.lsim(carried, path.position, np.arange(path.position.size) / RATE)
        arrived = int(np.flatnonzero(np.abs(path.position - 0.01) > 1e-9)[-1])
        rings.append(float(np.ptp((place - path.position)[arrived : arrived + 100])))
    assert rings[1] < 0.06 * rings[0]


def test_a_notch_takes_the_resonance_and_says_what_it_costs() -> None:
    """Its response at the resonance is its depth, 1 far below, and its phase at the crossover is the stated one."""
    (mode,) = modes(known("screw_compliance"))
    made = notch(mode, RATE)

    def response(f: float) -> complex:
        z = np.exp(2j * np.pi * f / RATE)
        b0, b1, b2, a1, a2 = made.section
        return complex((b0 + b1 / z + b2 / z**2) / (1 + a1 / z + a2 / z**2))

    assert abs(response(made.frequency)) == pytest.approx(made.depth, rel=1e-3) and abs(response(0.1)) == pytest.approx(1.0, abs=1e-3)
    assert -np.degrees(np.angle(response(30.0))) == pytest.approx(made.phase_cost(30.0)) and made.phase_cost(30.0) > 0.0 and made.covers


def test_a_resonance_that_the_sampling_cannot_show_gets_no_notch_and_a_reason() -> None:
    """Above 0.45 of the sampling rate a notch would act at the alias, far below: it is refused, and the loop has no filter there."""
    for frequency in (920.0, 1500.0):
        model = known("screw_compliance")
        of = replace(model, model=model.model.with_effect("screw_compliance", (0.06, frequency, 0.01, 0.01)), known=())
        (mode,) = modes(of)
        with pytest.raises(BadInput, match="below 900 Hz"):
            notch(mode, RATE)
        used = use(of, rate=RATE)
        assert used.notch is None and "below 900 Hz" in dict(used.refused)["notch"]
        assert used.filter is None or used.filter.kind == "low-pass"


def test_what_limits_the_bandwidth_is_named_with_its_cost() -> None:
    """The phase of each part at the crossover is that of its transfer function, and a loop without the part is faster; no others are named."""
    model = known("base_resonance")
    loop = feedback(model, RATE)
    found = bandwidth_of(model, RATE, loop.nominal.crossover)
    costs = {item.part: item for item in found.costs}
    assert set(costs) == {"delay", HOLD, "base_resonance", UNCERTAIN} and found.crossover == pytest.approx(loop.nominal.crossover)
    assert costs["delay"].phase == pytest.approx(360.0 * loop.nominal.crossover * model.model.delay, rel=1e-3)
    assert costs["delay"].without > 1.2 * found.crossover and costs[UNCERTAIN].without >= found.crossover
    reached = [item.without for item in found.costs if np.isfinite(item.without)]
    assert reached == sorted(reached, reverse=True)


def test_a_filter_in_the_loop_is_named_only_where_the_loop_reaches_more_with_it() -> None:
    """A poorly damped resonance near the crossover is worth a filter, for every sample of its frequency; the margins are kept with it."""
    ringing = known("screw_compliance", spread=0.01, delay=0.01)
    loop = feedback(ringing, RATE)
    found = with_filter(ringing, RATE, modes(ringing), loop)
    assert found is not None
    own, better = found
    assert better.crossover > loop.crossover and better.worst.phase >= 45.0 and better.worst.gain >= 2.0
    for item in samples(ringing, 24):
        assert margins(sampled(item, RATE), better.controller).gain >= 2.0
    assert np.array_equal(coefficients(better.controller, RATE)[1], own.section)


def test_the_discrete_coefficients_are_the_controller() -> None:
    """b0 .. a2 of the PID and of the filter behind it have the controller's response at every frequency."""
    own = Controller(300.0, 2000.0, 5.0, 1e-3, sections=low_pass(200.0, RATE).section[None, :])
    for f in (3.0, 50.0, 700.0):
        z = np.exp(2j * np.pi * f / RATE)
        parts = [(b0 + b1 / z + b2 / z**2) / (1 + a1 / z + a2 / z**2) for b0, b1, b2, a1, a2 in coefficients(own, RATE)]
        assert np.prod(parts) == pytest.approx(controller_response(own, np.array([f]), RATE)[0], rel=1e-9)
