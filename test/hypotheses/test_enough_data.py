"""Whether recordings suffice for a diagnosis."""

from __future__ import annotations

import numpy as np

from xy_sysid.axis.forward import DriveInput, move
from xy_sysid.axis.model import AxisModel
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.hypotheses.enough_data import prepared
from xy_sysid.samples.block import FloatArray

RATE = 100.0
RANDOM = np.random.default_rng(1)


def recorded(voltage: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Voltage, and position of a joint behind an encoder of 0.1 mrad."""
    drive = DriveInput(voltage=voltage, pull=np.zeros_like(voltage), limit=10.0, seen=1, start=0.0)
    position = move(AxisModel(3.0, 5e-3, 40.0), RATE, drive).position
    return voltage, np.round((position + 1e-4 * RANDOM.standard_normal(voltage.size)) / 1e-4) * 1e-4


def test_another_recording_never_makes_the_data_too_few() -> None:
    """Noise suffices. Together with a motion at two constant speeds the windows are longer, and most hold no change of speed."""
    noise = recorded(0.2 * RANDOM.standard_normal(1200))
    steady = recorded(0.02 * np.repeat([1.0, -1.0], 800))
    assert isinstance(prepared(RATE, [noise]), AxisData)
    assert isinstance(prepared(RATE, [noise, steady]), AxisData)


def test_recordings_that_lack_the_same_do_not_suffice_together() -> None:
    """Two slow sines are one tone, as each of them is."""
    time = np.arange(1600) / RATE
    sine = recorded(0.36 * np.sin(2.0 * np.pi * time / 16.0))
    assert "one tone" in str(prepared(RATE, [sine, sine]))
