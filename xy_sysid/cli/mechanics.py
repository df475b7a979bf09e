"""The options --kt and --gear, and mechanical parameters in display units."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from xy_sysid.cli.output import estimate, table

if TYPE_CHECKING:
    from xy_sysid.axis.mechanics import Figure, Mechanical, Transmission
    from xy_sysid.units import Units

Kt = Annotated[
    float | None, typer.Option("--kt", metavar="NM_PER_A", help="torque constant of the motor, N m/A; adds inertia and friction in SI units")
]
Gear = Annotated[
    str, typer.Option("--gear", metavar="RATIO", help="gear ratio: turns of the motor for one turn of the joint (50), or travel of one turn (5mm)")
]


def mechanics_table(figures: Iterable[Figure], units: Units, drive: Transmission) -> None:
    """Print the parameters in SI, at the joint or table and at the motor; nothing if they are unknown."""
    from xy_sysid.axis.mechanics import mechanics

    found = mechanics(figures, units, drive)
    if not found:
        return
    geared = drive.ratio is not None
    rows = [(*mechanics_cells(item), item.robot_name) for item in found]
    where = "the table" if units.output == "m" else "the joint"
    columns = ("parameter", "value", "95 % interval", "unit", *(("at the motor",) if geared else ()), "MuJoCo, URDF")
    table(f"in SI{f', at {where}' if geared else ''}", columns, rows)


def mechanics_cells(item: Mechanical) -> tuple[str, ...]:
    """Name, value, interval and unit; with a gear also the value at the motor."""
    motor = () if item.at_motor is None else (f"{item.at_motor:.4g} {item.motor_unit}",)
    return (*estimate(item.name, (item.value, item.low, item.high), item.unit), *motor)


def mechanics_document(figures: Iterable[Figure], units: Units, drive: Transmission) -> dict[str, Any]:
    """The same for JSON."""
    from xy_sysid.axis.mechanics import mechanics

    return {item.name: mechanics_row(item) for item in mechanics(figures, units, drive)}


def mechanics_row(item: Mechanical) -> dict[str, Any]:
    """One of them."""
    return {
        "value": item.value,
        "ci95": [item.low, item.high],
        "unit": item.unit,
        "at_motor": None if item.at_motor is None else {"value": item.at_motor, "unit": item.motor_unit},
        "robot_name": item.robot_name or None,
    }
