"""Drive: the returned voltage is the applied one, it starts and ends softly, and the axis never leaves the travel."""

from __future__ import annotations

from collections import deque
from typing import Any

import hypothesis
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xy_sysid.errors import BadInput
from xy_sysid.excitation import signal
from xy_sysid.excitation.drive import Drive
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings

RATE, N = 2000.0, 20


def settings(x: dict[str, Any] | None = None, **more: Any) -> ExcitationSettings:
    """One axis x."""
    return ExcitationSettings(axes={"x": AxisExcitation(**(x or {}))}, **more)


def place(seq: int, values: list[float]) -> Block:
    """A position block of axis x whose newest sample is ``seq``."""
    count = np.arange(seq - len(values) + 1, seq + 1, dtype=np.float64)
    return Block(("x",), count, count / RATE, np.array(values, dtype=np.float64)[:, None])


def running(what: ExcitationSettings, position: float = 0.0) -> Drive:
    """A drive that has received a position."""
    drive = Drive(what)
    drive.start()
    assert drive.see(place(0, [position] * 2))
    return drive


class Axis:
    """A first-order axis with delay, stepped 10 times a sample: speed' = pole (gain * voltage - speed)."""

    def __init__(self, start: float = 0.0, gain: float = 0.097, pole: float = 246.0, delay: float = 0.0013) -> None:
        self.position, self.speed, self.gain = start, 0.0, gain
        self.decay = float(np.exp(-pole / RATE / 10))
        self.line: deque[float] = deque([0.0] * round(delay * RATE * 10))
        self.furthest = start

    def play(self, block: Block) -> Block:
        """The positions at the block's samples."""
        out = np.empty_like(block.values)
        for row, voltage in enumerate(block.values[:, 0]):
            out[row] = self.position
            for _ in range(10):
                self.line.append(float(voltage))
                self.speed += (1 - self.decay) * (self.gain * self.line.popleft() - self.speed)
                self.position += self.speed / RATE / 10
                self.furthest = max(self.furthest, abs(self.position))
        return Block(block.axes, block.seq, block.time, out)


def drive_axis(drive: Drive, axis: Axis, seconds: float, ahead: int = 1) -> tuple[FloatArray, FloatArray]:
    """Voltage and position of a run in which block k sees the positions up to block k - ahead."""
    drive.start()
    answers: deque[Block] = deque()
    voltages, positions = [], []
    for _ in range(round(seconds * RATE / N)):
        if len(answers) == ahead:
            drive.see(answers.popleft())
        block = drive.next(N)
        answers.append(axis.play(block))
        voltages.append(block.values[:, 0])
        positions.append(answers[-1].values[:, 0])
    return np.concatenate(voltages), np.concatenate(positions)


def test_nothing_moves_before_start_and_before_the_first_position() -> None:
    """Nothing moves before `activate`; without a usable position it stays at 0 V and the signal is not used up."""
    drive = Drive(settings(ramp=0.0))
    drive.see(place(0, [0.0]))
    assert drive.state == "idle" and not drive.next(100).values.any()
    drive = Drive(settings(ramp=0.0))
    drive.start()
    for bad in (np.nan, np.inf, 1e6):
        assert not drive.see(place(0, [bad]))
        assert not drive.next(N).values.any()
    assert drive.see(place(60, [0.01]))
    first = drive.next(N)
    assert first.seq[0] == 60 and np.allclose(first.time, first.seq / RATE)
    assert np.array_equal(first.values[:, 0], signal(AxisExcitation(), RATE).next(N))


def test_positions_far_ahead_of_the_voltage_are_of_another_source() -> None:
    """Positions with the counter of an earlier voltage are not used; the next ones, with the counter of this voltage, are."""
    drive = Drive(settings(ramp=0.0))
    drive.start()
    assert not drive.see(place(36_000, [0.01]))
    assert "ahead of the voltage by its counter" in drive.unusable
    assert drive.see(place(139, [0.01]))


def test_the_ramp_fades_in_smoothly() -> None:
    """Smooth ramps: a constant voltage is reached along a raised cosine in the set time."""
    drive = running(settings({"kind": "off", "offset": 2.0}, ramp=0.1))
    u = drive.next(400).values[:, 0]
    assert u[0] == 0 and u[100] == pytest.approx(1.0) and (u[200:] == 2.0).all()
    assert (np.diff(u[:200]) >= 0).all() and np.abs(np.diff(u, 2)).max() < 1e-3


