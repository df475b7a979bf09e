"""Public functions for short tests, position-controlled servos, two axes at once, and numbers in SI."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from xy_sysid.axis.mechanics import Figure, drive_from, robot_parameters
from xy_sysid.axis.mechanics import mechanics as mechanical
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.diagnosis.answer import Answer
from xy_sysid.diagnosis.of_run import Data, runs_together
from xy_sysid.errors import BadInput
from xy_sysid.fitting.of_run import LinearModel
from xy_sysid.fitting.two_axes import coupling_in
from xy_sysid.response.coupling import Coupling
from xy_sysid.samples.recording import Recording, Run
from xy_sysid.settings import IdentifierSettings, build
from xy_sysid.tables import Table
from xy_sysid.time_models.as_words import first_order_words, servo_words
from xy_sysid.time_models.first_order import FirstOrder, first_order
from xy_sysid.time_models.output_error import told_table
from xy_sysid.time_models.servo import Servo
from xy_sysid.time_models.servo import servo as servo_of
from xy_sysid.units import USUAL, Units


class StepTest(FirstOrder):
    """A first-order model with delay and friction. ``found["gain"]`` is a number with its interval; ``sentences`` name what remains undetermined."""

    __slots__ = ()

    @property
    def sentences(self) -> tuple[str, ...]:
        """The answer, then everything that these tests do not determine, and a test that would."""
        return first_order_words(self)

    @property
    def table(self) -> Table:
        """Each quantity with its 95 % interval."""
        return told_table(self.quantities)

    def __str__(self) -> str:
        """The sentences and the table."""
        return "\n".join((*self.sentences, "", str(self.table)))

    def __repr__(self) -> str:
        return f"<StepTest: {self.sentences[0]}>"


class ServoTest(Servo):
    """A position-controlled joint. ``found["stiffness"]`` is a number with its interval; ``sentences`` name what remains undetermined."""

    __slots__ = ()

    @property
    def sentences(self) -> tuple[str, ...]:
        """The answer, then everything that target and angle alone do not determine."""
        return servo_words(self, None)

    @property
    def table(self) -> Table:
        """Each quantity, divided by the inertia, with its 95 % interval."""
        return told_table(self.quantities)

    def in_si(self, inertia: float, gear: str = "") -> Table:
        """Armature, kp, damping, frictionloss and forcerange, as MuJoCo calls them, for an inertia of joint and load, kg m^2 (mass, kg).

        gear: motor turns per joint turn ("50"), or travel per motor turn ("5mm"), for the values at the motor. Raises BadInput
        """
        columns = ("parameter", "value", "from", "to", "unit", "at the motor", "unit at the motor")
        found = robot_parameters(self.quantities, self.units, inertia, gear)
        return Table(columns, tuple((q.name, q.value, q.low, q.high, q.unit, q.at_motor, q.motor_unit if gear else "") for q in found))

    def __str__(self) -> str:
        """The sentences and the table."""
        return "\n".join((*self.sentences, "", str(self.table)))

    def __repr__(self) -> str:
        return f"<ServoTest: {self.sentences[0]}>"


def steps(data: Data) -> StepTest:
    """Gain, time constant, delay and friction (kS, kV, kA) from short step and ramp tests, with 95 % intervals.

    data: a run or several of one axis, or a recording of one axis with all its stretches, however short
    ``found.sentences`` name what these tests do not determine. Raises BadInput for an input or an output that never changes.
    """
    return StepTest(**_fields(first_order(_every(data))))


def servo(data: Data) -> ServoTest:
    """Stiffness, damping, friction, torque limit and delay of a position-controlled joint, from its target (the input) to its angle (the output).

    data: as for ``steps``, target and angle in one unit. All values are per inertia; ``found.in_si(inertia)`` has those of MuJoCo and URDF.
    Raises BadInput for too few samples or different units.
    """
    return ServoTest(**_fields(servo_of(_every(data))))


def coupling(data: Recording, combine: str = "", **settings: Any) -> Coupling:
    """The coupling of two axes that are driven at once: the 2 x 2 response, the coupling in each band, and whether two single-axis models suffice.

    combine:  corexy or gantry, for a machine whose two drives move both axes
    settings: any of the identifier's (docs/settings.md), for example band_low=1.0
    Source: Bendat & Piersol, Random Data, 4th ed., sec. 7.4. Raises BadInput for fewer than two axes, too few windows, or similar inputs.
    """
    return coupling_in(data, build(IdentifierSettings, settings, "coupling"), combine)


def mechanics(found: FirstOrder | LinearModel | PhysicalModel | Answer, kt: float | None = None, gear: str = "") -> Table:
    """Inertia or mass, damping and friction in SI, at the joint or table and at the motor, with the names of MuJoCo and URDF.

    found: result of ``steps``, ``fit``, ``refine`` or ``diagnose``, or a model; kt: torque constant, N m/A, if the input is a current
    gear:  motor turns per joint turn ("50"), or travel per motor turn ("5mm")
    Empty if the input is not a torque, a force, or a current with a known torque constant. Raises BadInput for a gear that cannot be read.
    """
    figures, units = _figures(found)
    drive = drive_from(kt, gear, units)
    columns = ("parameter", "value", "from", "to", "unit", "at the motor", "unit at the motor", "MuJoCo, URDF")
    rows = (
        (item.name, item.value, item.low, item.high, item.unit, item.at_motor, item.motor_unit if item.at_motor is not None else "", item.robot_name)
        for item in mechanical(figures, units, drive)
    )
    return Table(columns, tuple(rows))


def _figures(found: FirstOrder | LinearModel | PhysicalModel | Answer) -> tuple[tuple[Figure, ...], Units]:
    """Parameters with intervals, and their units."""
    if isinstance(found, FirstOrder):
        return found.quantities, found.units
    if isinstance(found, Answer):
        return found.rungs[-1].parameters if found.rungs else (), found.units
    if isinstance(found, LinearModel):
        return (found.fit.rigid, found.fit.units) if found.fit is not None else ((), USUAL)
    return found.parameters, found.units


def _fields(found: FirstOrder | Servo) -> dict[str, Any]:
    return {item.name: getattr(found, item.name) for item in fields(found)}


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
