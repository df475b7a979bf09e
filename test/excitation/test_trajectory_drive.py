"""The drive of a robot that accepts only trajectories, and an exact controller: never outside the limits, always to rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from xy_sim.following import Following, Point
from xy_sysid.errors import BadInput
from xy_sysid.excitation.designed import Planned
from xy_sysid.excitation.motion_plan import MotionPoints
from xy_sysid.excitation.trajectory import Trajectory
from xy_sysid.excitation.trajectory_drive import TrajectoryDrive, drive_of
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings, build

RATE, START = 200.0, 0.4
FINE = 5  # positions per sample
JOINT: dict[str, Any] = {
    "kind": "multisine",
    "rms": 0.0,
    "limit": 0.3,
    "max_speed": 0.8,
    "max_acceleration": 6.0,
    "low": 0.5,
    "high": 8.0,
    "period": 4.0,
    "travel_min": -1.0,
    "travel_max": 1.5,
    "brake": 0.1,
}


def settings(**x: Any) -> ExcitationSettings:
    """One joint of a JointTrajectoryController."""
    given = {"output": "commands", "interface": "position", "command": "joint_trajectory", "unit": "rad", "rate": RATE}
    return build(ExcitationSettings, {**given, "axes": {"x": AxisExcitation(**{**JOINT, **x})}})


class Robot:
    """A controller that receives the drive's messages, and a joint that follows it exactly; its clock may be late."""

    def __init__(self, drive: TrajectoryDrive, late: float = 0.0) -> None:
        self.drive, self.late, self.following = drive, late, Following(["x"])
        self.place, self.path, self.refused = START, [START], ""
        self.drive.start()
        self.see()

    def see(self) -> bool:
        """A joint state with the stamp of now."""
        at = np.array([self.drive.seq - 1.0 - self.late * RATE])
        return self.drive.see(Block(("x",), at, at / RATE, np.array([[self.place]])))

    def hear(self, points: MotionPoints) -> None:
        """Receive a message."""
        made = [
            Point(at=(s - points.sample[0]) / RATE, position=p, speed=v, push=a if k < points.brakes else np.empty(0))
            for k, (s, p, v, a) in enumerate(zip(points.sample, points.position, points.speed, points.acceleration, strict=True))
        ]
        begins = 1000.0 + (self.drive.stamp_from + points.sample[0]) / RATE
        none = np.zeros(1)
        self.refused = self.following.take(["x"], made, begins, self.clock(), Point(0.0, np.array([self.place]), none, none)) or self.refused

    def clock(self) -> float:
        """Of the controller, s."""
        return 1000.0 + (self.drive.seq - 1) / RATE - self.late

    def go(self, samples: int, deaf: bool = False, held_up: int = 0) -> FloatArray:
        """(samples * FINE,) positions; deaf: no message is received; held_up: delay of the first step, samples."""
        before = len(self.path)
        for k in range(samples):
            last = self.clock()
            self.drive.catch_up(held_up if k == 0 else 0)
            points = self.drive.message()
            for at in np.arange(last, self.clock() - 1e-9, 1.0 / FINE / RATE) + 1.0 / FINE / RATE:
                wanted = self.following.now(float(at))
                self.place = self.place if wanted is None else float(wanted[0][0])
                self.path.append(self.place)
            if points is not None and not deaf:
                self.hear(points)
            self.see()
        return np.array(self.path[before:])

    def limits_kept(self) -> None:
        """Position, speed and acceleration of the full motion, by differences."""
        path, step = np.array(self.path), 1.0 / FINE / RATE
        assert np.abs(path - START).max() <= JOINT["limit"] * (1 + 1e-9)
        assert np.abs(np.diff(path)).max() / step <= JOINT["max_speed"] * 1.001
        assert np.abs(np.diff(path, 2)).max() / step**2 <= JOINT["max_acceleration"] * 1.02  # 25 points in a period of the highest frequency


def robot(late: float = 0.0, **x: Any) -> Robot:
    drive = drive_of(settings(**x))
    assert isinstance(drive, TrajectoryDrive)
    return Robot(drive, late)