def test_centring_pulls_to_the_start_and_zero_is_open_loop() -> None:
    """Weak centring feedback relative to the start position; with 0 the loop is open."""
    drive = running(settings({"kind": "off", "centring": 3.0}, ramp=0.0), position=0.02)
    assert not drive.next(N).values.any()
    drive.see(place(25, [0.03] * 2))
    assert drive.next(N).values[:, 0] == pytest.approx(np.full(N, -0.03))
    open_loop = running(settings({"kind": "off", "centring": 0.0}, ramp=0.0))
    open_loop.see(place(25, [0.03] * 2))
    assert not open_loop.next(N).values.any()


def test_an_integrating_axis_stays_near_its_start() -> None:
    """Centring keeps an integrating axis near its start under noise, and the centring is in the published voltage."""
    drive, axis = Drive(settings({"low": 0.0})), Axis()
    voltage, position = drive_axis(drive, axis, 60.0)
    assert np.abs(position).max() < 0.12 and drive.report().braked[0] == 0
    free = signal(AxisExcitation(low=0.0), RATE).next(voltage.size)
    assert np.std(voltage[2000:]) == pytest.approx(np.std(free), rel=0.06) and not np.array_equal(voltage[2000:3000], free[1980:2980])


@pytest.mark.parametrize("ahead", [1, 2, 3, 4])
@pytest.mark.parametrize("volts", [5.0, 10.0, -5.0])
def test_the_soft_limits_stop_an_axis_driven_at_the_end(volts: float, ahead: int) -> None:
    """Soft travel limits brake before the end: 0.097 m/s/V, 246 rad/s, 1.3 ms, +5 V at 20-sample blocks never passes it."""
    drive, axis = Drive(settings({"kind": "noise", "rms": 0.5, "offset": volts, "centring": 0.0, "limit": 12.0})), Axis()
    voltage, position = drive_axis(drive, axis, 4.0, ahead)
    assert axis.furthest < 0.14
    assert np.abs(voltage).max() > 0.8 * abs(volts)
    assert drive.report().braked[0] > 0
    assert np.abs(position[-2000:]).min() > 0.09  # held before the end, without a jump back


@pytest.mark.parametrize("ahead", [1, 3])
def test_loud_noise_with_an_offset_never_passes_the_end(ahead: int) -> None:
    """The same under strong slow noise, in both directions, for a minute."""
    for volts, seed in ((2.0, 3), (-2.0, 4)):
        axis = Axis()
        drive_axis(Drive(settings({"rms": 3.0, "high": 20.0, "offset": volts, "centring": 0.0, "seed": seed})), axis, 30.0, ahead)
        assert 0.12 < axis.furthest < 0.14


def test_beyond_a_limit_the_push_is_inward() -> None:
    """At and beyond a soft limit: inward brake voltage for any signal."""
    for side in (1, -1):
        drive = running(settings({"kind": "off", "offset": 4.0 * side, "brake_voltage": 0.8, "centring": 0.0}, ramp=0.0), position=0.145 * side)
        assert drive.next(N).values[:, 0] == pytest.approx(np.full(N, -0.8 * side))


def test_the_amplitude_limit_comes_last() -> None:
    """No sample exceeds the limit, which is applied last, and the clipped samples are counted."""
    drive = running(settings({"rms": 3.0, "offset": 2.0, "limit": 2.5}, ramp=0.0))
    u = drive.next(4000).values
    assert np.abs(u).max() == 2.5
    report = drive.report()
    assert report.clipped[0] == np.sum(np.abs(u) == 2.5) > 100
    assert report.rms[0] == pytest.approx(np.sqrt(np.mean(u**2)))


def test_positions_that_stop_trip_the_watchdog() -> None:
    """No position for 50 ms while active: ramp to zero in abort_ramp, then stopped with a reason; the last samples are zeros."""
    drive = running(settings({"kind": "off", "offset": 1.0}, ramp=0.0))
    now, sent = 0.0, []
    while drive.state != "stopped" and now < 1:
        drive.tick(now)
        sent.append(drive.next(N).values[:, 0])
        now += 0.01
    assert 0.05 < now < 0.12 and drive.reason == "no position from the machine for 50 ms"
    u = np.concatenate(sent)
    falling = u[np.argmax(u < 1) : np.argmax(u == 0)]
    assert 36 <= falling.size <= 40 and (np.diff(falling) < 0).all()
    assert not sent[-1].any() and not drive.next(N).values.any()


def test_positions_that_are_not_numbers_count_as_none() -> None:
    """NaN and impossible positions trip the watchdog like missing ones, and are never used."""
    drive = running(settings({"kind": "off", "offset": 1.0}, ramp=0.0))
    for i, bad in enumerate([np.nan, 1e9, np.inf, -np.inf] * 5):
        drive.tick(i * 0.01)
        drive.see(place(i * N + N, [0.0, bad]))
        assert np.isfinite(drive.next(N).values).all()
    assert drive.state == "stopped" and "no position" in drive.reason


