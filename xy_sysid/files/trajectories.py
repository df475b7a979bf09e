"""A trajectory as trajectory_msgs/JointTrajectory in YAML for ``ros2 topic pub``, and as a CSV of its reference."""

from __future__ import annotations

import yaml

from xy_sysid.excitation.trajectory import Trajectory


def as_yaml(made: Trajectory, joint: str) -> str:
    """The message as YAML; with a stamp of 0 the motion starts when it arrives."""
    points = [
        {
            "positions": [float(place)],
            "velocities": [float(speed)],
            "accelerations": [float(push)],
            "time_from_start": {"sec": int(at), "nanosec": round((at - int(at)) * 1e9) % 10**9},
        }
        for at, place, speed, push in zip(made.time.round(9).tolist(), made.position, made.speed, made.acceleration, strict=True)
    ]
    return yaml.safe_dump({"joint_names": [joint], "points": points}, sort_keys=False, width=200)


def as_csv(made: Trajectory) -> str:
    """time, reference, and its derivatives."""
    rows = zip(made.time.tolist(), made.position.tolist(), made.speed.tolist(), made.acceleration.tolist(), strict=True)
    return "time,reference,speed,acceleration\n" + "\n".join(",".join(repr(value) for value in row) for row in rows) + "\n"
