"""Machine files, effects as text, random effects, and the document made from them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from helpers import ROOT

from campaigns.blind.cases import EFFECTS
from campaigns.documents import machines
from xy_sim import effect_text
from xy_sim.hidden import draw
from xy_sim.machine import Machine
from xy_sim.machine_file import machine_path, read
from xy_sim.parts import PARTS
from xy_sysid.errors import BadInput

DESIGN = {"time_delay", "viscous_friction", *EFFECTS}
MORE = {
    "asymmetric_viscous_friction",
    "gravity",
    "load_dependent_friction",
    "return_spring",
    "position_dependent_drag",
    "position_dependent_gain",
    "quadratic_drag",
}  # met on measured machines
GOOD = 'axes:\n  "x": {}\n'


def part_names(machine: Machine, axis: str = "x") -> list[str]:
    """Names of the parts on an axis."""
    return [part["name"] for part in machine.truth(axis)["parts"]]


def test_there_is_a_part_for_every_effect_name_and_two_that_no_hypothesis_knows() -> None:
    """The full list of the design, and surprise parts."""
    assert {name for name, part in PARTS.items() if part.group in ("base", "effect", "added")} == DESIGN | MORE
    assert sum(part.group == "outside" for part in PARTS.values()) >= 2


@pytest.mark.parametrize("name", ["paper", "rigid", "sticky", "loose_bolts", "hidden"])
def test_every_machine_of_the_issue_is_there_and_moves(name: str) -> None:
    """Found by name with and without .yaml, two axes, finite motion."""
    machine = Machine.from_file(f"{name}.yaml")
    assert machine_path(name) == machine_path(f"{name}.yaml")
    assert machine.axes == ("x", "y")
    y = machine.step(np.random.default_rng(0).standard_normal((2000, 2)))
    assert np.isfinite(y).all() and (np.ptp(y, axis=0) > 1e-5).all()


def test_paper_yaml_is_the_table_of_the_paper() -> None:
    """97 mm/s/V, 246 rad/s, 1.29 and 1.38 ms, a pair near 47 Hz with the antiresonance below, 0.5 um, 150 mm."""
    x, y = (Machine.from_file("paper.yaml").truth(axis) for axis in "xy")
    assert x["velocity_gain"] == pytest.approx(0.097, rel=0.01) and y["velocity_gain"] == pytest.approx(0.097, rel=0.01)
    assert x["pole"] == pytest.approx(246.0, rel=0.01) and y["pole"] == pytest.approx(246.0, rel=0.01)
    assert (x["delay"], y["delay"]) == (1.29e-3, 1.38e-3)
    assert 46.0 < x["antiresonance_hz"] < 47.0 < x["resonance_hz"] < 48.0
    assert 46.0 < y["antiresonance_hz"] < 47.0 < y["resonance_hz"] < 48.0
    assert x["count"] == pytest.approx(0.5e-6)
    assert read("paper.yaml").axes[0].drive.travel == 0.15


def test_loose_bolts_lower_the_pair_by_more_than_a_hertz_while_it_runs() -> None:
    """Both axes have a shift for the alarm, and none before half a minute."""
    machine = Machine.from_file("loose_bolts.yaml")
    for axis, fall in (("x", 1.9), ("y", 0.9)):
        before, start, late = (machine.truth(axis, time)["resonance_hz"] for time in (0.0, 30.0, 60.0))
        assert before == start
        assert before - late > fall


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('axes:\n  "x": {velocity_gian: 0.1}\n', "Did you mean 'velocity_gain'"),
        ('axes:\n  "x":\n    parts: {coulom_friction: 0.3}\n', "Did you mean 'coulomb_friction'"),
        ('axes:\n  "x":\n    parts: {backlash: {gapp: 1.0e-6}}\n', "Did you mean 'gap'"),
        ('axes:\n  "x":\n    parts: {backlash: {gap: wide}}\n', "gap is 'wide'; allowed: a number"),
        ('axes:\n  "x":\n    parts: {coulomb_friction: -1}\n', "allowed: 0 to 100 V"),
        ('axes:\n  "x":\n    parts: {base_loosening: {}}\n', "Add base_resonance"),
        ('axes:\n  "x": {}\n  yes: {}\n', "bare y"),
        ('axes:\n  "x": {}\n  true: {}\n', 'in quotes, "y"'),
        ('axes:\n  "x": 3\n', "names with values"),
        (GOOD + "rat: 1000\n", "Did you mean 'rate'"),
        (GOOD + "rate: 1\n", "10 to 100000"),
        (GOOD + "rate: fast\n", "rate is 'fast'"),
        (GOOD + "hidden: {sed: 1}\n", "Did you mean 'seed'"),
        (GOOD + "hidden: {effects: many}\n", "0 to 6, a range"),
        (GOOD + "base: nowhere.yaml\n", "hidden.yaml"),
        (GOOD + "base: machine.yaml\n", "its own base"),
        ("rate: 2000\n", "one group per axis"),
        ("- 1\n", "names with values"),
        ("a: [1\n", "YAML text"),
    ],
)
def test_a_mistake_in_a_machine_file_is_one_line_that_says_what_to_do(text: str, says: str, tmp_path: Path) -> None:
    """The wrong value, the allowed ones, the nearest spelling."""
    path = tmp_path / "machine.yaml"
    path.write_text(text)
    with pytest.raises(BadInput) as caught:
        Machine.from_file(path)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_adds_to_its_base_and_can_take_parts_away(tmp_path: Path) -> None:
    """Axes and parts are merged by name; numbers such as 1e-7, which YAML 1.1 reads as text, are numbers."""
    path = tmp_path / "machine.yaml"
    path.write_text('base: paper.yaml\naxes:\n  "x":\n    encoder_noise: 1e-7\n    parts: {base_resonance: false, backlash: {gap: 3e-5}}\n')
    machine = Machine.from_file(path)
    assert part_names(machine) == ["time_delay", "backlash"]
    assert part_names(machine, "y") == ["time_delay", "base_resonance"]
    assert machine.spec.axes[0].drive.encoder_noise == 1e-7
    assert machine.spec.axes[0].parts["backlash"]["gap"] == 3e-5


def test_effects_are_read_as_users_type_them() -> None:
    """Axis, name, size, parameters; the last entry for a name counts."""
    machine = effect_text.with_effects(
        Machine.from_file("rigid.yaml"), ["coulomb_friction", "coulomb_friction=0.3", "y:stribeck_friction=0.2,velocity=0.02"]
    )
    assert machine.spec.axes[0].parts["coulomb_friction"] == {"coulomb": 0.3}
    assert "stribeck_friction" not in machine.spec.axes[0].parts
    assert machine.spec.axes[1].parts["stribeck_friction"] == {"excess": 0.2, "coulomb": 0.15, "velocity": 0.02}


@pytest.mark.parametrize(
    "text", ["coulom=0.3", "z:backlash", "backlash=wide", "backlash,3", "backlash,gapp=3", "saturation=0", "", "=", "dead_zone=nan"]
)
def test_an_effect_that_is_mistyped_is_refused(text: str) -> None:
    """Every mistake is a BadInput of one line."""
    with pytest.raises(BadInput):
        effect_text.with_effects(Machine.from_file("rigid.yaml"), [text])


def test_a_seed_draws_the_same_machine_again_and_another_seed_another() -> None:
    """The machine of a seed is reproducible, and its effects differ between the axes for some seeds."""

    def hidden(seed: int) -> Machine:
        return Machine.from_file("hidden.yaml", seed)

    assert hidden(4).truth("x") == hidden(4).truth("x")
    assert len({str(hidden(seed).truth("x")["parts"]) for seed in range(20)}) == 20
    assert any(part_names(hidden(seed)) != part_names(hidden(seed), "y") for seed in range(5))


def test_what_is_drawn_is_what_was_asked_for() -> None:
    """Counts, groups, one of a family, sizes within the range; every effect occurs."""
    seen: set[str] = set()
    for seed in range(120):
        machine = draw(seed, effects=(1, 3))
        for axis in machine.spec.axes:
            drawn = [name for name in axis.parts if name != "time_delay"]
            families = [PARTS[name].family for name in drawn if PARTS[name].family]
            assert 1 <= len(drawn) <= 3 and len(set(families)) == len(families)
            assert all(PARTS[name].group == "effect" for name in drawn)
            for name in drawn:
                size = PARTS[name].parameters[0]
                assert size.low * 0.999 <= abs(axis.parts[name][size.name]) <= size.high * 1.001
            seen.update(drawn)
    assert seen == DESIGN - {"time_delay", "viscous_friction"}
    assert part_names(draw(1, "none")) == ["time_delay"]
    assert {PARTS[part_names(draw(seed, "outside"))[-1]].group for seed in range(10)} == {"outside"}
    assert len(part_names(draw(1, 2))) == 3


def test_drawn_sizes_can_be_scaled() -> None:
    """A tenth of the size scales each parameter by its power; other parameters are unchanged."""
    seen = set()
    for seed in range(8, 24):
        whole, tenth = draw(seed, 1), draw(seed, 1, scale=0.1)
        name = part_names(whole)[-1]
        a, b = whole.spec.axes[0].parts[name], tenth.spec.axes[0].parts[name]
        for place, item in enumerate(PARTS[name].parameters):
            power = float(place == 0) if item.power is None else item.power
            assert math.isclose(a[item.name], 10.0**power * b[item.name], rel_tol=1e-9)
        seen.add(name)
    assert {"cogging", "saturation"} <= seen


def test_an_installation_is_searched_where_ros_keeps_its_share(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """AMENT_PREFIX_PATH is searched for share/xy_sysid/config/machines."""
    folder = tmp_path / "share" / "xy_sysid" / "config" / "machines"
    folder.mkdir(parents=True)
    (folder / "mine.yaml").write_text(GOOD)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    assert machine_path("mine") == folder / "mine.yaml"


def test_the_document_says_what_the_parts_say() -> None:
    """docs/machines.md is made from files, keys and parts; refresh it with python -m campaigns.documents.machines"""
    text = (ROOT / "docs" / "machines.md").read_text(encoding="utf-8")
    assert machines.refreshed(text) == text
    assert all(f"#### `{name}`" in text for name in PARTS)
