"""By default the orders of a fit are chosen from the data."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.fitting_cases import LINES, function, held, paper_machine, response_of
from helpers.real_data import data

import xy_sysid as xy
from xy_sysid.fitting import Structure, choose_orders, identify
from xy_sysid.fitting.choose_orders import MOST_POLES, Choice, choose, stands
from xy_sysid.fitting.structure import FitOptions
from xy_sysid.fitting.verdicts import validate
from xy_sysid.front_door.simulated_recording import simulate
from xy_sysid.linear.simulate import held_response
from xy_sysid.linear.transfer_function import TransferFunction


def orders(found: Choice) -> tuple[int, int]:
    """Of numerator and denominator."""
    return found.fit.structure.numerator_order, found.fit.structure.denominator_order


def two_resonances(zero_at: float = 120.0) -> TransferFunction:
    """The paper's machine with a second pair, its zero at ``zero_at`` Hz and its pole at 150 Hz."""
    one, zero, pole = paper_machine(), 2 * np.pi * zero_at, 2 * np.pi * 150.0
    numerator = np.polymul(one.numerator, (pole / zero) ** 2 * np.array([1.0, 2 * 0.03 * zero, zero**2]))
    return function(numerator, np.polymul(one.denominator, [1.0, 2 * 0.03 * pole, pole**2]), one.delay)


@pytest.mark.parametrize(
    ("machine", "wanted"),
    [
        (function([20.0], [1.0, 240.0, 0.0], 1e-3), (0, 2)),
        (function([0.1], [1.0, 0.0], 1e-3), (0, 1)),
        (paper_machine(), (2, 4)),
        (two_resonances(), (4, 6)),
    ],
    ids=["rigid", "integrator", "one resonance", "two resonances"],
)
def test_simulated_machines_get_their_own_orders(machine: TransferFunction, wanted: tuple[int, int]) -> None:
    """From an integrator with delay up to two resonances, with a verdict that gives the reason; no orders are tested twice."""
    seen = held(machine, 0.01, seed=3)
    found = choose(seen, Structure())
    assert orders(found) == wanted
    checked = validate(found.fit, seen, choice=found)
    assert f"Orders {wanted[0]}/{wanted[1]}, chosen from the data" in next(item.sentence for item in checked.verdicts if item.name == "order")
    assert checked.ok


@pytest.mark.parametrize(
    ("machine", "before", "noise", "later", "wanted", "same"),
    [
        (paper_machine(), paper_machine(), 0.035, 0.025, (2, 4), True),
        (two_resonances(), two_resonances(), 0.035, 0.025, (4, 6), True),
        (two_resonances(145.5), two_resonances(145.5), 0.1, 0.01, (4, 6), False),
        (paper_machine(), two_resonances(), 0.01, 0.01, (2, 4), False),
    ],
    ids=["one resonance", "two resonances", "a second one appears in more data", "the second one is gone"],
)
def test_a_choice_stands_while_a_new_search_would_repeat_it(
    machine: TransferFunction, before: TransferFunction, noise: float, later: float, wanted: tuple[int, int], same: bool
) -> None:
    """The orders are searched again only if the new data ask for others; then the search finds these."""
    first = choose(held(before, noise, seed=3), Structure(), thorough=False)
    seen, options = held(machine, later, seed=4), FitOptions(relative_change=1e-6)
    now = identify(seen, first.fit.structure, first.fit.tf, options, doubt=False)
    assert stands(seen, first, now, options) == same == (orders(first) == wanted)
    assert orders(choose(seen, Structure(), thorough=False)) == wanted


def test_misfit_that_no_pole_explains_buys_no_orders() -> None:
    """A response distorted by friction, ten times above its noise: the resonance is found, but the cost never reaches that of noise."""
    bent = held_response(paper_machine(), LINES, 2000.0) * (1.0 + 0.1 / (1.0 + (LINES / 3.0) ** 2) + 0.02 * np.sin(LINES / 40.0))
    found = choose(response_of(bent, 0.002, seed=4), Structure())
    assert orders(found) == (2, 4)
    assert not found.fit.consistent
    assert found.fit.interval("resonance_1.frequency").value == pytest.approx(47.0, abs=0.3)


def test_friction_beside_a_resonance_leaves_the_orders_as_they_are() -> None:
    """Coulomb friction on the paper's machine: one resonance; on a rigid table: none."""
    for machine, wanted in (("rigid.yaml", (0, 2)), ("paper.yaml", (2, 4))):
        model = xy.fit(xy.frf(simulate(20.0, effects=["coulomb_friction"], machine=machine).run("x")))
        assert model.fit is not None
        assert (model.fit.structure.numerator_order, model.fit.structure.denominator_order) == wanted


def test_few_lines_buy_few_orders() -> None:
    """Eight lines of a machine with a resonance: a rigid body, since richer orders have fewer than four numbers for each parameter."""
    few = held(paper_machine(), 0.01, seed=3).select(slice(60, 120, 8))
    assert orders(choose(few, Structure())) in ((0, 1), (0, 2))


def test_a_choice_does_not_stand_where_a_tried_structure_has_too_few_lines() -> None:
    """Its loss cannot be shown again, so the orders are searched anew; no error ends the fit."""
    seen = held(paper_machine(), 0.03, seed=3)
    first, options = choose(seen, Structure(), thorough=False), FitOptions(relative_change=1e-6)
    assert stands(seen, first, first.fit, options)
    few = seen.select(slice(60, 120, 30))
    assert not stands(few, first, first.fit, options)


@pytest.mark.parametrize(
    ("path", "hold", "wanted", "frequency"),
    [
        ("two_inertia_bench/multisineA.npz", "none", (2, 4), 76.2),
        ("two_inertia_bench/multisineB.npz", "none", (2, 4), 76.2),
        ("lsb250/lsb250_exp1.npz", "zoh", (2, 4), 13.5),
        ("lsb250/lsb250_exp2.npz", "zoh", (2, 4), 13.5),
        ("crane/crane_1.npz", "zoh", (0, 1), None),
        ("hsm150/hsm_pos_0.06_1.npz", "zoh", (0, 2), None),
        ("emps/emps_train.npz", "zoh", (0, 2), None),
    ],
)
def test_real_machines_get_no_more_than_they_show(path: str, hold: str, wanted: tuple[int, int], frequency: float | None) -> None:
    """One resonance for the bench and for the guide, none for the others, though no cost comes near that of noise."""
    model = xy.fit(xy.frf(xy.load(data(path)), hold=hold), hold=hold)
    assert model.fit is not None
    assert (model.fit.structure.numerator_order, model.fit.structure.denominator_order) == wanted
    if frequency is not None:
        assert model.fit.interval("resonance_1.frequency").value == pytest.approx(frequency, rel=0.03)


def test_orders_that_no_fit_takes_are_not_tried() -> None:
    """From eight zeros and ten poles, four more of each exceed the limits of a fit: they are not tested, and no hint suggests lower orders."""
    frf = held(two_resonances(), 0.01, seed=3)
    richest = identify(frf, Structure(numerator_order=8, denominator_order=10))
    assert all(step.fit.structure.free_order <= MOST_POLES for step in choose_orders._steps(frf, richest))
