"""Targets to which a used model can be written: name -> files by name. Each target says what it cannot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from xy_sysid.control_design import snippets
from xy_sysid.control_design.use import Used
from xy_sysid.errors import BadInput
from xy_sysid.settings import unknown_name


@dataclass(frozen=True, slots=True)
class Exported:
    """files: text by name; note: what the target cannot say, or how the text is used."""

    files: Mapping[str, str]
    note: str = ""


def tables(used: Used) -> Exported:
    """The correction tables as CSV."""
    every = [*used.tables, *([used.friction] if used.friction is not None else [])]
    if not every:
        raise BadInput(
            "tables", f"axis {used.axis}, which has nothing by place and no dry friction", "a model with some", "There is nothing to correct."
        )
    return Exported({f"{used.axis}_{item.name}.csv": item.csv() for item in every}, "; ".join(f"{item.name}: {item.meaning}" for item in every))


def _snippet(write: Callable[[snippets.Designed], snippets.Snippet]) -> Callable[[Used], Exported]:
    def made(used: Used) -> Exported:
        item = write(snippets.Designed(axis=used.axis, units=used.model.units, gains=used.gains, feedback=used.feedback, shaper=used.shaper))
        return Exported({f"{used.axis}_{item.target}_{item.file}": item.text}, item.note)

    return made


TARGETS: dict[str, Callable[[Used], Exported]] = {
    "tables": tables,
    **{name: _snippet(write) for name, write in snippets.TARGETS.items()},
}


def export(used: Used, target: str) -> Exported:
    """The files of a target. Raises BadInput for an unknown target, or an axis for which it has nothing."""
    if target not in TARGETS:
        raise unknown_name(target, list(TARGETS), "target")
    return TARGETS[target](used)
