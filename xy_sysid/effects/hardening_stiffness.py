"""Hardening stiffness: a spring towards the middle that stiffens with distance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene, columns

LEAST = 0.01  # least cubic force at the end of the travel, relative to the linear force there


@law
def force(cubic: float, linear: float, x: float) -> float:
    """Force against the drive at ``x``, V."""
    return (linear + cubic * x * x) * x


def guesses(scene: Scene) -> Iterator[Guess]:
    """Position and its cube."""
    x = scene.position
    yield Guess(columns(x**3, x), lambda c: (float(c[0]), float(c[1])))


def refusal(values: Sequence[float], between: tuple[float, float]) -> str:
    """Rejects a spring that does not stiffen within the travel."""
    cubic, linear = values
    wins = cubic * max(place**2 for place in between)
    return "within the travel it does not stiffen: a return spring" if wins < LEAST * linear else ""


EFFECT = Effect(
    name="hardening_stiffness",
    law="F = linear x + cubic x^3",
    meaning="bellows, cable chain, hose",
    validity="rest position at x = 0; large travel",
    source="Worden & Tomlinson, Nonlinearity in Structural Dynamics, 2001, sec. 2.2.1 (Duffing)",
    category="force",
    parameters=(
        Parameter("cubic", "V/m3", 1e-6, 1e12, 3000.0, "input that holds it, per cube of the distance"),
        Parameter("linear", "V/m", -1e6, 1e6, 0.0, "the same, per distance", positive=False),
    ),
    shows="error grows towards both ends of the travel, with the sign of the position",
    look_alikes=("return_spring", "constant_load"),
    experiment="hold the axis at several positions: the input needed follows the law",
    functions={"force": force},
    guesses=guesses,
    refusal=refusal,
    family="spring",
    on_table=True,
)
