"""State feedback with an observer: margins over samples of the parameters, a step of load rejected, what delay and resonance allow."""

from __future__ import annotations

import ctypes
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.known_models import DELAY, axis, known

from xy_sysid.control_design.closed_loop import Encoder, follow_path
from xy_sysid.control_design.feedback import Asked, feedback, within_a_gap
from xy_sysid.control_design.path import Bounds, s_curve
from xy_sysid.control_design.sampled import looped, sampled
from xy_sysid.control_design.state_feedback import StateFeedback, state_feedback
from xy_sysid.control_design.state_text import source
from xy_sysid.control_design.uncertain import samples
from xy_sysid.errors import BadInput

RATE = 2000.0


@pytest.fixture(scope="module")
def rigid() -> StateFeedback:
    return state_feedback(known(), RATE)


def test_the_margins_hold_for_samples_that_were_not_designed_for(rigid: StateFeedback) -> None:
    """New samples of the intervals are stable, and the loop, closed independently here, stays 0.45 away from -1 (a gain margin of 2 is 0.5)."""
    frequency = np.geomspace(0.5, 0.499 * RATE, 2000)
    own = rigid.response(frequency)
    for item in samples(known(), 100)[30:]:
        system = sampled(item, RATE)
        assert np.max(np.abs(np.linalg.eigvals(looped(system, (rigid.a, rigid.b, rigid.c, 0.0))))) < 1.0
        loop = system.response(frequency) * own
        assert np.min(np.abs(1.0 + loop)) > 0.45


def test_a_step_of_load_is_rejected_without_a_lasting_error(rigid: StateFeedback) -> None:
    """The controller with the plant, sample by sample, reduces the error of a load of 1 V below a tenth after the stated time, and to 0."""
    system = sampled(known().model, RATE)
    z, past = np.zeros(rigid.b.size), [0.0] * (system.whole + 2)
    x = np.zeros(system.old.size)
    place = []
    for _ in range(int(2.0 * RATE)):
        place.append(x[0])
        u = float(rigid.c @ z)
        z = rigid.a @ z + rigid.b * (0.0 - x[0])
        past = [u, *past[:-1]]
        x = system.a @ x + system.old * (past[system.whole + 1] + 1.0) + system.new * (past[system.whole] + 1.0)
    error = np.abs(np.array(place))
    assert error.max() == pytest.approx(rigid.rejects, rel=1e-6)
    assert error[int(rigid.settles * RATE) + 1 :].max() <= 0.1 * error.max() and error[-1] < 1e-6 * error.max()


def test_delay_and_resonance_limit_the_bandwidth(rigid: StateFeedback) -> None:
    """Ten times the delay reduces the crossover by two thirds; a higher bandwidth gives an error with the resulting margins."""
    slow = replace(known(), model=axis(delay=12.9e-3), known=())
    assert state_feedback(slow, RATE).nominal.crossover < rigid.nominal.crossover / 3.0
    with pytest.raises(BadInput, match=r"phase margin|unstable"):
        state_feedback(slow, RATE, Asked(bandwidth=200.0))


def test_c_and_python_run_as_the_design_does(rigid: StateFeedback, tmp_path: Path) -> None:
    """Both sources give the voltages of the design, and compile without a warning; the sum with the feedforward stays within the limit."""
    text, module = source(rigid, "axis", "a test", 2.0)
    (tmp_path / "control.c").write_text(text)
    strict = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off", "-shared", "-fPIC")
    subprocess.run(["gcc", *strict, "-o", tmp_path / "control.so", tmp_path / "control.c"], check=True)
    compiled = ctypes.CDLL(str(tmp_path / "control.so")).axis_control
    compiled.restype = ctypes.c_double
    space: dict[str, Any] = {}
    exec(module, space)
    python, state, z = space["Controller"](), (ctypes.c_double * (rigid.b.size + 1))(), np.zeros(rigid.b.size)
    errors, held, written = 1e-3 * np.random.default_rng(3).standard_normal(400), 0.0, []
    for k, error in enumerate(errors.tolist()):
        fed = 1.5 * np.sin(0.1 * k)
        z = rigid.free @ z + rigid.b * error + rigid.drive * held
        written.append(float(np.clip(rigid.c @ z + fed, -2.0, 2.0)))
        held = written[-1] - fed
        assert python.input(error, fed) == pytest.approx(written[-1], rel=1e-9, abs=1e-12)
        assert compiled(state, ctypes.c_double(error), ctypes.c_double(fed)) == pytest.approx(written[-1], rel=1e-9, abs=1e-12)
    assert max(written) == 2.0 and min(np.abs(written)) < 2.0


def test_a_simulated_path_is_followed_as_the_exported_source_would(rigid: StateFeedback) -> None:
    """Reading by reading: its errors, passed to the source with the feedforward, give the voltages that were written, at the limit too."""
    space: dict[str, Any] = {}
    exec(source(rigid, "axis", "a test", 1.0)[1], space)
    controller, late = space["Controller"](), axis(delay=DELAY + 1.0 / RATE)
    path = s_curve([0.0, 0.02, 0.0], Bounds(0.3, 5.0, 500.0), RATE)
    extra = 0.5 * np.sin(0.02 * np.arange(path.position.size))
    run = follow_path(late, path, rigid.controller(1.0), extra, Encoder(noise=1e-6, count=0.5e-6))
    written = [controller.input(error, fed) for error, fed in zip(path.position - run.shown, extra, strict=True)]
    assert run.voltage == pytest.approx(np.array(written), rel=1e-9, abs=1e-12)
    assert np.max(np.abs(run.voltage)) == 1.0


def test_an_axis_that_coasts_is_held_at_a_bandwidth_of_its_pid() -> None:
    """With hardly any drag the observer must be fast for the margins: the margins limit the bandwidth, not the drag."""
    model = known(delay=0.05)
    coasting = replace(model.model, gain=0.164, pole=2.24, delay=0.0)
    slow = replace(model, model=coasting, known=())
    found, pid = state_feedback(slow, 1000.0), feedback(slow, 1000.0)
    assert found.nominal.crossover > 0.3 * pid.nominal.crossover and found.worst.phase >= 45.0 and found.worst.gain >= 2.0
    assert found.settles < 1.0


def test_a_loop_across_an_open_gap_is_stable_with_the_motor_alone() -> None:
    """Inside the gap only the motor's mass is in the loop, which keeps its margins there."""
    model = known("backlash")
    found = state_feedback(model, RATE)
    assert found.bandwidth <= state_feedback(known(), RATE).bandwidth
    assert 2.0 <= found.worst.gain < 0.7 * found.nominal.gain  # the motor alone limits it
    (motor,) = within_a_gap(model.model)
    assert np.max(np.abs(np.linalg.eigvals(looped(sampled(motor, RATE), (found.a, found.b, found.c, 0.0))))) < 1.0
