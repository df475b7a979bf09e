"""xy-sysid trajectory: a multisine or sweep for a JointTrajectoryController."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import emit, say


def trajectory(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="trajectory_msgs/JointTrajectory as YAML; its reference goes into OUT with .csv")],
    joint: Annotated[str, typer.Option(help="name of the joint")],
    position: Annotated[float, typer.Option(min=1e-9, help="largest motion about the start, rad or m")],
    speed: Annotated[float, typer.Option(min=1e-9, help="largest speed, per s")],
    acceleration: Annotated[float, typer.Option(min=1e-9, help="largest acceleration, per s^2")],
    start: Annotated[float, typer.Option(help="present position of the joint, rad or m")] = 0.0,
    kind: Annotated[str, typer.Option(help="multisine or sweep")] = "multisine",
    low: Annotated[float, typer.Option(min=1e-6, help="lowest frequency, Hz")] = 0.2,
    high: Annotated[float, typer.Option(min=1e-6, help="highest frequency, Hz")] = 10.0,
    seconds: Annotated[float, typer.Option(min=0.1, max=3600.0, help="length, s")] = 30.0,
    rate: Annotated[float, typer.Option(min=1.0, max=2000.0, help="points a second")] = 100.0,
    seed: int = 1,
    force: o.Force = False,
    json: o.Json = False,
) -> None:
    """Write the largest excitation within limits of position, speed and acceleration as a trajectory, for a robot that accepts only trajectories."""
    from xy_sysid.bags.atomic import write_text
    from xy_sysid.excitation.trajectory import MotionLimits
    from xy_sysid.excitation.trajectory import trajectory as logic
    from xy_sysid.files.trajectories import as_csv, as_yaml

    reference = out.with_suffix(".csv")
    o.output_file("OUT", out, force)
    o.output_file("OUT", reference, force)
    made = logic(kind, (low, high), seconds, rate, MotionLimits(position, speed, acceleration, start), seed)
    write_text(out, as_yaml(made, joint))
    write_text(reference, as_csv(made))
    most = max(abs(made.position - start)), max(abs(made.speed)), max(abs(made.acceleration))
    if json:
        names = ("position", "speed", "acceleration")
        emit(
            {
                "files": [str(out), str(reference)],
                "points": made.time.size,
                "seconds": made.time[-1],
                "limited_by": made.limited_by,
                "largest": dict(zip(names, most, strict=True)),
            }
        )
        return
    say(
        f"{made.time.size} points over {made.time[-1]:g} s; the limit of {made.limited_by} decides. "
        f"Largest motion {most[0]:.3g}, speed {most[1]:.3g}, acceleration {most[2]:.3g}."
    )
