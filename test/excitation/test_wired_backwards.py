"""An axis with reversed wiring is stopped within a tenth of its travel at any voltage, and a correct one never is."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
import pytest
from helpers import ROOT

from campaigns.faults.backwards import LEVELS, TENTH, worst
from xy_sysid.excitation.drive import Drive
from xy_sysid.jit import compiled
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings

DOC = ROOT / "docs" / "real-machine-safely.md"
RATE, ROWS = 2000.0, 20
LONG = {"limit": 5.0, "travel_min": -0.1, "travel_max": 0.1, "brake": 0.04}


@dataclass(kw_only=True)
class Axis:
    """speed' = (gain (voltage - friction) - speed) / lag + unstable * place: m/s/V, s, V of friction and load, 1/s^2, s of delay, m of noise."""

    gain: float = 0.1
    lag: float = 0.02
    friction: float = 0.0
    load: float = 0.0
    unstable: float = 0.0
    delay: float = 0.0
    noise: float = 2e-7
    count: float = 5e-7
    place: float = 0.0
    speed: float = 0.0
    late: FloatArray = field(default_factory=lambda: np.empty(0), init=False)

    def play(self, voltage: FloatArray, random: np.random.Generator) -> FloatArray:
        """(n,) V -> (n,) m as the encoder shows them."""
        late = self.late if self.late.size else np.zeros(round(self.delay * RATE))
        arriving = np.concatenate((late, voltage))
        self.late = arriving[len(voltage) :]
        numbers = np.array([self.gain, self.lag, self.friction, self.load, self.unstable])
        places, self.place, self.speed = _played(arriving[: len(voltage)], numbers, self.place, self.speed)
        return np.asarray(np.round((places + self.noise * random.standard_normal(len(voltage))) / self.count) * self.count)


@compiled
def _played(voltage: FloatArray, numbers: FloatArray, place: float, speed: float) -> tuple[FloatArray, float, float]:
    """(n,) m at the start of each sample, and position and speed after the last."""
    gain, lag, friction, load, unstable = numbers
    places, rubs = np.empty(voltage.size), gain * friction / lag
    for row in range(voltage.size):
        places[row] = place
        force = gain * (voltage[row] + load) / lag + unstable * place - speed / lag
        free = speed + (force - np.sign(speed if speed != 0.0 else force) * rubs) / RATE
        stuck = (speed == 0.0 and abs(force) <= rubs) or (rubs > 0.0 and free * speed < 0.0)
        speed = 0.0 if stuck else free
        place += speed / RATE
    return places, place, speed


def driven(axis: Axis, excitation: AxisExcitation, seconds: float, sign: float = 1.0) -> tuple[Drive, float]:
    """The drive after this time, and the largest distance of the axis from its start, m."""
    drive, random = Drive(ExcitationSettings(axes={"x": excitation})), np.random.default_rng(excitation.seed)
    drive.start()
    begin, furthest = axis.place, 0.0
    for k in range(round(seconds * RATE / ROWS)):
        drive.tick(k * ROWS / RATE)
        block = drive.next(ROWS)
        seen = sign * axis.play(block.values[:, 0], random)
        furthest = max(furthest, abs(axis.place - begin))
        if drive.state == "stopped":
            break
        drive.see(Block(block.axes, block.seq, block.time, seen[:, None]))
    return drive, furthest


def promised() -> dict[float, tuple[float, float]]:
    """Bounds from the table in the docs: s until zero volts and m until rest, by V rms."""
    rows = re.findall(r"^\| ([\d.]+) V \| ([\d.]+) ms \| ([\d.]+) mm \|", DOC.read_text(encoding="utf-8"), re.MULTILINE)
    return {float(rms): (float(time) / 1000, float(way) / 1000) for rms, time, way in rows}


def test_the_docs_give_every_level_and_each_is_within_a_tenth_of_the_travel() -> None:
    """From 0.1 V to the limit, as measured by ``python -m campaigns.faults.backwards``."""
    assert set(promised()) == set(LEVELS) and max(way for _, way in promised().values()) < TENTH


@pytest.mark.parametrize("rms", LEVELS)
def test_the_simulated_table_wired_backwards_is_stopped_as_the_docs_promise(rms: float) -> None:
    """Default settings, wrong signs from the start, two of the 25 measured seeds."""
    seconds, way = promised()[rms]
    stopped, longest, furthest = worst(rms, (2, 5))
    assert stopped and round(longest, 3) <= seconds and furthest <= way


