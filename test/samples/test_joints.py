"""Stamped samples get counters."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import Block
from xy_sysid.samples.joint_fields import JointOutput, joints_of
from xy_sysid.samples.joint_states import JointCounter


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
    """Jitter of a third of a sample has no effect; a lost sample leaves its counter free."""
    random = np.random.default_rng(0)
    times = 5.0 + np.arange(2000) / 125.0 + random.uniform(-0.3, 0.3, 2000) / 125.0 / 2
    kept = np.delete(np.arange(2000), [700, 701, 1500])
    seqs, values = feed(JointCounter(("x",), with_voltage=False), times[kept])
    assert seqs == kept.tolist()
    assert values == list(range(len(kept)))


def test_counters_come_from_the_nearest_voltage_sample() -> None:
    """Position stamps a third of a sample away are paired with the right voltage sample."""
    counter = JointCounter(("x",), with_voltage=True)
    seq = np.arange(1000.0, 1020.0)
    counter.see_voltage(Block(("x",), seq, seq / 2000.0, np.zeros((20, 1))))
    seqs, _ = feed(counter, (np.arange(1005, 1030) + 0.3) / 2000.0)
    assert seqs == list(range(1005, 1030))


def test_without_any_voltage_nothing_is_paired_and_memory_stays_bounded() -> None:
    """Samples wait for the voltage stream, for a limited time."""
    counter = JointCounter(("x",), with_voltage=True)
    assert feed(counter, np.arange(5000) / 125.0) == ([], [])
    assert len(counter._early) <= 800


def test_repeated_and_backward_stamps_are_left_out() -> None:
    """Equal stamps count once."""
    times = np.repeat(np.arange(600) / 125.0, 2)
    seqs, _ = feed(JointCounter(("x",), with_voltage=False), times)
    assert seqs == list(range(600))


def test_stamps_that_never_move_give_nothing() -> None:
    """Without a rate or samples there is no error."""
    assert feed(JointCounter(("x",), with_voltage=False), np.zeros(1000)) == ([], [])
    assert feed(JointCounter(("x",), with_voltage=False), np.full(10, np.nan)) == ([], [])


def test_a_source_that_starts_again_counts_from_zero() -> None:
    """Stamps that go back by more than a second are a restart, which the pairing detects."""
    counter = JointCounter(("x",), with_voltage=False)
    feed(counter, 10.0 + np.arange(600) / 125.0)
    seqs, _ = feed(counter, 2.0 + np.arange(600) / 125.0)
    assert seqs == list(range(600))


def voltage(seq: np.ndarray, start: float = 0.0, rate: float = 500.0) -> Block:
    return Block(("x",), seq, start + seq / rate, np.zeros((len(seq), 1)))


@pytest.mark.parametrize("start", [0.0, 1.7e9])
def test_voltage_in_blocks_of_one_row_teaches_the_rate(start: float) -> None:
    """One sample per message, with time since the start or ROS time: positions get the counter of their voltage."""
    counter = JointCounter(("x",), with_voltage=True)
    seqs: list[float] = []
    for n in range(1000):
        counter.see_voltage(voltage(np.array([float(n)]), start))
        block = counter.add(start + (n + 0.2) / 500.0, np.zeros(1))
        seqs += block.seq.tolist() if block is not None else []
    assert seqs == list(range(1000))
    assert counter.wrong() == ""


def test_clocks_that_are_apart_pair_nothing_and_are_named() -> None:
    """Voltage in seconds since its start and joint states since 1970: no sample, and a message with the difference."""
    counter = JointCounter(("x",), with_voltage=True)
    counter.see_voltage(voltage(np.arange(100.0)))
    assert feed(counter, 1.7e9 + np.arange(100) / 500.0) == ([], [])
    assert "the clocks of voltage and joint_states are apart by 1.7e+09 s" in counter.wrong()


@pytest.mark.parametrize(
    ("with_voltage", "stamp", "words"), [(True, 0.0, "the stamps are zero"), (False, 0.0, "the stamps are zero"), (False, 7.5, "stay at 7.5")]
)
def test_stamps_that_never_move_are_named(with_voltage: bool, stamp: float, words: str) -> None:
    """Missing stamps of a driver are reported."""
    counter = JointCounter(("x",), with_voltage)
    feed(counter, np.full(100, stamp))
    assert words in counter.wrong()


def test_rates_that_differ_are_named() -> None:
    """125 joint states and 500 samples of voltage per second: a message with both rates; with 20 % of jitter at one rate there is none."""
    random = np.random.default_rng(3)
    for rate, words in ((125.0, "voltage comes at 500 Hz, joint_states at 125"), (500.0, "")):
        counter = JointCounter(("x",), with_voltage=True)
        counter.see_voltage(voltage(np.arange(1000.0)))
        feed(counter, 2.0 - 400 / rate + (np.arange(400) + random.uniform(-0.2, 0.2, 400)) / rate)
        assert (words in counter.wrong()) if words else counter.wrong() == ""


def test_each_axis_may_have_a_joint_of_any_spelling() -> None:
    """Axis=joint; an unnamed axis is its own joint; anything else is refused with an example."""
    assert joints_of(("x", "y"), ("y=joint-2",)) == {"x": "x", "y": "joint-2"}
    for entries in (("joint-2",), ("z=a",), ("x=a", "x=b"), ("x=",), ("x=y",)):
        with pytest.raises(BadInput, match="parameter joints"):
            joints_of(("x", "y"), entries)


def late_cycles(rows: int, period: float, seed: int = 1) -> np.ndarray:
    """Stamps of a busy computer: one cycle in a hundred begins up to ten periods late, followed by short ones until it has caught up."""
    random, stamps, free = np.random.default_rng(seed), np.zeros(rows), 0.0
    for k in range(rows):
        late = random.uniform(0.0, 10 * period) if random.random() < 0.01 else random.exponential(0.05 * period)
        stamps[k] = max(k * period, free) + late
        free = stamps[k] + 0.1 * period
    return stamps


def test_a_long_stall_that_is_caught_up_with_loses_nothing_and_one_that_is_not_leaves_its_numbers() -> None:
    """Cycles of 0.4 s that arrive at once after a stall are all numbered; a pause of the source of 0.4 s is a gap; later samples are right."""
    even = 100.0 + np.arange(3000) * 0.005
    caught = even.copy()
    caught[1000:1080] = even[1080] + np.arange(80) * 1e-4 - 0.009
    seqs, _ = feed(JointCounter(("x",), with_voltage=False), caught)
    assert seqs == list(range(3000))
    still = np.delete(even, np.arange(1000, 1080))
    seqs, _ = feed(JointCounter(("x",), with_voltage=False), still)
    assert seqs == np.delete(np.arange(3000), np.arange(1000, 1080)).tolist()


def test_the_rate_is_learnt_where_most_cycles_only_catch_up() -> None:
    """A very busy computer: bursts of eight cycles every eight periods. The median step is a tenth of a period, and no sample is lost."""
    bursts = 100.0 + np.repeat(np.arange(400) * 8, 8) * 0.005 + np.tile(np.arange(8), 400) * 0.0005
    seqs, _ = feed(JointCounter(("x",), with_voltage=False), bursts)
    assert seqs == list(range(len(seqs))) and len(seqs) > 3000


def test_a_rate_that_was_learnt_while_the_source_caught_up_with_a_stall_is_learnt_anew() -> None:
    """The first samples are ten times too fast, then the rate is 200 Hz: after some seconds the counters are consecutive, none is lost."""
    stamps = 100.0 + np.concatenate((np.arange(400) * 0.0005, 0.2 + np.arange(1, 6000) * 0.005))
    counter = JointCounter(("x",), with_voltage=False)
    blocks = [block for time in stamps if (block := counter.add(float(time), np.zeros(1))) is not None]
    late = [block for block in blocks if block.time[0] > 110.0]
    seqs, times = (np.concatenate([getattr(block, name) for block in late]) for name in ("seq", "time"))
    assert np.all(np.diff(seqs) == 1.0) and len(seqs) > 3900
    assert np.abs(np.diff(times) / 0.005 - 1.0).max() < 0.1


@pytest.mark.parametrize("with_voltage", [False, True])
def test_cycles_that_begin_late_are_no_losses_and_losses_are_found_among_them(with_voltage: bool) -> None:
    """A late cycle and those that catch up keep their numbers; lost samples leave theirs free; times are evenly spaced."""
    stamps = 1.7e9 + late_cycles(6000, 0.002)
    kept = np.delete(np.arange(6000), [2500, 2501, 4100])
    counter = JointCounter(("x",), with_voltage)
    seqs: list[float] = []
    times: list[float] = []
    for number, time in enumerate(stamps[kept]):
        if with_voltage and number % 20 == 0:
            counter.see_voltage(voltage(np.arange(number, number + 20.0), 1.7e9 + 1e-4))
        block = counter.add(float(time), np.zeros(1))
        if block is not None:
            seqs += block.seq.tolist()
            times += block.time.tolist()
    assert seqs == kept[: len(seqs)].tolist() and len(seqs) > 5900
    assert np.abs(np.diff(times) / np.diff(seqs) / 0.002 - 1.0).max() < 0.1


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("output", ["position", "velocity"])
def test_samples_fed_together_are_counted_as_one_by_one(seed: int, output: JointOutput) -> None:
    """Late cycles, losses, restarts, another rate, repeated and missing stamps, in pieces of any length: the same blocks, bit for bit."""
    random = np.random.default_rng(seed)
    size, period = 12_000, float(random.choice([5e-4, 2e-3, 0.02]))
    late = np.where(random.random(size) < 0.02, random.uniform(0.2, 60.0, size), 0.0)
    times = period * (np.maximum.accumulate(np.arange(size) + late) + random.normal(0.0, 0.05, size)) + 1e3
    times = np.delete(times, np.arange(5000, 5000 + 7 * seed))
    half = len(times) // 2
    if seed % 4 == 1:
        times[half:] -= 3.0 * seed
    if seed % 4 == 2:
        times[half:] = times[half] + 1.3 * (times[half:] - times[half])
    if seed % 4 == 3:
        times[random.integers(0, len(times), 20)] = np.nan
        times[4001:4030] = times[4000]
    rows = random.normal(size=(len(times), 2))
    single, together = (JointCounter(("x",), with_voltage=False, output=output) for _ in range(2))
    blocks = [(index, single.add(float(time), row)) for index, (time, row) in enumerate(zip(times, rows, strict=True))]
    expected = [(index, block) for index, block in blocks if block is not None]
    cuts = [0, *sorted(random.integers(0, len(times), 9).tolist()), len(times)]
    found = [(first, *together.feed(times[first:last], rows[first:last])) for first, last in itertools.pairwise(cuts)]
    assert sum(len(block) for _, block in expected) > size // 10
    for name in ("seq", "time", "values"):
        one, other = (np.concatenate([getattr(block, name) for block in some]) for some in ([b for _, b in expected], [b for _, b, _ in found]))
        np.testing.assert_array_equal(one, other)
    came = np.concatenate([np.full(len(block), index) for index, block in expected])
    np.testing.assert_array_equal(came, np.concatenate([first + index for first, _, index in found]))
    assert single.wrong() == together.wrong()
