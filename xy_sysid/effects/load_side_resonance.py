"""Load-side resonance: a spring between motor and load, with the encoder on the load."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import partial

from xy_sysid.effects import _pole_zero_pair
from xy_sysid.effects._contract import Effect, Parameter, law
from xy_sysid.effects._scene import Guess, Scene
from xy_sysid.samples.block import FloatArray

LOWEST, HIGHEST = 1.0, 600.0  # Hz, range of the tested frequencies


@law
def section(frequency: float, damping: float, fs: float) -> tuple[float, float, float, float, float]:
    """Two poles by the bilinear transform, exact at the resonance (Franklin, Powell & Workman, 3rd ed., sec. 6.1): no aliasing."""
    w = 2.0 * math.pi * frequency
    turn = min(0.5 * w / fs, 1.4)
    c = 2.0 * fs * turn / math.tan(turn)
    whole = c * c + 2.0 * damping * w * c + w * w
    b0 = w * w / whole
    return b0, 2.0 * b0, b0, 2.0 * (w * w - c * c) / whole, (c * c - 2.0 * damping * w * c + w * w) / whole


def guesses(scene: Scene) -> Iterator[Guess]:
    """The traces of a pole-zero pair; the two coefficients are read differently."""
    for trace, frequency in _pole_zero_pair.traces(scene, LOWEST, HIGHEST):
        yield Guess(trace, partial(_read, frequency))


def _read(frequency: float, c: FloatArray) -> tuple[float, ...]:
    """(frequency, damping) from the two coefficients of poles at ``frequency``."""
    return (frequency, min(max(-0.5 * float(c[1]), 0.005), 0.5))


def joint(scene: Scene) -> Iterable[tuple[float, float, float, tuple[float, ...]]]:
    """Base and poles from the frequency response."""
    found = _pole_zero_pair.of_response(scene, zeros=0)
    if found is not None and LOWEST <= found.pair[0] <= HIGHEST:
        yield found.gain, found.delay, found.pole, found.pair


EFFECT = Effect(
    name="load_side_resonance",
    law="v = v_rigid w^2 / (s^2 + 2 d w s + w^2); w = 2 pi frequency",
    meaning="compliance of shaft, belt or gear between motor and load; the encoder sits on the load (link side, glass scale)",
    validity="one mode, small amplitude; friction sits at the motor, whose motion the encoder does not see",
    source="Spong, Modeling and control of elastic joint robots, J. Dyn. Sys. Meas. Control 109 (1987), eq. 10",
    category="motion",
    parameters=(
        Parameter("frequency", "Hz", 1.0, 2000.0, 60.0, "resonance: motor and load oscillate against each other"),
        Parameter("damping", "", 1e-4, 1.0, 0.03, "its damping ratio"),
    ),
    shows="a resonance without an antiresonance before it; above it the motion falls and lags by a further 180 degrees",
    look_alikes=("screw_compliance", "base_resonance", "amplifier_lag"),
    experiment="a second encoder on the motor: it sees an antiresonance before the same resonance",
    functions={"section": section},
    guesses=guesses,
    joint=joint,
    family="resonance",
    mode_frequency="frequency",
)