def test_a_pause_of_the_caller_is_not_blamed_on_the_encoder() -> None:
    """Positions that arrived while the caller was asleep are read before the watchdog checks."""
    drive = running(settings(ramp=0.0))
    drive.tick(0.0)
    drive.tick(5.0)
    assert drive.state == "active"
    drive.see(place(40, [0.0]))
    drive.tick(5.01)
    assert drive.state == "active"


def test_a_machine_that_never_answers_is_named_and_nothing_moved() -> None:
    """If the machine never answers: a reason, at 0 V all the time."""
    drive = Drive(settings(patience=0.2))
    drive.start()
    for i in range(100):
        drive.tick(i * 0.01)
        assert not drive.next(N).values.any()
    assert drive.state == "stopped" and drive.reason.startswith("no answer from the machine for 0.2 s")


def test_an_orderly_end_fades_out_and_the_last_block_is_zeros() -> None:
    """Duration over: ramp out, then one block of zeros, then stopped."""
    drive = running(settings({"kind": "off", "offset": 1.0}, ramp=0.1, duration=0.5))
    blocks: list[FloatArray] = []
    while drive.state != "stopped" and len(blocks) < 200:
        blocks.append(drive.next(N).values[:, 0])
    u = np.concatenate(blocks)
    assert u.size == 1000 + 200 + N and not blocks[-1].any()
    assert u[999] == 1.0 and u[1100] == pytest.approx(0.5) and drive.reason == "the duration of 0.5 s is over"


def test_a_quicker_stop_replaces_a_slower_one_without_a_jump() -> None:
    """A guard that trips during an orderly end shortens it from where it is; a slower one does not lengthen it."""
    drive = running(settings({"kind": "off", "offset": 1.0}, ramp=0.0))
    drive.stop("told to", 1.0)
    first = drive.next(1000).values[:, 0]
    drive.stop("encoder", 0.02)
    drive.stop("told again", 2.0)
    second = drive.next(60).values[:, 0]
    assert first[-1] == pytest.approx(0.5, abs=0.01) and abs(second[0] - first[-1]) < 0.01
    assert not second[40:].any() and drive.reason == "told to"


def test_loudness_and_limits_change_while_running_and_the_rest_does_not() -> None:
    """rms and limits change during motion, linearly over a block; the kind of signal only while inactive, otherwise with a reason."""
    before = settings({"kind": "off", "offset": 1.0}, ramp=0.0)
    drive = running(before)
    drive.next(N)
    drive.change(settings({"kind": "off", "offset": 2.0, "limit": 1.9}, ramp=0.0))
    u = drive.next(N).values[:, 0]
    assert u[0] == pytest.approx(1.05) and u[-1] == 1.9 and (np.diff(u)[:-3] > 0).all()
    with pytest.raises(BadInput, match=r"x\.kind is to change to noise while active.*Deactivate first"):
        drive.change(settings({"kind": "noise", "offset": 2.0, "limit": 1.9}, ramp=0.0))


def test_the_axes_are_matched_by_name_and_do_not_touch_each_other() -> None:
    """Axes are independent: settings of another axis have no effect, columns may be in any order, a missing one is no position."""
    two = ExcitationSettings(axes={"x": AxisExcitation(), "y": AxisExcitation(seed=2, rms=3.0)}, ramp=0.0)
    drive = Drive(two)
    drive.start()
    assert not drive.see(place(0, [0.0]))
    one_row = np.zeros(1)
    assert drive.see(Block(("z", "y", "x"), one_row, one_row, np.array([[9.0, 0.0, 0.01]])))
    both = drive.next(200).values
    assert np.array_equal(both[:, 0], running(settings(ramp=0.0), position=0.01).next(200).values[:, 0])
    drive.skip(10)
    assert drive.next(1).seq[0] == 210


VOLTS = st.floats(0.0, 100.0, allow_subnormal=False)


@st.composite
def axis_settings(draw: st.DrawFn) -> dict[str, Any]:
    """Any settings of an axis that are allowed."""
    low = draw(st.floats(-10.0, 10.0))
    width = draw(st.floats(1e-3, 20.0))
    return {
        "kind": draw(st.sampled_from(["noise", "off", "multisine", "sweep", "step", "impulse", "prbs"])),
        "rms": draw(VOLTS),
        "limit": draw(st.floats(1e-3, 1000.0)),
        "offset": draw(st.floats(-100.0, 100.0)),
        "centring": draw(st.floats(0.0, 10_000.0)),
        "travel_min": low,
        "travel_max": low + width,
        "brake": width * draw(st.floats(1e-3, 0.49)),
        "brake_voltage": draw(VOLTS),
        "velocity_gain": draw(st.sampled_from([0.0, 1e-4, 0.1, 10.0])),
    }


