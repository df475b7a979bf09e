"""Naming the missing effect on the simulated machine, whose physics and numerics are others; and saying so when nothing fits."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sim.parts import PARTS
from xy_sysid.axis_model import STANDARD
from xy_sysid.cli import run
from xy_sysid.cli.simulate import drive
from xy_sysid.diagnosis import _judged, diagnose
from xy_sysid.greybox import prepare
from xy_sysid.imports import save
from xy_sysid.race import AT_FLOOR
from xy_sysid.recording import Recording
from xy_sysid.refinement import refine
from xy_sysid.settings import AxisExcitation, ExcitationSettings


def recorded(effect: str, seconds: float = 30.0, seed: int = 21) -> Recording:
    machine = Machine.from_file("rigid.yaml", seed)
    machine = with_effects(machine, effect.split("+")) if effect else machine
    axes = {axis: AxisExcitation(seed=seed + k) for k, axis in enumerate(machine.axes)}
    return drive(machine, ExcitationSettings(lockstep=True, speed=0.0, axes=axes), seconds, lambda _: None)


@pytest.mark.parametrize("effect", ["coulomb_friction", "cogging", "dead_zone", "constant_load", "saturation", "lead_error"])
def test_the_missing_effect_is_named_and_the_error_falls_to_the_floor(effect: str) -> None:
    """First name right, held-out error within 5 % of the floor's, confident."""
    u, y = recorded(effect).axis("x")
    found = diagnose(2000.0, u, y)
    assert (found.verdict, found.effects) == ("missing_effect", (effect,))
    assert found.ladder is not None
    assert found.ladder.final.held_out_error < 1.05 * found.ladder.final.noise_floor
    assert found.ladder.steps[0].fit.excess > 0.3
    assert found.confidence > 0.5
    assert effect in found.sentence and "floor" in found.sentence


def test_two_effects_are_both_named() -> None:
    """One after the other, the larger one first."""
    u, y = recorded("coulomb_friction+cogging").axis("x")
    found = diagnose(2000.0, u, y)
    assert found.verdict == "missing_effect"
    assert set(found.effects) == {"coulomb_friction", "cogging"}


@pytest.mark.parametrize("effect", ["coulomb_friction=0.001", "dead_zone=0.002"])
def test_an_effect_in_the_noise_is_named_without_confidence(effect: str) -> None:
    """The base is at the floor, the name is the simplest that its trace asks for, and it is no certainty."""
    found = diagnose(2000.0, *recorded(effect).axis("x"))
    assert found.ladder is not None and found.ladder.steps[0].fit.excess < AT_FLOOR
    assert found.effects == (effect.partition("=")[0],)
    assert found.ladder.faint == found.effects
    assert found.confidence < 0.5


def test_an_effect_in_the_noise_of_a_base_without_any_excess_is_no_division_by_zero() -> None:
    """Excess of the base exactly 0."""
    u, y = recorded("dead_zone=0.002").axis("x")
    ladder = refine(data := prepare(2000.0, u, y))
    first = replace(ladder.steps[0], fit=replace(ladder.steps[0].fit, excess=0.0))
    found = _judged(data, replace(ladder, steps=(first, *ladder.steps[1:])), STANDARD, 1e-3, 1.0)
    assert found.verdict == "missing_effect" and found.effects == ("dead_zone",)


def test_a_clean_axis_misses_nothing() -> None:
    """No false alarm on either axis."""
    recording = recorded("")
    for axis in recording.axes:
        assert diagnose(2000.0, *recording.axis(axis)).verdict == "nothing_missing"


@pytest.mark.parametrize("effect", ["thermal_viscosity", "quadratic_drag"])
def test_what_is_not_in_the_library_is_not_named(effect: str) -> None:
    """Never a name with confidence for an effect that no hypothesis knows."""
    u, y = recorded(effect, seconds=20.0).axis("x")
    found = diagnose(2000.0, u, y)
    assert found.verdict == "not_in_library"
    assert found.effect is None or found.confidence <= 0.5


@pytest.mark.parametrize(
    ("u", "y", "words"),
    [
        (np.ones(4000), np.zeros(4000), "2 s without a gap"),
        (np.ones(40_000), np.arange(40_000.0), "the input does not move"),
        (np.sin(np.arange(40_000.0)), np.ones(40_000), "the output does not move"),
    ],
)
def test_what_is_lacking_in_the_data_is_said(u: np.ndarray, y: np.ndarray, words: str) -> None:
    """Too short, not excited, standing still: each in words."""
    found = diagnose(2000.0, u, y)
    assert found.verdict == "not_enough_data"
    assert words in found.sentence


@pytest.fixture(scope="module")
def rec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("rec") / "rec.npz"
    save(recorded("x:coulomb_friction", seconds=20.0), path)
    return path


def test_diagnose_answers_with_the_contracts_document(rec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Verdict, error, places, candidates with parameters, next experiment; nothing missing on the other axis."""
    assert run(["diagnose", str(rec), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    x = told["axes"]["x"]
    assert (x["verdict"], x["effect"]) == ("missing_effect", "coulomb_friction")
    assert x["error"]["unit"] == "m/s" and x["error"]["now"] > 5 * x["error"]["held_out"]
    assert {place["kind"] for place in x["where"]} <= {"frequency", "speed", "position", "amplitude", "direction", "time"}
    best = next(item for item in x["candidates"] if item["effect"] == "coulomb_friction")
    size = PARTS["coulomb_friction"].parameters[0].default
    assert best["parameters"]["coulomb_friction.coulomb"]["value"] == pytest.approx(size, rel=0.01)
    assert x["next_experiment"]
    assert told["axes"]["y"]["verdict"] == "nothing_missing"


def test_refine_writes_the_ladder_and_the_model(rec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The error falls from rung to rung; the YAML holds physical parameters with intervals."""
    model = tmp_path / "model.yaml"
    assert run(["refine", str(rec), "--auto", "-a", "x", "--model", str(model), "--json"]) == 0
    x = json.loads(capsys.readouterr().out)["axes"]["x"]
    assert [rung["added"] for rung in x["ladder"]] == [None, "coulomb_friction"]
    assert x["ladder"][1]["held_out_error"] < 0.2 * x["ladder"][0]["held_out_error"]
    assert x["verdict"] == "explained"
    written = yaml.safe_load(model.read_text(encoding="utf-8"))
    assert written["axes"]["x"]["parameters"]["coulomb_friction.coulomb"]["unit"] == "V"


def test_an_effect_can_be_added_by_name(rec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Right or wrong: the ladder tells; a name that nobody knows is refused with the nearest."""
    assert run(["refine", str(rec), "--add", "cogging", "-a", "x", "--json"]) == 0
    x = json.loads(capsys.readouterr().out)["axes"]["x"]
    assert [rung["added"] for rung in x["ladder"]] == [None, "cogging"]
    assert x["ladder"][1]["held_out_error"] > 0.5 * x["ladder"][0]["held_out_error"]
    assert x["verdict"] != "explained"
    assert run(["refine", str(rec), "--add", "coulomb", "-a", "x"]) == 2
    assert "coulomb_friction" in capsys.readouterr().err
