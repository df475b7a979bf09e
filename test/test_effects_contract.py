"""Every effect of the folder is complete, honest about its limits, and absent when its size is zero."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from xy_sysid.axis_model import STANDARD, AxisModel, simulate
from xy_sysid.effects import EFFECTS, Scene
from xy_sysid.effects.contract import FUNCTIONS, WORDS
from xy_sysid.errors import BadInput
from xy_sysid.stream import FloatArray

RATE = 2000.0


def names(text: str) -> list[str]:
    """The words of a table."""
    return text.split()


BASE = AxisModel(0.097, 1.29e-3, 246.0)
NAMES = names("""time_delay viscous_friction coulomb_friction stribeck_friction presliding_hysteresis asymmetric_friction
constant_load dead_zone saturation amplifier_lag backlash cogging lead_error screw_compliance base_resonance
hardening_stiffness gain_drift position_dependent_gain asymmetric_viscous_friction""")
ACTING = [name for name in EFFECTS if EFFECTS[name].category != "base"]


@cache
def motion(n: int = 8001) -> tuple[FloatArray, FloatArray]:
    """Band noise of 1 V rms, and a position that goes along with it, (n,) each."""
    u = sosfilt(butter(4, 300, fs=RATE, output="sos"), np.random.default_rng(0).standard_normal(n))
    u = np.asarray(u / u.std())
    x = np.concatenate(([0.0], np.cumsum(simulate(BASE, RATE, u, np.zeros(n))) / RATE))
    return u, x


def test_the_folder_holds_the_promised_effects() -> None:
    """The names of the design, each once."""
    assert sorted(EFFECTS) == sorted(NAMES)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_says_everything_about_itself(name: str) -> None:
    """Law, meaning, validity, source, how it shows itself, look-alikes that exist, an experiment, parameters in order."""
    effect = EFFECTS[name]
    assert effect.name == name
    for text in (effect.law, effect.meaning, effect.validity, effect.source, effect.shows, effect.experiment):
        assert len(text) >= 6
        assert "\n" not in text
    assert effect.look_alikes
    assert set(effect.look_alikes) <= set(EFFECTS) - {name}
    assert sorted(effect.functions) == sorted(FUNCTIONS[effect.category])
    for parameter in effect.parameters:
        assert parameter.name.isidentifier()
        assert parameter.name not in WORDS or effect.category == "base"
        assert parameter.meaning
        assert parameter.unit or parameter.name in ("asymmetry", "split", "damping", "pole_damping", "depth", "share", "guide")
        assert parameter.low < parameter.high
        assert parameter.low <= parameter.typical <= parameter.high
        assert not parameter.positive or parameter.low > 0


@pytest.mark.parametrize("name", ACTING)
def test_an_effect_of_size_zero_is_the_base_bit_for_bit(name: str) -> None:
    """Nothing of an absent effect is left in the loop."""
    u, x = motion()
    values = (0.0, *EFFECTS[name].typical[1:])
    assert np.array_equal(simulate(BASE.with_effect(name, values), RATE, u, x), simulate(BASE, RATE, u, x))


@pytest.mark.parametrize("name", ACTING)
def test_an_effect_fades_with_its_size(name: str) -> None:
    """A thousandth of the usual size moves the axis far less than the usual size does (saturation: a thousandfold limit)."""
    u, x = motion()
    base = simulate(BASE, RATE, u, x)
    small = EFFECTS[name].typical[0] * (1e3 if name == "saturation" else 1e-3)
    rest = EFFECTS[name].typical[1:]
    if name in ("base_resonance", "screw_compliance"):  # the pair closes only if its dampings are equal
        rest = (rest[0], rest[1], rest[1])
    if name == "stribeck_friction":
        rest = (1e-3, rest[1])
    if name == "backlash":
        pytest.skip("no gap is still two masses")
    full = simulate(BASE.with_effect(name), RATE, u, x) - base
    faint = simulate(BASE.with_effect(name, (small, *rest)), RATE, u, x) - base
    assert np.all(np.isfinite(full))
    assert np.std(full) > 1e-3 * np.std(base)
    assert np.std(faint) < 0.05 * np.std(full)


@pytest.mark.parametrize("name", ACTING)
def test_an_effect_reads_its_start_values_from_data(name: str) -> None:
    """Each of its traces is finite, of the data's length, and read into one value per parameter."""
    u, x = motion()
    effect = EFFECTS[name]
    truth = simulate(BASE.with_effect(name), RATE, u, x)
    base = simulate(BASE, RATE, u, x)
    scene = Scene(RATE, BASE.gain, BASE.pole, u[:-1], truth, x[:-1], truth - base)
    assert effect.guesses is not None
    found = list(effect.guesses(scene))
    assert found or name in ("cogging", "lead_error", "position_dependent_gain")  # these need travel
    for guess in found:
        assert guess.columns.shape[1] == truth.size
        assert np.all(np.isfinite(guess.columns))
        values = guess.read(np.full(guess.columns.shape[0], 0.1))
        assert len(values) == len(effect.parameters)
        assert np.all(np.isfinite(values))


def test_a_law_with_an_unknown_word_is_refused() -> None:
    """The error names the argument and what is known."""
    effect = EFFECTS["constant_load"]

    def force(load: float, temperature: float) -> float:
        return load * temperature

    with pytest.raises(BadInput, match=r"argument of force is 'temperature'; allowed: .*\bx\b"):
        replace(effect, functions={"force": force})


def test_an_unknown_effect_is_answered_with_the_nearest_name() -> None:
    """A typo is an error."""
    with pytest.raises(BadInput, match="coulomb_friction"):
        AxisModel(0.1, 0.0, 200.0, (("coulomb_frction", (0.1,)),))
    with pytest.raises(BadInput, match="not in the library yet"):
        STANDARD.extended([EFFECTS["cogging"]])
