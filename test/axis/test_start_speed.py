"""A recording cut from a longer one begins in motion: its start speed, and the simulation from it."""

from __future__ import annotations

import numpy as np
import pytest

from xy_sysid.axis.model import AxisModel, simulate, start_of
from xy_sysid.axis.start_speed import start_speed

RATE = 1000.0
SLOW = AxisModel(0.5, 1e-3, 2.0)  # the start speed decays only after seconds


def moved(model: AxisModel, seconds: float = 20.0) -> tuple[np.ndarray, np.ndarray]:
    """(n,) a drive of slow noise, and the position from rest, with an encoder of 0.1 um."""
    random = np.random.default_rng(7)
    u = np.convolve(random.standard_normal(int(seconds * RATE) + 1), np.full(40, 40.0**-0.5), "same")
    x = np.concatenate(([0.0], np.cumsum(simulate(model, RATE, u, np.zeros_like(u))) / RATE))
    return u, np.round(x / 1e-7) * 1e-7


@pytest.mark.parametrize("seed", range(8))
def test_the_speed_of_the_first_sample_is_known_as_well_as_is_said(seed: int) -> None:
    """A constant speed, a changing one, and zero, with encoder noise."""
    time, noise = np.arange(400) / RATE, 1e-6 * np.random.default_rng(seed).standard_normal(400)
    for speed, acceleration in ((0.05, 0.0), (-0.2, 3.0), (0.0, 0.0)):
        found, doubt = start_speed(RATE, 0.3 + speed * time + 0.5 * acceleration * time**2 + noise)
        assert abs(found - speed) < 4.0 * doubt
        assert doubt < 0.1 * abs(speed) + 3e-3  # noise of 1 um read at 1 kHz


def test_what_starts_from_rest_is_not_said_to_move() -> None:
    """At any acceleration: under a constant force, and under a growing one."""
    time = np.arange(400) / RATE
    for way in (0.5 * 8.0 * time**2, 100.0 * time**3, 0.0 * time):
        found, doubt = start_speed(RATE, way)
        assert abs(found) <= 3.0 * doubt


@pytest.mark.parametrize(
    ("model", "part"),
    [(SLOW, 0.1), (SLOW.with_effect("coulomb_friction", (0.05,)), 0.1), (SLOW.with_effect("base_resonance", (0.2, 25.0, 0.03, 0.03)), 0.2)],
    ids=["rigid", "dry friction", "on its feet"],
)
def test_a_model_goes_on_where_a_cut_recording_begins(model: AxisModel, part: float) -> None:
    """As in the full recording; from rest it would be wrong for seconds. The initial oscillation of a base is not known."""
    u, x = moved(model)
    whole = np.diff(x) * RATE
    for cut in (3333, 6000, 9001):
        rest = simulate(model, RATE, u[cut:], np.full_like(u[cut:], x[cut]))
        found = simulate(model, RATE, u[cut:], x[cut:])
        wrong, left = (float(np.sqrt(np.mean((one - whole[cut:])[:2000] ** 2))) for one in (rest, found))
        assert left < part * wrong, (cut, wrong, left)


def test_a_model_from_rest_begins_at_rest() -> None:
    """Exactly: no answer about a recording that begins there has changed."""
    u, x = moved(SLOW)
    assert start_of(SLOW, RATE, u, x) == 0.0
