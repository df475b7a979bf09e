"""Every effect of the folder is complete, states its validity, and has no influence at size zero."""

from __future__ import annotations

import ast
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from xy_sysid.axis.model import STANDARD, AxisModel, simulate
from xy_sysid.effects import EFFECTS, Guess, Scene
from xy_sysid.effects._contract import FUNCTIONS, WORDS
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

RATE = 2000.0
PACKAGE = Path(__file__).parents[2] / "xy_sysid"
RELATIONS = ("look_alikes", "suspects", "special_of", "sum_of", "start_friction", "masks")  # fields of an effect that may name other effects


def names(text: str) -> list[str]:
    """The words of a table."""
    return text.split()


BASE = AxisModel(0.097, 1.29e-3, 246.0)
NAMES = names("""time_delay viscous_friction coulomb_friction stribeck_friction presliding_hysteresis asymmetric_friction
constant_load dead_zone saturation amplifier_lag backlash cogging lead_error screw_compliance base_resonance
load_side_resonance hardening_stiffness gain_drift position_dependent_gain asymmetric_viscous_friction gravity return_spring
position_dependent_drag quadratic_drag load_dependent_friction""")
ACTING = [name for name in EFFECTS if EFFECTS[name].category != "base"]


@cache
def motion(n: int = 8001) -> tuple[FloatArray, FloatArray]:
    """Band noise of 1 V rms, and a related position, (n,) each."""
    u = sosfilt(butter(4, 300, fs=RATE, output="sos"), np.random.default_rng(0).standard_normal(n))
    u = np.asarray(u / u.std())
    x = np.concatenate(([0.0], np.cumsum(simulate(BASE, RATE, u, np.zeros(n))) / RATE))
    return u, x


def test_the_folder_holds_the_promised_effects() -> None:
    """The names of the design, each once."""
    assert sorted(EFFECTS) == sorted(NAMES)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_says_everything_about_itself(name: str) -> None:
    """Law, meaning, validity, source, signs in data, existing look-alikes, an experiment, parameters in order."""
    effect = EFFECTS[name]
    assert effect.name == name
    for text in (effect.law, effect.meaning, effect.validity, effect.source, effect.shows, effect.experiment):
        assert len(text) >= 6
        assert "\n" not in text
    assert effect.look_alikes
    assert set(effect.look_alikes) <= set(EFFECTS) - {name}
    assert {*effect.suspects, *effect.masks} <= set(EFFECTS) - {name}
    assert effect.suspects or effect.simulable or effect.category == "base"  # otherwise it would never be used
    assert bool(effect.mode_frequency) == (effect.category == "motion")
    assert not effect.mode_frequency or dict(zip(effect.names, effect.parameters, strict=True))[effect.mode_frequency].unit == "Hz"
    assert sorted(effect.functions) == sorted(FUNCTIONS[effect.category])
    for parameter in effect.parameters:
        assert parameter.name.isidentifier()
        assert parameter.name not in WORDS or effect.category == "base"
        assert parameter.meaning
        assert parameter.unit or parameter.name in ("asymmetry", "split", "damping", "pole_damping", "hertz", "depth", "share", "guide")
        assert parameter.low < parameter.high
        assert parameter.low <= parameter.typical <= parameter.high
        assert not parameter.positive or parameter.low > 0


def test_no_effect_is_named_in_code_outside_its_own_file() -> None:
    """One effect, one file or folder: elsewhere its name is only in relation fields of other effects, and in texts."""
    found = {str(path.relative_to(PACKAGE)): names for path in sorted(PACKAGE.rglob("*.py")) if (names := effects_named_in(path))}
    assert not found, f"{found}: use what an effect says of itself (category, family, a field)"


def effects_named_in(path: Path) -> list[str]:
    """Places in the package's files that name effects of other files."""
    place = path.relative_to(PACKAGE)
    own = place.parts[1].removesuffix(".py") if place.parts[0] == "effects" else ""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    related = [item.value for item in ast.walk(tree) if isinstance(item, ast.keyword) and item.arg in RELATIONS and own in EFFECTS]
    allowed = {id(node) for value in related for node in ast.walk(value)}
    named = [
        f"line {node.lineno}: {node.value}"
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant)
        and isinstance(node.value, str)
        and id(node) not in allowed
        and node.value.partition(".")[0] in {*EFFECTS} - {own}
    ]
    imports = [item for item in ast.walk(tree) if isinstance(item, ast.ImportFrom) and str(item.module).startswith("xy_sysid.effects")]
    taken = {part for item in imports for part in (*str(item.module).split(".")[2:3], *(alias.name for alias in item.names))}
    return named + sorted(taken & ({*EFFECTS} - {own}))


def test_the_folder_tells_effects_from_tools_by_their_names() -> None:
    """Names with a leading underscore are tools; everything else is one effect, named like its file or folder."""
    there = {path.stem for path in (PACKAGE / "effects").iterdir() if path.suffix == ".py" or (path / "__init__.py").is_file()}
    assert {name for name in there if not name.startswith("_")} == set(EFFECTS)


@pytest.mark.parametrize("name", ACTING)
def test_an_effect_of_size_zero_is_the_base_bit_for_bit(name: str) -> None:
    """An absent effect has no influence in the loop."""
    u, x = motion()
    values = (0.0, *EFFECTS[name].typical[1:])
    assert np.array_equal(simulate(BASE.with_effect(name, values), RATE, u, x), simulate(BASE, RATE, u, x))


