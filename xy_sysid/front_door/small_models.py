"""Public functions for short tests, position-controlled servos, two axes at once, and numbers in SI."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from xy_sysid.axis.mechanics import Figure, drive_from
from xy_sysid.axis.mechanics import mechanics as mechanical
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.diagnosis.of_run import Data, Diagnosed, Refinement, runs_together
from xy_sysid.errors import BadInput
from xy_sysid.fitting.two_axes import coupling_in
from xy_sysid.response.coupling import Coupling
from xy_sysid.samples.recording import Recording, Run
from xy_sysid.settings import IdentifierSettings, build
from xy_sysid.tables import Table
from xy_sysid.time_models.first_order import FirstOrder, first_order
from xy_sysid.time_models.servo import Servo
from xy_sysid.time_models.servo import servo as servo_of
from xy_sysid.units import Units


def steps(data: Data) -> FirstOrder:
    """Gain, time constant, delay and friction (kS, kV, kA) from short step and ramp tests, with 95 % intervals.

    data: a run or several of one axis, or a recording of one axis with all its stretches, however short
    ``found.sentences`` say what these tests do not determine. Raises BadInput for an input or an output that never changes.
    """
    return first_order(_every(data))


def servo(data: Data) -> Servo:
    """Stiffness, damping, friction, torque limit and delay of a position-controlled joint, from its target (the input) to its angle (the output).

    data: as for ``steps``, target and angle in one unit. All numbers are over the inertia; ``found.in_si(inertia)`` has those of MuJoCo and URDF.
    Raises BadInput for too few samples or different units.
    """
    return servo_of(_every(data))


def coupling(data: Recording, combine: str = "", **settings: Any) -> Coupling:
    """What two axes that are driven at once do to each other: the 2 x 2 response, its coupling by band, and whether two single-axis models suffice.

    combine:  corexy or gantry, of a machine whose two drives move both axes
    settings: any of the identifier's (docs/settings.md), for example band_low=1.0
    Source: Bendat & Piersol, Random Data, 4th ed., sec. 7.4. Raises BadInput for fewer than two axes, too few windows, or inputs that are alike.
    """
    return coupling_in(data, build(IdentifierSettings, settings, "coupling"), combine)


def mechanics(found: FirstOrder | PhysicalModel | Diagnosed | Refinement, kt: float | None = None, gear: str = "") -> Table:
    """Inertia or mass, damping and friction in SI, at the joint or table and at the motor, with the names of MuJoCo and URDF.

    found: of ``steps``, ``refine`` or ``diagnose``, or a model; kt: torque constant of a current as input, N m/A
    gear:  turns of the motor for one of the joint ("50"), or the way of one turn ("5mm")
    Empty where the input is no torque, force or current with a constant. Raises BadInput for a gear that cannot be read.
    """
    figures, units = _figures(found)
    drive = drive_from(kt, gear, units)
    columns = ("parameter", "value", "from", "to", "unit", "at the motor", "unit at the motor", "MuJoCo, URDF")
    rows = (
        (item.name, item.value, item.low, item.high, item.unit, item.at_motor, item.motor_unit if item.at_motor is not None else "", item.robot_name)
        for item in mechanical(figures, units, drive)
    )
    return Table(columns, tuple(rows))


def _figures(found: FirstOrder | PhysicalModel | Diagnosed | Refinement) -> tuple[tuple[Figure, ...], Units]:
    """Parameters with intervals, and their units."""
    if isinstance(found, FirstOrder):
        return found.quantities, found.units
    if isinstance(found, Diagnosed):
        return found.ladder.final.parameters if found.ladder is not None else (), found.units
    model = found.model if isinstance(found, Refinement) else found
    return model.parameters, model.units


def _every(data: Data) -> tuple[Run, ...]:
    """Every stretch of one axis. Raises BadInput for several axes, or runs that do not belong together."""
    runs: list[Run] = []
    for item in data if isinstance(data, Sequence) else (data,):
        if isinstance(item, Recording):
            if len(item.axes) != 1:
                raise BadInput("recording", f"of {len(item.axes)} axes", "one axis", f"Choose one with .run(name): {', '.join(item.axes)}.")
            runs += item.every_stretch(item.axes[0])
        else:
            runs.append(item)
    return runs_together(runs)
