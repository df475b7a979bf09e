"""Pictures of the documentation: one per effect, all made by one command, none too heavy."""

from __future__ import annotations

import re

import pytest
from helpers import ROOT

from campaigns.pictures.examples import EXAMPLES, Example, rigid_model
from campaigns.pictures.reading import page, picture
from xy_sim.parts import PARTS
from xy_sysid.axis.model import STANDARD
from xy_sysid.effects import EFFECTS

DOCS = ROOT / "docs"


def test_the_page_is_made_by_its_command() -> None:
    """python -m campaigns.pictures"""
    assert (DOCS / "reading-pictures.md").read_text(encoding="utf-8") == page()


def test_every_effect_of_the_library_has_its_example() -> None:
    """Every effect that a diagnosis can name and the simulated machine can have is shown; the first example is a machine without any."""
    assert {example.effect for example in EXAMPLES} == {"", *(effect.name for effect in STANDARD.acting if effect.name in PARTS)}
    assert EXAMPLES[0].effect == "" and set(EFFECTS) >= {example.effect for example in EXAMPLES[1:]}


def test_the_pictures_are_there_and_light() -> None:
    """The folder contains exactly the pictures of the page, in total less than 3 MB."""
    shown = {DOCS / target for target in re.findall(r"\]\((pictures/[^)]+)\)", page())}
    there = {path for path in (DOCS / "pictures").iterdir() if path.suffix == ".png"}
    assert {DOCS / picture(example) for example in EXAMPLES} <= shown <= there
    assert sum(path.stat().st_size for path in (DOCS / "pictures").iterdir()) < 3_000_000


def test_the_words_of_a_picture_are_true_of_it() -> None:
    """Coulomb friction: the mean error jumps at standstill. Nothing missing: no place is marked."""
    by_name = {example.name: example for example in EXAMPLES}
    friction = _residual(by_name["coulomb_friction"], "speed")
    slow = [(v, e) for v, e in zip(friction["speed"], friction["mean_error"], strict=True) if 0.004 < abs(v) < 0.02]
    assert slow and all(v * e < 0 and abs(e) > 5e-4 for v, e in slow)
    assert not rigid_model(by_name["nothing_missing"])["steps"][0]["pictures"]["failing"]


@pytest.mark.parametrize("name", ["constant_load", "gain_drift"])
def test_a_load_is_the_same_at_all_times_and_a_drift_is_not(name: str) -> None:
    """Error by time: nearly flat for a load, a V for a drift."""
    time = _residual(next(example for example in EXAMPLES if example.name == name), "time")["error_over_floor"]
    assert (max(time) < 1.5 * min(time)) == (name == "constant_load")
    assert (max(time) > 5 * min(time)) == (name == "gain_drift")


def _residual(example: Example, kind: str) -> dict[str, list[float]]:
    found: dict[str, list[float]] = rigid_model(example)["steps"][0]["pictures"]["residual"][kind]
    return found
