"""The answer on independently simulated machines: in closed loop, with preloaded springs, on part of a wave."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.foreign import Joint, across_gap, driven

from xy_sysid.axis.model import STANDARD
from xy_sysid.diagnosis.answer import Answer
from xy_sysid.diagnosis.diagnose import diagnose
from xy_sysid.effects import EFFECTS

SLIDE = Joint(fs=1000.0, seconds=40.0, count=1e-6, mass=0.1, drag=10.0, shake=1.0, band=(0.5, 60.0))
LINEAR_MOTOR = Joint(
    fs=2000.0,
    seconds=20.0,
    count=1e-6,
    mass=8.0,
    drag=20.0,
    coulomb=10.0,
    cogging=6.0,
    period=0.03,
    moves=(0.2, 0.8, 8.0),
    control=(8e4, 1500.0),
    shake=4.0,
)
ROBOT = Joint(
    fs=500.0,
    seconds=60.0,
    count=2e-5,
    mass=0.3,
    drag=0.4,
    coulomb=0.6,
    breaks=0.3,
    fades=0.05,
    moves=(1.2, 2.0, 10.0),
    control=(120.0, 6.0),
)


def of(joint: Joint, seed: int = 1) -> Answer:
    """The answer for a machine."""
    return diagnose(joint.fs, *driven(joint, seed))


def values(found: Answer) -> dict[str, tuple[float, ...]]:
    """Of each effect of the last model."""
    return dict(found.final.model.effects)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_linear_motor_in_closed_loop_has_cogging_and_friction(seed: int) -> None:
    """It stops and starts at each move, so that the effect of friction is linear in its size only at low frequencies."""
    found = of(LINEAR_MOTOR, seed)
    assert set(found.effects) == {"coulomb_friction", "cogging"}, found.sentence
    assert found.confidence > 0.9
    amplitude, period, _ = values(found)["cogging"]
    assert (amplitude, period) == pytest.approx((6.0, 0.03), rel=0.01)
    assert values(found)["coulomb_friction"][0] == pytest.approx(10.0, rel=0.01)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_robots_joint_that_breaks_away_has_stribeck_friction(seed: int) -> None:
    """Only moves and pauses, without noise in the drive; the first choice may be another law of friction."""
    found = of(ROBOT, seed)
    assert found.effects == ("stribeck_friction",), found.sentence
    assert found.confidence > 0.9
    assert values(found)["stribeck_friction"] == pytest.approx((0.6, 0.3, 0.05), rel=0.02)


def test_a_load_on_a_linear_motor_does_not_hide_its_cogging() -> None:
    """Friction and load bias the base, so that the cogging's trace is not visible; least squares with the friction shows it."""
    found = of(replace(LINEAR_MOTOR, load=3.0))
    assert set(found.effects) == {"asymmetric_friction", "cogging"}, found.sentence
    assert found.confidence > 0.9
    assert values(found)["cogging"][:2] == pytest.approx((6.0, 0.03), rel=0.01)


def test_heavy_friction_does_not_hide_that_it_breaks_away() -> None:
    """The breakaway part is a seventh of the friction: the first start leads to another minimum, that of its trace does not."""
    found = of(replace(ROBOT, coulomb=2.0))
    assert found.effects == ("stribeck_friction",), found.sentence
    assert values(found)["stribeck_friction"] == pytest.approx((2.0, 0.3, 0.05), rel=0.02)


@pytest.mark.parametrize(("breaks", "effects"), [(0.0, {"saturation", "coulomb_friction"}), (5.0, {"saturation", "stribeck_friction"})])
def test_a_drive_that_is_at_its_limit_for_half_of_the_time_is_told_from_a_slow_axis(breaks: float, effects: set[str]) -> None:
    """A controller requests far more than the limit; a rigid base fitted to these requests is wrong, so that no trace is useful."""
    joint = replace(LINEAR_MOTOR, cogging=0.0, breaks=breaks, fades=0.13, limit=60.0)
    assert 0.2 < float(np.mean(np.abs(driven(joint, 1)[0]) > joint.limit)) < 0.6
    found = of(joint)
    assert set(found.effects) == effects, found.sentence
    assert found.confidence > 0.9
    assert values(found)["saturation"][0] == pytest.approx(60.0, rel=0.01)