@hypothesis.settings(max_examples=150, deadline=None, suppress_health_check=list(hypothesis.HealthCheck))
@given(
    x=axis_settings(),
    ramp=st.floats(0.0, 1.0),
    places=st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=12),
    late=st.integers(0, 200),
    stop=st.integers(0, 12),
)
def test_never_outward_beyond_a_limit(x: dict[str, Any], ramp: float, places: list[float], late: int, stop: int) -> None:
    """For any settings, motion, age of the position and state: an axis last measured at or beyond a limit gets no outward voltage."""
    try:
        drive = Drive(settings(x, ramp=ramp))
    except BadInput as refused:
        assert "centring" in str(refused)
        return
    drive.start()
    middle, half = (x["travel_max"] + x["travel_min"]) / 2, (x["travel_max"] - x["travel_min"]) / 2
    for k, part in enumerate(places):
        if k == stop:
            drive.stop("told to", 0.02)
        position = middle + part * half
        drive.see(place(k * N, [position - part * half * 0.1, position]))
        drive.skip(late)
        voltage = drive.next(N).values[:, 0]
        assert np.isfinite(voltage).all() and np.abs(voltage).max() <= x["limit"]
        seen = drive._travel.seen
        assert seen is not None
        if seen.position[0] >= x["travel_max"]:
            assert voltage.max() <= 0
        if seen.position[0] <= x["travel_min"]:
            assert voltage.min() >= 0


def test_two_forecasts_at_once_leave_the_nearer_end_its_way() -> None:
    """Strong voltage to both sides brings both brake zones close: 5 mm beyond the upper limit the voltage is still inward."""
    drive = running(settings({"kind": "off", "offset": -60.0, "centring": 0.0, "limit": 10.0, "travel_min": -0.14, "travel_max": 0.14}, ramp=0.0))
    for k in range(1, 6):  # it has moved fast in both directions
        drive.next(N)
        drive.see(place(k * N, [0.1 * (-1) ** k, 0.145]))
    assert drive._travel.within(np.full((N, 1), 3.0), drive.seq).max() <= 0


@pytest.mark.parametrize(("centring", "gain", "allowed"), [(2.0, 0.0, True), (1e4, 0.0, False), (1e3, 0.097, False), (1e3, 0.001, True)])
def test_centring_that_would_make_the_axis_swing_is_refused(centring: float, gain: float, allowed: bool) -> None:
    """From the known machine, or from limit and travel: the sentence gives the largest value, also while active."""
    wanted = settings({"centring": centring, "velocity_gain": gain})
    drive = running(settings({"velocity_gain": gain}))
    if allowed:
        Drive(wanted)
        drive.change(wanted)
        return
    for act in (Drive, drive.change):
        with pytest.raises(BadInput, match=r"x\.centring is .* V/m; allowed: up to .* the loop oscillates"):
            act(wanted)


@pytest.mark.parametrize("side", [1, -1])
def test_outside_and_not_coming_back_ends_at_zero_volts(side: int) -> None:
    """Beyond the soft limit for half a second without return: zero volts, with the reason; an axis that returns continues."""
    for speed, ends in ((0.0, True), (0.05, False)):
        drive = running(settings({"kind": "off"}, ramp=0.0), position=0.145 * side)
        for k in range(1, 80):
            drive.tick(k * 0.01)
            drive.see(place(k * N, [side * (0.145 - speed * 0.01 * k) + 5e-6 * (k % 7)] * 2))
            drive.next(N)
        assert (drive.state == "stopped" and "does not come back" in drive.reason) == ends, drive.reason
        assert ends == drive.fault


@pytest.mark.parametrize("side", [1, -1])
def test_outward_motion_that_full_inward_voltage_does_not_slow_ends_at_zero_volts(side: int) -> None:
    """A wrong sign drives outward: it ends within 120 ms; an axis that slows down is not stopped."""
    for slowing, ends in ((1.0, True), (0.7, False)):
        drive = running(settings({"kind": "off", "brake_voltage": 2.0}, ramp=0.0), position=0.11 * side)
        position, speed, pushed = 0.11, 0.2, 0
        for k in range(1, 60):
            drive.tick(k * 0.01)
            position += speed * 0.01
            drive.see(place(k * N, [side * (position - speed * 0.005), side * position]))
            voltage = drive.next(N).values[:, 0]
            if (side * voltage < -1.9).any():
                pushed, speed = pushed + 1, speed * slowing
            if drive.state != "active":
                break
        assert drive.fault == ends, drive.reason
        assert not ends or (pushed <= 12 and ("not slowed" in drive.reason or "beyond its limit" in drive.reason))
