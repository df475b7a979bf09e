"""The numbers for an ODrive, compared with a simulation of its controller: turns, N m, 8 kHz, and its encoder estimator."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pytest
from helpers.known_models import DELAY, GAIN, POLE, known

from xy_sysid.axis.model import AxisModel
from xy_sysid.control_design.exports import Exported, export
from xy_sysid.control_design.feedback import GAIN_MARGIN, PHASE_MARGIN
from xy_sysid.control_design.uncertain import samples
from xy_sysid.control_design.use import use
from xy_sysid.units import Units

PERIOD = 125e-6  # s
TURN = 2.0 * math.pi  # rad
UNITS = Units("N m", "rad")
LATE = round(DELAY / PERIOD) + 1  # cycles of delay: of the axis, and one until the torque is written


@dataclass
class Odrive:
    """One cycle of the firmware: encoder estimator, then position and velocity controller."""

    encoder_bandwidth: float
    pos_gain: float
    vel_gain: float
    vel_integrator_gain: float
    pos: float = 0.0
    vel: float = 0.0
    held: float = 0.0

    def cycle(self, wanted: float, turns: float) -> float:
        """Torque in N m for an encoder reading in turns."""
        self.pos += PERIOD * self.vel
        off = turns - self.pos
        self.pos += PERIOD * 2.0 * self.encoder_bandwidth * off
        self.vel += PERIOD * self.encoder_bandwidth**2 * off
        error = self.pos_gain * (wanted - self.pos) - self.vel
        torque = self.vel_gain * error + self.held
        self.held += PERIOD * self.vel_integrator_gain * error
        return torque


@pytest.fixture(scope="module")
def written() -> Exported:
    return export(use(known(units=UNITS, delay=0.05), rate=2000.0), "odrive")


def numbers(written: Exported) -> dict[str, float]:
    (text,) = written.files.values()
    found = {name: float(value) for name, value in re.findall(r"odrv0\.axis0\.(?:\w+\.)*(\w+) = ([-\d.e+]+)", text)}
    found.pop("inertia")
    return found


def told(written: Exported) -> tuple[float, float, float]:
    """Crossover, Hz, phase margin, degrees, and gain margin, from the note."""
    found = re.search(r"Crossover ([\d.]+) Hz; .*phase margin ([\d.]+) degrees, gain margin ([\d.]+\d)", written.note)
    assert found is not None
    return float(found[1]), float(found[2]), float(found[3])


def response(own: dict[str, float], hertz: float) -> complex:
    """Frequency response of the running controller, N m per turn, for a sine of the encoder, with the path at 0."""
    drive, w = Odrive(**own), TURN * hertz
    whole = round(1.0 / (hertz * PERIOD)) * 20
    times = np.arange(3 * whole) * PERIOD
    torque = np.array([drive.cycle(0.0, math.sin(w * at)) for at in times])[-whole:]
    wave = np.exp(-1j * w * times[-whole:])
    columns = np.column_stack((wave.real, wave.imag, np.ones(whole)))
    cosine, sine, _ = np.linalg.lstsq(columns, torque, rcond=None)[0]
    return complex(cosine, sine) / -1j * -1.0  # torque = Re((cosine + j sine) e^jwt), the encoder Re(-j e^jwt); the error is minus the encoder


def margins(controller: Mapping[float, complex], model: AxisModel) -> tuple[float, float, float]:
    """Crossover, Hz, phase margin, degrees, and gain margin of an axis with a hold of one cycle and output in the next, by frequency."""
    hertz = np.array(list(controller))
    s = 2j * np.pi * hertz
    axis = model.gain * model.pole / (s * (s + model.pole)) / TURN * np.exp(-s * (model.delay + 1.5 * PERIOD))
    size, turn = np.log(np.abs(axis * np.array(list(controller.values())))), np.unwrap(np.angle(axis * np.array(list(controller.values()))))
    crossover = float(np.interp(0.0, -size, hertz))
    phase = 180.0 + math.degrees(float(np.interp(crossover, hertz, turn)))
    return crossover, phase, math.exp(-float(np.interp(math.pi, -turn, size)))


def settles(own: Mapping[str, float], factor: float) -> bool:
    """True if the axis comes to rest after a step of a thousandth of a turn, with both gains of the velocity loop multiplied."""
    drive = Odrive(**{**own, **{name: factor * own[name] for name in ("vel_gain", "vel_integrator_gain")}})
    keeps, fed = math.exp(-POLE * PERIOD), GAIN / TURN
    angle = speed = 0.0
    waiting = [0.0] * LATE
    off = []
    for _ in range(16000):
        waiting.append(drive.cycle(1e-3, angle))
        settled = fed * waiting.pop(0)
        angle += settled * PERIOD + (speed - settled) * (1.0 - keeps) / POLE
        speed = settled + (speed - settled) * keeps
        off.append(abs(angle - 1e-3))
    return bool(max(off[8000:]) < 0.1 * max(off[:8000]))


def test_every_sample_keeps_the_margins_that_are_told_under_odrives_own_controller(written: Exported) -> None:
    """The frequency response of the running controller, with its estimator, gives the crossover, phase and gain margin of the note."""
    controller = {float(hertz): response(numbers(written), float(hertz)) for hertz in np.geomspace(20.0, 300.0, 40)}
    model = known(units=UNITS, delay=0.05)
    found = np.array([margins(controller, item) for item in samples(model, 24)])
    crossover, phase, gain = told(written)
    assert found[0, 0] == pytest.approx(crossover, rel=0.02)
    assert found[:, 1].min() == pytest.approx(phase, abs=1.5) and phase >= PHASE_MARGIN
    assert found[:, 2].min() == pytest.approx(gain, rel=0.03) and gain >= GAIN_MARGIN


def test_the_loop_is_stable_up_to_its_gain_margin_and_no_further(written: Exported) -> None:
    """The closed loop in turns and N m: 5 % below the gain margin of the model the axis comes to rest, 5 % above it does not."""
    own = numbers(written)
    controller = {float(hertz): response(own, float(hertz)) for hertz in np.geomspace(20.0, 300.0, 40)}
    model = replace(known(units=UNITS).model, delay=(LATE - 1) * PERIOD)
    _, _, gain = margins(controller, model)
    assert gain > GAIN_MARGIN and settles(own, 1.0) and settles(own, 0.95 * gain) and not settles(own, 1.05 * gain)