def test_a_zone_of_the_drive_in_which_nothing_happens_is_told_beside_friction() -> None:
    """Both hold the axis at small inputs; the zone reduces every input, friction acts against the motion."""
    found = of(replace(SLIDE, coulomb=0.3, zone=0.3, shake=2.0, band=(0.5, 40.0)))
    assert set(found.effects) == {"coulomb_friction", "dead_zone"}, found.sentence
    own = values(found)
    assert (own["coulomb_friction"][0], own["dead_zone"][0]) == pytest.approx((0.3, 0.3), rel=0.02)


def test_in_a_move_that_passes_each_place_once_nothing_is_named_by_place() -> None:
    """Motion in one direction, with slowly changing friction: a position-dependent drag cannot be distinguished from it."""
    joint = Joint(fs=1000.0, seconds=20.0, count=1e-4, mass=0.1, drag=1.0, coulomb=0.3, shake=0.4, band=(0.2, 20.0), offset=2.0)
    drive, position = driven(joint, 4)
    assert np.all(np.diff(position[:: int(joint.fs / 5.0)]) > 0.0)
    found = diagnose(joint.fs, drive, position + 0.01 * np.sin(2.0 * np.pi * position / 1.3 / float(np.ptp(position))))
    assert not {name for name in found.effects if STANDARD[name].is_by_place}, found.sentence


def test_a_spring_beside_friction_that_breaks_away_is_not_one_that_stiffens() -> None:
    """With hardening stiffness in addition the error is at the floor, but the set is refused: the return spring is tested instead."""
    found = of(replace(SLIDE, spring=100.0, coulomb=0.2, breaks=0.1, fades=0.01), seed=2)
    assert set(found.effects) == {"return_spring", "stribeck_friction"}, found.sentence


@pytest.mark.parametrize(
    ("gap", "table", "coulomb"), [(1e-4, 0.1, 0.0), (1e-4, 0.1, 0.15), (3e-5, 0.1, 0.15), (3e-4, 0.03, 0.15), (3e-4, 0.1, 0.15), (3e-4, 0.3, 0.0)]
)
def test_a_gap_before_a_table_that_drags_is_found(gap: float, table: float, coulomb: float) -> None:
    """Half of the drag is the table's, as for guides; the base has a wrong delay. Light tables and heavy ones."""
    found = diagnose(2000.0, *across_gap(gap, table, coulomb, 1))
    assert set(found.effects) == {"backlash"} | ({"coulomb_friction"} if coulomb else set()), found.sentence
    assert values(found)["backlash"][0] == pytest.approx(gap, rel=0.1)


@pytest.mark.parametrize(
    ("gap", "table", "coulomb", "lag", "load"), [(1e-4, 0.1, 0.15, 2e-3, 0.0), (3e-4, 0.05, 0.1, 2e-3, 0.05), (3e-4, 0.1, 0.0, 3e-3, 0.1)]
)
def test_what_a_gap_hides_is_found_with_it(gap: float, table: float, coulomb: float, lag: float, load: float) -> None:
    """An amplifier lag has no trace before a gap, and without it no filter follows the motor; a load acts on the table."""
    found = diagnose(2000.0, *across_gap(gap, table, coulomb, 1, lag=lag, load=load))
    true = {"backlash": gap, "amplifier_lag": lag, "coulomb_friction": coulomb, "constant_load": load}
    assert set(found.effects) == {name for name, size in true.items() if size}, found.sentence
    assert {name: values(found)[name][0] for name in found.effects} == pytest.approx({name: size for name, size in true.items() if size}, rel=0.1)
    assert found.confidence > 0.9


