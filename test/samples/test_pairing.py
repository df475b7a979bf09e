"""Bad streams: passed and refused samples, and the messages."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from xy_sysid.samples.block import Block, Samples
from xy_sysid.samples.pairing import QUANTITIES, Gap, Pairer
from xy_sysid.samples.ring import Ring

FS = 2000.0
AXES = ("x", "y")


def block(first: int, n: int = 20, *, axes: tuple[str, ...] = AXES, rate: float = FS, shift: float = 0.0) -> Block:
    seq = np.arange(first, first + n, dtype=float)
    return Block(axes, seq, seq / rate + shift, np.column_stack([seq + 1000 * k for k in range(len(axes))]))


class Machine:
    """Feeds both streams and stores the output."""

    def __init__(self) -> None:
        self.pairer = Pairer(AXES, reorder=0.05)
        self.samples: list[Samples] = []
        self.gaps: list[Gap] = []

    def voltage(self, b: Block) -> None:
        self._take(self.pairer.feed("voltage", b))

    def position(self, b: Block) -> None:
        self._take(self.pairer.feed("position", b))

    def both(self, first: int, n: int = 20) -> None:
        self.voltage(block(first, n))
        self.position(block(first, n))

    def _take(self, events: list[Samples | Gap]) -> None:
        for event in events:
            if isinstance(event, Gap):
                self.gaps.append(event)
            else:
                self.samples.append(event)

    def heard(self) -> list[int]:
        out: list[int] = []
        for s in self.samples:
            assert np.array_equal(s.voltage, s.position)
            assert np.array_equal(s.voltage[:, 0], np.arange(s.seq, s.seq + len(s)))
            out += range(s.seq, s.seq + len(s))
        return out


@pytest.fixture
def machine() -> Machine:
    made = Machine()
    for first in range(0, 1000, 20):
        made.both(first)
    return made


def test_clean_streams_pass_whole(machine: Machine) -> None:
    """Every sample once, no gap, the rate from the time column."""
    assert machine.heard() == list(range(1000))
    assert machine.gaps == []
    assert machine.pairer.rate == FS
    assert not machine.pairer.counts


def test_pairs_are_made_by_counter_not_by_arrival() -> None:
    """Any interleaving and order within the reorder time gives the same samples."""
    random = np.random.default_rng(0)
    machine = Machine()
    machine.both(0)
    queue = [(kind, first) for first in range(20, 2000, 20) for kind in ("voltage", "position")]
    for start in range(0, len(queue), 6):
        part = queue[start : start + 6]
        random.shuffle(part)
        for kind, first in part:
            getattr(machine, kind)(block(first))
    assert machine.heard() == list(range(2000))
    assert machine.gaps == []


def test_lost_blocks_become_one_gap_each(machine: Machine) -> None:
    """Missing samples are given up after the reorder time, and counted."""
    for first in range(1000, 2000, 20):
        machine.voltage(block(first))
        if first not in (1200, 1220, 1600):
            machine.position(block(first))
    assert machine.heard() == [n for n in range(2000) if not (1200 <= n < 1240 or 1600 <= n < 1620)]
    assert [(g.seq, g.samples, g.reason) for g in machine.gaps] == [(1200, 40, "lost"), (1600, 20, "lost")]
    assert machine.pairer.counts["lost"] == 60


def test_duplicates_change_nothing(machine: Machine) -> None:
    """A repeated block is counted and ignored, even with other values."""
    wrong = block(980)
    machine.position(Block(AXES, wrong.seq, wrong.time, wrong.values * 0 - 5))
    machine.both(1000)
    machine.voltage(block(1000))
    machine.both(1020)
    assert machine.heard() == list(range(1040))
    assert machine.pairer.counts["duplicated"] == 40


def test_nan_samples_are_left_out_and_nothing_else(machine: Machine) -> None:
    """A NaN gives a gap of exactly those samples, with its reason."""
    bad = block(1000)
    bad.values[3:5, 1] = np.nan
    machine.voltage(block(1000))
    machine.position(bad)
    machine.both(1020)
    assert machine.heard() == [n for n in range(1040) if n not in (1003, 1004)]
    assert [(g.seq, g.samples, g.reason) for g in machine.gaps] == [(1003, 2, "not_finite")]
    assert "counter 1003" in machine.pairer.said["not_finite"]


def test_a_jump_of_time_cuts_the_run(machine: Machine) -> None:
    """The samples are kept, but no run crosses the jump."""
    machine.voltage(block(1000, shift=0.25))
    machine.position(block(1000, shift=0.25))
    machine.voltage(block(1020, shift=0.25))
    machine.position(block(1020, shift=0.25))
    assert machine.heard() == list(range(1040))
    assert {(g.seq, g.samples, g.reason) for g in machine.gaps} == {(1000, 0, "time_jump")}


def test_a_source_that_starts_again_is_followed(machine: Machine) -> None:
    """Counters restart at zero: one gap with its reason, then samples continue."""
    before = len(machine.samples)
    for first in range(0, 400, 20):
        machine.both(first)
    assert machine.gaps[0].reason == "restart"
    after = [n for s in machine.samples[before:] for n in range(s.seq, s.seq + len(s))]
    assert after[-1] == 399
    assert len(after) >= 340
    assert machine.pairer.counts["restart"] >= 1


def test_one_old_block_is_late_not_a_restart(machine: Machine) -> None:
    """A single very late sample is counted and ignored."""
    machine.position(block(200))
    machine.both(1000)
    assert machine.heard() == list(range(1020))
    assert machine.pairer.counts["late"] == 20


def test_wrong_columns_are_refused_in_words(machine: Machine) -> None:
    """The sentence gives the received and the expected columns; other columns are allowed in any order."""
    machine.position(block(1000, axes=("a", "b")))
    assert machine.pairer.said["wrong_columns"] == "position: columns a, b; expected x, y"
    swapped = block(1000)
    machine.position(Block(("y", "z", "x"), swapped.seq, swapped.time, swapped.values[:, [1, 1, 0]]))
    machine.voltage(block(1000))
    assert machine.heard() == list(range(1020))


def test_unequal_rates_stop_the_pairing() -> None:
    """Equal counters do not mean equal times, so no sample is passed."""
    machine = Machine()
    for first in range(0, 2000, 20):
        machine.voltage(block(first, rate=2000.0))
        machine.position(block(first, rate=1000.0))
    assert "voltage comes at 2000 Hz, position at 1000 Hz" in machine.pairer.said["unequal_rates"]
    assert len(machine.heard()) <= 200


def test_silence_of_one_stream_does_not_grow_without_limit(machine: Machine) -> None:
    """While the encoder is silent the memory is constant, and pairing continues afterwards."""
    for first in range(1000, 101_000, 1000):
        machine.voltage(block(first, 1000))
    for first in range(101_000, 103_000, 1000):
        machine.both(first, 1000)
    assert machine.heard()[-1] == 102_999
    assert set(machine.heard()) >= set(range(101_000, 103_000))
    assert machine.pairer.counts["overrun"] > 0


@pytest.mark.parametrize("seq", [[0.5, 1.5], [np.nan, 1.0], [5.0, 4.0], [np.inf, 3.0]])
def test_counters_that_do_not_count_are_refused(machine: Machine, seq: list[float]) -> None:
    """Not integer, not finite or not increasing."""
    machine.position(Block(AXES, np.array(seq), np.zeros(2), np.zeros((2, 2))))
    assert machine.pairer.counts["bad_counter"] == 1


def abused(seed: int) -> Machine:
    """A machine after lost, doubled, shuffled, time-shifted and spoilt blocks."""
    random = np.random.default_rng(seed)
    machine = Machine()
    machine.both(0)
    blocks = [(kind, block(first, shift=0.01 * (first >= 4000))) for first in range(20, 6000, 20) for kind in ("voltage", "position")]
    order = np.argsort(np.arange(len(blocks)) + random.normal(0, 2, len(blocks)) * (np.arange(len(blocks)) % 97 < 40))
    for i in order:
        kind, b = blocks[int(i)]
        fate = random.random()
        if fate < 0.03:
            continue
        if fate < 0.06:
            getattr(machine, kind)(b)
        if fate > 0.97:
            b.values[int(random.integers(20)), int(random.integers(2))] = random.choice([np.nan, np.inf])
        getattr(machine, kind)(b)
    return machine


def test_the_short_way_of_blocks_without_a_fault_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ring.follow accepts most blocks; without it samples, gaps and counts are the same, bit for bit."""
    followed: list[bool] = []
    follow = Ring.follow

    def watched(ring: Ring, *how: Any) -> bool:
        followed.append(follow(ring, *how))
        return followed[-1]

    for seed in range(5):
        monkeypatch.setattr(Ring, "follow", watched)
        short = abused(seed)
        monkeypatch.setattr(Ring, "follow", lambda ring, *how: False)
        long = abused(seed)
        assert short.gaps == long.gaps
        assert short.pairer.counts == long.pairer.counts
        assert short.heard() == long.heard()
        for kind in QUANTITIES:
            assert short.pairer._rings[kind].offset == long.pairer._rings[kind].offset
    assert sum(followed) > 0.5 * len(followed)


