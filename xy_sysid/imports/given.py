"""Units and factors that the user gives for the topics of a bag, which name none."""

from __future__ import annotations

import dataclasses

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.imports.foreign_units import Unit, to_si, unit_of
from xy_sysid.imports.reading import Reading
from xy_sysid.imports.sheet_table import scaled
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording
from xy_sysid.units import Sensed


def in_units(recording: Recording, reading: Reading) -> Recording:
    """The recording in SI, by the given units and factors, or those of the bag. Raises BadInput if axes get different units."""
    notes = list(recording.notes)
    u, input_unit = _side(recording, "input", recording.voltage, recording.input_unit, reading, notes)
    y, output_unit = _side(recording, "output", recording.position, recording.output_unit, reading, notes)
    r = None if recording.reference is None else _side(recording, "reference", recording.reference, recording.output_unit, reading, [])[0]
    measured: Sensed = output_unit.quantity if output_unit.quantity in ("velocity", "acceleration") else recording.measured
    return dataclasses.replace(
        recording, voltage=u, position=y, reference=r, input_unit=input_unit.name, output_unit=output_unit.name, measured=measured, notes=tuple(notes)
    )


def _meant(text: str, measured: Sensed) -> str:
    """The intended unit: for a velocity the unit of its position may be given, rad for rad/s."""
    return f"{text}/s" if measured == "velocity" and unit_of(text).quantity == "position" else text


def _side(recording: Recording, role: str, values: FloatArray, text: str, reading: Reading, notes: list[str]) -> tuple[FloatArray, Unit]:
    known, names = unit_of(text), (role, "output") if role == "reference" else (role,)
    if known.scale == 1.0 and not any(what.endswith(names) for what in (*reading.units, *reading.scales)):
        return values, known
    columns, units = [], []
    for place, axis in enumerate(recording.axes):
        told: list[str] = []
        one, own = scaled(values[:, place], reading.unit(role, axis) or text, reading.scale(role, axis), f"the {role} of {axis}", told)
        one, unit = to_si(one, own if role == "input" else _meant(own, recording.measured), f"the {role}", told)
        notes += [note for note in told if note not in notes]
        columns.append(one)
        units.append(unit)
    if len({unit.name for unit in units}) > 1:
        given = ", ".join(f"{axis} in {unit.name}" for axis, unit in zip(recording.axes, units, strict=True))
        raise BadInput(f"the {role}", given, "one unit for all axes", "Choose axes with --axis, or give all the same --unit.")
    return np.column_stack(columns), units[0]
