"""A fitted model for other tools: YAML that reloads, .mat for MATLAB's tf(), python-control objects."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import yaml

from xy_sysid.errors import BadInput, BadRecording, MissingExtra
from xy_sysid.fitting.result import Fit
from xy_sysid.transfer_function import TransferFunction

FORMAT = "xy_sysid model 1"
Hold = Literal["zoh", "none"]
LONGEST_DELAY = 1e3  # s; no axis answers later


def model_document(fits: dict[str, Fit], provenance: dict[str, Any]) -> dict[str, Any]:
    """Everything about the models that is worth keeping, in plain types."""
    return {"format": FORMAT, "provenance": provenance, "axes": {axis: _axis(fit) for axis, fit in fits.items()}}


def _axis(fit: Fit) -> dict[str, Any]:
    tf = fit.tf
    return {
        "transfer_function": {
            "variable": "s" if tf.sampling_time is None else "z",
            "numerator": [float(c) for c in tf.numerator],
            "denominator": [float(c) for c in tf.denominator],
            "delay_s": float(tf.delay),
            "sampling_time_s": tf.sampling_time,
            "input_unit": tf.input_unit,
            "output_unit": tf.output_unit,
        },
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
    text = yaml.dump(model_document(fits, provenance), Dumper=Quoting, sort_keys=False, width=120, allow_unicode=True)
    path.write_text(text, encoding="utf-8")


class Quoting(yaml.SafeDumper):
    """Writes the names x, y, ... with quotes."""


def _string(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    style = '"' if len(text) == 1 else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=style)


Quoting.add_representer(str, _string)


@dataclass(frozen=True, slots=True)
class SavedModel:
    """A model as a file keeps it; hold: how its input behaves between samples; data: SHA-256 of what it was fitted to, or empty."""

    tf: TransferFunction
    hold: Hold
    data: str


def read_model(path: Path) -> dict[str, TransferFunction]:
    """The transfer functions of a model file, by axis; raises BadRecording or BadInput in one line if it is not one."""
    return {axis: saved.tf for axis, saved in read_saved(path).items()}


def read_saved(path: Path) -> dict[str, SavedModel]:
    """The models of a file with what is known of them, by axis; raises BadRecording or BadInput in one line if it is not one."""
    document = model_file(path)
    origin = document.get("provenance")
    told = origin.get("data_sha256") if isinstance(origin, dict) else None
    digests = told if isinstance(told, dict) else {}
    found: dict[str, SavedModel] = {}
    for axis, part in document["axes"].items():
        tf = _transfer_function(path, str(axis), part)
        hold = part.get("hold", "zoh")
        if hold not in get_args(Hold):
            raise BadInput(f"{path}: axis {axis}: hold", repr(hold), ", ".join(get_args(Hold)), "Correct it.")
        found[str(axis)] = SavedModel(tf, hold, str(digests.get(axis, "")))
    return found


def model_file(path: Path, formats: tuple[str, ...] = (FORMAT,)) -> dict[str, Any]:
    """The document of a model file of one of these formats; raises BadRecording in one line if it is not one."""
    try:
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as problem:
        raise BadRecording(path, problem.strerror or "cannot be read", "Check the path.") from None
    except (yaml.YAMLError, ValueError):
        raise BadRecording(path, "is not a YAML file", "Give a model written by xy-sysid fit --model.") from None
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
    return TransferFunction(numerator / denominator[0], denominator / denominator[0], delay, step, *units)


def write_mat(path: Path, fits: dict[str, Fit]) -> None:
    """A MATLAB file: for each axis <axis>_num, <axis>_den, <axis>_delay, so that tf(x_num, x_den, 'InputDelay', x_delay) works."""
    from scipy.io import savemat

    content: dict[str, Any] = {}
    for axis, fit in fits.items():
        name = "".join(c if c.isalnum() else "_" for c in axis)
        name = name if name[:1].isalpha() else f"axis_{name}"
        content |= {f"{name}_num": fit.tf.numerator, f"{name}_den": fit.tf.denominator, f"{name}_delay": fit.tf.delay}
        content |= {f"{name}_Ts": fit.tf.sampling_time or 0.0, f"{name}_freq_hz": fit.frequency, f"{name}_frf": fit.measured}
        content[f"{name}_units"] = f"{fit.tf.output_unit}/{fit.tf.input_unit}"
    savemat(path, content, oned_as="row")


def to_control(tf: TransferFunction, pade_order: int = 4) -> Any:
    """A python-control TransferFunction; the delay of a continuous one becomes a Pade form, of a discrete one whole steps.

    Raises MissingExtra when python-control is not installed.
    """
    try:
        import control
    except ImportError:
        raise MissingExtra("python-control", "control") from None
    if tf.sampling_time is None:
        if tf.delay > 0:
            top, bottom = control.pade(tf.delay, pade_order)
            return control.TransferFunction(np.polymul(tf.numerator, top), np.polymul(tf.denominator, bottom))
        return control.TransferFunction(tf.numerator, tf.denominator)
    steps = round(tf.delay / tf.sampling_time)
    return control.TransferFunction(tf.numerator, np.concatenate((tf.denominator, np.zeros(steps))), tf.sampling_time)
