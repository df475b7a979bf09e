"""Models in files, of either kind: a transfer function (``fit --model``) or an axis with physical effects (``refine --model``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from xy_sysid.axis_model import AxisModel, Library
from xy_sysid.axis_model import simulate as simulate_axis
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.exports import FORMAT, Hold, Quoting, model_file, read_saved
from xy_sysid.greybox import GreyboxFit
from xy_sysid.linear_part import linear_part, nonlinear
from xy_sysid.simulation import simulate
from xy_sysid.stream import FloatArray
from xy_sysid.transfer_function import TransferFunction

AXIS_FORMAT = "xy_sysid axis model 1"
REWRITE = "Write the model again with xy-sysid refine --model."


@dataclass(frozen=True, slots=True)
class Saved:
    """One axis of a model file: ``axis`` for an axis model, else ``tf``; data: SHA-256 of what it was fitted to, or empty."""

    tf: TransferFunction
    axis: AxisModel | None
    hold: Hold
    data: str

    @property
    def doubt(self) -> str:
        """What speaks against judging the model by its free simulation; empty if nothing does."""
        effects = self.axis.effects if self.axis is not None else ()
        names = [name for name, _ in effects if self.axis is not None and not self.axis.library[name].simulable]
        if not names:
            return ""
        return f"no free simulation can follow {' and '.join(names)} (the contact is chaotic): the error says little about the model"

    def velocity(self, sampling_rate: float, voltage: FloatArray, position: FloatArray) -> FloatArray:
        """(n - 1,) simulated mean velocity of each sample, m/s, from rest."""
        if self.axis is not None:
            return simulate_axis(self.axis, sampling_rate, voltage, position)
        return np.asarray(np.diff(simulate(self.tf, sampling_rate, voltage)) * sampling_rate)


def axis_document(fits: Mapping[str, GreyboxFit], provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Axis models with intervals, errors and origin, in plain types."""
    return {"format": AXIS_FORMAT, "provenance": dict(provenance), "axes": {name: _axis(fit) for name, fit in fits.items()}}


def _axis(fit: GreyboxFit) -> dict[str, Any]:
    tf = linear_part(fit.model)
    return {
        "effects": [name for name, _ in fit.model.effects],
        "parameters": {
            item.name: {"value": float(item.value), "unit": item.unit, "ci95": [float(item.low), float(item.high)]} for item in fit.parameters
        },
        "held_out_error": float(fit.held_out_error),
        "noise_floor": float(fit.noise_floor),
        "linear_part": {
            "numerator": [float(value) for value in tf.numerator],
            "denominator": [float(value) for value in tf.denominator],
            "delay_s": float(tf.delay),
            "leaves_out": list(nonlinear(fit.model)),
        },
    }


def write_axis_models(path: Path, fits: Mapping[str, GreyboxFit], provenance: Mapping[str, Any]) -> None:
    """As YAML that ``read_models`` reads. Raises BadRecording if it cannot be written."""
    text = yaml.dump(axis_document(fits, provenance), Dumper=Quoting, sort_keys=False, width=120, allow_unicode=True)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as problem:
        raise BadRecording(path, f"cannot be written ({problem.strerror})", "Choose another place.") from None


def write_axis_mat(path: Path, fits: Mapping[str, GreyboxFit]) -> None:
    """For MATLAB: tf(x_num, x_den, 'InputDelay', x_delay) is the linear part, x_parameters a struct, x_effects the names."""
    from scipy.io import savemat

    content: dict[str, Any] = {}
    for axis, fit in fits.items():
        name = "".join(c if c.isalnum() else "_" for c in axis)
        name = name if name[:1].isalpha() else f"axis_{name}"
        tf = linear_part(fit.model)
        content |= {f"{name}_num": tf.numerator, f"{name}_den": tf.denominator, f"{name}_delay": tf.delay}
        content[f"{name}_effects"] = np.array([own for own, _ in fit.model.effects], dtype=object)
        content[f"{name}_parameters"] = {item.name.replace(".", "_"): item.value for item in fit.parameters}
    try:
        savemat(path, content, oned_as="row", long_field_names=True)
    except OSError as problem:
        raise BadRecording(path, f"cannot be written ({problem.strerror})", "Choose another place.") from None


def read_models(path: Path, library: Library) -> dict[str, Saved]:
    """The models of a file of either kind, by axis; raises BadRecording or BadInput in one line if it is none."""
    document = model_file(path, (FORMAT, AXIS_FORMAT))
    if document["format"] == FORMAT:
        return {axis: Saved(item.tf, None, item.hold, item.data) for axis, item in read_saved(path).items()}
    origin = document.get("provenance")
    digests = origin.get("data_sha256") if isinstance(origin, dict) else None
    found = {}
    for axis, part in document["axes"].items():
        model = _model(path, str(axis), part, library)
        digest = str(digests.get(axis, "")) if isinstance(digests, dict) else ""
        found[str(axis)] = Saved(linear_part(model), model, "zoh", digest)
    return found


def _model(path: Path, axis: str, part: Any, library: Library) -> AxisModel:
    try:
        values = {str(name): float(item["value"]) for name, item in part["parameters"].items()}
        names = [str(name) for name in part["effects"]]
        base = values["gain"], values["delay"], values["pole"]
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError):
        needed = "effects as a list and parameters gain, delay and pole, each with its value"
        raise BadRecording(path, f"axis {axis} has no {needed}", REWRITE) from None
    effects = []
    for name in names:
        missing = [key for key in library[name].names if f"{name}.{key}" not in values]
        if missing:
            raise BadRecording(path, f"axis {axis} has no value of {name}.{missing[0]}", REWRITE)
        effects.append((name, tuple(values[f"{name}.{key}"] for key in library[name].names)))
        for item, value in zip(library[name].parameters, effects[-1][1], strict=True):
            if not item.low <= value <= item.high:
                raise BadInput(f"{path}: axis {axis}: {name}.{item.name}", value, f"{item.low:g} to {item.high:g} {item.unit}", "Correct it.")
    return AxisModel(*base, tuple(effects), library)
