"""Run files and parameter files: their result, and the errors for mistakes in them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from helpers import ROOT

from campaigns.documents.ros_parameters import default_text
from xy_sysid.errors import BadInput
from xy_sysid.files.package_files import find, share
from xy_sysid.files.ros_parameters import NODES, WITH_AXES, checked, parameters
from xy_sysid.processes import starter
from xy_sysid.processes.run_plan import plan
from xy_sysid.settings import knobs

HERE = ROOT


def planned(text: str) -> list[tuple[str, str]]:
    return [(spec.name, " ".join(spec.command[1:])) for spec in plan(text, "run.yaml", Path("/folder"))]


def test_listeners_start_first_and_the_excitation_last() -> None:
    """Start order is the reverse of stop order, for any order in the file."""
    names = [
        name for name, _ in planned("nodes: [{executable: excitation}, {executable: ballscrew}, {executable: identifier}, {executable: recorder}]")
    ]
    assert names == ["ballscrew", "recorder", "identifier", "excitation"]


def test_an_entry_becomes_a_command_with_names_namespace_and_parameters_in_the_node_s_types() -> None:
    """name, namespace, params_file, parameters, remap and env are applied; an integer for a float parameter becomes a float."""
    (spec,) = plan(
        "env: {ROS_DOMAIN_ID: 7}\nnodes:\n- executable: excitation\n  name: drive\n  namespace: /m\n  params_file: p.yaml\n"
        '  parameters: {"x": {rms: 2}, block: 10}\n  remap: {voltage: u}\n  restart: true',
        "run.yaml",
        Path("/folder"),
    )
    assert spec.command[:4] == (sys.executable, "-m", "xy_sysid.nodes.excitation", "--ros-args")
    text = " ".join(spec.command)
    for part in ("__node:=drive", "__ns:=/m", "-r voltage:=u", "--params-file /folder/p.yaml", "-p x.rms:=2.0", "-p block:=10"):
        assert part in text
    assert spec.env == (("ROS_DOMAIN_ID", "7"),)
    assert spec.restart
    assert not spec.optional


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nodes: [{executable: exitation}]", ("exitation", "excitation", "node 1")),
        ("nodes: [{executable: excitation, parametrs: {}}]", ("parametrs", "'parameters'")),
        ('nodes: [{executable: excitation, parameters: {"x": {rsm: 1}}}]', ("x.rsm", "'x.rms'")),
        ('nodes: [{executable: excitation, parameters: {"x": {rms: -1}}}]', ("rms", "-1")),
        ("nodes: [{executable: excitation, parameters: {y: {rms: 1}}}]", ("y", "line 1", 'Write "y"')),
        ("nodes: [{executable: excitation, restart: perhaps}]", ("restart", "perhaps", "true or false")),
        ("nodes: [{executable: identifier}, {executable: identifier}]", ("identifier (twice)", "name:")),
        ("nodes: [excitation]", ("'excitation'", "executable:")),
        ("nodes: [{name: a}]", ("without executable:", "ballscrew")),
        ("nods: []", ("no run file", "demo.yaml")),
        ("nodes: [", ("not YAML",)),
        ("nodes: [{executable: excitation}]\nnamspace: /x", ("namspace", "'namespace'")),
    ],
)
def test_a_slip_in_a_run_file_is_one_line_with_the_nearest_spelling(text: str, words: tuple[str, ...]) -> None:
    """The message gives the value, the allowed values and the next action, in one line."""
    with pytest.raises(BadInput) as caught:
        planned(text)
    message = str(caught.value)
    assert message.startswith("run.yaml")
    assert "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("/**/exitation:\n  ros__parameters: {rate: 1000}", ("exitation", "'excitation'")),
        ("/**/excitation:\n  ros__parameters: {rat: 1000}", ("'rat'", "'rate'")),
        ("/**/excitation:\n  ros__parameters: {rate: fast}", ("rate", "fast")),
        ("/**/excitation: {rate: 1000}", ("ros__parameters",)),
        ("/**:\n  ros__parameters: {lenght: 1024}", ("'lenght'", "'length'")),
        ('/**/excitation:\n  ros__parameters:\n    "x": {rms: 1}\n    y: {rms: 1}', ("line 4", 'Write "y"')),
        ("[1, 2]", ("no parameter file",)),
    ],
)
def test_a_slip_in_a_parameter_file_is_told_before_a_node_sees_it(text: str, words: tuple[str, ...]) -> None:
    """ROS ignores an unknown parameter and fails for a bare y; here both are one clear line."""
    with pytest.raises(BadInput) as caught:
        parameters(text, "p.yaml")
    for word in words:
        assert word in str(caught.value)


def test_a_section_for_all_nodes_reaches_those_that_know_the_name() -> None:
    """/** gives each node those parameters that it has."""
    assert parameters("/**:\n  ros__parameters: {rate: 1000, length: 1024}", "p.yaml") == {
        "excitation": {"rate": 1000.0},
        "identifier": {"length": 1024},
    }


def test_the_default_file_is_what_the_settings_say() -> None:
    """config/default.yaml contains exactly all settings of every node at their defaults."""
    text = (HERE / "config" / "default.yaml").read_text(encoding="utf-8")
    assert text == default_text(), "run: python -m campaigns.documents.ros_parameters > config/default.yaml"
    assert parameters(text, "default.yaml") == {
        node: {knob.name: knob.value for knob in knobs(cls())} | ({"axes": ["x", "y"]} if node in WITH_AXES else {}) for node, cls in NODES.items()
    }


@pytest.mark.parametrize("name", ["demo", "real.yaml", str(HERE / "config" / "demo.yaml")])
def test_the_run_files_that_come_along_are_sound(name: str) -> None:
    """Found by name or path; every parameter in them is a known setting, and their parameter files exist."""
    specs = starter.load(name)
    assert specs[-1].name == "excitation"


def test_a_real_machine_gets_the_network_profile(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """real.yaml and a copy of it: full path of the profile; one next to the file has precedence; a set variable is kept."""
    monkeypatch.delenv(starter.PROFILE, raising=False)
    package = str((share() / "config" / "fastdds.xml").resolve())
    assert all(dict(spec.env)[starter.PROFILE] == package for spec in starter.load("real.yaml"))
    copy = tmp_path / "mine.yaml"
    copy.write_text(f"env: {{{starter.PROFILE}: fastdds.xml}}\nnodes: [{{executable: excitation}}]", encoding="utf-8")
    assert dict(starter.load(str(copy))[0].env)[starter.PROFILE] == package
    (tmp_path / "fastdds.xml").touch()
    assert dict(starter.load(str(copy))[0].env)[starter.PROFILE] == str((tmp_path / "fastdds.xml").resolve())
    monkeypatch.setenv(starter.PROFILE, "/own.xml")
    assert starter.PROFILE not in dict(starter.load(str(copy))[0].env)
    monkeypatch.delenv(starter.PROFILE)
    copy.write_text(copy.read_text().replace("fastdds", "nothing"))
    with pytest.raises(BadInput, match=r"nothing\.xml"):
        starter.load(str(copy))


def test_a_run_file_that_is_not_there_is_told_with_those_that_are() -> None:
    """The names that come with the package are in the message."""
    with pytest.raises(BadInput, match=r"demo\.yaml"):
        find("dmeo.yaml")


def test_a_parameter_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    """A params_file is relative to its run file and must exist."""
    (tmp_path / "run.yaml").write_text("nodes: [{executable: excitation, params_file: none.yaml}]", encoding="utf-8")
    with pytest.raises(BadInput, match=r"none\.yaml"):
        starter.load(str(tmp_path / "run.yaml"))


def test_shipped_files_are_found_in_a_source_tree_and_in_an_installation(tmp_path: Path) -> None:
    """Next to the package in a source tree; in share/xy_sysid of the prefix in an installation; otherwise one clear line."""
    assert share() == HERE
    module = tmp_path / "lib" / "python3.12" / "site-packages" / "xy_sysid" / "files" / "package_files.py"
    module.parent.mkdir(parents=True)
    with pytest.raises(BadInput, match="Install it again"):
        share(module)
    (tmp_path / "share" / "xy_sysid").mkdir(parents=True)
    (tmp_path / "share" / "xy_sysid" / "package.xml").touch()
    assert share(module) == tmp_path / "share" / "xy_sysid"


def test_axes_of_other_names_go_with_the_default_file() -> None:
    """Other axes and their settings are accepted, those of x and y in default.yaml are ignored; a misspelt axis or setting is an error."""
    given = {"axes": ["pan", "x"], "pan": {"rms": 0.5}, "y": {"rms": 2.0}, "rate": 500}
    assert checked("excitation", given, "p.yaml") == {"axes": ["pan", "x"], "rate": 500.0, "pan.rms": 0.5}
    assert parameters(default_text().replace('["x", "y"]', '["pan"]'), "default.yaml")["excitation"]["axes"] == ["pan"]
    for values, words in (
        ({"axes": ["pan"], "pam": {"rms": 1.0}}, "pam.rms"),
        ({"axes": "x"}, "list of names"),
        ({"axes": ["pan"], "pan": {"rmss": 1}}, "pan.rms"),
    ):
        with pytest.raises(BadInput, match=words):
            checked("excitation", values, "p.yaml")