def test_random_abuse_never_crashes_and_never_invents() -> None:
    """With any lost, doubled, shuffled or spoilt blocks, each output sample was sent, in order, once."""
    for seed in range(10):
        heard = abused(seed).heard()
        assert heard == sorted(set(heard))
        assert len(heard) > 3000


@pytest.mark.parametrize("size", [1, 20, 500])
@pytest.mark.parametrize("rate", [500.0, 1000.0, 1900.0, 1970.0, 4000.0])
def test_a_rate_that_changes_while_the_counter_goes_on_is_estimated_again(rate: float, size: int) -> None:
    """2 kHz changes to another rate without a restart: a message, only brief mixing of both, and pairing continues at the new one.

    From 1 kHz to 4 kHz no single stamp shows the change.
    """
    machine = Machine()
    for first in range(0, 12_000, size):
        one = block(first, size) if first < 3000 else block(first, size, rate=rate, shift=3000 / FS - 3000 / rate)
        machine.voltage(one)
        machine.position(one)
    assert machine.pairer.rate == pytest.approx(rate)
    assert "the rate is estimated again" in machine.pairer.said["restart"]
    assert sum(len(part.voltage) for part in machine.samples if part.seq >= 3020) > 5000
    assert len(machine.heard()) == len(set(machine.heard()))


