"""Published parameters of recorded machines, compared with those of ``refine``."""

from __future__ import annotations

from itertools import permutations
from typing import Any

from helpers.cli_tools import cli
from helpers.real_data import data
from pytest import approx


def refined(path: str, *options: str) -> Any:
    """The answer of ``refine --json`` for the only axis."""
    said = cli("refine", data(path), *options, "--json")
    assert said.code == 0, said.err
    (found,) = said.json["axes"].values()
    return found


def value(found: Any, name: str) -> float:
    return float(found["model"]["parameters"][name]["value"])


def left(found: Any) -> float:
    """Held-out error of the final model, SI."""
    return float(found["ladder"][-1]["held_out_error"])


def test_the_friction_of_two_joints_of_a_robot_is_that_of_least_squares() -> None:
    """UR10e: Coulomb and viscous friction within 3 % of plain least squares and 10 % of the published ones; errors of 26 and 45 mrad/s at most.

    Least squares has errors of 24 and 34 mrad/s on the full recording, the rigid model 96 and 134 on the held-out windows.
    """
    wrist = refined("ur10e/ur-20_01_22-joint_6.csv", "--map", "time=1,input=19,output=7", "--unit", "input=A,output=rad", "--add", "coulomb_friction")
    assert value(wrist, "coulomb_friction.coulomb") == approx(0.243, rel=0.03)
    assert value(wrist, "coulomb_friction.coulomb") == approx(0.227, rel=0.10)
    assert 1.0 / value(wrist, "gain") == approx(0.316, rel=0.03)
    assert left(wrist) < 26e-3
    shoulder = refined(
        "ur10e/ur-20_01_22-joint_1.csv", "--map", "time=1,input=14,output=2", "--unit", "input=A,output=rad", "--add", "coulomb_friction"
    )
    assert value(shoulder, "coulomb_friction.coulomb") == approx(1.38, rel=0.03)
    assert value(shoulder, "coulomb_friction.coulomb") == approx(1.26, rel=0.10)
    assert 1.0 / value(shoulder, "gain") == approx(2.17, rel=0.03)
    assert left(shoulder) < 45e-3


def test_load_limit_and_friction_are_found_in_any_order() -> None:
    """Ball-and-plate motor: load 0.835 V, Coulomb 0.35 V and limit 2.94 V, each within 5 %, and one error, whichever effect was added first."""
    effects = {"constant_load": ("load", 0.835), "coulomb_friction": ("coulomb", 0.35), "saturation": ("limit", 2.94)}
    for order in permutations(effects):
        found = refined("ball_plate/motor1.npz", *(word for name in order for word in ("--add", name)))
        assert left(found) < 0.0495, order
        for name, (parameter, published) in effects.items():
            assert value(found, f"{name}.{parameter}") == approx(published, rel=0.05), (order, name)