@pytest.mark.parametrize("late", [0.0, 0.08, -0.01])
@pytest.mark.parametrize("kind", ["multisine", "sweep"])
def test_pieces_are_one_motion_within_the_limits(kind: str, late: float) -> None:
    """Over a whole period and into the next, for a controller whose clock is late or early, one limit is reached and none exceeded."""
    one = robot(late, kind=kind)
    one.go(1000)
    assert one.drive.state == "active" and not one.refused, one.drive.reason
    one.limits_kept()
    path, step = np.array(one.path), 1.0 / FINE / RATE
    parts = np.ptp(path) / 0.6, np.abs(np.diff(path)).max() / step / 0.8, np.abs(np.diff(path, 2)).max() / step**2 / 6.0
    assert max(parts) > 0.95


@pytest.mark.parametrize(("late", "words"), [(-0.2, "stamped 0.2 s after it comes"), (0.12, "stamped 0.12 s before it comes")])
def test_a_robot_whose_clock_is_another_is_not_moved(late: float, words: str) -> None:
    """Pieces would not fit together: its joint states are not usable, and the reason gives the difference of the clocks."""
    one = robot(late)
    assert np.ptp(one.go(100)) == 0.0 and words in one.drive.unusable


@pytest.mark.parametrize("samples", [301, 433, 517, 848])
def test_stop_brakes_within_the_limits_and_the_reference_says_where_it_rests(samples: int) -> None:
    """STOP, from any speed: the joint is at rest after LEAD and speed over acceleration, and the last reference is its position."""
    one = robot()
    one.go(samples)
    one.drive.obey_stop()
    one.go(60)
    assert one.drive.state == "stopped" and one.drive.reason == "STOP"
    assert np.ptp(one.go(20)) == 0.0 and one.drive.safe[0] == pytest.approx(one.place, abs=1e-9)
    one.limits_kept()


@pytest.mark.parametrize("samples", [301, 517])
def test_a_computer_that_dies_leaves_a_joint_that_comes_to_rest_by_itself(samples: int) -> None:
    """Without further messages the controller brakes after the horizon as in its last message, within the limits."""
    one = robot()
    one.go(samples)
    one.go(150, deaf=True)
    assert np.ptp(one.go(20, deaf=True)) == 0.0
    one.limits_kept()


def test_a_stall_longer_than_the_horizon_ends_it_and_a_shorter_one_is_not_noticed() -> None:
    """After a shorter interruption the motion continues at its present point; after a longer one it stays at rest, with a reason."""
    one = robot()
    one.go(400)
    one.go(200, held_up=70)
    assert not one.drive.reason
    one.go(10, held_up=200)
    assert one.drive.fault and "longer than horizon" in one.drive.reason
    assert one.drive.state == "stopped" and one.drive.safe[0] == pytest.approx(one.place, abs=1e-9)
    one.limits_kept()


def test_a_joint_that_something_holds_back_stays_where_it_is_in_the_end() -> None:
    """The drive brakes with the reason that the joint does not follow, and commands the measured position."""
    one = robot()
    one.go(400)
    held = one.place - 0.5
    for _ in range(100):
        one.place = held
        one.see()
        one.drive.catch_up(0)
        one.drive.message()
    assert one.drive.fault and "does not follow" in one.drive.reason
    assert one.drive.strayed is not None and one.drive.strayed[0] == held


def test_a_joint_whose_motion_would_leave_its_travel_is_not_moved() -> None:
    """The reason gives position, motion and travel; no message is sent."""
    one = robot(travel_max=0.6)
    assert one.drive.fault and "x stands at 0.4 rad: its motion from 0.1 to 0.7 rad would leave its travel" in one.drive.reason
    assert np.ptp(one.go(100)) == 0.0 and one.drive.state == "stopped"


def test_an_axis_that_is_off_stays() -> None:
    """It gets its position as reference, with speed 0."""
    two = {"x": AxisExcitation(**JOINT), "y": AxisExcitation(**{**JOINT, "kind": "off", "max_speed": 0.0, "max_acceleration": 0.0})}
    drive = drive_of(settings().model_copy(update={"axes": two}))
    assert isinstance(drive, TrajectoryDrive)
    drive.start()
    drive.see(Block(("x", "y"), np.array([-1.0]), np.array([0.0]), np.array([[0.1, -0.2]])))
    drive.next(1)
    points = drive.message()
    assert points is not None and np.ptp(points.position[:, 0]) > 0.0
    assert set(points.position[:, 1]) == {-0.2} and not points.speed[:, 1].any()


