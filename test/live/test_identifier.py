"""The online logic end to end, without ROS: from streams of a simulated machine to transfer functions and alarms."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.live_streams import AXES, blocks, last, recorded

from xy_sim.machine import Machine
from xy_sysid.errors import BadInput
from xy_sysid.fitting import identify
from xy_sysid.fitting.choose_orders import Choice, choose
from xy_sysid.fitting.result import Fit
from xy_sysid.fitting.structure import Structure
from xy_sysid.front_door.simulated_recording import simulate
from xy_sysid.live import fitter
from xy_sysid.live.fitter import LiveFitter, Update
from xy_sysid.live.identifier import FitRequest, Identifier
from xy_sysid.live.messages import read_transfer_function
from xy_sysid.live.plain_messages import ERROR, OK
from xy_sysid.live.replay import replay
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.block import Block
from xy_sysid.samples.pairing import Quantity
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings

SETTINGS = IdentifierSettings()


@pytest.fixture(scope="module")
def paper() -> Recording:
    return recorded("paper.yaml", 60.0)


@pytest.fixture(scope="module")
def sound(paper: Recording) -> list[Update]:
    """All updates from a minute of an unchanged machine."""
    return list(replay(blocks(paper), SETTINGS, AXES))


@pytest.fixture(scope="module")
def loosening() -> list[Update]:
    """All updates from a minute of a machine with loosening bolts."""
    return list(replay(blocks(recorded("loose_bolts.yaml", 60.0)), SETTINGS, AXES))


def test_a_minute_of_the_paper_machine_gives_its_truth(sound: list[Update]) -> None:
    """Delay within 20 us, the 47 Hz pair within 0.2 Hz, relative error at most 1.5 %, gain within 1 %."""
    final = sound[-1]
    machine = Machine.from_file("paper.yaml")
    for axis in AXES:
        truth, fit = machine.truth(axis), final.axes[axis].fit
        assert fit is not None and fit.converged
        assert fit.relative_error <= 0.015
        assert fit.tf.delay == pytest.approx(truth["delay"], abs=20e-6)
        assert fit.interval("resonance_1.frequency").value == pytest.approx(truth["resonance_hz"], abs=0.2)
        assert fit.interval("antiresonance_1.frequency").value == pytest.approx(truth["antiresonance_hz"], abs=0.2)
        assert fit.interval("gain").value == pytest.approx(truth["velocity_gain"], rel=0.01)
    assert [status.level for status in final.statuses()] == [OK, OK, OK]  # x, y and that two single-axis models suffice


def test_any_chunking_gives_the_same_updates_bit_for_bit(paper: Recording) -> None:
    """Blocks of 7, 20 or 8192 samples: the same array messages."""
    part = slice(0, 16_000)
    short = Recording(paper.sampling_rate, AXES, paper.seq[part], paper.time[part], paper.voltage[part], paper.position[part])
    reference = [message.data for update in replay(blocks(short), SETTINGS, AXES) for message in update.arrays()]
    assert len(reference) > 10
    for size in (7, 8192):
        other = [message.data for update in replay(blocks(short, size), SETTINGS, AXES) for message in update.arrays()]
        assert len(other) == len(reference)
        assert all(np.array_equal(a, b) for a, b in zip(other, reference, strict=True))


def test_loosening_bolts_raise_the_alarm_within_ten_seconds(paper: Recording, loosening: list[Update]) -> None:
    """A 1 Hz shift of the 47 Hz pair is reported within 10 s of data after it is complete, and no earlier alarm was false."""
    machine = Machine.from_file("loose_bolts.yaml")
    first: dict[str, float] = {}
    for update in loosening:
        for axis, part in update.axes.items():
            if part.track.alarm:
                first.setdefault(axis, update.request.seq / paper.sampling_rate)
    for axis in AXES:
        start = next(t for t in np.arange(0, 60, 0.1) if machine.truth(axis, t)["resonance_hz"] < machine.truth(axis)["resonance_hz"] - 1e-9)
        shown = next((t for t in np.arange(0, 80, 0.1) if machine.truth(axis, t)["resonance_hz"] <= machine.truth(axis)["resonance_hz"] - 0.95), 60.0)
        assert start < first[axis] <= shown + 10.0


def test_a_sound_machine_raises_no_alarm(sound: list[Update]) -> None:
    """A minute at four standard errors without an alarm."""
    assert not any(part.track.alarm for update in sound for part in update.axes.values())


def test_the_alarm_is_an_error_with_a_sentence(loosening: list[Update]) -> None:
    """The status gives the axis, the frequency before and now, and what to check."""
    status = loosening[-1].statuses()[0]
    assert status.level == ERROR
    assert "resonance moved down by" in status.message
    assert "bolt" in status.message


def spoilt(recording: Recording, seed: int) -> Iterator[tuple[Quantity, Block]]:
    """Lost, doubled, late and broken blocks, a frozen encoder and a jump."""
    random = np.random.default_rng(seed)
    waiting: list[tuple[Quantity, Block]] = []
    for kind, block in blocks(recording):
        fate = random.random()
        position = block.values.copy()
        first = int(block.seq[0])
        if kind == "position" and 40_000 <= first < 42_000:
            position[:] = 0.001
        if kind == "position" and first == 60_000:
            position[5] += 0.05
        if fate < 0.0005:
            position[3] = np.nan
        item = (kind, Block(block.axes, block.seq, block.time, position))
        if 0.0005 <= fate < 0.001:
            continue
        if fate > 0.98:
            waiting.append(item)
            continue
        yield item
        if fate > 0.97:
            yield item
        if waiting and random.random() < 0.5:
            yield waiting.pop()


def test_bad_streams_leave_the_response_inside_its_band(paper: Recording, sound: list[Update]) -> None:
    """Any fault of the streams is counted and reported, and the estimate stays within five sigma of the truth."""
    identifier = Identifier(SETTINGS, AXES)
    final = last(replay(spoilt(paper, 5), SETTINGS, AXES, identifier))
    clean = sound[-1]
    assert identifier.faults["lost"] > 0 and identifier.faults["not_finite"] > 0 and identifier.faults["duplicated"] > 0
    assert identifier.dropped["x"]["frozen"] > 0 and identifier.dropped["x"]["leap"] > 0
    for axis in AXES:
        bad, good = final.axes[axis], clean.axes[axis]
        assert bad.windows < good.windows
        assert bad.fit is not None and good.fit is not None
        assert bad.fit.tf.delay == pytest.approx(good.fit.tf.delay, abs=5e-6)
        both = bad.frf.trusted & good.frf.trusted
        apart = np.abs(bad.frf.response - good.frf.response)[both] / np.hypot(bad.frf.sigma, good.frf.sigma)[both]
        assert np.sqrt(np.mean(apart**2)) < 1.5
    values = dict(final.statuses()[0].values)
    assert int(values["dropped windows: frozen"]) > 0
    assert int(values["stream: lost"]) > 0


def test_a_saved_state_goes_on_after_a_restart(paper: Recording) -> None:
    """Half the data, a restart from the saved state, the other half: only the windows around the restart are missing."""
    half = 60_000
    a, b = Identifier(SETTINGS, AXES), Identifier(SETTINGS, AXES)
    for kind, block in blocks(paper):
        if block.seq[0] < half:
            a.feed(kind, block)
    b.restore({name: value.copy() for name, value in a.state().items()})
    assert b.windows == a.windows
    requests: list[FitRequest] = []
    for kind, block in blocks(paper):
        if block.seq[0] >= half:
            requests += b.feed(kind, block)
    assert requests[-1].axes["x"].windows >= 57 - 3
    fit = LiveFitter(SETTINGS).fit(requests[-1]).axes["x"].fit
    assert fit is not None and fit.relative_error < 0.015


def test_orders_are_searched_once_while_new_data_only_confirm_them(paper: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    """At the fits 1, 2, 4, 8, ... the choice is judged again in a few ms; the slow search runs at the first fit of each axis only."""
    searched: list[Choice] = []

    def counted(frf: FrequencyResponse, family: Structure, thorough: bool) -> Choice:
        searched.append(choose(frf, family, thorough))
        return searched[-1]

    monkeypatch.setattr(fitter, "choose", counted)
    updates = list(replay(blocks(paper), SETTINGS, AXES))
    assert len(updates) > 16
    assert len(searched) == len(AXES)
    fits = [update.axes[axis].fit for update in updates for axis in AXES]
    assert {(fit.structure.numerator_order, fit.structure.denominator_order) for fit in fits if fit is not None} == {(2, 4)}


def test_orders_with_too_many_parameters_for_fewer_lines_are_chosen_again(paper: Recording, monkeypatch: pytest.MonkeyPatch) -> None:
    """The coherence fell, or the source came back at another rate: an error of the old orders does not end the fits."""
    *_, last = [update.request for update in replay(blocks(paper), SETTINGS, AXES)]
    fits = LiveFitter(SETTINGS)
    fits.fit(replace(last, number=1))

    def refused(*given: Any, **named: Any) -> Fit:
        if named.get("doubt") is False:
            raise BadInput("number of trusted lines", 5, "more than 5", "Record longer.")
        return identify(*given, **named)

    monkeypatch.setattr(fitter, "identify", refused)
    found = fits.fit(replace(last, number=4)).axes
    assert [(update.problem, update.fit is not None) for update in found.values()] == [("", True)] * len(AXES)


def test_orders_that_explain_the_data_are_not_lost_again() -> None:
    """With friction a new search misses the resonance now and then, with ten times the cost; orders that noise confirms stay."""
    updates = list(replay(blocks(simulate(60.0, effects=["coulomb_friction"])), SETTINGS, AXES))
    fits = [update.axes[axis].fit for update in updates for axis in AXES if update.request.number >= 4]
    assert len(fits) > 50
    assert {(fit.structure.numerator_order, fit.structure.denominator_order) for fit in fits if fit is not None} == {(2, 4)}


def test_a_state_of_other_settings_is_refused() -> None:
    """The error gives the saved and the required settings."""
    state = Identifier(SETTINGS, AXES).state()
    with pytest.raises(BadInput, match="2048"):
        Identifier(IdentifierSettings(length=2048), AXES).restore(state)
    with pytest.raises(BadInput, match="axes"):
        Identifier(SETTINGS, ("x",)).restore(state)


def test_time_that_stands_still_is_counted_not_crashed() -> None:
    """Without a rate there are no windows, and a counter shows it."""
    identifier = Identifier(IdentifierSettings(length=64), ("x",))
    for start in range(0, 4000, 20):
        seq = np.arange(start, start + 20, dtype=float)
        for kind in ("voltage", "position"):
            identifier.feed(kind, Block(("x",), seq, np.zeros(20), np.sin(seq)[:, None]))
    assert identifier.faults["no_rate"] > 0
    assert identifier.windows == {"x": 0}


def test_the_transfer_function_message_reads_back(sound: list[Update]) -> None:
    """Three labelled parts, one after the other."""
    final = sound[-1]
    message = next(m for m in final.arrays() if m.topic == "transfer_function/x")
    assert message.labels == ("numerator", "denominator", "delay")
    assert message.sizes == (3, 5, 1)
    fit = final.axes["x"].fit
    assert fit is not None
    again = read_transfer_function(message)
    assert np.array_equal(again.numerator, fit.tf.numerator) and np.array_equal(again.denominator, fit.tf.denominator)
    assert again.delay == fit.tf.delay


def test_one_axis_at_rest_does_not_harm_the_other(paper: Recording) -> None:
    """An axis without excitation is reported; the other one is identified."""
    still = Recording(
        paper.sampling_rate, AXES, paper.seq, paper.time, paper.voltage * np.array([1.0, 0.0]), paper.position * np.array([1.0, 0.0])
    )  # fmt: skip
    final = last(replay(blocks(still), SETTINGS, AXES))
    assert final.axes["x"].fit is not None
    assert final.axes["y"].fit is None
    assert "number of trusted lines is 0" in final.axes["y"].problem


@pytest.mark.parametrize("size", [1, 20])
def test_a_source_that_comes_back_at_another_rate_starts_new_spectra(size: int) -> None:
    """500 Hz, then again from counter 0 at 250 Hz: the new rate is used and reported, and no earlier window remains."""
    random = np.random.default_rng(2)
    identifier = Identifier(IdentifierSettings(length=256), AXES)

    def send(number: int, rate: float, start: float) -> None:
        u = random.standard_normal((number, 2))
        y = np.cumsum(u, axis=0) / rate
        for first in range(0, number, size):
            seq = np.arange(first, min(first + size, number), dtype=float)
            rows = slice(first, first + size)
            identifier.feed("voltage", Block(AXES, seq, start + seq / rate, u[rows]))
            identifier.feed("position", Block(AXES, seq, start + seq / rate, y[rows]))

    send(4000, 500.0, 1.7e9)
    assert identifier.sampling_rate == 500.0 and identifier.windows["x"] >= 28 and identifier.sentences == {}
    send(2000, 250.0, 1.7e9 + 20.0)
    assert identifier.sampling_rate == 250.0
    assert 5 <= identifier.windows["x"] <= 14
    assert "came back at 250 Hz, before it was 500 Hz" in identifier.sentences["rate_changed"]


def test_a_level_clears_within_ten_seconds_after_a_loss_is_over(paper: Recording) -> None:
    """Two lost blocks of position: a warning at once, OK again within 10 s of data, and the count remains."""
    part = slice(0, 80_000)
    short = Recording(paper.sampling_rate, AXES, paper.seq[part], paper.time[part], paper.voltage[part], paper.position[part])
    gone = {("position", 40_000.0), ("position", 40_020.0)}
    kept = [(kind, block) for kind, block in blocks(short) if (kind, float(block.seq[0])) not in gone]
    assert len(kept) == len(list(blocks(short))) - 2
    levels = {update.request.seconds: update.statuses()[0] for update in replay(iter(kept), SETTINGS, AXES)}
    lost = [seconds for seconds, status in levels.items() if "lost" in status.message]
    assert lost and min(lost) >= 20.0 and max(lost) <= 30.0
    final = list(levels.values())[-1]
    assert final.level == OK and dict(final.values)["stream: lost"] == "40"
