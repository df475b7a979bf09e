"""The filter across a gap: its derivatives, any law of dry friction in it, and the bar for its innovations."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sysid import jit
from xy_sysid.axis.model import STANDARD, AxisModel, Library, simulate
from xy_sysid.effects import EFFECTS, Effect
from xy_sysid.effects._contract import Companions, Limits
from xy_sysid.effects.backlash import contact
from xy_sysid.effects.backlash.filter_source import NAMES
from xy_sysid.effects.backlash.innovations import Innovations, View
from xy_sysid.errors import BadInput
from xy_sysid.excitation.lockstep import drive
from xy_sysid.files.effects import from_file
from xy_sysid.greybox.free_run import AxisData, GreyboxFit, fit_base, prepare
from xy_sysid.greybox.one_step import as_companions, error_without, filter_fit, noise_of, one_step_fit
from xy_sysid.greybox.whitened import whitened_rms
from xy_sysid.settings import AxisExcitation, ExcitationSettings, build

RATE = 2000.0
BASE = (0.097, 1.29e-3, 246.0)
GAP = EFFECTS["backlash"]
OWN_LAW = '''"""Dry friction that grows with speed."""

from xy_sysid.effects import Effect, Guess, Parameter, columns, law


@law
def level(size, growth, v, direction):
    return size * (1.0 + growth * abs(v)) * (1.0 + 0.1 * direction)


def guesses(scene):
    yield Guess(columns(scene.direction()), lambda c: (max(float(c[0]), 1e-3), 1.0))


EFFECT = Effect(
    name="growing_friction",
    law="F = size (1 + growth |v|) sign(v), a tenth more forth",
    meaning="a wiper that warms up",
    validity="a test",
    source="none, for a test",
    category="friction",
    parameters=(
        Parameter("size", "V", 1e-6, 100.0, 0.2, "level at rest"),
        Parameter("growth", "s/m", 1e-3, 1e3, 5.0, "relative rise per speed"),
    ),
    shows="as Coulomb friction, more at speed",
    look_alikes=("coulomb_friction",),
    experiment="constant speeds",
    functions={"level": level},
    guesses=guesses,
)
'''


@cache
def machine(*effects: str) -> tuple[AxisData, GreyboxFit]:
    axes = {name: build(AxisExcitation, {"seed": seed}) for name, seed in (("x", 5), ("y", 6))}
    settings = build(ExcitationSettings, {"rate": RATE, "lockstep": True, "speed": 0.0, "axes": axes})
    recording = drive(with_effects(Machine.from_file("rigid.yaml", 11), effects), settings, 20.0, lambda _: None)
    data = prepare(RATE, *recording.axis("x"))
    return data, fit_base(data)


def innovations(data: AxisData, base: GreyboxFit, *laws: str, others: tuple[tuple[str, tuple[float, ...]], ...] = ()) -> Innovations:
    model = base.model
    return Innovations(
        RATE, (model.gain, model.delay, model.pole), noise_of(data), as_companions(data, STANDARD, others), tuple(EFFECTS[name] for name in laws)
    )


def test_a_contact_that_is_stiff_and_damped_does_not_run_away_in_coarse_steps() -> None:
    """It has enough explicit steps: with three per sample it would diverge from the recording."""
    data, base = machine("backlash=20e-6")
    fit = innovations(data, base, "coulomb_friction")
    inner = fit.start((base.model.gain, base.model.delay, base.model.pole), (20e-6, 0.75, 3900.0, 1.0, 100.0, 0.4, 0.0, 0.0), (0.1,))
    coarse, fine = (fit.rms(inner, View(8000, sub_steps=sub_steps)) for sub_steps in (3, 24))
    assert coarse == pytest.approx(fine, rel=0.02)


def test_starts_that_are_tried_on_all_cores_find_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parallel and sequential runs are equal bit for bit, with the same number of runs; each removes the dead zone with its own parameters."""
    data, base = machine("backlash=20e-6", "dead_zone=0.05")
    found = []
    for cores in (1, 3):
        monkeypatch.setattr(jit, "cores", partial(int, cores))
        found.append(filter_fit(data, base, GAP, [("dead_zone", (0.05,))])[1])
    one, three = found
    assert (one.base, one.values, one.companions, one.runs) == (three.base, three.values, three.companions, three.runs)
    np.testing.assert_array_equal(one.innovation, three.innovation)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("coulomb_friction", (0.1,)),
        ("stribeck_friction", (0.06, 0.08, 0.01)),
        ("asymmetric_friction", (0.1, 0.3)),
        ("presliding_hysteresis", (0.1, 12e-6, 1.5)),
    ],
)
def test_derivatives_are_those_of_the_filter(name: str, values: tuple[float, ...]) -> None:
    """Each column agrees with the effect of a small change of its number (the median sample to a quarter; at constant gain)."""
    data, base = machine("backlash=20e-6", f"{name}={values[0]}", "dead_zone=0.05")
    fit = innovations(data, base, name, others=(("dead_zone", (0.05,)),))
    view = View(8000, 1.0, 6, 12.0)
    start = fit.start((base.model.gain, base.model.delay, base.model.pole), (20e-6, 0.5, 2000.0, 0.05, 15.0, 0.05, 0.2, 0.02), values)
    every = np.arange(start.size)
    inner = fit.solved(start, every, view, 15, 1e-3)
    assert fit.rms(inner, view) < 3.0  # at this optimum contacts are followed
    slopes = fit.run(fit.outer(inner), view, True)[1][1000:]
    for place in every:
        moved = []
        for sign in (1.0, -1.0):
            there = inner.copy()
            there[place] += sign * 1e-3
            moved.append(fit.innovations(there, view)[1000:])
        if fit.low[place] + 1e-2 < inner[place] < fit.high[place] - 1e-2:
            difference = (moved[0] - moved[1]) / 2e-3
            seen = float(np.median(np.abs(difference)))
            assert np.median(np.abs(slopes[:, place] - difference)) < max(0.25 * seen, 1e-3), place  # a change below 1e-3 of the noise is not visible


