"""The table in docs/use.md of losses in MJCF."""

from __future__ import annotations

from pathlib import Path

from helpers import ROOT

from campaigns.documents.mjcf import NOTHING, lost, table
from xy_sysid.axis.model import STANDARD


def test_the_table_of_the_documentation_is_what_the_export_says() -> None:
    """python -m campaigns.documents.mjcf prints it; every effect of the library has a row."""
    made = table()
    assert all(f"\n| {effect.name} | " in made for effect in STANDARD.acting)
    assert made in (Path(ROOT) / "docs" / "use.md").read_text(encoding="utf-8")


def test_an_effect_that_mujoco_knows_loses_nothing_and_one_that_it_does_not_is_named() -> None:
    """MJCF can describe cogging, but not a gap."""
    assert lost("cogging") == lost("presliding_hysteresis") == NOTHING
    assert "not a first-order lag" in lost("backlash")
