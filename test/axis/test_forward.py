"""Simulation without a measured position: the position follows from the simulated motion."""

from __future__ import annotations

import numpy as np
import pytest

from xy_sysid.axis.forward import DriveInput, move
from xy_sysid.axis.model import AxisModel, simulator
from xy_sysid.samples.block import FloatArray

RATE = 2000.0
RIGID = AxisModel(gain=0.1, delay=1.3e-3, pole=240.0)


def voltage(seconds: float, rms: float = 1.5) -> FloatArray:
    """Held noise of 20 ms."""
    return np.repeat(rms * np.random.default_rng(1).standard_normal(round(seconds * 50)), round(RATE / 50))


def driven(volts: FloatArray, centring: float = 0.0, limit: float = 10.0, start: float = 0.0) -> DriveInput:
    return DriveInput(voltage=volts, pull=np.full(volts.size, centring), limit=limit, seen=40, start=start)


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("coulomb_friction", (0.2,)),
        ("cogging", (0.15, 2.5e-3, 0.3)),
        ("lead_error", (8e-6, 0.01, 0.3)),
        ("saturation", (1.0,)),
        ("return_spring", None),
    ],
)
def test_it_moves_as_the_simulation_at_the_position_that_comes_out(effect: str, values: tuple[float, ...] | None) -> None:
    """The same model explains the simulated recording to a thousandth of the motion, the assumed accuracy of laws."""
    model = RIGID.with_effect(effect, values)
    found = move(model, RATE, driven(voltage(2.0), start=0.01))
    again = simulator(model.library, [effect], RATE, found.voltage, found.position)(model.row)
    speed = np.diff(found.position) * RATE
    assert float(np.std(again - speed)) < 1e-3 * float(np.std(speed))
    assert found.position[0] == 0.01


def test_the_pull_brings_it_back_and_the_limit_holds() -> None:
    """Under a constant voltage the axis rests where the centring balances it; no sample exceeds the limit."""
    push = np.full(round(10.0 * RATE), 0.5)
    found = move(RIGID, RATE, driven(push, centring=50.0))
    assert found.position[-1] == pytest.approx(0.5 / 50.0, rel=1e-3)
    clipped = move(RIGID, RATE, driven(voltage(1.0, 5.0), limit=2.0))
    assert float(np.max(np.abs(clipped.voltage))) == 2.0
