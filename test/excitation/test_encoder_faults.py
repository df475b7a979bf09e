"""For any encoder fault: zero volts within a bound, with the reason; and no false stop of a machine without fault."""

from __future__ import annotations

import re
from typing import Any

import pytest
from helpers import ROOT

from campaigns.faults.encoder_faults import FAULTS, FROM_THE_START, frozen, run, scaled, settings
from xy_sim.machine import Machine
from xy_sysid.excitation.drive import Drive
from xy_sysid.samples.block import Block, FloatArray

DOC = ROOT / "docs" / "real-machine-safely.md"
STOP = 0.15  # m, the end stop of the simulated table
NOISE = {"rms": 2.0}


def promised() -> dict[str, tuple[float, float]]:
    """Bounds from the table in the docs: s until zero volts and m until rest, by fault."""
    rows = re.findall(r"^\| ([\w ]+) \| ([\d.]+) ms \| ([\d.]+) mm \|", DOC.read_text(encoding="utf-8"), re.MULTILINE)
    return {name: (float(time) / 1000, float(way) / 1000) for name, time, way in rows}


@pytest.mark.parametrize("name", FAULTS)
def test_an_encoder_that_fails_ends_at_zero_volts_as_the_docs_promise(name: str) -> None:
    """Each fault, under noise of 2 V rms: within the time and travel of docs/real-machine-safely.md, with a reason."""
    seconds, way = promised()[name]
    found = run(Machine.from_file("rigid.yaml"), Drive(settings(NOISE)), 21.0, FAULTS[name], at=1.0)
    assert found.fault and found.reason
    assert found.seconds <= seconds and found.travel <= way, found
    assert found.place < STOP


@pytest.mark.parametrize("name", FROM_THE_START)
def test_an_encoder_that_was_wrong_from_the_start_ends_at_zero_volts(name: str) -> None:
    """A wrong sign, unit or encoder before any motion: detected before an end is reached."""
    found = run(Machine.from_file("rigid.yaml"), Drive(settings(NOISE)), 8.0, FAULTS[name])
    assert found.fault and found.place < STOP, found


@pytest.mark.parametrize("volts", [1.5, 5.0, -9.0])
def test_a_frozen_encoder_never_lets_the_axis_run_into_its_end_stop(volts: float) -> None:
    """At full voltage towards an end, the encoder freezes at the worst place, just before the brake zone."""
    machine = Machine.from_file("rigid.yaml")
    drive = Drive(settings({"kind": "off", "rms": 0.0, "offset": volts, "centring": 0.0}))
    near: list[FloatArray] = []

    def fault(block: Block, good: Block) -> Block:
        near.append(good.values[-1])
        return frozen(block, good)

    at = (0.118 - 0.02) / (0.097 * abs(volts)) + 0.25
    found = run(machine, drive, at + 3.0, fault, at=at)
    assert found.fault and "encoder frozen" in found.reason
    assert abs(near[0][0]) > 0.06 and found.place < STOP, (near[0], found)


@pytest.mark.parametrize("volts", [1.0, -3.0, 8.0])
def test_a_sign_that_is_wrong_from_the_start_is_found_before_an_end(volts: float) -> None:
    """Constant voltage with reversed wiring: zero volts before the end stop, without knowledge of the machine."""
    drive = Drive(settings({"kind": "off", "rms": 0.0, "offset": volts}))
    found = run(Machine.from_file("rigid.yaml"), drive, 6.0, scaled(-1.0))
    assert found.fault and found.place < 0.14, found


@pytest.mark.parametrize(("name", "volts"), [("frozen while driven", 0.6), ("1000 times too small", 1.0), ("1000 times too small", -5.0)])
def test_a_constant_voltage_creeps_no_further_than_a_loud_one_runs(name: str, volts: float) -> None:
    """Slow motion just above friction, and a steady motion with an encoder that shows a thousandth of it: zero volts before the end stop."""
    drive = Drive(settings({"kind": "off", "rms": 0.0, "offset": volts, "centring": 0.0}))
    found = run(Machine.from_file("rigid.yaml"), drive, 4.0, FAULTS[name])
    assert found.fault and "encoder frozen" in found.reason and found.place < 0.08, found


HEALTHY: dict[str, dict[str, Any]] = {
    "as it is": {},
    "heavy friction": {"coulomb_friction": 1.0},
    "dead zone": {"dead_zone": {}},
    "backlash": {"backlash": {}},
    "a load": {"constant_load": 0.3},
    "a soft screw": {"screw_compliance": {}},
    "a spring": {"hardening_stiffness": {}},
}


@pytest.mark.parametrize("effect", HEALTHY)
@pytest.mark.parametrize("axis", [{"rms": 0.2}, {"rms": 2.0}, {"kind": "sweep", "low": 0.5}], ids=["quiet", "loud", "sweep"])
def test_a_machine_that_is_well_is_not_stopped(effect: str, axis: dict[str, Any]) -> None:
    """No false stops: effects of any size, weak and strong excitation."""
    machine = Machine.from_file("rigid.yaml").with_parts(HEALTHY[effect])
    found = run(machine, Drive(settings(axis)), 3.0)
    assert not found.fault, found.reason


def test_an_axis_that_friction_holds_is_told_from_a_frozen_encoder_by_breakaway() -> None:
    """It looks like a frozen encoder; the reason names the setting that distinguishes them, and with it there is no stop."""
    machine = Machine.from_file("rigid.yaml").with_parts({"coulomb_friction": 8.0})
    found = run(machine, Drive(settings(NOISE)), 3.0)
    assert found.fault and "set breakaway" in found.reason and found.travel < 1e-4
    machine.reset()
    found = run(machine, Drive(settings({**NOISE, "breakaway": 8.0})), 3.0)
    assert not found.fault, found.reason


@pytest.mark.parametrize("name", ["paper.yaml", "rigid.yaml", "sticky.yaml", "loose_bolts.yaml", "surprise.yaml", "hidden.yaml"])
def test_no_machine_that_comes_with_the_package_is_stopped(name: str) -> None:
    """Noise at the default level, and no excitation: no guard trips."""
    for axis in ({}, {"kind": "off", "rms": 0.0}):
        found = run(Machine.from_file(name), Drive(settings(axis)), 3.0)
        assert not found.fault, found.reason
