"""The models of stories in the format of ``xy-sysid refine --model``, and back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.errors import BadInput
from xy_sysid.files.linear_models import sealed_yaml
from xy_sysid.files.models import AXIS_FORMAT, axis_models


def model_text(source: str, documents: Mapping[str, Mapping[str, Any]]) -> str:
    """The newest models of all axes; source: where the stories come from; documents: axis -> story."""
    return sealed_yaml(_document(source, documents))


def _document(source: str, documents: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    axes = {
        axis: {
            "effects": list(model["effects"]),
            "parameters": {name: dict(item) for name, item in model["parameters"].items()},
            "held_out_error": model["held_out_error"],
            "noise_floor": model["noise_floor"],
            **_units(document),
        }
        for axis, document in documents.items()
        if (model := document.get("model"))
    }
    rates = {axis: document["sampling_rate"] for axis, document in documents.items() if axis in axes and document.get("sampling_rate")}
    return {"format": AXIS_FORMAT, "provenance": {"source": source, "sampling_rate_hz": rates}, "axes": axes}


def _units(document: Mapping[str, Any]) -> dict[str, str]:
    """Units of input and output, where the story names them."""
    named = document.get("units") or {}
    return {key: str(named[name]) for name, key in (("input", "input_unit"), ("output", "output_unit"), ("measured", "measured")) if name in named}


def model_of(document: Mapping[str, Any], axis: str, library: Library = STANDARD) -> PhysicalModel:
    """The newest model of a story. Raises BadInput for a story without one."""
    if not document.get("model"):
        raise BadInput(f"story of axis {axis}", "without a model", "a model with physical effects", "Diagnose the axis first.")
    return axis_models(Path("story"), _document("story", {axis: document}), library)[axis]