def test_a_law_of_friction_from_a_user_s_file_acts_inside_the_filter(tmp_path: Path) -> None:
    """A user's law: the filter moves like the simulation, and a fit with a gap recovers its level."""
    path = tmp_path / "growing_friction.py"
    path.write_text(OWN_LAW, encoding="utf-8")
    (law,) = from_file(path)
    known = Library([GAP, EFFECTS["coulomb_friction"], law])
    assert filter_leaves(law, (0.2, 5.0)) < 0.01
    data, base = machine("backlash=30e-6", "asymmetric_friction=0.1,coulomb=0.2")
    own = replace(base, model=replace(base.model, library=known).with_effect("growing_friction", (0.1, 0.01)))
    fit = one_step_fit(data, own, GAP)
    assert [name for name, _ in fit.model.effects] == ["backlash", "growing_friction"]
    assert fit.parameter("growing_friction.size").value == pytest.approx(0.2, rel=0.1)
    assert fit.parameter("backlash.gap").value == pytest.approx(30e-6, rel=0.05)


def filter_leaves(law: Effect, values: tuple[float, ...]) -> float:
    """Relative error of the filter's speed without a gap, with a negligible weight of the encoder."""
    u = 3.0 * lfilter([0.3], [1.0, -0.7], np.random.default_rng(1).standard_normal(4001))
    velocity = simulate(AxisModel(*BASE, library=Library([law])).with_effect(law.name, values), RATE, u, np.zeros_like(u))
    position = np.concatenate(([0.0], np.cumsum(velocity))) / RATE
    none = np.zeros(0)
    nothing = Companions(none, none, none, none, none.astype(np.bool_), lambda _, n: (u[:n], position[: n + 1], np.zeros((2, n)), 1.0))
    fit = Innovations(RATE, BASE, 1e6, nothing, (law,)).with_soft_contact(10.0)
    closed = fit.start(BASE, (1e-10, 0.4, 30e3, 0.5, 0.0, 0.0, 0.0, 0.0), values)
    fit.high[NAMES.index("rate")] = closed[NAMES.index("rate")]
    out = fit.innovations(closed, View(u.size - 1, process_noise_factor=0.0, sub_steps=400)) * 1e6
    return float(np.std(np.diff(out))) * RATE / float(np.std(velocity))


def test_two_laws_of_bristles_at_once_are_refused() -> None:
    """One line that says what to leave out."""
    data, base = machine("backlash=30e-6")
    twice = replace(EFFECTS["presliding_hysteresis"], name="other_bristles")
    known = Library([GAP, EFFECTS["presliding_hysteresis"], twice])
    model = replace(base.model, library=known).with_effect("presliding_hysteresis").with_effect("other_bristles")
    with pytest.raises(BadInput, match="one of bristles at most"):
        one_step_fit(data, replace(base, model=model), GAP)


def test_the_filter_without_a_gap_is_always_there_to_be_beaten() -> None:
    """With a true gap it is far worse; without one it is as good, to a few hundredths."""
    data, base = machine("backlash=30e-6")
    fit, found = filter_fit(data, base, GAP)
    assert found.without.shape == found.innovation.shape
    assert error_without(data, found) > 5.0 * fit.held_out_error
    data, base = machine("coulomb_friction=0.2")
    fit, found = filter_fit(data, base, GAP)
    assert error_without(data, found) < 1.03 * fit.held_out_error
    assert fit.excess > 0.15


def test_a_gap_that_cannot_come_near_the_best_without_it_is_given_up_soon() -> None:
    """Compared with a simulation at the noise: fewer runs, and the result says so; the fit of a true gap is not given up."""
    data, base = machine("coulomb_friction=0.2")
    held = np.arange(data.velocity.size) >= data.training
    whole, its = filter_fit(data, base, GAP)
    early, found = filter_fit(data, base, GAP, limits=Limits(bar=noise_of(data) * RATE))
    assert found.given_up
    assert not early.converged
    assert whole.converged
    assert early.excess > 0.15
    assert found.runs < its.runs
    assert error_without(data, found) < 1.2 * error_without(data, its)
    data, base = machine("backlash=30e-6")
    bar = whitened_rms(base.error, held)
    assert not filter_fit(data, base, GAP, limits=Limits(bar=bar))[1].given_up


@pytest.mark.parametrize(("idle", "times", "given_up"), [(0.0, 100.0, False), (0.0, 0.5, True), (0.9, 0.5, True), (0.9, 100.0, False)])
def test_what_beats_the_bar_where_nobody_fitted_goes_on_even_if_the_filter_does_as_well_without_a_gap(
    idle: float, times: float, given_up: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bar applies to the held-out error. idle: 0 counts every gap as without effect; times: bar over the final innovation with the gap."""
    data, base = machine("backlash=30e-6")
    bar = times * filter_fit(data, base, GAP)[0].held_out_error
    monkeypatch.setattr(contact, "IDLE", idle)
    assert filter_fit(data, base, GAP, limits=Limits(bar=bar))[1].given_up == given_up


def test_what_was_given_up_says_nothing_of_its_numbers() -> None:
    """Their intervals are infinite."""
    data, base = machine("backlash=30e-6")
    fit, found = filter_fit(data, base, GAP, limits=Limits(bar=1e-9))
    assert found.given_up
    assert np.all(np.isinf(found.spread)) and np.all(np.isinf(found.base_spread))
    assert fit.parameter("backlash.gap").high == np.inf
