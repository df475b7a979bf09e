"""Screw compliance: the screw is a spring between motor and table."""

from __future__ import annotations

from collections.abc import Iterable

from xy_sysid.effects import _pole_zero_pair
from xy_sysid.effects._contract import Effect, Parameter
from xy_sysid.effects._scene import Guess, Scene


def guesses(scene: Scene) -> Iterable[Guess]:
    """Pairs above 90 Hz."""
    return _pole_zero_pair.guesses(scene, 90.0, 600.0)


def joint(scene: Scene) -> Iterable[tuple[float, float, float, tuple[float, ...]]]:
    """Base and pair from the frequency response."""
    return _pole_zero_pair.joint(scene, 90.0, 600.0)


EFFECT = Effect(
    name="screw_compliance",
    law="v = v_rigid (s^2 + 2 d w s + w^2) / (s^2 + 2 d_p w_p s + w_p^2) (w_p / w)^2; w = 2 pi frequency, w_p = w (1 + split)",
    meaning="axial and torsional compliance of screw, nut and bearing; the encoder sits on the motor",
    validity="one mode, small amplitude; friction sits at the motor, whose motion the encoder sees",
    source="Varanasi & Nayfeh, The dynamics of lead-screw drives, J. Dyn. Sys. Meas. Control 126 (2004), sec. 3",
    category="motion",
    parameters=(
        Parameter("split", "", 1e-4, 10.0, 0.25, "resonance over antiresonance, minus 1"),
        Parameter("frequency", "Hz", 1.0, 2000.0, 110.0, "antiresonance: table on the screw, motor locked"),
        Parameter("damping", "", 1e-4, 1.0, 0.02, "damping ratio of the antiresonance"),
        Parameter("pole_damping", "", 1e-4, 1.0, 0.03, "damping ratio of the resonance"),
    ),
    shows="antiresonance and a resonance far above it, mostly from 90 Hz on; same equations as base_resonance: "
    "typical values decide which is more likely",
    look_alikes=("base_resonance",),
    experiment="a scale on the table, an accelerometer on the base, or another payload",
    functions={"section": _pole_zero_pair.section},
    guesses=guesses,
    joint=joint,
    family="resonance",
    mode_frequency="frequency",
)
