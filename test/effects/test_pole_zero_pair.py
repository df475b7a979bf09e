"""Start values of both resonances from the frequency response: base and pair together."""

from __future__ import annotations

import numpy as np
import pytest

from xy_sysid.axis.model import STANDARD, AxisModel, simulate
from xy_sysid.effects import Scene
from xy_sysid.samples.block import FloatArray

RATE = 1000.0


def scene(voltage: FloatArray, velocity: FloatArray) -> Scene:
    """The scene of a base that explains nothing."""
    position = np.cumsum(velocity) / RATE
    return Scene(sampling_rate=RATE, gain=1.0, pole=20.0, voltage=voltage, velocity=velocity, position=position, error=velocity)


def test_base_and_pair_are_read_together_from_the_response() -> None:
    """For a motion with both, from a base without them: each within 20 %, as start values."""
    voltage = np.random.default_rng(2).normal(size=20_001)
    model = AxisModel(0.5, 4e-3, 52.0).with_effect("base_resonance", (0.2, 25.0, 0.03, 0.03))
    velocity = simulate(model, RATE, voltage, np.zeros(voltage.size))
    joint = STANDARD["base_resonance"].joint
    assert joint is not None
    ((gain, delay, pole, (split, frequency, *_)),) = joint(scene(voltage[:-1], velocity))
    assert (gain, delay, pole, split, frequency) == pytest.approx((0.5, 4e-3, 52.0, 0.2, 25.0), rel=0.2)


def test_nothing_is_read_of_signals_that_have_nothing_to_do_with_each_other() -> None:
    """No line of the spectrum is coherent enough."""
    voltage, velocity = np.random.default_rng(2).normal(size=(2, 80_000))
    tone = np.sin(2.0 * np.pi * 7.0 * np.arange(80_000) / RATE)
    for name in ("screw_compliance", "base_resonance"):
        joint = STANDARD[name].joint
        assert joint is not None
        assert list(joint(scene(voltage, velocity))) == [] == list(joint(scene(tone, tone)))
