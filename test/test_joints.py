"""Stamped samples become counted ones."""

from __future__ import annotations

import numpy as np

from xy_sysid.joints import JointCounter
from xy_sysid.stream import Block


def feed(counter: JointCounter, times: np.ndarray) -> tuple[list[float], list[float]]:
    seqs: list[float] = []
    values: list[float] = []
    for k, time in enumerate(times):
        block = counter.add(float(time), np.array([float(k)]))
        if block is not None:
            seqs += block.seq.tolist()
            values += block.values[:, 0].tolist()
    return seqs, values


def test_stamps_alone_are_counted_with_jitter_and_losses() -> None:
    """Jitter of a third of a sample changes nothing; a lost sample leaves its counter free."""
    random = np.random.default_rng(0)
    times = 5.0 + np.arange(2000) / 125.0 + random.uniform(-0.3, 0.3, 2000) / 125.0 / 2
    kept = np.delete(np.arange(2000), [700, 701, 1500])
    seqs, values = feed(JointCounter(("x",), with_voltage=False), times[kept])
    assert seqs == kept.tolist()
    assert values == list(range(len(kept)))


def test_counters_come_from_the_nearest_voltage_sample() -> None:
    """Position stamps a third of a sample off pair with the voltage sample they belong to."""
    counter = JointCounter(("x",), with_voltage=True)
    seq = np.arange(1000.0, 1020.0)
    counter.see_voltage(Block(("x",), seq, seq / 2000.0, np.zeros((20, 1))))
    seqs, _ = feed(counter, (np.arange(1005, 1030) + 0.3) / 2000.0)
    assert seqs == list(range(1005, 1030))


def test_without_any_voltage_nothing_is_paired_and_memory_stays_bounded() -> None:
    """Samples wait for the voltage stream, not for ever."""
    counter = JointCounter(("x",), with_voltage=True)
    assert feed(counter, np.arange(5000) / 125.0) == ([], [])
    assert len(counter._early) <= 800


def test_repeated_and_backward_stamps_are_left_out() -> None:
    """A stamp counts once."""
    times = np.repeat(np.arange(600) / 125.0, 2)
    seqs, _ = feed(JointCounter(("x",), with_voltage=False), times)
    assert seqs == list(range(600))


def test_stamps_that_never_move_give_nothing() -> None:
    """No rate, no samples, no crash."""
    assert feed(JointCounter(("x",), with_voltage=False), np.zeros(1000)) == ([], [])
    assert feed(JointCounter(("x",), with_voltage=False), np.full(10, np.nan)) == ([], [])


def test_a_source_that_starts_again_counts_from_zero() -> None:
    """Stamps that go back by more than a second are a restart, which the pairing then sees."""
    counter = JointCounter(("x",), with_voltage=False)
    feed(counter, 10.0 + np.arange(600) / 125.0)
    seqs, _ = feed(counter, 2.0 + np.arange(600) / 125.0)
    assert seqs == list(range(600))
