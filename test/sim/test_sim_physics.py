"""Each part alone: no influence of the inner step, no gain of energy, and linear parts agree with their truth."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import butter, sosfilt, tf2ss

from xy_sim.machine import Machine
from xy_sim.parts import PARTS
from xy_sysid.samples.block import FloatArray

TENTH_OF_A_COUNT = 0.05e-6
EXACT = [name for name, part in PARTS.items() if part.group != "imperfection"]  # dirt: test_sim_imperfections.py
SIZES: dict[str, object] = {"base_loosening": {"start": 0.5}}  # otherwise it would begin after the test
LINEAR = ["paper", "amplifier_lag", "screw_compliance", "viscous_friction", "constant_stiffness", "attached_mass", "on_table", "time_delay"]
LINEAR += ["weak_modes", "return_spring"]


@cache
def band_noise(n: int) -> FloatArray:
    """(n, 2) voltages of 1 V rms below 300 Hz."""
    u = sosfilt(butter(6, 300, fs=2000, output="sos"), np.random.default_rng(0).standard_normal((n, 2)), axis=0)
    return np.asarray(u / u.std())


def with_part(name: str) -> Machine:
    """The paper's table with one part of default size."""
    return Machine.from_file("paper.yaml", clean=True).with_parts({name: SIZES.get(name, {})})


@pytest.mark.parametrize("name", EXACT)
def test_halving_the_inner_step_changes_nothing(name: str) -> None:
    """Less than a tenth of an encoder count over 2 s, so that it is not visible; bristles are worst with 0.02 to 0.03 um.

    Even backlash: its contacts are damped and located in time, so errors of rounding do not grow here.
    """
    machine = with_part(name)
    finer = Machine(replace(machine.spec, inner_rate=2 * machine.spec.inner_rate), clean=True)
    u = band_noise(4000)
    assert np.abs(machine.step(u) - finer.step(u)).max() < TENTH_OF_A_COUNT


@pytest.mark.parametrize("name", EXACT)
def test_energy_never_appears(name: str) -> None:
    """Stored energy minus the motor's work falls at every sample, driven (0.5 s) and free (0.5 s), except for rounding."""
    machine = with_part(name)
    u = 2.0 * np.random.default_rng(1).standard_normal((2000, 2))
    u[1000:] = 0.0
    balance = [0.0]
    for k in range(2000):
        machine.step(u[k : k + 1])
        balance.append(machine.energy("x") - machine.state("x")["work"])
    assert np.diff(balance).max() < 1e-12 * max(1.0, -balance[-1])
    assert balance[-1] < -1.0


def test_work_is_stored_or_turned_to_heat_by_the_drag() -> None:
    """Power balance of a rigid axis: work of the motor = kinetic energy + integral of drag v^2, to the sum's own error."""
    machine = Machine.from_file("rigid.yaml", clean=True)
    machine = Machine(replace(machine.spec, rate=20_000.0), clean=True)
    drive = machine.spec.axes[0].drive
    speed = []
    for voltage in 2.0 * np.sin(2 * np.pi * 20.0 * np.arange(2000) / 20_000.0):
        machine.step(np.full((1, 2), voltage))
        speed.append(machine.state("x")["motor_speed"])
    heat = np.trapezoid(drive.drag * np.array([0.0, *speed]) ** 2, dx=1 / 20_000.0)
    assert machine.state("x")["work"] == pytest.approx(machine.energy("x") + heat, rel=1e-6)


def linear_machine(kind: str) -> Machine:
    """A machine without anything nonlinear."""
    machine = Machine.from_file("paper.yaml", clean=True)
    if kind == "constant_stiffness":
        return machine.with_parts({"hardening_stiffness": {"cubic": 0.0, "linear": 20.0}})
    if kind == "attached_mass":
        return machine.with_parts({"loose_mode": {"gap": 0.0, "damping": 0.0}})
    if kind == "on_table":
        machine = machine.with_parts({"screw_compliance": {}})
        axes = tuple(replace(axis, drive=axis.drive.model_copy(update={"encoder_on": "table"})) for axis in machine.spec.axes)
        return Machine(replace(machine.spec, axes=axes), clean=True)
    return machine if kind == "paper" else machine.with_parts({kind: {}})


def exact_positions(truth: dict[str, Any], u: FloatArray, rate: float) -> FloatArray:
    """Response of a transfer function with delay to held voltages, by matrix exponentials between the delayed times."""
    a, b, c, _ = tf2ss(truth["numerator"], truth["denominator"])
    scale = np.diag(300.0 ** np.arange(a.shape[0]))  # balances the companion form
    a, b, c = scale @ a @ np.linalg.inv(scale), scale @ b, c @ np.linalg.inv(scale)
    n = a.shape[0]
    delay = truth["delay"] * rate
    whole, rest = int(delay), delay % 1.0 / rate

    def held(span: float) -> tuple[FloatArray, FloatArray]:
        both = expm(np.block([[a, b], [np.zeros((1, n + 1))]]) * span)
        return both[:n, :n], both[:n, n]

    (a1, b1), (a2, b2) = held(rest), held(1.0 / rate - rest)
    late = np.concatenate((np.zeros(whole + 1), u))
    x, y = np.zeros(n), np.zeros(u.size)
    for k in range(u.size):
        y[k] = (c @ x).item()
        x = a2 @ (a1 @ x + b1 * late[k]) + b2 * late[k + 1]
    return y


@pytest.mark.parametrize("kind", LINEAR)
def test_linear_machines_move_as_their_transfer_function_says(kind: str) -> None:
    """Within 1e-10 m after any voltages: coefficients, fractional delay and hold are exact; two derivations agree."""
    machine = linear_machine(kind)
    u = band_noise(2000)
    y = machine.step(u)
    for column, axis in enumerate(machine.axes):
        assert np.abs(y[:, column] - exact_positions(machine.truth(axis), u[:, column], machine.rate)).max() < 1e-10


@pytest.mark.parametrize("frequency", [2.0, 20.0, 46.0, 47.5, 100.0, 250.0])
def test_a_sine_through_the_paper_machine_meets_the_truth(frequency: float) -> None:
    """Steady response at a frequency is the transfer function's times the hold's, to 0.1 %, in magnitude and phase."""
    machine = Machine.from_file("paper.yaml", clean=True)
    n = 2000 * 4
    instants = np.arange(n) / 2000.0
    y = machine.step(np.repeat(np.sin(2 * np.pi * frequency * instants)[:, None], 2, axis=1))[n // 2 :, 0]
    late = instants[n // 2 :]
    columns = np.column_stack((np.sin(2 * np.pi * frequency * late), np.cos(2 * np.pi * frequency * late), np.ones(n // 2)))
    sine, cosine, _ = np.linalg.lstsq(columns, y, rcond=None)[0]
    expected = sum(shifted(machine.truth("x"), frequency + 2000.0 * image) for image in range(-40, 41))
    assert abs(complex(sine, cosine) / expected - 1.0) < 1e-3


def shifted(truth: dict[str, Any], frequency: float) -> complex:
    """Transfer function times the hold's at ``frequency``, Hz; sampling adds its images."""
    s = 2j * np.pi * frequency
    plant = np.polyval(np.array(truth["numerator"]), s) / np.polyval(np.array(truth["denominator"]), s)
    return complex(plant * np.exp(-s * truth["delay"]) * (1 - np.exp(-s / 2000.0)) / (s / 2000.0))
