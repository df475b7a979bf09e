"""A trajectory as trajectory_msgs/JointTrajectory in YAML for ``ros2 topic pub``, and as a CSV of its reference, which is read again here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from xy_sysid.bags.opening import text_of
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.excitation.trajectory import Trajectory

HEAD = "time,reference,speed,acceleration"
MOST = 1 << 26  # bytes of a CSV: an hour at 1 kHz has as many


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
    return HEAD + "\n" + "\n".join(",".join(repr(value) for value in row) for row in rows) + "\n"


def motion_of(path: Path) -> Trajectory:
    """The trajectory of a CSV by ``as_csv``. Raises BadInput for a file that cannot be read, or that is not evenly spaced from time 0."""
    act = "Make it again: xy-sysid next --trajectory."
    try:
        head, *lines = text_of(path, "a trajectory", MOST).splitlines() or [""]
        if head != HEAD:
            raise ValueError(f"its first line is {head[:60]!r}")
        time, position, speed, acceleration = np.array([[float(cell) for cell in line.split(",")] for line in lines]).T
    except BadRecording as problem:
        raise BadInput("motion", f"{path}: {problem.problem}", "a trajectory of xy-sysid next", problem.act) from None
    except ValueError as problem:
        raise BadInput(f"motion {path.name}", str(problem), f"the columns {HEAD}", act) from None
    even = time.size > 2 and bool(np.allclose(time, np.arange(time.size) * time[1], rtol=0.0, atol=1e-6)) and time[1] > 0.0
    if not (even and all(np.isfinite(values).all() for values in (position, speed, acceleration))):
        raise BadInput(f"motion {path.name}", "with uneven times or numbers that are not finite", "even times from 0", act)
    return Trajectory(time=time, position=position, speed=speed, acceleration=acceleration, limited_by="the design")
