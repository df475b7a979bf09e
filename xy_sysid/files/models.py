"""Models in files, of either kind: a transfer function (``fit --model``) or an axis with physical effects (``refine --model``)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from xy_sysid.axis.linear_part import linear_part, nonlinear
from xy_sysid.axis.model import STANDARD, AxisModel, Library
from xy_sysid.bags.atomic import whole, write_text
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.diagnosis.as_json import parameters
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.files.linear_models import FORMAT, fitted_to, linear_axis, mat_name, model_file, read_saved, sealed_yaml
from xy_sysid.files.unasked import free
from xy_sysid.fitting.of_run import LinearModel
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.response.estimate import Estimate
from xy_sysid.units import OF, USUAL, Units

AXIS_FORMAT = "xy_sysid axis model 1"
REWRITE = "Write the model again with xy-sysid refine --model."
Model = LinearModel | PhysicalModel


def save(model: Model | Mapping[str, Model], path: Path | str, axis: str = "", *, force: bool = False) -> None:
    """Write a model as YAML that ``load_model`` and the commands read; the file is written completely or not at all.

    model: of one axis, or {axis: model}, all of the same kind; axis: its name, if the model does not contain it
    Raises BadInput if the file exists and ``force`` is False, BadRecording if it cannot be written.
    """
    path = Path(path)
    free("file", path, force, "say force=True")
    models = dict(model) if isinstance(model, Mapping) else {axis or model.axis or "x": model}
    if not models:
        raise BadInput("model", "none", "one or more", "Give a model.")
    kinds = {type(item) for item in models.values()}
    if len(kinds) > 1 or not kinds <= {LinearModel, PhysicalModel}:
        names = ", ".join(sorted(kind.__name__ for kind in kinds))
        raise BadInput(
            "model", names, "transfer functions only, or axis models only", "Give step.model or what fit gives; a file of its own for each kind."
        )
    digests = {name: item.data[0] if len(item.data) == 1 else list(item.data) for name, item in models.items() if item.data}
    rates = {name: item.sampling_rate for name, item in models.items() if isinstance(item, PhysicalModel) and item.sampling_rate}
    origin = {"data_sha256": digests, **({"sampling_rate_hz": rates} if rates else {})}
    document: dict[str, Any] = {"format": FORMAT, "provenance": origin, "axes": {}}
    for name, item in models.items():
        if isinstance(item, LinearModel):
            document["axes"][name] = linear_axis(item)
        else:
            document["format"] = AXIS_FORMAT
            document["axes"][name] = _physical(item)
    write_text(path, sealed_yaml(document))


def load_model(path: Path | str, axis: str = "", library: Library = STANDARD) -> Model:
    """A model that ``save``, ``fit --model`` or ``refine --model`` wrote: a transfer function, or an axis with physical effects.

    axis: which one, of a file with several; library: with effects of your own, if the model has any
    Raises BadRecording or BadInput in one line.
    """
    models = read_models(Path(path), library)
    if not axis and len(models) > 1:
        raise BadInput("axis", "not given", ", ".join(models), f"{path} holds several: choose one with axis=.")
    if axis and axis not in models:
        raise BadInput("axis", repr(axis), ", ".join(models), "Choose one of these.")
    return models[axis or next(iter(models))]


def axis_document(fits: Mapping[str, GreyboxFit], provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Axis models with intervals, errors and origin, in plain types."""
    return {"format": AXIS_FORMAT, "provenance": dict(provenance), "axes": {name: _axis(fit) for name, fit in fits.items()}}


def _axis(fit: GreyboxFit) -> dict[str, Any]:
    errors = {"held_out_error": float(fit.held_out_error), "noise_floor": float(fit.noise_floor)}
    return _written(fit.model, fit.units, dict(parameters(fit.parameters)), errors)


def _physical(item: PhysicalModel) -> dict[str, Any]:
    if item.fit is not None:
        return _axis(item.fit)
    if item.known:
        return _written(item.model, item.units, dict(parameters(item.known)), {})
    return _written(item.model, item.units, {name: {"value": float(value)} for name, value in item.model.values().items()}, {})


