"""ROS parameter files: checked against the settings before a node reads them.

Text in, values out; the caller reads the file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import yaml

from xy_sysid.bags.opening import too_much
from xy_sysid.errors import BadInput
from xy_sysid.settings import (
    AXES,
    BallscrewSettings,
    DiagnoserSettings,
    ExcitationSettings,
    IdentifierSettings,
    RecorderSettings,
    Settings,
    build,
    for_axes,
    knobs,
    of_other_axes,
    unknown_name,
)

NODES: dict[str, type[Settings]] = {
    "excitation": ExcitationSettings,
    "ballscrew": BallscrewSettings,
    "identifier": IdentifierSettings,
    "diagnoser": DiagnoserSettings,
    "recorder": RecorderSettings,
}
BARE_BOOLEANS = re.compile(r"y|n|yes|no|on|off|true|false", re.IGNORECASE)


def load(text: str, where: str) -> Any:
    """The YAML document; raises BadInput for invalid YAML, and for a bare ``y`` as a name, which ROS reads as true."""
    try:
        problem = too_much(text)
        if problem:
            raise BadInput(where, problem, "at most a few hundred values in a few levels", "Start from config/default.yaml.")
        root = yaml.compose(text, Loader=yaml.SafeLoader)
        document = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise BadInput(where, "not YAML", "a YAML document", " ".join(str(error).split())) from None
    for key in _keys(root):
        if key.style is None and BARE_BOOLEANS.fullmatch(key.value):
            line = key.start_mark.line + 1
            raise BadInput(f"{where}: name in line {line}", key.value, "a quoted one", f'Write "{key.value}": a bare one means true or false.')
    return document


def _keys(node: yaml.Node | None) -> Iterator[yaml.ScalarNode]:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if isinstance(key, yaml.ScalarNode):
                yield key
            yield from _keys(value)
    elif isinstance(node, yaml.SequenceNode):
        for value in node.value:
            yield from _keys(value)


def flat(values: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested parameters with dotted names: {"x": {"rms": 1}} becomes {"x.rms": 1}."""
    found: dict[str, Any] = {}
    for key, value in values.items():
        if isinstance(value, Mapping):
            found |= flat(value, f"{prefix}{key}.")
        else:
            found[f"{prefix}{key}"] = value
    return found


WITH_AXES = ("excitation", "identifier", "diagnoser")  # nodes with the parameter ``axes``


def _axes(node: str, values: Mapping[str, Any], where: str) -> list[str]:
    """The names in ``axes``; raises BadInput if it is not a list of names."""
    axes = values.get("axes", list(AXES))
    if node not in WITH_AXES or not isinstance(axes, list) or not axes or not all(isinstance(axis, str) and axis for axis in axes):
        raise BadInput(f"{where}: axes", repr(axes), 'a list of names like ["x", "y"]', "Change it and try again.")
    return axes


def checked(node: str, values: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Parameters of one kind of node, by dotted name, each in the type that the node declares (2 becomes 2.0 for a float).

    Raises BadInput for an unknown name (with the nearest spelling) and for a value outside its limits.
    """
    cls, given = NODES[node], flat(values)
    named = {"axes": _axes(node, given, where)} if "axes" in given else {}
    axes = given.pop("axes", list(AXES))
    defaults = {knob.name: knob.value for knob in knobs(for_axes(cls, axes))}
    others = of_other_axes(cls, given, axes)
    for name in given:
        if name not in defaults and name not in others:
            raise unknown_name(name, [*defaults, "axes"], where)
    settings = build(cls, {**defaults, **{name: value for name, value in given.items() if name not in others}}, where)
    return named | {knob.name: knob.value for knob in knobs(settings) if knob.name in given}


def parameters(text: str, where: str, nodes: Mapping[str, str] | None = None) -> dict[str, dict[str, Any]]:
    """Parameters of every node in a ROS parameter file, by node name.

    ``nodes`` maps node names to kinds, for nodes with names of their own. A section ``/**`` is for
    every node, and each of its names must be known to at least one. Raises BadInput.
    """
    kinds = dict(nodes or {name: name for name in NODES})
    document = load(text, where)
    if not isinstance(document, dict) or not document:
        raise BadInput(where, "no parameter file", "sections like /**/excitation: with ros__parameters: in them", "Start from config/default.yaml.")
    found: dict[str, dict[str, Any]] = {name: {} for name in kinds}
    for section, content in document.items():
        if not isinstance(content, dict) or set(content) != {"ros__parameters"} or not isinstance(content["ros__parameters"], dict):
            raise BadInput(f"{where}: section", repr(section), "one that holds ros__parameters: and nothing else", "Indent the parameters under it.")
        name, values = str(section).rpartition("/")[2], flat(content["ros__parameters"])
        if name == "**":
            for key, kind in kinds.items():
                known = {knob.name for knob in knobs(for_axes(NODES[kind], values.get("axes", AXES)))} | ({"axes"} if kind in WITH_AXES else set())
                found[key] |= checked(kind, {k: v for k, v in values.items() if k in known}, where)
            everything = {knob.name: None for kind in kinds.values() for knob in knobs(for_axes(NODES[kind], values.get("axes", AXES)))} | {
                "axes": None
            }
            for key in values:
                if key not in everything:
                    raise unknown_name(key, everything, where)
        elif name in kinds:
            found[name] |= checked(kinds[name], values, f"{where}: {name}")
        else:
            raise unknown_name(name, kinds, f"{where}: node")
    return {name: values for name, values in found.items() if values}
