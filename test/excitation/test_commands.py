"""Commands for controllers of ros2_control: efforts and velocities as voltage, positions relative to the measured one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from xy_sysid.errors import BadInput
from xy_sysid.excitation.drive import Drive
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings, build

RATE = 500.0
JOINT: dict[str, Any] = {"rms": 0.02, "limit": 0.1, "travel_min": -1.0, "travel_max": 2.0, "brake": 0.2, "high": 100.0}


def settings(interface: str = "position", **x: Any) -> ExcitationSettings:
    """One joint."""
    values = {**JOINT, **x}
    return ExcitationSettings(output="commands", interface=interface, unit="rad", rate=RATE, axes={"x": AxisExcitation(**values)})


def seen(drive: Drive, position: float, seq: float | None = None) -> bool:
    """A joint state with the stamp of now."""
    at = np.array([float(drive.seq if seq is None else seq)])
    return drive.see(Block(("x",), at, at / RATE, np.array([[position]])))


def running(what: ExcitationSettings, position: float = 0.5) -> Drive:
    """A drive that has received the position of the joint."""
    drive = Drive(what)
    drive.start()
    assert seen(drive, position, -1.0)
    return drive


def followed(drive: Drive, samples: int) -> FloatArray:
    """(samples,) references of a joint that follows exactly."""
    sent = []
    for _ in range(samples):
        sent.append(float(drive.next(1).values[0, 0]))
        seen(drive, sent[-1], drive.seq - 0.5)
    return np.array(sent)


def test_no_position_is_sent_before_one_is_measured() -> None:
    """Position interface: until the first joint state nothing is sent; a zero would drive the joint to zero."""
    drive = Drive(settings())
    drive.start()
    assert np.isnan(drive.next(3).values).all() and np.isnan(drive.safe).all()


def test_positions_are_a_small_signal_about_where_the_joint_stood_and_begin_without_a_step() -> None:
    """The reference begins at the measured position, stays within the limit around it, and has the requested rms."""
    drive = running(settings())
    sent = followed(drive, 5000)
    assert drive.state == "active", drive.reason
    assert sent[0] == 0.5 and np.abs(sent - 0.5).max() <= 0.1
    assert np.abs(np.diff(sent[:10])).max() < 0.002
    assert 0.015 < np.std(sent[500:]) < 0.025


def test_the_last_position_is_a_measured_one_and_stays_it() -> None:
    """Stopped: the reference fades to the measured position, and does not follow a sagging joint."""
    drive = running(settings())
    followed(drive, 1000)
    assert seen(drive, 0.48, drive.seq)
    drive.stop("asked", 0.1)
    faded = [float(drive.next(1).values[0, 0]) for _ in range(60)]
    assert drive.state == "stopped" and faded[-1] == 0.48
    assert np.abs(np.diff(faded)).max() < 0.03
    seen(drive, 0.47, drive.seq)
    assert drive.next(1).values[0, 0] == 0.48 and drive.safe[0] == 0.48


def test_a_slow_sweep_carries_the_small_signal_through_the_range_and_the_travel_holds() -> None:
    """slow, slow_period: the centre moves; no reference leaves the travel, for any settings."""
    drive = running(settings(rms=0.01, limit=0.6, slow=0.5, slow_period=4.0, travel_max=0.8), 0.5)
    sent = followed(drive, 4000)
    assert drive.state == "active", drive.reason
    assert sent.max() == 0.8 and -0.1 < sent.min() < 0.05
    assert drive.report().braked[0] > 100


@pytest.mark.parametrize(("after", "words"), [(lambda reference: 0.5, "stands still"), (lambda reference: 0.95, "away from where its reference was")])
def test_a_joint_that_does_not_follow_stops_it(after: Any, words: str) -> None:
    """The controller ignores references, the encoder is frozen, an external force acts: the drive stops with a reason, in rad."""
    drive = running(settings())
    for _ in range(1500):
        value = float(drive.next(1).values[0, 0])
        seen(drive, after(value), drive.seq - 0.5)
    assert drive.fault and words in drive.reason and "mrad" in drive.reason


def test_a_joint_outside_its_travel_is_not_moved() -> None:
    """Position interface: one sentence with position and travel, and only the measured position as reference."""
    drive = Drive(settings())
    drive.start()
    seen(drive, 2.5, -1.0)
    assert drive.fault and "x stands at 2.5 rad, outside its travel from -1 to 2 rad" in drive.reason
    assert drive.next(1).values[0, 0] == 2.5 and drive.state == "stopped"


@pytest.mark.parametrize("interface", ["effort", "velocity"])
def test_efforts_and_velocities_end_at_zero_and_turn_inward_at_the_travel(interface: str) -> None:
    """As voltage: 0 before the first position and at the end, inward at an end of the travel, limits in the unit of the interface."""
    drive = Drive(settings(interface, rms=0.5, limit=1.0, centring=0.0))
    drive.start()
    assert not drive.next(3).values.any()
    seen(drive, 1.99, 0.0)
    sent = np.concatenate([drive.next(1).values for _ in range(200) if seen(drive, 1.99, drive.seq) or True])
    assert sent[60:].max() <= 0.0 and sent.min() >= -1.0
    drive.stop("asked", 0.02)
    assert not np.concatenate([drive.next(1).values for _ in range(15)])[-1].any() and drive.state == "stopped"


def test_no_joint_state_for_the_watchdog_stops_it() -> None:
    """The watchdog of voltage also applies to commands: the last measured position remains."""
    drive = running(settings())
    followed(drive, 100)
    last = drive.safe[0]
    for k in range(100):
        drive.tick(k * 0.002)
    assert drive.blind and "no position" in drive.reason
    drive.next(50)
    assert drive.next(1).values[0, 0] == last


def test_stamps_of_another_clock_are_named() -> None:
    """Joint states with stamps of another clock are not usable, and the reason gives the sign and size of the difference."""
    drive = running(settings())
    followed(drive, 1000)
    assert not seen(drive, 0.5, drive.seq + 5000) and "stamped 10 s ahead" in drive.unusable


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"x.limit": 10.0, "interface": "position"}, "up to half the travel, 1.5 rad"),
        ({"x.rms": 1.0, "x.limit": 0.5}, "up to limit = 0.5 N m"),
        ({"lockstep": True}, "output is commands with lockstep"),
    ],
)
def test_settings_that_do_not_fit_commands_are_refused_in_their_unit(values: dict[str, Any], words: str) -> None:
    """The defaults for volts do not apply to radians: limit and rms must be given."""
    given = {"output": "commands", "unit": "rad", "rate": RATE, **{f"x.{name}": value for name, value in JOINT.items()}, **values}
    with pytest.raises(BadInput, match=words):
        build(ExcitationSettings, given)
