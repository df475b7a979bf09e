"""Reads and checks machine files (YAML)."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from xy_sim.couplings import Couplings
from xy_sim.drive import Drive
from xy_sim.parts import PARTS
from xy_sysid.bags.opening import yaml_of
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.settings import build, unknown_name

Parts = Mapping[str, Mapping[str, float]]
_TOP = ("description", "base", "rate", "inner_rate", "seed", "unit", "axes", "hidden", "coupling")
_HIDDEN = ("seed", "effects", "scale")
LONGEST = 1 << 17  # bytes of a machine file


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis: its drive, and its parts with every parameter (part -> parameter -> value, SI)."""

    name: str
    drive: Drive
    parts: Parts


@dataclass(frozen=True, slots=True)
class Spec:
    """The description of a machine.

    rate: samples per second, Hz; inner_rate: fewest inner steps per second, Hz; seed: of the encoder noise;
    unit: of positions, m or rad (masses are then inertias)
    hidden: the effects that ``xy_sim.drawing`` draws (keys seed, effects, scale), or None
    coupling: of its two axes
    """

    axes: tuple[Axis, ...]
    rate: float = 2000.0
    inner_rate: float = 40_000.0
    seed: int = 0
    description: str = ""
    hidden: Mapping[str, Any] | None = None
    unit: str = "m"
    coupling: Couplings = field(default_factory=Couplings)


def _folders() -> list[Path]:
    prefixes = [entry for entry in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if entry]
    shares = [Path(prefix) / "share" / "xy_sysid" / "config" / "machines" for prefix in (*prefixes, sys.prefix)]
    package = Path(__file__).resolve().parent
    return [package.parent / "config" / "machines", package / "machines", *shares]


def machine_path(name: str | Path) -> Path:
    """The file of a machine: a path, or a name (with or without .yaml) in config/machines of the source or the installation.

    Raises BadInput if there is none.
    """
    given = Path(name)
    if given.is_file():
        return given
    for folder in _folders():
        for candidate in (folder / given, folder / f"{given}.yaml"):
            if candidate.is_file():
                return candidate
    names = sorted({file.name for folder in _folders() for file in folder.glob("*.yaml")})
    raise BadInput("machine", repr(str(name)), "a file, or one of " + (", ".join(names) or "none installed"), "Give one of these or a path.")


def _mapping(value: object, where: str) -> dict[str, Any]:
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise BadInput(where, repr(value), "names with values (key: value)", "Indent the keys below it.")
    for key in value:
        if isinstance(key, bool):
            raise BadInput(
                f"{where}: name", str(key), 'text, such as "x" or "y"', 'YAML reads a bare y, yes or on as true: write the name in quotes, "y".'
            )
    return {str(key): item for key, item in value.items()}


def _number(value: object, where: str, low: float, high: float) -> float:
    try:
        number = float(str(value))
    except ValueError:
        number = float("nan")
    if isinstance(value, bool) or not low <= number <= high:
        raise BadInput(where, repr(value), f"{low:g} to {high:g}", "Change it and try again.")
    return number


def parts_from(given: object, where: str) -> dict[str, dict[str, float]]:
    """Parts with all parameters, from part -> size, or part -> parameter -> value, or part -> nothing; raises BadInput for wrong ones."""
    table = _mapping(given, f"{where}: parts")
    for name in table:
        if name not in PARTS:
            raise unknown_name(name, list(PARTS), f"{where}: part")
    return {name: PARTS[name].values(value, where) for name, value in table.items()}


def fitting(axis: Axis) -> Axis:
    """The same axis; raises BadInput if it has base_loosening without base_resonance."""
    if "base_loosening" in axis.parts and "base_resonance" not in axis.parts:
        raise BadInput(f"axis {axis.name}: part", "base_loosening", "only on a base that can swing", "Add base_resonance.")
    return axis


