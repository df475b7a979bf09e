"""A fitted model for other programs: YAML that can be loaded again, .mat for MATLAB's tf()."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import yaml

from xy_sysid.bags.atomic import whole, write_text
from xy_sysid.bags.opening import text_of, too_much
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.files.seal import sealed, unsealed
from xy_sysid.fitting.of_run import LinearModel
from xy_sysid.fitting.result import Fit
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.units import over

FORMAT = "xy_sysid model 1"
Hold = Literal["zoh", "none"]
LONGEST_DELAY = 1e3  # s; no axis has a longer delay
MOST_COEFFICIENTS = 64  # of a polynomial; with more, rounding makes the roots meaningless


def model_document(fits: dict[str, Fit], provenance: dict[str, Any]) -> dict[str, Any]:
    """The document of the models, in plain types."""
    return {"format": FORMAT, "provenance": provenance, "axes": {axis: _axis(fit) for axis, fit in fits.items()}}


def linear_axis(model: LinearModel) -> dict[str, Any]:
    """One axis of the document, with or without a fit."""
    return _axis(model.fit) if model.fit is not None else {"transfer_function": _coefficients(model.tf), "hold": model.hold}


def _coefficients(tf: TransferFunction) -> dict[str, Any]:
    return {
        "variable": "s" if tf.sampling_time is None else "z",
        "numerator": [float(c) for c in tf.numerator],
        "denominator": [float(c) for c in tf.denominator],
        "delay_s": float(tf.delay),
        "sampling_time_s": tf.sampling_time,
        "input_unit": tf.input_unit,
        "output_unit": tf.output_unit,
    }


def _axis(fit: Fit) -> dict[str, Any]:
    return {
        "transfer_function": _coefficients(fit.tf),
        "hold": fit.structure.hold,
        "method": fit.method,
        "relative_error": float(fit.relative_error),
        "band_hz": [float(fit.frequency[0]), float(fit.frequency[-1])],
        "estimates": {
            item.name: {"value": float(item.value), "ci95": [float(item.low), float(item.high)], "unit": item.unit} for item in fit.intervals
        },
    }


def write_model(path: Path, fits: dict[str, Fit], provenance: dict[str, Any]) -> None:
    """Write the models as YAML; axis names are quoted, as a bare y would mean true."""
    write_text(path, sealed_yaml(model_document(fits, provenance)))


class Quoting(yaml.SafeDumper):
    """Writes the names x, y, ... with quotes."""


def _string(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    style = '"' if len(text) == 1 else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


Quoting.add_representer(str, _string)


def sealed_yaml(document: Mapping[str, Any]) -> str:
    """The text of a model file."""
    return sealed(str(yaml.dump(document, Dumper=Quoting, sort_keys=False, width=120, allow_unicode=True)))


@dataclass(frozen=True, slots=True)
class SavedModel:
    """A model from a file; hold: behaviour of the input between samples; data: SHA-256 of the data in its fit, if known."""

    tf: TransferFunction
    hold: Hold
    data: tuple[str, ...]


def read_saved(path: Path) -> dict[str, SavedModel]:
    """The models of a file by axis; raises BadRecording or BadInput in one line for another file."""
    document = model_file(path)
    origin = document.get("provenance")
    found: dict[str, SavedModel] = {}
    for axis, part in document["axes"].items():
        tf = _transfer_function(path, str(axis), part)
        hold = part.get("hold", "zoh")
        if hold not in get_args(Hold):
            raise BadInput(f"{path}: axis {axis}: hold", repr(hold), ", ".join(get_args(Hold)), "Correct it.")
        found[str(axis)] = SavedModel(tf, hold, fitted_to(origin, str(axis)))
    return found


def fitted_to(origin: Any, axis: str) -> tuple[str, ...]:
    """SHA-256 of each recording in the fit of an axis's model, from the provenance of its file; empty if unknown."""
    digests = origin.get("data_sha256") if isinstance(origin, dict) else None
    told = digests.get(axis) if isinstance(digests, dict) else None
    return tuple(str(item) for item in told) if isinstance(told, list) else (str(told),) if told else ()


