"""Excitation: every signal is the same in any chunking, has its power in the stated band, and refuses impossible settings."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from scipy.signal import sosfreqz, welch

from xy_sysid.errors import BadInput
from xy_sysid.excitation import MAKERS, multisine, schedule, signal
from xy_sysid.excitation.contract import crest
from xy_sysid.excitation.noise import sections
from xy_sysid.excitation.prbs import layout
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation

RATE = 2000.0


def in_chunks(settings: AxisExcitation, total: int, seed: int) -> FloatArray:
    """The stream in random pieces, including empty ones and single samples."""
    stream, random, pieces = signal(settings, RATE), np.random.default_rng(seed), []
    left = total
    while left:
        n = min(left, int(random.choice([0, 1, 2, 20, 333, 9000])))
        pieces.append(stream.next(n))
        left -= n
    return np.concatenate(pieces)


@pytest.mark.parametrize("kind", list(MAKERS))
def test_any_chunking_gives_the_same_stream_bit_for_bit(kind: str) -> None:
    """`next(n) -> block`: the stream does not depend on the block sizes."""
    settings = AxisExcitation(kind=kind, period=1.3)
    whole = signal(settings, RATE).next(30_000)
    assert whole.shape == (30_000,) and whole.dtype == np.float64 and np.isfinite(whole).all()
    assert np.array_equal(in_chunks(settings, 30_000, 1), whole)
    assert np.array_equal(in_chunks(settings, 30_000, 2), whole)


@pytest.mark.parametrize("kind", ["noise", "multisine", "multisine_odd", "multisine_detect", "prbs"])
def test_the_seed_makes_axes_independent_and_repeatable(kind: str) -> None:
    """Per axis independent and seeded."""
    one, again, other = (signal(AxisExcitation(kind=kind, seed=s), RATE).next(40_000) for s in (1, 1, 2))
    assert np.array_equal(one, again)
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.1


@pytest.mark.parametrize("rate", [1000.0, 2000.0, 5000.0, 20_000.0])
@pytest.mark.parametrize(("low", "high"), [(0.1, 300.0), (0.0, 300.0), (20.0, 450.0), (2.0, 50.0)])
def test_the_noise_filter_is_flat_in_band_and_60_db_down_outside(rate: float, low: float, high: float) -> None:
    """Flat in band (0.04 dB) and >= 40 dB down outside (from 0.92 low and 1.08 high; 60 dB from 0.90 and 1.10), at any rate."""
    sos = sections(low, high, rate)
    wide = np.union1d(np.linspace(0, rate / 2, 20_001)[1:], np.geomspace(0.01, rate / 2, 20_001))
    gain = 20 * np.log10(np.abs(sosfreqz(sos, wide, fs=rate)[1]) + 1e-30)
    assert np.ptp(gain[(wide >= low) & (wide <= high)]) < 0.041
    assert (gain[(wide <= 0.92 * low) | (wide >= 1.08 * high)] < -40).all()
    assert (gain[(wide <= 0.90 * low) | (wide >= 1.10 * high)] < -59).all()


@pytest.mark.parametrize("rate", [1000.0, 2000.0, 5000.0])
def test_the_noise_itself_has_its_rms_and_its_band(rate: float) -> None:
    """The rms set; measured spectrum flat within statistics and >= 40 dB down outside."""
    stream = signal(AxisExcitation(rms=0.7), rate)
    data = stream.next(int(400 * rate))
    assert np.std(data) == pytest.approx(0.7, rel=0.005)  # 400 s x 300 Hz: standard error 0.2 %
    frequency, power = welch(data, rate, nperseg=int(rate))
    density = 0.7**2 / 299.9
    inside = (frequency > 3) & (frequency < 298)
    assert np.mean(power[inside]) == pytest.approx(density, rel=0.03)  # 2 % of the power is in the transition bands
    assert np.max(np.abs(power[inside] / density - 1)) < 0.3  # 800 averages: 3.5 % per line
    assert np.max(power[frequency > 340]) < density * 1e-4  # 40 dB


def test_slow_noise_reaches_down_to_its_lowest_frequency_and_no_further() -> None:
    """A lowest frequency of 0.1 Hz at 2 kHz is real: power at 0.12 Hz, none below 0.07 Hz."""
    data = signal(AxisExcitation(low=0.1, high=5.0, seed=3), 2000.0).next(2000 * 3000).reshape(-1, 100).mean(axis=1)
    frequency, power = welch(data, 20.0, window="blackmanharris", nperseg=20 * 400)
    assert np.mean(power[(frequency > 0.13) & (frequency < 0.5)]) == pytest.approx(1 / 4.9, rel=0.15)
    assert np.max(power[(frequency > 0.015) & (frequency < 0.065)]) < 1e-4 / 4.9  # 40 dB


def test_days_of_noise_take_constant_memory() -> None:
    """Constant memory for days: the state does not grow and the level does not drift."""
    stream = signal(AxisExcitation(), RATE)
    stream.next(20)
    tracemalloc.start()
    levels = [float(np.std(stream.next(200_000))) for _ in range(20)]
    before = tracemalloc.get_traced_memory()[0]
    levels += [float(np.std(stream.next(200_000))) for _ in range(20)]
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 20_000
    assert max(levels) / min(levels) < 1.05


@pytest.mark.parametrize("kind", ["multisine", "multisine_odd", "multisine_detect"])
def test_a_multisine_has_equal_power_on_its_lines_and_nothing_elsewhere(kind: str) -> None:
    """Full, odd, odd with random detection lines; the period is exact in samples and the lines are known."""
    settings = AxisExcitation(kind=kind, rms=1.5, low=1.0, high=200.0, period=2.0)
    made = multisine(settings, RATE)
    lines = made.lines()
    assert lines.period == 4000
    data = made.next(3 * lines.period)
    assert np.array_equal(data[:4000], data[4000:8000])
    spectrum = np.abs(np.fft.rfft(data[:4000])) / 2000
    assert np.ptp(spectrum[lines.excited]) < 1e-12
    assert np.max(np.delete(spectrum, lines.excited)) < 1e-12
    assert np.sqrt(np.mean(data**2)) == pytest.approx(1.5, rel=1e-12)
    assert lines.crest == pytest.approx(crest(data), rel=1e-12) and 1.4 < lines.crest < 6
    assert lines.excited[0] >= 2 and lines.excited[-1] <= 400
    everything = np.sort(np.concatenate((lines.excited, lines.even, lines.odd)))
    assert np.array_equal(everything, np.arange(2, 401))


def test_one_of_each_four_odd_lines_is_left_for_detection() -> None:
    """Odd with random detection lines: one left out per group of four, not always the same one."""
    lines = multisine(AxisExcitation(kind="multisine_detect", low=0.1, high=300.0), RATE).lines()
    odd = np.sort(np.concatenate((lines.excited, lines.odd)))
    assert (odd % 2 == 1).all() and (lines.even % 2 == 0).all()
    groups = odd[: odd.size // 4 * 4].reshape(-1, 4)
    left_out = np.isin(groups, lines.odd)
    assert (left_out.sum(axis=1) == 1).all()
    assert set(np.argmax(left_out, axis=1)) == {0, 1, 2, 3}


def test_the_sweep_repeats_smoothly_and_covers_its_band() -> None:
    """Swept sine: periodic, no jump of value or slope, power from low to high."""
    settings = AxisExcitation(kind="sweep", low=5.0, high=300.0, period=4.0, rms=1.0)
    data = signal(settings, RATE).next(16_000)
    assert np.array_equal(data[:8000], data[8000:])
    assert np.max(np.abs(np.diff(data))) <= np.sqrt(2) * 2 * np.pi * 300 / RATE + 1e-9
    assert np.sqrt(np.mean(data**2)) == pytest.approx(1.0, rel=0.01)
    power = np.abs(np.fft.rfft(data[:8000])) ** 2
    frequency = np.arange(power.size) / 4.0
    assert power[(frequency >= 5) & (frequency <= 300)].sum() / power.sum() > 0.995
    inside = power[(frequency >= 10) & (frequency <= 290)]
    assert inside.min() / inside.mean() > 0.2
    assert power[frequency > 360].max() / inside.mean() < 1e-3


def test_a_stepped_sine_holds_whole_cycles_without_jumps() -> None:
    """Stepped sine: log-spaced, integer periods in each dwell, phase continuous."""
    settings = AxisExcitation(kind="stepped_sine", low=0.5, high=300.0, period=1.0, steps=12, rms=0.5)
    dwells = schedule(settings, RATE)
    ratios = np.diff(np.log([d.frequency for d in dwells]))
    assert np.ptp(ratios) < 0.01 and len(dwells) == 12
    total = dwells[-1].start + dwells[-1].samples
    data = signal(settings, RATE).next(total + 1)
    for dwell in dwells:
        part = data[dwell.start : dwell.start + dwell.samples]
        line = np.abs(np.fft.rfft(part)) * 2 / dwell.samples
        assert line[dwell.cycles] == pytest.approx(0.5 * np.sqrt(2), rel=1e-9)
        assert np.delete(line, dwell.cycles).max() < 1e-9
        assert abs(dwell.frequency - dwell.cycles * RATE / dwell.samples) < 1e-12
        assert data[dwell.start] == pytest.approx(0.0, abs=1e-12)
    assert np.max(np.abs(np.diff(data))) <= 0.5 * np.sqrt(2) * 2 * np.pi * 301 / RATE


def test_a_prbs_is_of_maximal_length_and_two_levels() -> None:
    """PRBS: clocked, amplitude is the rms, and the autocorrelation of a maximal-length sequence (peak, else -1)."""
    settings = AxisExcitation(kind="prbs", rms=2.0, high=100.0, period=0.6)
    bits, chip = layout(settings, RATE)
    assert (bits, chip) == (7, 8)
    data = signal(settings, RATE).next(2 * 127 * 8)
    assert np.array_equal(data[: 127 * 8], data[127 * 8 :])
    assert set(np.unique(data)) == {-2.0, 2.0}
    chips = data[: 127 * 8 : 8] / 2
    circular = np.round(np.fft.ifft(np.abs(np.fft.fft(chips)) ** 2).real)
    assert circular[0] == 127 and set(circular[1:]) == {-1.0}


def test_impulse_and_step_start_at_rest_and_alternate() -> None:
    """Impulse and step: a rest first, then up and down in turn, so that an integrating axis returns."""
    impulse = signal(AxisExcitation(kind="impulse", rms=3.0, period=0.1), RATE).next(900)
    assert np.flatnonzero(impulse).tolist() == [199, 399, 599, 799] and impulse[[199, 399]].tolist() == [3.0, -3.0]
    step = signal(AxisExcitation(kind="step", rms=3.0, period=0.1), RATE).next(800)
    assert [step[i] for i in (0, 199, 200, 399, 400, 600, 799)] == [0, 0, 3.0, 3.0, 0, -3.0, -3.0]
    assert not signal(AxisExcitation(kind="off"), RATE).next(500).any()


@pytest.mark.parametrize(
    ("values", "rate", "words"),
    [
        ({"kind": "noise", "high": 300.0}, 600.0, "high is 300 Hz; allowed: below half the rate, 300 Hz"),
        ({"kind": "noise", "low": 1e-5}, 2000.0, "low is 1e-05 Hz"),
        ({"kind": "multisine", "low": 10.0, "high": 10.2, "period": 0.07}, 2000.0, "lines of the multisine is 0"),
        ({"kind": "multisine", "period": 3600.0}, 50_000.0, "samples"),
        ({"kind": "sweep", "low": 0.0, "high": 1.0, "period": 0.5}, 2000.0, "at least one cycle"),
        ({"kind": "stepped_sine", "low": 0.0}, 2000.0, "above 0 Hz"),
        ({"kind": "prbs", "period": 0.001}, 2000.0, "three chips"),
        ({"kind": "noise"}, float("nan"), "rate is nan"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(values: dict[str, object], rate: float, words: str) -> None:
    """High is limited below Nyquist; periods and bands that do not fit the rate give an error with the allowed range."""
    with pytest.raises(BadInput) as caught:
        signal(AxisExcitation.model_validate(values), rate)
    assert words in str(caught.value) and "\n" not in str(caught.value)
