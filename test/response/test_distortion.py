"""Even and odd distortion of an axis, at the free lines of an odd multisine."""

from __future__ import annotations

import pytest

from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sysid.excitation.lockstep import drive
from xy_sysid.response.distortion import Distortion, distortion
from xy_sysid.response.period import find_period
from xy_sysid.settings import AxisExcitation, ExcitationSettings


def split(effect: str, kind: str = "multisine_detect") -> Distortion | None:
    machine = Machine.from_file("rigid.yaml", 3)
    machine = with_effects(machine, [effect]) if effect else machine
    axes = {axis: AxisExcitation.model_validate({"kind": kind, "seed": 4 + k, "period": 2.048}) for k, axis in enumerate(machine.axes)}
    recording = drive(machine, ExcitationSettings(lockstep=True, speed=0.0, axes=axes), 20.0, lambda _: None)
    u, y = recording.axis("x")
    period = find_period(u)
    assert period == 4096
    return distortion(recording.sampling_rate, u, y, period)


def test_a_linear_axis_shows_none() -> None:
    """Neither kind exceeds the non-periodic part."""
    found = split("")
    assert found is not None and found.odd is not None
    assert not found.even.seen and not found.odd.seen
    assert found.periods >= 7 and found.even.lines > 3 * found.odd.lines / 2
    assert "not seen" in found.sentence


@pytest.mark.parametrize("effect", ["coulomb_friction", "dead_zone", "saturation"])
def test_what_is_alike_in_both_directions_is_odd(effect: str) -> None:
    """Far above noise, and above the even part."""
    found = split(effect)
    assert found is not None and found.odd is not None
    assert found.odd.seen and found.odd.level > -35.0
    assert found.odd.level > found.even.level + 25.0


def test_what_differs_between_the_directions_is_even_too() -> None:
    """Asymmetric friction."""
    found = split("asymmetric_friction")
    assert found is not None and found.even.seen and found.even.level > -55.0


def test_what_the_multisine_cannot_show_is_not_told() -> None:
    """Odd without detection lines: even distortion only; full: none."""
    odd = split("coulomb_friction", "multisine_odd")
    assert odd is not None and odd.odd is None and "multisine_detect" in odd.sentence
    assert split("coulomb_friction", "multisine") is None
