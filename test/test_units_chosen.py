"""Chosen units of a reader: for lengths and angles, their speeds and units with them in a denominator, and only within the choice."""

from __future__ import annotations

import math
import threading

import pytest

from xy_sysid.units import chosen_units, motion, moved, readable, shown_in


@pytest.mark.parametrize(
    ("choice", "unit", "factor", "shown"),
    [
        ("um", "m", 1e6, "um"),
        ("um", "m/s/V", 1e6, "um/s/V"),
        ("in", "m/s^2", 1 / 0.0254, "in/s^2"),
        ("deg", "rad/s", 180 / math.pi, "deg/s"),
        ("rpm", "rad/s/A", 30 / math.pi, "rpm/A"),
        ("rpm", "rad/s^2", 30 / math.pi, "rpm/s"),
        ("rpm", "rad", 0.5 / math.pi, "rev"),
        ("um", "rad", 1e3, "mrad"),
        ("deg", "counts/s", 1.0, "counts/s"),
        ("parsec", "m", 1e3, "mm"),
    ],
)
def test_a_motion_is_shown_in_the_chosen_unit(choice: str, unit: str, factor: float, shown: str) -> None:
    """Other quantities, encoder counts and unknown choices are unchanged."""
    with shown_in([choice]):
        scale, name = motion(unit)
        assert scale == pytest.approx(factor) and name == shown
    assert motion("m") == (1e3, "mm")


def test_a_choice_holds_in_its_task_and_no_longer() -> None:
    """A second browser, in another task, keeps its own units; after the block the default units are restored."""
    heard = []
    with shown_in(["um", "deg"]):
        other = threading.Thread(target=lambda: heard.append(chosen_units()))
        other.start()
        other.join()
        assert moved(0.0039, "m/s") == "3900 um/s" and readable("s") == (1e3, "ms")
        assert chosen_units() == ("um", "deg")
    assert heard == [()] and chosen_units() == ()