@pytest.mark.parametrize(
    ("x", "words"),
    [
        ({"rms": 0.2, "max_acceleration": 600.0}, "x.max_speed would be exceeded"),
        ({"rms": 0.05, "limit": 0.05, "max_speed": 5.0, "max_acceleration": 300.0}, "x.limit would be exceeded"),
        ({"rms": 0.2, "max_speed": 50.0}, "x.max_acceleration would be exceeded"),
        ({"high": 60.0}, "8.*60 Hz"),
        ({"low": 0.1, "period": 4.0}, "cycles of the lowest"),
        ({"max_speed": 0.0}, "x.max_speed is 0 rad/s with joint_trajectory; allowed: above 0"),
        ({"kind": "noise"}, "x.kind is noise with joint_trajectory; allowed: multisine, sweep, off"),
        ({"slow": 0.1}, "x.slow is 0.1 with joint_trajectory"),
    ],
)
def test_what_exceeds_the_limits_is_refused_before_anything_moves(x: dict[str, Any], words: str) -> None:
    """The error names the limit, with the largest allowed size."""
    with pytest.raises(BadInput, match=words):
        drive_of(settings(**x))


def test_a_size_within_the_limits_is_kept_and_nothing_changes_while_active() -> None:
    """rms is that of the motion; limits are not raised during a motion."""
    one = robot(rms=0.004)
    one.go(804)
    assert np.std(one.path) == pytest.approx(0.004, rel=0.02)
    with pytest.raises(BadInput, match="while active"):
        one.drive.change(settings(rms=0.004, limit=0.4))
    one.limits_kept()


@pytest.mark.parametrize("more", [{"output": "blocks"}, {"interface": "velocity"}])
def test_trajectories_are_positions_for_a_controller(more: dict[str, Any]) -> None:
    """The command names the other required settings."""
    given = {**settings().model_dump(), **more}
    with pytest.raises(BadInput, match="interface"):
        build(ExcitationSettings, given)


def test_a_joint_state_that_comes_while_this_computer_has_stood_still_is_no_fault_of_the_clock() -> None:
    """If commands are late, joint states up to the present time are usable, and no later ones."""
    one = robot()
    one.go(100)
    stalled = round(0.2 * RATE)

    def seen(after: int, overdue: int) -> bool:
        at = np.array([one.drive.seq - 1.0 + after])
        return one.drive.see(Block(("x",), at, at / RATE, np.array([[one.place]])), overdue)

    assert not seen(stalled, 0) and "stamped 0.2 s after it comes" in one.drive.unusable
    assert seen(1, stalled) and seen(stalled, stalled)  # one that has waited to be read, and one that has just arrived
    assert not seen(2 * stalled, stalled) and "stamped 0.2 s after it comes" in one.drive.unusable


def test_the_motion_of_an_experiment_is_sent_once_and_ends_where_it_began() -> None:
    """In the place of the multisine, within the limits; the duration ends it at rest."""
    time = np.arange(401) / RATE
    moved = 0.2 * np.sin(np.pi * time / 2.0) ** 2
    speed = np.gradient(moved) * RATE
    wanted = Trajectory(time=time, position=moved, speed=speed, acceleration=np.gradient(speed) * RATE, limited_by="the design")
    drive = drive_of(settings().model_copy(update={"duration": 2.0}), planned=Planned(motions={"x": wanted}))
    assert isinstance(drive, TrajectoryDrive) and "(the design)" in drive.sizes
    one = Robot(drive)
    path = one.go(500)
    one.limits_kept()
    assert path.max() - START == pytest.approx(0.2, abs=1e-3) and path.min() - START > -1e-3
    assert drive.state == "stopped" and path[-1] == pytest.approx(START, abs=1e-3) and np.ptp(path[-200:]) == 0.0
