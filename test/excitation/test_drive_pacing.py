"""Pacing: blocks by the clock without drift or burst; in lockstep, each block uses exactly the allowed positions."""

from __future__ import annotations

import numpy as np

from xy_sysid.excitation.pacing import CATCH_UP, Answers, Clock
from xy_sysid.samples.block import Block


def rows(first: int, last: int) -> Block:
    """Positions whose value is their counter."""
    seq = np.arange(first, last, dtype=np.float64)
    return Block(("x",), seq, seq, seq[:, None])


def test_block_k_is_due_at_start_plus_k_periods_without_drift() -> None:
    """Real-time pacing from a monotonic clock: an hour of irregular wake-ups sends exactly the blocks of an hour."""
    clock, random, now = Clock(0.01, 100.0), np.random.default_rng(1), 100.0
    while now < 3700.0:
        for _ in range(clock.due(now)):
            clock.count(now)
        now += random.uniform(0.001, 0.012)
    assert abs(clock.sent - 360_000) <= 2


def test_a_short_stall_is_caught_up_and_a_long_one_skipped() -> None:
    """If late, catch up at most a few blocks, otherwise skip time; never a burst."""
    clock = Clock(0.01, 0.0)
    clock.count(0.0)
    assert clock.skip(0.029) == 0 and clock.due(0.029) == 2 <= CATCH_UP
    assert clock.skip(1.0) == 99 and clock.due(1.0) == 1 and clock.late == 99
    clock.count(1.0)
    assert clock.due(1.0) == 0 and clock.due(1.0101) == 1


def test_a_stream_that_may_not_skip_slips() -> None:
    """Lockstep: after waiting for the machine one block is due, not all the missed ones."""
    clock = Clock(0.01, 0.0)
    clock.slip(5.0)
    assert clock.due(5.0) == 1 and clock.sent == 0
    assert Clock(0.0, 0.0).due(7.0) == 1


def test_answers_are_handed_out_up_to_a_sample_however_they_arrive() -> None:
    """Deterministic: block k uses the positions up to block k - ahead, for any size of the messages."""
    whole, pieces = Answers(), Answers()
    whole.add(rows(0, 60))
    got = []
    for first in range(0, 60, 7):
        pieces.add(rows(first, min(60, first + 7)))
    for end in (19, 39, 59):
        one, other = whole.up_to(end), pieces.up_to(end)
        assert one is not None and other is not None
        assert np.array_equal(one.seq, other.seq) and one.seq[-1] == end
        got.append(one.seq)
    assert np.array_equal(np.concatenate(got), np.arange(60))
    assert whole.up_to(79) is None


def test_lost_repeated_and_broken_answers_do_not_confuse() -> None:
    """After a lost block the available positions are used; an old or NaN counter is not an answer."""
    answers = Answers()
    answers.add(rows(0, 20))
    assert answers.up_to(19) is not None
    answers.add(rows(0, 20))
    answers.add(Block(("x",), np.array([np.nan]), np.zeros(1), np.zeros((1, 1))))
    assert answers.up_to(39) is None
    answers.add(rows(40, 60))
    lost = answers.up_to(39)
    assert lost is not None and len(lost) == 0
    after = answers.up_to(59)
    assert after is not None and after.seq.tolist() == list(range(40, 60))
