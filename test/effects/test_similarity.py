"""Bounds, typical sizes and start values scale with the motion: other units give the same diagnosis."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.simulated import recorded

from xy_sysid.diagnosis.diagnose import diagnose
from xy_sysid.effects import EFFECTS
from xy_sysid.effects._similarity import SPEED, VOLTAGE, Similarity


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("", 1.0),
        ("V", 5.0),
        ("m", 3.0),
        ("m/s", 1.5),
        ("1/s", 0.5),
        ("rad", 1.0),
        ("rad/s", 0.5),
        ("Hz", 1.0),
        ("V/m", 5.0 / 3.0),
        ("V/m3", 5.0 / 27.0),
        ("1/m2", 1.0 / 9.0),
        ("s/m", 2.0 / 3.0),
        ("V/(m/s)", 5.0 / 1.5),
        ("m/s/V", 1.5 / 5.0),
    ],
)
def test_a_unit_is_carried_over_by_its_powers(unit: str, factor: float) -> None:
    """Length, time and drive scale separately; numbers without unit, and frequencies, are unchanged."""
    assert Similarity(length=3.0, time=2.0, voltage=5.0).factor(unit) == pytest.approx(factor)


def test_a_motion_like_the_usual_one_changes_nothing_and_standing_still_neither() -> None:
    """All factors are 1."""
    wave = np.tile([1.0, -1.0], 100)
    for drive, speed in ((VOLTAGE * wave, SPEED * wave), (0.0 * wave, 0.0 * wave)):
        similar = Similarity.of(8000.0, drive, speed)
        assert (similar.length, similar.time, similar.voltage) == pytest.approx((1.0, 1.0, 1.0))


def test_every_parameter_of_the_library_has_a_unit_that_is_understood() -> None:
    """All units are made of V, m, s, rad and Hz; bounds keep their order on a machine a thousand times as large."""
    large = Similarity(length=1e3, time=10.0, voltage=1e-2)
    for effect in EFFECTS.values():
        for item, other in zip(effect.parameters, effect.on(large), strict=True):
            assert set(item.unit) <= set("Vmsrad/()123Hz"), (effect.name, item.unit)
            assert other.low < other.high and other.low <= other.typical <= other.high
            assert other.typical == pytest.approx(item.typical * large.factor(item.unit))


@pytest.mark.parametrize("effect", ["coulomb_friction", "stribeck_friction", "presliding_hysteresis", "backlash"])
def test_the_same_axis_in_other_units_misses_the_same_effect(effect: str) -> None:
    """With hundreds of newtons and degrees: the same name and confidence, and each number in its own unit."""
    recording = recorded(effect, seconds=20.0)
    voltage, position = recording.axis("x")
    length, drive = 300.0, 200.0
    here, there = diagnose(2000.0, voltage, position), diagnose(2000.0, drive * voltage, length * position)
    assert here.effects == there.effects == (effect,)
    assert there.confidence == pytest.approx(here.confidence, abs=0.02)
    own = Similarity(length=length, time=1.0, voltage=drive)
    units = {f"{effect}.{item.name}": item.unit for item in EFFECTS[effect].parameters}
    for key, unit in (("gain", "m/s/V"), ("pole", "rad/s"), *list(units.items())[:1]):
        one, other = here.final.parameter(key).value, there.final.parameter(key).value
        assert other == pytest.approx(one * own.factor(unit), rel=0.02), key
