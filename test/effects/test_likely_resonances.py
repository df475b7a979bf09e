"""Traces of a resonance: the best of the few frequencies from averaged spectra is the best of all frequencies."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from xy_sysid.axis.model import STANDARD, AxisModel, simulate
from xy_sysid.effects import Scene, _pole_zero_pair
from xy_sysid.greybox.free_run import AxisData, GreyboxFit, fit_base, prepare, scene_of, screened
from xy_sysid.samples.block import FloatArray

RATE = 2000.0
BASE = AxisModel(gain=0.097, delay=1.3e-3, pole=60.0)


@cache
def fitted(*effects: tuple[str, tuple[float, ...]]) -> tuple[AxisData, GreyboxFit]:
    """20 s of noise below 300 Hz, an encoder of 0.1 um, and the rigid base fitted to it."""
    random = np.random.default_rng(4)
    voltage = np.asarray(lfilter([0.35], [1.0, -0.65], random.normal(size=40001)))
    model = BASE
    for name, values in effects:
        model = model.with_effect(name, values)
    place = np.zeros(voltage.size)  # no law here depends on position
    velocity = simulate(model, RATE, voltage, place)
    position = np.round(np.concatenate(((0.0,), np.cumsum(velocity) / RATE)) / 1e-7) * 1e-7
    data = prepare(RATE, voltage, position)
    return data, fit_base(data)


def everywhere(scene: Scene, frequencies: FloatArray) -> FloatArray:
    return frequencies


@pytest.mark.parametrize(
    ("effect", "frequency"), [("base_resonance", 12.0), ("base_resonance", 47.0), ("screw_compliance", 130.0), ("screw_compliance", 350.0)]
)
@pytest.mark.parametrize("beside", [(), (("coulomb_friction", (0.1,)),)], ids=["alone", "beside friction"])
def test_the_trace_of_a_resonance_is_as_good_as_the_best_of_all_frequencies(
    effect: str, frequency: float, beside: tuple[tuple[str, tuple[float, ...]], ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Found among four, also with friction that the base has fitted as drag."""
    data, base = fitted((effect, (0.1, frequency, 0.03, 0.03)), *beside)
    few = screened(data, base, [STANDARD[effect]], scene_of(data, base)).traces[0]
    monkeypatch.setattr(_pole_zero_pair, "_likely", everywhere)
    every = screened(data, base, [STANDARD[effect]], scene_of(data, base)).traces[0]
    assert few.share == pytest.approx(every.share, rel=1e-9)
    assert few.values == pytest.approx(every.values, rel=1e-9)
    assert every.share > 0.02


def test_a_scene_that_stands_still_shows_no_frequency() -> None:
    """A spectrum of zeros gives no frequency and no division by zero."""
    still = np.zeros(4000)
    scene = Scene(RATE, BASE.gain, BASE.pole, still, still, still, still)
    with np.errstate(all="raise"):
        guesses = list(_pole_zero_pair.guesses(scene, 5.0, 90.0))
    assert all(np.isfinite(guess.columns).all() for guess in guesses)
