"""A designed experiment for a robot that accepts only trajectories: the expected motion, from rest to rest, within the limits."""

from __future__ import annotations

import numpy as np
import scipy

from xy_sysid.axis.forward import move
from xy_sysid.axis.model import AxisModel
from xy_sysid.errors import BadInput
from xy_sysid.excitation.trajectory import Trajectory, faded
from xy_sysid.experiment_design.criteria import MOST_POINTS, ORDER, POINTS_EACH
from xy_sysid.experiment_design.of_run import NextExperiment


def as_trajectory(found: NextExperiment, model: AxisModel, rate: float) -> Trajectory:
    """The predicted motion of the fitted model in an experiment, as points of a trajectory.

    rate: points per second; frequencies above an eighth of it are removed, because a controller cannot follow them between points
    Raises BadInput if there is no experiment, for a rate out of range, and for a motion that would exceed a limit of the machine.
    """
    if found.experiment is None:
        raise BadInput("experiment", "none", "one that helps", found.sentence or "Give wider limits, or another setup.")
    if not 1.0 <= rate <= MOST_POINTS:
        raise BadInput("points a second", rate, f"1 to {MOST_POINTS:g}", "Give the rate of the trajectory's points.")
    fine = max(found.sampling_rate, rate)
    start = found.limits.start
    motion = move(model, fine, found.experiment.drive(fine, found.seconds, start))
    sos = scipy.signal.butter(ORDER, min(rate / POINTS_EACH, 0.45 * fine), fs=fine, output="sos")
    time = np.arange(motion.position.size) / fine
    window, _, _ = faded(time, float(time[-1]))
    moved = window * scipy.signal.sosfiltfilt(sos, motion.position - start)
    speed = np.gradient(moved) * fine
    acceleration = np.gradient(speed) * fine
    at = np.arange(int(time[-1] * rate) + 1) / rate
    points = [np.interp(at, time, values) for values in (moved, speed, acceleration)]
    made = Trajectory(time=at, position=start + points[0], speed=points[1], acceleration=points[2], limited_by="the design")
    _within(found, made)
    return made


def _within(found: NextExperiment, made: Trajectory) -> None:
    """Raises BadInput for a trajectory that is closer to a limit than the margin."""
    limits = found.limits
    free = 1.0 - limits.margin
    low, high = (limits.start + free * max(min(end - limits.start, limits.reach), -limits.reach) for end in limits.travel)
    act = "Design it again within these limits: xy-sysid next."
    if not low <= float(made.position.min()) <= float(made.position.max()) <= high:
        span = (float(made.position.min()), float(made.position.max()))
        raise BadInput("travel of the trajectory", limits.span(span), limits.span((low, high)), act)
    for name, values, most in (("speed", made.speed, limits.speed), ("acceleration", made.acceleration, limits.acceleration)):
        peak = float(np.max(np.abs(values)))
        if peak > free * most:
            raise BadInput(f"{name} of the trajectory", f"{peak:.3g}", f"up to {free * most:.3g}", act)