@pytest.mark.parametrize("name", ACTING)
def test_an_effect_fades_with_its_size(name: str) -> None:
    """A thousandth of the typical size changes the motion far less than the typical size (for a limit or a frequency, a thousand times the size)."""
    effect = EFFECTS[name]
    if not effect.simulable:
        pytest.skip("free simulation does not judge it: without a gap there are still two masses")
    u, x = motion()
    base = simulate(BASE, RATE, u, x)
    volts = [k == 0 or (effect.category == "friction" and item.unit == "V") for k, item in enumerate(effect.parameters)]
    small = [value * (1e-3 if scaled else 1.0) for value, scaled in zip(effect.typical, volts, strict=True)]
    if effect.mode_frequency:  # the pair closes only if its dampings are equal
        damping = [k for k, item in enumerate(effect.parameters) if k and item.name != effect.mode_frequency]
        small = [small[damping[0]] if k in damping else value for k, value in enumerate(small)]
    full = simulate(BASE.with_effect(name), RATE, u, x) - base
    assert np.all(np.isfinite(full))
    assert np.std(full) > 1e-3 * np.std(base)
    grows = effect.category == "input" or effect.mode_frequency == effect.names[0]
    ways = [small, [effect.typical[0] * 1e3, *small[1:]]] if grows else [small]
    assert min(float(np.std(simulate(BASE.with_effect(name, tuple(values)), RATE, u, x) - base)) for values in ways) < 0.05 * np.std(full)


@pytest.mark.parametrize("name", ACTING)
def test_an_effect_reads_its_start_values_from_data(name: str) -> None:
    """Each of its traces is finite, has the data's length, and gives one value per parameter; a moving axis has some."""
    u, x = motion()
    effect = EFFECTS[name]
    truth = simulate(BASE.with_effect(name), RATE, u, x)
    base = simulate(BASE, RATE, u, x)
    assert effect.guesses is not None
    near, far = (list(effect.guesses(Scene(RATE, BASE.gain, BASE.pole, u[:-1], truth, place * x[:-1], truth - base))) for place in (1.0, 100.0))
    assert far
    for guess in (*near, *far):
        assert guess.columns.shape[1] == truth.size
        assert np.all(np.isfinite(guess.columns))
        values = guess.read(np.full(guess.columns.shape[0], 0.1))
        assert len(values) == len(effect.parameters)
        assert np.all(np.isfinite(values))


@pytest.mark.parametrize(("samples", "asked"), [(1000, 1), (2**16 + 1, 2)])
def test_what_an_effect_guesses_of_a_short_scene_is_worked_out_once(samples: int, asked: int) -> None:
    """For a long scene they would need too much memory."""
    calls: list[Scene] = []

    def guesses(scene: Scene) -> list[Guess]:
        calls.append(scene)
        return [Guess(np.ones((1, samples)), lambda c: (1.0,))]

    effect, still = replace(EFFECTS["constant_load"], guesses=guesses), np.zeros(samples)
    scene = Scene(RATE, BASE.gain, BASE.pole, still, still, still, still)
    assert len(effect.guessed(scene)) == len(effect.guessed(scene)) == 1
    assert len(calls) == asked


def test_a_weight_is_not_looked_for_where_it_is_a_load_and_a_spring() -> None:
    """Less than half a radian of travel, or a linear axis: no trace, so that simpler laws are named."""
    u, x = motion()
    still = np.zeros(u.size - 1)
    for reach, traces in ((0.4, 0), (0.6, 1)):
        scene = Scene(RATE, BASE.gain, BASE.pole, u[:-1], still, np.linspace(2.0, 2.0 + reach, x.size - 1), still)
        guesses = EFFECTS["gravity"].guesses
        assert guesses is not None and len(list(guesses(scene))) == traces


def test_friction_that_holds_only_with_a_drive_is_not_counted_as_dry_friction() -> None:
    """Every machine has dry friction, but not one that grows with the input."""
    assert {name for name in ACTING if EFFECTS[name].is_of_the_input} == {"load_dependent_friction"}
    dry = {"coulomb_friction", "stribeck_friction", "asymmetric_friction", "presliding_hysteresis"}
    assert {name for name in ACTING if EFFECTS[name].is_dry} == dry


def test_a_frequency_that_is_no_parameter_is_refused() -> None:
    """The error lists the existing ones."""
    with pytest.raises(BadInput, match="mode_frequency is 'resonance'; allowed: split, frequency, damping, pole_damping"):
        replace(EFFECTS["base_resonance"], mode_frequency="resonance")


def test_what_is_fitted_as_a_logarithm_is_one_and_the_same_in_every_recording() -> None:
    """Values per recording differ by a sum, which a logarithm cannot represent."""
    effect = EFFECTS["coulomb_friction"]
    with pytest.raises(BadInput, match="per_recording is of a positive parameter"):
        replace(effect, parameters=tuple(replace(item, per_recording=True) for item in effect.parameters))


def test_a_force_that_is_no_straight_line_of_speed_is_not_taken_for_one() -> None:
    """It would be simulated without sub-steps, and wrongly."""

    def square(load: float, v: float) -> float:
        return load * v * abs(v)

    def placed(load: float, v: float, x: float) -> float:
        return load * v * x

    load = EFFECTS["constant_load"]
    for law in (square, placed):
        curved = replace(load, functions={"force": law})
        with pytest.raises(BadInput, match="straight is of another law; allowed: a force in proportion to v alone"):
            replace(curved, straight=True)
    with pytest.raises(BadInput, match="straight is of another law"):
        replace(EFFECTS["coulomb_friction"], straight=True)


def test_a_law_with_an_unknown_word_is_refused() -> None:
    """The error names the argument and the known ones."""
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
