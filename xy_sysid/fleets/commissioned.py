"""A model file and a fleet's table -> the reference for a running machine: estimates at commissioning, and the spread between recordings."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from xy_sysid.axis.model import Library
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.files.linear_models import model_file, read_saved
from xy_sysid.files.models import read_models
from xy_sysid.fleets.columns import column_of, columns
from xy_sysid.fleets.trends import trend
from xy_sysid.fleets.words import widest
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.estimate import Estimate

Known = tuple[Estimate, ...]


def of_transfer_functions(path: Path) -> Mapping[str, tuple[TransferFunction, Known]]:
    """For each axis the transfer function of a file of ``fit --model``, and the estimates of gain, delay and resonances.

    Raises BadRecording or BadInput in one line for any other file.
    """
    models, document = read_saved(path), model_file(path)
    found = {}
    for axis, model in models.items():
        told = document["axes"][axis].get("estimates")
        known = tuple(
            _estimate(path, axis, str(name), item) for name, item in (told.items() if isinstance(told, dict) else ()) if compared(str(name))
        )
        if not known or model.tf.sampling_time is not None:
            raise BadRecording(path, f"axis {axis} has no estimates of a transfer function in s", "Write it with xy-sysid fit --model.")
        found[axis] = model.tf, known
    return found


def of_axis_models(path: Path, library: Library) -> Mapping[str, Known]:
    """For each axis the parameters of a file of ``refine --model``, with their intervals. Raises BadRecording or BadInput for any other file."""
    unlike = {item.name for item in columns(library) if not item.trended}
    found = {}
    for axis, model in read_models(path, library).items():
        if not isinstance(model, PhysicalModel) or not model.known:
            raise BadRecording(path, f"axis {axis} has no parameters of effects with intervals", "Write it with xy-sysid refine --model.")
        found[axis] = tuple(item for item in model.known if column_of(item.name) not in unlike)
    return found


def compared(name: str) -> bool:
    """True for the compared estimates of a transfer function: gain, delay, and the frequencies of resonances and antiresonances."""
    return name in ("gain", "delay") or ("resonance_" in name and name.endswith(".frequency"))


def spreads(table: Path) -> Mapping[str, float]:
    """For each column, the median spread between recordings over the axes of a fleet's table. Raises BadRecording or BadInput."""
    return {column: between for column, between, _ in widest(trend(table))}


def _estimate(path: Path, axis: str, name: str, item: Any) -> Estimate:
    try:
        low, high = map(float, item["ci95"])
        return Estimate(name=name, value=float(item["value"]), unit=str(item["unit"]), low=low, high=high)
    except (KeyError, TypeError, ValueError):
        raise BadInput(f"{path}: axis {axis}: {name}", str(item), "value, ci95 with two numbers, and unit", "Write it with fit --model.") from None
