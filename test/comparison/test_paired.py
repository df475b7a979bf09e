"""Which of two models is better: a paired test on held-out data."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from helpers.simulated import recorded

from xy_sysid.axis.model import AxisModel, simulate
from xy_sysid.comparison.which_is_better import Paired, paired
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

RATE = 2000.0
TRUE = AxisModel(0.097, 1.29e-3, 246.0)


@cache
def friction() -> tuple[FloatArray, FloatArray]:
    u, y = recorded("x:coulomb_friction", seconds=30.0).axis("x")
    return u, y


def compared(before: AxisModel, after: AxisModel) -> Paired:
    u, y = friction()
    return paired(simulate(before, RATE, u, y), simulate(after, RATE, u, y), y, RATE)


def test_friction_in_the_model_is_better_where_friction_acts() -> None:
    """Low frequencies most, certain, with an interval; the reverse is as much worse."""
    rough, right = AxisModel(0.0953, 1.29e-3, 350.0), TRUE.with_effect("coulomb_friction", (0.2,))
    found = compared(rough, right)
    assert found.better is True and found.p < 1e-6
    assert found.ratio < 0.2 and found.low < found.ratio < found.high
    assert found.after < 1.2 * found.noise_floor < 0.2 * found.before
    assert found.changes[0].low == 0.0 and found.changes[0].better
    back = compared(right, rough)
    assert back.better is False and back.ratio == pytest.approx(1.0 / found.ratio)
    assert "after is better" in found.sentence and "after is worse" in back.sentence


def test_no_difference_is_no_difference() -> None:
    """The same model, and one with a negligible difference."""
    right = TRUE.with_effect("coulomb_friction", (0.2,))
    same = compared(right, right)
    assert same.better is None and same.ratio == 1.0 and same.changes == ()
    near = compared(right, TRUE.with_effect("coulomb_friction", (0.20001,)))
    assert near.better is None and near.changes == ()


def test_noise_alone_is_hardly_ever_called_a_change() -> None:
    """Two models whose errors differ only by chance: in 40 tries at most a few verdicts, and few bands."""
    random = np.random.default_rng(3)
    verdicts, changes = 0, 0
    for _ in range(40):
        position = np.cumsum(random.standard_normal(20_001)) * 1e-4
        velocity = np.diff(position) * RATE
        one, other = (velocity + 1e-3 * random.standard_normal(velocity.size) for _ in range(2))
        found = paired(one, other, position, RATE)
        verdicts += found.better is not None
        changes += bool(found.changes)
    assert verdicts <= 3 and changes <= 5


def test_too_little_data_is_refused() -> None:
    """A t-test over two windows would be meaningless."""
    y = np.cumsum(np.random.default_rng(0).standard_normal(600))
    with pytest.raises(BadInput, match="unseen data is"):
        paired(np.zeros(599), np.zeros(599), y, RATE)
    with pytest.raises(BadInput, match="length of the simulations"):
        paired(np.zeros(598), np.zeros(598), y, RATE)
