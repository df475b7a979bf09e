"""The fraction that one-step prediction explains, above the noise."""

from __future__ import annotations

from dataclasses import replace
from math import exp

import numpy as np
import pytest

from xy_sysid.axis.model import AxisModel
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.hypotheses.companions import size_ahead
from xy_sysid.hypotheses.criteria import SIZE, TELLS
from xy_sysid.hypotheses.one_step import OneStepResult

NOISE = 1e-3  # m/s


def ahead(error: float) -> GreyboxFit:
    """A fit with this one-step error, m/s."""
    nothing = np.empty(0)
    fit = GreyboxFit(
        model=AxisModel(0.1, 1e-3, 250.0),
        parameters=(),
        training_error=error,
        held_out_error=error,
        noise_floor=NOISE,
        excess=0.0,
        scores=nothing,
        forced=1.0,
        force=0.0,
        simulated=nothing,
        error=nothing,
        runs=1,
        converged=True,
        held_out_powers=np.empty((0, 0)),
    )
    return replace(fit, one_step=True)


def test_what_is_gone_counts_over_what_is_left_beyond_the_noise() -> None:
    """From two times the noise power above the noise to one time: half is explained."""
    assert size_ahead(NOISE * 3.0**0.5, NOISE * 2.0**0.5, NOISE) == pytest.approx(1.0)
    assert size_ahead(NOISE, NOISE * 2.0**0.5, NOISE) == pytest.approx(-1.0)


@pytest.mark.parametrize(("bar", "without"), [(1.9, 9.0), (9.0, 1.9)])
def test_a_gap_wins_by_what_it_explains_beyond_the_noise(bar: float, without: float) -> None:
    """Compared with the better of the two without a gap; a named effect must explain this fraction, as in a simulation."""
    last = (1.0 + (1.9**2 - 1.0) / (1.0 + SIZE)) ** 0.5
    assert OneStepResult((("backlash", ahead(0.99 * last * NOISE)),), bar * NOISE, without * NOISE).is_accepted
    assert not OneStepResult((("backlash", ahead(1.01 * last * NOISE)),), bar * NOISE, without * NOISE).is_accepted


def test_a_gap_does_not_win_by_what_nobody_can_tell() -> None:
    """At the noise, the smallest gain is many times the residual above it."""
    best = ahead(1.0001 * NOISE)
    little = OneStepResult((("backlash", best),), 9.0 * NOISE, 1.02 * best.held_out_error)
    assert little.size > SIZE and not little.is_accepted
    assert replace(little, without=1.01 * exp(0.5 * TELLS) * best.held_out_error).is_accepted