def test_jitter_stalls_and_a_clock_that_drifts_are_no_other_rate() -> None:
    """Stamps late by up to half a period, occasional stalls of 15 periods with catching up, and a clock error of 500 ppm."""
    random = np.random.default_rng(4)
    machine = Machine()
    for first in range(0, 60_000, 20):
        late = random.uniform(0.0, 0.5, 20) + (np.linspace(15.0, 0.0, 20) if first % 10_000 == 5000 else 0.0)
        one = block(first, rate=FS * (1.0 + (5e-4 if first > 1000 else 0.0)), shift=0.0 if first <= 1000 else 1000 / FS * 5e-4)
        one = Block(one.axes, one.seq, one.time + late / FS, one.values)
        machine.voltage(one)
        machine.position(one)
    assert machine.pairer.counts["restart"] == 0
    assert machine.pairer.counts["time_jump"] == 12  # six stalls, in both streams
    assert len(machine.heard()) == 60_000


def test_a_rate_that_one_stream_was_read_wrong_at_does_not_stay() -> None:
    """The first voltages arrive while the source catches up after a stall: both rates are estimated again later, and samples are paired."""
    machine = Machine()
    for first in range(0, 40_000, 20):
        machine.position(block(first))
        machine.voltage(block(first, rate=3.0 * FS) if first < 400 else block(first))
    assert machine.pairer.counts["unequal_rates"] > 0
    assert machine.pairer.rate == pytest.approx(FS) and len(machine.heard()) > 10_000
