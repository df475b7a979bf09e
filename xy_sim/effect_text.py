"""Effects in a command line: ``[axis:]name[=size][,parameter=value]...``."""

from __future__ import annotations

from collections.abc import Sequence

from xy_sim.machine import Machine
from xy_sim.parts import PARTS
from xy_sysid.errors import BadInput
from xy_sysid.settings import unknown_name


def parse(text: str) -> tuple[str | None, str, dict[str, str]]:
    """Axis (None is every axis), name of the part and the given parameters; raises BadInput with the nearest spelling.

    >>> parse("x:stribeck_friction=0.3,velocity=0.02")
    ('x', 'stribeck_friction', {'excess': '0.3', 'velocity': '0.02'})
    """
    axis, _, rest = text.rpartition(":")
    first, *others = (item.strip() for item in rest.split(","))
    name, _, size = (item.strip() for item in first.partition("="))
    if name not in PARTS:
        raise unknown_name(name, list(PARTS), "effect")
    values = {PARTS[name].parameters[0].name: size} if size else {}
    for other in others:
        key, given, value = (item.strip() for item in other.partition("="))
        if not given:
            raise BadInput(f"effect {name}", repr(other), "parameter=value", "Write NAME[=SIZE][,PARAMETER=VALUE].")
        values[key] = value
    return axis.strip() or None, name, values


def with_effects(machine: Machine, texts: Sequence[str]) -> Machine:
    """A new machine at rest with these effects, later ones replacing earlier ones of the same name; raises BadInput."""
    for text in texts:
        axis, name, values = parse(text)
        machine = machine.with_parts({name: values}, None if axis is None else (axis,))
    return machine
