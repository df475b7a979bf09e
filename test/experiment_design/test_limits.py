"""Limits of an experiment."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from xy_sysid.axis.forward import Motion
from xy_sysid.axis.model import AxisModel
from xy_sysid.errors import BadInput
from xy_sysid.excitation.motion_check import check_loop, most_centring
from xy_sysid.experiment_design.design import broken_in_time
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits, as_recorded, of_settings
from xy_sysid.experiment_design.proposals import neighbours, proposals
from xy_sysid.samples.recording import Recording, Run
from xy_sysid.settings import AxisExcitation, ExcitationSettings

RATE = 1000.0


def motion(amplitude: float, volts: float = 1.0) -> Motion:
    """A sine of 1 Hz."""
    time = np.arange(2000) / RATE
    return Motion(RATE, volts * np.sin(2 * np.pi * time), amplitude * np.sin(2 * np.pi * time))


def test_a_reach_and_a_highest_frequency_bound_the_experiments_of_a_robot() -> None:
    """The reach counts from the start, with the margin; no band is wider than the highest frequency."""
    limits = MachineLimits(voltage=2.0, travel=(-1.0, 1.0), reach=0.1, highest=12.5)
    assert limits.broken(motion(0.09)) == "travel" and limits.broken(motion(0.08)) == ""
    assert limits.room == pytest.approx(0.085)
    every = proposals(limits, RATE)
    assert {item.excitation.high for item in every if item.excitation.kind in ("noise", "sweep")} == {10.0, 12.5}
    near = neighbours(next(item for item in every if item.excitation.high == 12.5), limits, RATE)
    assert max(item.excitation.high for item in near) == 12.5


def test_it_says_which_limit_a_motion_comes_too_near_to() -> None:
    """Voltage up to the limit; speed, acceleration and travel with a margin."""
    limits = MachineLimits(voltage=2.0, travel=(-0.1, 0.1), speed=0.5, acceleration=3.0, rms=1.0)
    assert limits.broken(motion(0.05)) == ""
    assert limits.broken(motion(0.09)) == "speed"
    assert limits.broken(motion(0.01, 2.1)) == "voltage"
    assert limits.broken(motion(0.01, 1.9)) == "rms"
    assert MachineLimits(voltage=2.0, travel=(-0.1, 0.1)).broken(motion(0.09)) == "travel"
    assert MachineLimits(voltage=2.0, travel=(-0.1, 0.1), acceleration=1.0).broken(motion(0.05)) == "acceleration"
    assert limits.broken(Motion(RATE, np.ones(9), np.full(9, np.nan))) == "a model whose simulation diverges"


def recorded(amplitude: float, volts: float, zero: float, samples: int = 2000) -> Run:
    """The same as a recording with another zero."""
    item = motion(amplitude, volts)
    return Recording.from_arrays(RATE, item.voltage[:samples], item.position[:samples] + zero, units=("V", "m")).run("x")


def test_without_limits_an_experiment_stays_within_what_was_recorded() -> None:
    """The largest voltage of all recordings; the travel of the last one, relative to its end, because others may have another zero."""
    last = recorded(0.05, 2.0, 0.02)
    limits = as_recorded([recorded(0.08, 3.0, -0.3), last])
    assert limits.voltage == pytest.approx(3.0, rel=1e-3)
    assert limits.travel == (last.position.min(), last.position.max())
    assert limits.start == last.position[-1]


def test_a_recording_that_ends_where_it_went_farthest_leaves_no_room_that_is_known() -> None:
    """The recorded travel has no reserve: refused in one line, unless the user gives the travel."""
    ends_high = recorded(0.05, 3.0, 0.0, 251)
    with pytest.raises(BadInput, match="where the axis stands, 50 mm, between its ends"):
        as_recorded([ends_high])
    assert as_recorded([ends_high], travel=(-0.1, 0.1)).travel == (-0.1, 0.1)


def test_the_zone_in_which_the_excitation_brakes_is_kept_free_where_it_is_longer_than_the_margin() -> None:
    """The brake zone begins 30 mm before an end and would change the experiment. No experiment is designed from inside it."""
    limits = MachineLimits(voltage=2.0, travel=(-0.1, 0.1), brake=0.03)
    assert limits.broken(motion(0.075)) == "travel" and limits.broken(motion(0.069)) == ""
    assert limits.room == pytest.approx(0.07) and replace(limits, brake=0.01).room == pytest.approx(0.085)
    with pytest.raises(BadInput, match="where the axis stands, 80 mm, between its ends without brake zones of 30 mm"):
        replace(limits, start=0.08)


def test_the_design_fades_in_as_the_excitation_does() -> None:
    """Its ramp is in every proposal, and in the simulation."""
    settings = ExcitationSettings(axes={"x": AxisExcitation(brake=0.03)}, ramp=4.0)
    limits = MachineLimits(**of_settings(settings, "x"))
    assert (limits.ramp, limits.brake) == (4.0, 0.03)
    item = next(iter(proposals(limits, RATE)))
    early, late = (float(np.std(item.drive(RATE, 12.0, 0.0).voltage[part])) for part in (slice(0, 1000), slice(4000, 12000)))
    assert item.ramp == 4.0 and early < 0.2 * late
    at_once = replace(item, ramp=0.0).drive(RATE, 12.0, 0.0).voltage
    assert float(np.std(at_once[:1000])) > 5.0 * early


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("voltage", 0.0, "voltage"),
        ("voltage", 6398.0, "voltage is 6398 V; allowed: up to 1000 V"),
        ("seconds", -1.0, "seconds"),
        ("margin", 1.0, "margin"),
        ("start", 0.2, "travel"),
        ("travel", (-0.1, 77_570.0), "travel is .* allowed: within"),
    ],
)
def test_limits_that_make_no_sense_are_refused(name: str, value: Any, words: str) -> None:
    """One line that names the value."""
    values: dict[str, Any] = {"voltage": 2.0, "travel": (-0.1, 0.1), name: value}
    with pytest.raises(BadInput, match=words):
        MachineLimits(**values)


def test_no_proposal_asks_for_more_than_the_voltage() -> None:
    """Neither a proposal nor its neighbour: the peak of its signal and its slow sine together stay within the limit."""
    limits = MachineLimits(voltage=3.0, travel=(-0.1, 0.1))
    first = proposals(limits, RATE)
    assert len(first) > 50
    for item in [*first[::3], *(near for one in first[::30] for near in neighbours(one, limits, RATE))]:
        drive = item.drive(RATE, 4.0, 0.0)
        assert item.excitation.limit == 3.0
        assert float(np.max(np.abs(drive.voltage))) < 3.0 * 1.1, item.words  # Gaussian noise has a tail, which the drive clips


def test_every_proposal_is_one_that_the_excitation_takes() -> None:
    """Its settings have their own bounds, which a large voltage limit or a short travel would exceed."""
    for limits in (MachineLimits(voltage=1000.0, travel=(-0.1, 0.1)), MachineLimits(voltage=900.0, travel=(-1e-5, 1e-5))):
        assert all(item.excitation.rms <= 100.0 for item in proposals(limits, RATE))


def test_no_proposal_pulls_harder_than_the_excitation_allows() -> None:
    """A joint driven in long blocks: the excitation accepts every proposal, and an offset keeps it inside the travel."""
    axis = AxisExcitation(limit=1.2, travel_min=-2.5, travel_max=2.5)
    settings = ExcitationSettings(axes={"x": axis}, rate=RATE, block=100, lockstep=True, unit="rad")
    limits = MachineLimits(voltage=1.2, travel=(-2.5, 2.5), start=0.8, centring=float(most_centring(settings)[0]))
    assert limits.centring < 0.95 * limits.voltage / limits.room  # the proposal without this is refused
    held = 0
    for item in proposals(limits, RATE):
        check_loop(settings.model_copy(update={"axes": {"x": item.excitation}}))
        if item.excitation.offset:
            held += 1
            assert abs(item.excitation.offset / item.excitation.centring) < limits.room
    assert held >= 4


def test_what_drifts_slowly_to_a_limit_is_seen_in_an_experiment_that_lasts() -> None:
    """A load with weak centring: 86 mm after 8 s, 177 mm after a minute."""
    limits = MachineLimits(voltage=5.0, travel=(-0.14, 0.14))
    hangs = AxisModel(0.097, 1e-3, 246.0).with_effect("constant_load", (0.15,))
    held = AxisExcitation(kind="off", rms=0.0, centring=0.84, limit=5.0)
    assert broken_in_time([hangs], 2000.0, limits, Experiment(held, 8.0)) == ""
    assert broken_in_time([AxisModel(0.097, 1e-3, 246.0), hangs], 2000.0, limits, Experiment(held, 60.0)) == "travel"
