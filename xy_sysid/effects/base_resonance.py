"""Base resonance: the base is a mass on a spring, and the table accelerates it."""

from __future__ import annotations

import math
from collections.abc import Iterable

from xy_sysid.effects import _pole_zero_pair
from xy_sysid.effects._contract import Effect, Parameter
from xy_sysid.effects._scene import Guess, Scene

LOWEST, HIGHEST = 1.0, 90.0  # Hz, range of the tested frequencies
SLOW = 0.25  # lowest tested frequency of a slow axis, relative to the corner frequency of its base


def guesses(scene: Scene) -> Iterable[Guess]:
    """Pairs up to 90 Hz."""
    return _pole_zero_pair.guesses(scene, _lowest(scene), HIGHEST)


def joint(scene: Scene) -> Iterable[tuple[float, float, float, tuple[float, ...]]]:
    """Base and pair from the frequency response."""
    return _pole_zero_pair.joint(scene, _lowest(scene), HIGHEST)


def _lowest(scene: Scene) -> float:
    """Lowest tested frequency, Hz: 5, or lower for a slow axis."""
    return max(LOWEST, min(5.0, SLOW * scene.pole / (2.0 * math.pi)))


EFFECT = Effect(
    name="base_resonance",
    law="v = v_rigid (s^2 + 2 d w s + w^2) / (s^2 + 2 d_p w_p s + w_p^2) (w_p / w)^2; w = 2 pi frequency, w_p = w (1 + split)",
    meaning="machine frame on its feet or its bolts; the encoder, fixed to it, sees antiresonance before resonance",
    validity="one mode, small amplitude; friction acts between table and base, whose motion the encoder sees",
    source="Preumont, Vibration Control of Active Structures, 3rd ed., sec. 2.4 (alternating poles and zeros)",
    category="motion",
    parameters=(
        Parameter("split", "", 1e-4, 10.0, 0.06, "resonance over antiresonance, minus 1"),
        Parameter("frequency", "Hz", LOWEST, 2000.0, 46.0, "antiresonance: base and table together, screw locked"),
        Parameter("damping", "", 1e-4, 1.0, 0.02, "damping ratio of the antiresonance"),
        Parameter("pole_damping", "", 1e-4, 1.0, 0.03, "damping ratio of the resonance"),
    ),
    shows="antiresonance and a resonance near it, mostly below 90 Hz; same equations as screw_compliance: typical values decide which is more likely",
    look_alikes=("screw_compliance",),
    experiment="a scale on the table, an accelerometer on the base, or another payload",
    functions={"section": _pole_zero_pair.section},
    guesses=guesses,
    joint=joint,
    family="resonance",
    mode_frequency="frequency",
)
