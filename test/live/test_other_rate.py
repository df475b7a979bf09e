"""A driver that restarts at another rate is followed within ten seconds, and a reset clears everything learned from a stream."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest

from xy_sysid.live.identifier import Identifier
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.samples.joint_states import JointCounter
from xy_sysid.samples.newest import Newest
from xy_sysid.samples.pairing import QUANTITIES
from xy_sysid.settings import IdentifierSettings

SOON = 10.0  # s of data until another rate is detected
RATES = (50.0, 125.0, 250.0, 1000.0)  # Hz, of joint states
CHANGES = (0.5, 0.7, 0.8, 0.9, 0.96, 0.98, 1.02, 1.04, 1.1, 1.3, 2.0)


def stamps(rate: float, seconds: float, start: float, jitter: float = 0.1, lost: float = 0.0, seed: int = 1) -> FloatArray:
    """Stamps of a driver: late by up to ``jitter`` periods; some are lost."""
    random = np.random.default_rng(seed)
    count = round(seconds * rate)
    kept = random.random(count) >= lost
    return np.asarray((start + (np.arange(count) + random.uniform(0.0, jitter, count)) / rate)[kept])


def counted(counter: JointCounter, times: FloatArray) -> list[Block]:
    """The blocks made from the stamps."""
    return [block for time in times if (block := counter.add(float(time), np.zeros(2))) is not None]


def heard(joints: JointCounter, times: FloatArray) -> Iterator[Block]:
    """Each sample as passed on by the node: one position and one effort."""
    random = np.random.default_rng(7)
    for time in times:
        block = joints.add(float(time), random.standard_normal(2))
        if block is not None:
            yield block


def feed(joints: JointCounter, times: FloatArray, *sinks: Identifier | Newest) -> list[Block]:
    """Pass each quantity of each sample to a listener separately."""
    blocks = list(heard(joints, times))
    for block in blocks:
        for place, kind in enumerate(QUANTITIES[::-1]):
            given = Block(("x",), block.seq, block.time, block.values[:, place : place + 1])
            for sink in sinks:
                sink.feed(kind, given)
    return blocks


@pytest.mark.parametrize(("rate", "change"), [*itertools.product(RATES[:-1], CHANGES), *((RATES[-1], change) for change in CHANGES[::5])])
def test_another_rate_of_joint_states_is_followed_within_ten_seconds(rate: float, change: float) -> None:
    """From half to double, from 2 % on: the counter restarts, then both live listeners estimate the rate from 250 samples, without further loss."""
    joints, identifier, newest = (
        JointCounter(("x",), with_voltage=False),
        Identifier(IdentifierSettings(length=64), ("x",)),
        Newest(("x",), 60.0, 3.0, 0.5),
    )
    read = SOON + 250.0 / rate / change  # s
    first, second = stamps(rate, 13.0, 100.0), stamps(rate * change, read + 2.0, 115.0)
    before = feed(joints, first, identifier, newest)
    assert identifier.sampling_rate == pytest.approx(rate, rel=2e-3)
    soon = second < 115.0 + read
    after = feed(joints, second[soon], identifier, newest)
    noticed = next(block for last, block in itertools.pairwise((before[-1], *after)) if block.seq[0] <= last.seq[0])
    assert noticed.time[0] < 115.0 + SOON
    assert identifier.sampling_rate == pytest.approx(rate * change, rel=2e-3)
    lost = sum(identifier.faults.values())
    feed(joints, second[~soon], identifier, newest)
    assert sum(identifier.faults.values()) == lost
    assert newest.sampling_rate == pytest.approx(rate * change, rel=2e-3)
    assert newest.lacking() == ""


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize(("jitter", "lost"), [(0.1, 0.0), (0.6, 0.0), (0.3, 0.01), (0.3, 0.05)])
def test_jitter_and_losses_are_no_other_rate(jitter: float, lost: float, rate: float) -> None:
    """Two minutes at one rate, or 30,000 samples: the counter never restarts."""
    blocks = counted(JointCounter(("x",), with_voltage=False), stamps(rate, min(120.0, 30_000.0 / rate), 5.0, jitter, lost))
    assert np.all(np.diff(np.concatenate([block.seq for block in blocks])) > 0)


@pytest.mark.parametrize("seconds", [0.5, 2.0, 8.0])
def test_two_drivers_on_one_topic_leave_no_trace(seconds: float) -> None:
    """Two publishers at 250 Hz for a moment, at the start or later; with one left, its rate is found within ten seconds."""
    for before in (0.0, 6.0):
        joints, identifier = JointCounter(("x",), with_voltage=False), Identifier(IdentifierSettings(length=64), ("x",))
        one, other = stamps(250.0, before + seconds, 100.0, seed=2), stamps(250.0, seconds, 100.0 + before + 0.0013, seed=3)
        feed(joints, np.sort(np.concatenate((one, other))), identifier)
        feed(joints, stamps(250.0, SOON + 2.0, 100.0 + before + seconds, seed=4), identifier)
        assert identifier.sampling_rate == pytest.approx(250.0, rel=2e-3)


@pytest.mark.parametrize("change", [0.8, 0.98, 1.02])
@pytest.mark.parametrize("rate", [50.0, 125.0, 500.0, 2000.0])
def test_another_rate_of_blocks_is_followed_within_ten_seconds(rate: float, change: float) -> None:
    """The counter continues, and only the time shows it."""
    identifier, random = Identifier(IdentifierSettings(length=64), ("x",)), np.random.default_rng(3)
    time, rows, pace = 0.0, 5, rate
    for first in range(0, round(30.0 * rate), rows):
        pace = rate if first < 12.3 * rate else rate * change
        at = time + np.arange(rows) / pace
        time = float(at[-1]) + 1.0 / pace
        seq = np.arange(first, first + rows, dtype=float)
        for kind in QUANTITIES:
            identifier.feed(kind, Block(("x",), seq, at, random.standard_normal((rows, 1))))
        if time > 12.3 + SOON + 250.0 / pace:
            break
    assert identifier.sampling_rate == pytest.approx(rate * change, rel=2e-3)