def _numeric(values: dict[str, Any]) -> dict[str, Any]:
    """Numbers such as 1e-6, which YAML 1.1 reads as text."""

    def number(value: Any) -> Any:
        try:
            return float(value) if isinstance(value, str) else value
        except ValueError:
            return value

    return {name: number(value) for name, value in values.items()}


def _axis(name: str, given: object, where: str) -> Axis:
    values = _mapping(given, f"{where}: axis {name}")
    parts = parts_from({part: value for part, value in values.pop("parts").items() if value is not False}, f"{where}: axis {name}")
    known = [*Drive.model_fields, "parts"]
    for key in values:
        if key not in known:
            raise unknown_name(key, known, f"{where}: axis {name}")
    return fitting(Axis(name, build(Drive, _numeric(values), f"{where}: axis {name}"), parts))


def _table(name: str | Path, beside: Path | None = None, depth: int = 0) -> tuple[str, dict[str, Any]]:
    """File name and top-level keys; missing ones come from ``base``, and axes and parts are merged by name."""
    near = None if beside is None else beside / str(name)
    path = near if near is not None and near.is_file() else machine_path(name)
    if depth > 8:
        raise BadInput(f"{path.name}: base", repr(str(name)), "a chain of at most 8 files", "A file must not be its own base.")
    try:
        own = _mapping(yaml_of(path, "a machine file", LONGEST), path.name)
    except BadRecording as problem:
        raise BadInput("machine file", f"{path}: {problem.problem}", "YAML text", problem.act) from None
    for key in own:
        if key not in _TOP:
            raise unknown_name(key, list(_TOP), path.name)
    axes = {axis: _mapping(values, f"{path.name}: axis {axis}") for axis, values in _mapping(own.get("axes"), f"{path.name}: axes").items()}
    for axis, values in axes.items():
        values["parts"] = _mapping(values.get("parts"), f"{path.name}: axis {axis}: parts")
    if "base" not in own:
        return path.name, {**own, "axes": axes}
    _, below = _table(own.pop("base"), path.parent, depth + 1)
    merged = dict(below["axes"])
    for axis, values in axes.items():
        under = merged.get(axis, {"parts": {}})
        merged[axis] = {**under, **values, "parts": {**under["parts"], **values["parts"]}}
    return path.name, {**below, **own, "axes": merged}


def read(name: str | Path) -> Spec:
    """The machine of a file; raises BadInput, which names the wrong value and either the allowed values or the nearest spelling."""
    file, table = _table(name)
    hidden = _mapping(table["hidden"], f"{file}: hidden") if "hidden" in table else None
    for key in hidden or {}:
        if key not in _HIDDEN:
            raise unknown_name(key, list(_HIDDEN), f"{file}: hidden")
    if not table["axes"]:
        raise BadInput(f"{file}: axes", "empty", "one group per axis", 'Add axes: {"x": {}}.')
    axes = tuple(_axis(axis, values, file) for axis, values in table["axes"].items())
    default = Spec(axes)
    rate = _number(table.get("rate", default.rate), f"{file}: rate", 10.0, 1e5)
    inner = _number(table.get("inner_rate", max(default.inner_rate, rate)), f"{file}: inner_rate", rate, 1e7)
    seed = int(_number(table.get("seed", default.seed), f"{file}: seed", 0, 2**31 - 1))
    unit = str(table.get("unit", default.unit))
    if unit not in ("m", "rad"):
        raise BadInput(f"{file}: unit", repr(unit), "m, rad", "Choose one of these.")
    coupling = build(Couplings, _numeric(_mapping(table.get("coupling"), f"{file}: coupling")), f"{file}: coupling")
    if coupling.any and len(axes) != 2:
        raise BadInput(f"{file}: coupling", f"of {len(axes)} axes", "two axes", "Leave it out, or add an axis.")
    return Spec(
        axes=axes,
        rate=rate,
        inner_rate=inner,
        seed=seed,
        description=str(table.get("description", "")),
        hidden=hidden,
        unit=unit,
        coupling=coupling,
    )