@pytest.mark.parametrize("rms", [0.1, 0.2, 0.5, 1.0, 2.0, 5.0])
@pytest.mark.parametrize(
    "wrong",
    [{}, {"lag": 0.1}, {"delay": 0.02}, {"friction": 0.3, "gain": 0.2}, {"noise": 5e-6}, {"count": 1e-5}, {"load": -0.05}],
    ids=["as it is", "slow", "late", "friction", "noisy", "coarse", "load"],
)
def test_an_axis_wired_backwards_is_stopped_within_a_tenth_of_its_travel(wrong: dict[str, float], rms: float) -> None:
    """Slow, delayed, sticky, noisy, coarse or loaded: at any voltage less than 20 of 200 mm, with a reason and the next action."""
    drive, furthest = driven(Axis(**wrong), AxisExcitation(rms=rms, seed=3, **LONG), 20.0, sign=-1.0)
    held = wrong.get("friction", 0.0) > rms  # then it rests, which is no fault
    assert furthest < 0.02 and (drive.fault or held), (drive.state, drive.reason, furthest)
    assert not drive.fault or "wires or the encoder's sign" in drive.reason, drive.reason


RIGHT: dict[str, dict[str, float]] = {
    "as it is": {},
    "friction": {"friction": 0.5},
    "heavy friction": {"friction": 1.5},
    "slow pole": {"lag": 0.5, "gain": 0.5},
    "free mass": {"lag": 5.0, "gain": 5.0},
    "delay of 20 ms": {"delay": 0.02},
    "delay of 60 ms": {"delay": 0.06},
    "noise": {"noise": 2e-5},
    "loud noise": {"noise": 2e-4},
    "coarse encoder": {"count": 1e-4},
    "hanging load": {"load": -0.1},
    "hanging load that friction holds": {"load": -0.6, "friction": 0.7},
    "load that tips over": {"unstable": 1.0, "lag": 0.1},
}


@pytest.mark.parametrize("rms", [0.1, 0.5, 2.0])
@pytest.mark.parametrize("right", RIGHT)
def test_a_right_axis_is_never_called_backwards(right: str, rms: float) -> None:
    """Friction, slow poles, delays, noise, coarse encoders and loads, several seeds: the sign is never blamed."""
    for seed in (1, 2):
        drive, _ = driven(Axis(**RIGHT[right]), AxisExcitation(rms=rms, seed=seed, **LONG), 4.0)
        assert "sign" not in drive.reason and "wires" not in drive.reason, drive.reason


def test_a_signal_too_fast_for_the_delay_of_a_right_axis_is_named_as_a_cause() -> None:
    """Noise from 20 Hz on behind 10 ms looks backwards for some seeds: the reason names both causes and the test that distinguishes them."""
    reasons = [driven(Axis(delay=0.01), AxisExcitation(rms=2.0, low=20.0, seed=seed, velocity_gain=0.1, **LONG), 3.0)[0].reason for seed in (2, 3)]
    blamed = [reason for reason in reasons if "wires" in reason]
    assert all("If run --first says that plus is plus" in reason and "lower the setting low" in reason for reason in blamed), blamed
    backwards = driven(Axis(), AxisExcitation(rms=2.0, seed=1, **LONG), 3.0, sign=-1.0)[0].reason
    assert "If run --first says that plus is plus" in backwards


@pytest.mark.parametrize("kind", ["multisine", "sweep", "stepped_sine", "prbs", "step", "impulse", "off"])
@pytest.mark.parametrize("delay", [0.0, 0.03])
def test_no_kind_of_signal_makes_a_right_axis_look_backwards(kind: str, delay: float) -> None:
    """With a delay of half a period, a positive voltage moves it to minus: that is no sign of wrong wiring."""
    for rms in (0.3, 2.0):
        drive, _ = driven(Axis(delay=delay), AxisExcitation(kind=kind, rms=rms, low=0.5, **LONG), 6.0)
        assert "sign" not in drive.reason and "wires" not in drive.reason, drive.reason


def test_an_axis_that_vibrates_under_a_weak_centring_is_not_called_backwards() -> None:
    """Moved by the other axis, not by its own voltage, which only follows the motion through the centring."""
    for frequency in (3.0, 12.0, 31.0):
        drive = Drive(ExcitationSettings(axes={"x": AxisExcitation(kind="off", **LONG)}))
        drive.start()
        for k in range(600):
            seq = np.arange(k * ROWS, (k + 1) * ROWS, dtype=np.float64)
            drive.see(Block(("x",), seq, seq / RATE, (2e-4 * np.sin(2 * np.pi * frequency * seq / RATE))[:, None]))
            drive.next(ROWS)
        assert drive.state == "active", drive.reason
