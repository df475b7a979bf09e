"""From a run file to the list of processes, or to the settings of one node; it starts nothing and reads no file."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from xy_sysid.errors import BadInput
from xy_sysid.files.ros_parameters import NODES, checked, load, parameters
from xy_sysid.settings import NAMESPACE, unknown_name

MODULES = {
    "excitation": "xy_sysid.nodes.excitation",
    "identifier": "xy_sysid.nodes.identifier",
    "diagnoser": "xy_sysid.nodes.diagnoser",
    "recorder": "xy_sysid.nodes.recorder",
    "ballscrew": "xy_sim.node",
}
STOP_ORDER = tuple(MODULES)
"""First stopped first: the voltage goes to zero while everybody still listens, and the machine is the last to go."""

NODE_KEYS = {
    "executable": (str, "one of " + ", ".join(MODULES)),
    "name": (str, "a node name"),
    "namespace": (str, "a ROS namespace like /xy"),
    "params_file": (str, "a ROS parameter file, relative to the run file"),
    "parameters": (dict, "names and values"),
    "remap": (dict, "from: to"),
    "env": (dict, "names and values"),
    "restart": (bool, "true or false"),
    "optional": (bool, "true or false"),
}
FILE_KEYS = {"namespace": NODE_KEYS["namespace"], "env": NODE_KEYS["env"], "nodes": (list, "a list of nodes")}


@dataclass(frozen=True, slots=True)
class ProcessSpec:
    """One process to start and monitor.

    ``env`` is added to the environment. ``stop_rank``: the lowest is stopped first. ``restart``: start it again when it
    dies with an error. ``optional``: the others continue without it; otherwise its end stops all.
    """

    name: str
    command: tuple[str, ...]
    env: tuple[tuple[str, str], ...] = ()
    stop_rank: int = 0
    restart: bool = False
    optional: bool = False


def plan(text: str, where: str, folder: Path) -> list[ProcessSpec]:
    """The processes of a run file in start order: receivers first, the drive last.

    ``text`` is the file's content, ``where`` its name for messages, ``folder`` the base of its relative paths.
    Raises BadInput that names the value, the allowed ones and, for an unknown name, the nearest spelling.
    """
    document = load(text, where)
    if not isinstance(document, dict) or not document.get("nodes"):
        raise BadInput(where, "no run file", "a list nodes:, each with executable:", "Start from config/demo.yaml.")
    _check(document, FILE_KEYS, where)
    specs = [_process(entry, document, f"{where}: node {number}", folder) for number, entry in enumerate(document["nodes"], start=1)]
    names = [spec.name for spec in specs]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(f"{where}: name", f"{name} (twice)", "a name of its own for every node", "Add name: to one of them.")
    return sorted(specs, key=lambda spec: -spec.stop_rank)


def _process(entry: object, document: Mapping[str, Any], where: str, folder: Path) -> ProcessSpec:
    if not isinstance(entry, dict):
        raise BadInput(where, repr(entry), "names and values like executable: excitation", "Write it so.")
    _check(entry, NODE_KEYS, where)
    kind: str = entry.get("executable", "")
    if not kind:
        raise BadInput(where, "without executable:", ", ".join(MODULES), "Add it.")
    if kind not in MODULES:
        raise unknown_name(kind, list(MODULES), f"{where}: executable")
    name: str = entry.get("name", kind)
    namespace = entry.get("namespace", document.get("namespace", NAMESPACE))
    arguments = ["-r", f"__node:={name}", "-r", f"__ns:={namespace}"]
    for source, target in entry.get("remap", {}).items():
        arguments += ["-r", f"{source}:={target}"]
    if "params_file" in entry:
        arguments += ["--params-file", str(folder / entry["params_file"])]
    for parameter, value in checked(kind, entry.get("parameters", {}), f"{where}: {kind}").items():
        arguments += ["-p", f"{parameter}:={json.dumps(value)}"]
    return ProcessSpec(
        name=name,
        command=(sys.executable, "-m", MODULES[kind], "--ros-args", *arguments),
        env=tuple((key, str(value)) for key, value in {**document.get("env", {}), **entry.get("env", {})}.items()),
        stop_rank=STOP_ORDER.index(kind),
        restart=entry.get("restart", False),
        optional=entry.get("optional", False),
    )


def _check(given: Mapping[str, Any], known: Mapping[str, tuple[type, str]], where: str) -> None:
    for key, value in given.items():
        if key not in known:
            raise unknown_name(str(key), list(known), where)
        expected, meaning = known[key]
        if not isinstance(value, expected):
            raise BadInput(f"{where}: {key}", repr(value), meaning, "Change it and try again.")


def parameter_files(text: str, where: str) -> list[tuple[str, dict[str, str]]]:
    """Each parameter file in a run file, with the kinds of the nodes that read it, so that it can be checked first."""
    found: dict[str, dict[str, str]] = {}
    for entry in load(text, where)["nodes"]:
        if "params_file" in entry:
            found.setdefault(entry["params_file"], {name: name for name in NODES})[entry.get("name", entry["executable"])] = entry["executable"]
    return list(found.items())


def is_run_file(text: str, where: str) -> bool:
    """True if the text lists nodes, and is not a ROS parameter file. Raises BadInput for invalid YAML."""
    document = load(text, where)
    return isinstance(document, dict) and "nodes" in document


@dataclass(frozen=True, slots=True)
class Told:
    """The settings of one node in a run file: its parameters by dotted name, its namespace and its remappings."""

    parameters: Mapping[str, Any]
    namespace: str = NAMESPACE
    remap: Mapping[str, str] = field(default_factory=dict)

    def topic(self, name: str) -> str:
        """The full name of a topic from the node's own name for it."""
        name = self.remap.get(name, name)
        return name if name.startswith("/") else f"{self.namespace.rstrip('/')}/{name}"


def told(kind: str, text: str, where: str, read: Callable[[str], str]) -> Told:
    """The settings of the only node of a kind in a run file; its own parameters override those of its parameter file.

    read: returns the text of a parameter file, from its name in the run file
    Raises BadInput for a run file with no node of the kind, or with several.
    """
    plan(text, where, Path())
    document = load(text, where)
    entries = [entry for entry in document["nodes"] if entry["executable"] == kind]
    if len(entries) != 1:
        raise BadInput(f"{where}: nodes", f"with {len(entries)} of executable: {kind}", "one", "Give a run file of one machine.")
    (entry,) = entries
    found: dict[str, Any] = {}
    if "params_file" in entry:
        kinds = dict(parameter_files(text, where))[entry["params_file"]]
        found |= parameters(read(entry["params_file"]), entry["params_file"], kinds).get(entry.get("name", kind), {})
    found |= checked(kind, entry.get("parameters", {}), f"{where}: {kind}")
    return Told(found, entry.get("namespace", document.get("namespace", NAMESPACE)), entry.get("remap", {}))
