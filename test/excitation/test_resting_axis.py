"""No guard applies more than the requested voltage to an axis that does not move outward, with any encoder flicker."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from xy_sysid.excitation import signal
from xy_sysid.excitation.drive import Drive
from xy_sysid.excitation.encoder_noise import EncoderNoise
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings

RATE, ROWS, COUNT = 2000.0, 20, 5e-7
CASES = list(itertools.product(("x", "y"), (0.1, 0.3, 1.0), (0.0, 0.08), (2e-7, 5e-6)))


def flickering(place: FloatArray, noise: float, random: np.random.Generator) -> FloatArray:
    """Readings of resting or moving axes, (n, axes): noise, then whole counts."""
    return np.asarray(np.round((place + noise * random.standard_normal(place.shape)) / COUNT) * COUNT)


@pytest.mark.parametrize(("driven", "rms", "start", "noise"), CASES)
def test_no_guard_applies_more_than_was_asked(driven: str, rms: float, start: float, noise: float) -> None:
    """One axis is driven in the middle, and gets exactly its signal; the other rests there or in the brake zone, then gets 25 mV."""
    middle = {"centring": 0.0, "limit": 10.0, "travel_min": -0.1, "travel_max": 0.1, "brake": 0.04, "brake_voltage": 5.0}
    axes = {name: AxisExcitation(**middle, kind="noise" if name == driven else "off", low=20.0, rms=rms) for name in ("x", "y")}
    settings = ExcitationSettings(axes=axes, ramp=0.0)
    resting = "y" if driven == "x" else "x"
    pushed = {**axes, resting: axes[resting].model_copy(update={"offset": 0.025})}
    drive, random = Drive(settings), np.random.default_rng(3)
    wanted = signal(axes[driven], RATE)
    moves, rests = drive.axes.index(driven), drive.axes.index(resting)
    place, asked = np.zeros(2), 0.0
    place[rests] = start
    voltage = np.zeros((ROWS, 2))
    drive.start()
    for k in range(600):
        drive.tick(k * ROWS / RATE)
        seq = np.arange((k - 1) * ROWS, k * ROWS, dtype=np.float64)
        path = place + 0.1 / RATE * np.cumsum(voltage, axis=0)
        drive.see(Block(drive.axes, seq, seq / RATE, flickering(path, noise, random)))
        place = path[-1]
        if k == 300:
            drive.change(settings.model_copy(update={"axes": pushed}))
            asked = 0.025
        voltage = drive.next(ROWS).values
        signal_now = wanted.next(ROWS)
        assert np.all(np.abs(voltage[:, moves] - signal_now) <= 1e-12 * np.abs(signal_now))
        assert np.abs(voltage[:, rests]).max() <= asked + 1e-12
        assert start or k <= 300 or voltage[-1, rests] == asked
    assert drive.state == "active", drive.reason


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("rms", [0.1, 1.0])
def test_an_axis_that_moves_inward_through_the_brake_zone_gets_no_more_than_was_asked(side: float, rms: float) -> None:
    """From 18 mm before the end towards the middle, with noise of ten counts: inward voltage is unchanged, outward voltage is reduced."""
    axis = AxisExcitation(centring=0.0, limit=10.0, travel_min=-0.1, travel_max=0.1, brake=0.04, brake_voltage=5.0, low=20.0, rms=rms)
    drive, wanted, random = Drive(ExcitationSettings(axes={"x": axis}, ramp=0.0)), signal(axis, RATE), np.random.default_rng(4)
    drive.start()
    for k in range(300):
        drive.tick(k * ROWS / RATE)
        seq = np.arange(k * ROWS, (k + 1) * ROWS, dtype=np.float64)
        drive.see(Block(("x",), seq, seq / RATE, flickering(side * (0.082 - 0.02 * seq / RATE)[:, None], 5e-6, random)))
        voltage, asked = drive.next(ROWS).values[:, 0], wanted.next(ROWS)
        inward = side * asked <= 0.0
        np.testing.assert_allclose(voltage[inward], asked[inward], rtol=1e-12)
        assert (np.abs(voltage) <= np.abs(asked) * (1 + 1e-12)).all()
    assert drive.state == "active", drive.reason


def test_an_axis_that_coasts_outward_is_braked_though_nothing_is_asked() -> None:
    """Motion above the noise, towards an end at 0 V: the guard brakes."""
    axis = AxisExcitation(kind="off", centring=0.0, travel_min=-0.1, travel_max=0.1, brake=0.04, brake_voltage=2.0)
    drive, least = Drive(ExcitationSettings(axes={"x": axis}, ramp=0.0)), 0.0
    drive.start()
    for k in range(30):
        seq = np.arange(k * ROWS, (k + 1) * ROWS, dtype=np.float64)
        drive.see(Block(("x",), seq, seq / RATE, (0.05 + 0.1 * seq / RATE)[:, None]))
        least = min(least, float(drive.next(ROWS).values.min()))
    assert least < -0.5


@pytest.mark.parametrize("sigma", [0.0, 2e-7, 3e-6, 1e-4])
def test_what_needs_no_motion_covers_the_noise_and_hardly_more(sigma: float) -> None:
    """The estimated noise bounds all readings of a resting axis; steady motion does not increase it."""
    random = np.random.default_rng(1)
    for speed in (0.0, 0.2):
        noise, rest = EncoderNoise(1), np.zeros((4000, 1))
        for row in range(0, 4000, ROWS):
            time = np.arange(row, row + ROWS)[:, None] / RATE
            rest[row : row + ROWS] = flickering(np.zeros((ROWS, 1)), sigma, random)
            noise.saw(np.round((speed * time + rest[row : row + ROWS]) / COUNT) * COUNT)
        assert np.ptp(rest) <= 1.6 * noise.still[0]
        assert noise.still[0] < 12 * (sigma + COUNT) or speed
        assert noise.still[0] < 12 * (sigma + COUNT) + 2 * speed / RATE


LOOKED_AT = 11  # positions of the last 0.1 s, one for each block of 10 ms, in which the travel guard looks for motion


def test_noise_is_not_taken_for_motion_however_long_the_axis_rests() -> None:
    """A quarter of an hour of blocks, with noise far above a count: no position differs from earlier ones by more than the noise."""
    random, noise = np.random.default_rng(5), EncoderNoise(1)
    noise.saw(flickering(np.zeros((4000, 1)), 1e-4, random))
    places = flickering(np.zeros(90_000), 1e-4, random)
    lowest = np.lib.stride_tricks.sliding_window_view(places, LOOKED_AT).min(axis=1)
    assert (places[LOOKED_AT - 1 :] - lowest < noise.still[0]).all()


@pytest.mark.parametrize("rows", [1, 2, 20])
def test_the_first_positions_are_not_taken_for_motion_either(rows: int) -> None:
    """A driver may send single positions: a noise estimate from few of them is enlarged."""
    for seed in range(200):
        random, noise, last = np.random.default_rng(seed), EncoderNoise(1), list[float]()
        for _ in range(24):
            block = flickering(np.zeros((rows, 1)), 1e-4, random)
            noise.saw(block)
            last.append(float(block[-1, 0]))
            assert last[-1] - min(last[-LOOKED_AT:]) <= noise.still[0]
