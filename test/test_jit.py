"""Compiling to machine code happens once on each computer. The budget of a search does not count the time for it."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from helpers.foreign import Joint, driven

from xy_sysid.diagnosis import refine as search
from xy_sysid.greybox.axis_data import prepare
from xy_sysid.jit import spent_compiling


def test_what_compiling_takes_is_told() -> None:
    """Compiling a function that is not cached adds to it; a second call adds nothing."""
    before = spent_compiling()
    twice = numba.njit(lambda x: x + x)
    assert twice(np.float64(2.0)) == 4.0
    once = spent_compiling()
    assert once > before
    assert twice(np.float64(3.0)) == 6.0
    assert spent_compiling() == once


def test_a_budget_does_not_count_what_compiling_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that runs only during compilation never ends a search: the first answer on a new computer is as complete as the second."""
    clock = [0.0]

    def compiling() -> float:
        clock[0] += 1.0  # each reading advances by a second
        return clock[0]

    monkeypatch.setattr(search, "spent_compiling", compiling)
    joint = Joint(fs=1000.0, seconds=20.0, count=1e-6, mass=0.1, drag=10.0, coulomb=0.2, shake=1.0, band=(0.5, 60.0))
    found = search.refine(prepare(joint.fs, *driven(joint, 1)), effort=search.Effort(budget=10.0, clock=lambda: clock[0] + 1.0))
    assert not found.stopped
    assert found.effects == ("coulomb_friction",)