def model_file(path: Path, formats: tuple[str, ...] = (FORMAT,)) -> dict[str, Any]:
    """The document of a model file of one of these formats; raises BadRecording in one line for another file."""
    text = unsealed(path, text_of(path, "a model"))
    try:
        problem = too_much(text)
        document = None if problem else yaml.safe_load(text)
    except (yaml.YAMLError, ValueError):
        raise BadRecording(path, "is not a YAML file", "Give a model written by xy-sysid fit --model.") from None
    if problem:
        raise BadRecording(path, f"holds {problem}, and no model does", "Give a model written by xy-sysid fit --model.")
    if not isinstance(document, dict) or document.get("format") not in formats or not isinstance(document.get("axes"), dict) or not document["axes"]:
        known = " or ".join(f"'{name}'" for name in formats)
        raise BadRecording(path, f"is not a model file ({known})", "Give a model written by xy-sysid fit --model.")
    return document


def _transfer_function(path: Path, axis: str, part: Any) -> TransferFunction:
    try:
        told = part["transfer_function"]
        numerator, denominator = np.array(told["numerator"], dtype=float), np.array(told["denominator"], dtype=float)
        given = told.get("sampling_time_s")
        step = None if given is None else float(given)
        delay = float(told["delay_s"])
        units = str(told["input_unit"]), str(told["output_unit"])
        variable = str(told.get("variable", "s" if step is None else "z"))
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError):
        needed = "numerator and denominator as lists of numbers, delay_s, input_unit and output_unit"
        raise BadRecording(path, f"axis {axis} has no transfer_function with {needed}", "Write the model again with xy-sysid fit --model.") from None
    for problem, allowed in (
        (numerator.ndim != 1 or denominator.ndim != 1, "numerator and denominator as plain lists of coefficients"),
        (max(numerator.size, denominator.size) > MOST_COEFFICIENTS, f"at most {MOST_COEFFICIENTS} coefficients each"),
        (not (np.isfinite(numerator).all() and np.isfinite(denominator).all()), "finite coefficients"),
        (not numerator.any(), "a numerator that is not 0"),
        (not denominator.size or denominator.flat[0] == 0, "a denominator that does not begin with 0"),
        (numerator.size > denominator.size, "at most as many numerator coefficients as denominator coefficients"),
        (not 0 <= delay <= LONGEST_DELAY, f"a delay from 0 to {LONGEST_DELAY:g} s"),
        (variable != ("s" if step is None else "z"), "variable s without a sampling time, or z with one"),
        (step is not None and not 0 < step < np.inf, "a sampling time above 0 s"),
    ):
        if problem:
            raise BadInput(f"{path}: axis {axis}", "a transfer function with bad numbers", allowed, "Correct it.")
    return TransferFunction(numerator / denominator[0], denominator / denominator[0], delay, step, input_unit=units[0], output_unit=units[1])


def mat_name(axis: str) -> str:
    """The name of an axis as a name in MATLAB."""
    name = "".join(c if c.isalnum() else "_" for c in axis)
    return name if name[:1].isalpha() else f"axis_{name}"


def write_mat(path: Path, fits: dict[str, Fit]) -> None:
    """A MATLAB file: for each axis <axis>_num, <axis>_den, <axis>_delay, so that tf(x_num, x_den, 'InputDelay', x_delay) works."""
    from scipy.io import savemat

    content: dict[str, Any] = {}
    for axis, fit in fits.items():
        name = mat_name(axis)
        content |= {f"{name}_num": fit.tf.numerator, f"{name}_den": fit.tf.denominator, f"{name}_delay": fit.tf.delay}
        content |= {f"{name}_Ts": fit.tf.sampling_time or 0.0, f"{name}_freq_hz": fit.frequency, f"{name}_frf": fit.measured}
        content[f"{name}_units"] = over(fit.tf.output_unit, fit.tf.input_unit)
    with whole(path) as part:
        savemat(part, content, oned_as="row")