def _written(model: AxisModel, units: Units, parameters: dict[str, Any], errors: dict[str, float]) -> dict[str, Any]:
    tf = linear_part(model)
    return {
        "input_unit": units.input,
        "output_unit": units.output,
        **({"measured": units.sensed} if units.sensed != "position" else {}),
        "effects": [name for name, _ in model.effects],
        "parameters": parameters,
        **errors,
        "linear_part": {
            "numerator": [float(value) for value in tf.numerator],
            "denominator": [float(value) for value in tf.denominator],
            "delay_s": float(tf.delay),
            "leaves_out": list(nonlinear(model)),
        },
    }


def write_axis_models(path: Path, fits: Mapping[str, GreyboxFit], provenance: Mapping[str, Any]) -> None:
    """Write YAML that ``read_models`` reads. Raises BadRecording if it cannot be written."""
    write_text(path, sealed_yaml(axis_document(fits, provenance)))


def write_axis_mat(path: Path, fits: Mapping[str, GreyboxFit]) -> None:
    """For MATLAB: tf(x_num, x_den, 'InputDelay', x_delay) is the linear part, x_parameters a struct, x_effects the names."""
    from scipy.io import savemat

    content: dict[str, Any] = {}
    for axis, fit in fits.items():
        name = mat_name(axis)
        tf = linear_part(fit.model)
        content |= {f"{name}_num": tf.numerator, f"{name}_den": tf.denominator, f"{name}_delay": tf.delay}
        content[f"{name}_effects"] = np.array([own for own, _ in fit.model.effects], dtype=object)
        content[f"{name}_parameters"] = {item.name.replace(".", "_"): item.value for item in fit.parameters}
    with whole(path) as part:
        savemat(part, content, oned_as="row", long_field_names=True)


def read_models(path: Path, library: Library) -> Mapping[str, Model]:
    """The models of a file of either kind, by axis; raises BadRecording or BadInput in one line for another file."""
    document = model_file(path, (FORMAT, AXIS_FORMAT))
    if document["format"] == FORMAT:
        return {axis: LinearModel(item.tf, item.hold, axis, item.data) for axis, item in read_saved(path).items()}
    return axis_models(path, document, library)


def axis_models(path: Path, document: Mapping[str, Any], library: Library) -> dict[str, PhysicalModel]:
    """The models of a document of axis models; path: of its file, for errors. Raises BadRecording or BadInput in one line."""
    origin = document.get("provenance")
    found = {}
    for axis, part in document["axes"].items():
        model = _model(path, str(axis), part, library)
        measured = str(part.get("measured") or (origin.get("measured") if isinstance(origin, dict) else None))
        named = str(part.get("input_unit", USUAL.input)), str(part.get("output_unit", USUAL.output))
        units = next((kind(*named) for sensed, kind in OF.items() if sensed == measured), Units(*named))
        known, rate = _known(part["parameters"], model), _rate(origin, str(axis))
        found[str(axis)] = PhysicalModel(model, str(axis), fitted_to(origin, str(axis)), units, known=known, sampling_rate=rate)
    return found


def _rate(origin: Any, axis: str) -> float | None:
    """Hz of the recording in the fit of an axis, from the provenance of its file; None if unknown."""
    told = origin.get("sampling_rate_hz") if isinstance(origin, dict) else None
    told = told.get(axis) if isinstance(told, dict) else told
    return float(told) if isinstance(told, int | float) and 0.0 < told < math.inf else None


def _known(written: Mapping[str, Any], model: AxisModel) -> tuple[Estimate, ...]:
    """The parameters with the file's intervals; empty if one of them has none."""
    found = []
    for name, value in model.values().items():
        item = written.get(name, {})
        ends = item.get("ci95")
        if not (isinstance(ends, list) and len(ends) == 2 and all(isinstance(end, int | float) for end in ends)):
            return ()
        found.append(Estimate(name=name, value=value, unit=str(item.get("unit", "")), low=float(ends[0]), high=float(ends[1])))
    return tuple(found)


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
            if not item.allows(value):
                raise BadInput(f"{path}: axis {axis}: {name}.{item.name}", value, item.allowed, "Correct it.")
    return AxisModel(*base, tuple(effects), library)