@pytest.mark.parametrize("coulomb", [0.0, 0.2])
def test_a_spring_whose_rest_is_far_off_is_one_spring(coulomb: float) -> None:
    """The spring of a valve: preloaded by five times its travel, held by the drive."""
    found = of(replace(SLIDE, spring=100.0, rest=-0.05, offset=5.0, coulomb=coulomb))
    assert set(found.effects) == {"return_spring"} | ({"coulomb_friction"} if coulomb else set()), found.sentence
    force = STANDARD["return_spring"].functions["force"]
    own = values(found)["return_spring"]
    here, beyond = force(*own, 0.0, 1.0), force(*own, 1e-3, 1.0)  # far from its rest, softening cannot be determined
    assert (here, (beyond - here) / 1e-3) == pytest.approx((5.0, 100.0), rel=0.02)


def test_a_spring_that_does_not_stiffen_is_not_said_to() -> None:
    """A flexure at its rest: hardening stiffness without hardening has fewer parameters, and is the wrong name."""
    found = of(replace(SLIDE, spring=100.0, coulomb=0.2))
    assert set(found.effects) == {"return_spring", "coulomb_friction"}, found.sentence
    assert found.confidence > 0.9


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_part_of_a_wave_is_no_spring_that_gives_way(seed: int) -> None:
    """Noise moves the axis over 0.7 to 0.9 of a period, around one rest position."""
    drive, position = driven(replace(SLIDE, cogging=0.2, period=0.02, drag=20.0, shake=1.5, band=(0.2, 60.0)), seed)
    assert 0.65 < np.ptp(position) / 0.02 < 0.95
    found = diagnose(1000.0, drive, position)
    assert found.effects == ("cogging",), found.sentence
    assert found.confidence > 0.9
    assert values(found)["cogging"][:2] == pytest.approx((0.2, 0.02), rel=0.01)


@pytest.mark.parametrize(
    ("effect", "inside", "outside"),
    [
        ("return_spring", (100.0, 0.0, 1000.0), (100.0, 0.0, 4000.0)),  # softening d^2 < 1/3 at d = 10 mm
        ("cogging", (1.0, 0.03, 0.0), (1.0, 0.05, 0.0)),  # half a period on 20 mm
        ("hardening_stiffness", (1e5, 100.0), (1e3, 100.0)),
        ("lead_error", (1e-5, 0.01, 0.0), (1e-3, 0.01, 0.0)),
        ("lead_error", (1e-5, 0.01, 0.0), (1e-5, 0.045, 0.0)),
    ],
)
def test_values_outside_of_where_a_law_holds_are_refused_in_words(effect: str, inside: tuple[float, ...], outside: tuple[float, ...]) -> None:
    """On a travel of 20 mm: the reason names the limit, and is empty within it."""
    refusal = STANDARD[effect].refusal
    assert refusal is not None and EFFECTS[effect].refusal is refusal
    assert refusal(inside, (-0.01, 0.01)) == ""
    assert len(refusal(outside, (-0.01, 0.01)).split()) > 4


@pytest.mark.parametrize("cut", [3333, 4444, 6000])
@pytest.mark.parametrize(("coulomb", "effects"), [(0.0, ()), (0.3, ("coulomb_friction",))])
def test_a_recording_that_begins_in_motion_is_a_recording(cut: int, coulomb: float, effects: tuple[str, ...]) -> None:
    """Cut from a longer recording of a machine that coasts for a second: its start speed is not a missing effect."""
    coasting = Joint(fs=1000.0, seconds=25.0, count=1e-6, mass=1.0, drag=1.0, coulomb=coulomb, shake=3.0, band=(0.2, 60.0))
    drive, position = driven(coasting, 2)
    found = diagnose(coasting.fs, drive[cut:], position[cut:])
    assert found.effects == effects, found.sentence
    assert found.confidence > 0.9
