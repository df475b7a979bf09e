"""Live closed loop: the reference as instrument, matched by its stamps, for any order and chunking of blocks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from helpers.servo import H1, JOINT, Servo
from scipy import signal

from xy_sysid.errors import BadInput
from xy_sysid.fitting.of_recording import estimate
from xy_sysid.live.identifier import FitRequest, Identifier
from xy_sysid.live.replay import replay
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.block import Block, FloatArray, Samples, StreamName
from xy_sysid.samples.pairing import Gap
from xy_sysid.samples.recording import Recording
from xy_sysid.samples.reference import ReferenceHold
from xy_sysid.settings import IdentifierSettings

SERVO = Servo()
ROWS = 20_000
Streams = Iterator[tuple[StreamName, Block]]


@pytest.fixture(scope="module")
def servo() -> Recording:
    """40 s of noise below 60 Hz on the reference, 10 mrad rms."""
    made = signal.lfilter(*signal.butter(4, 60.0, fs=SERVO.rate), np.random.default_rng(77).standard_normal(ROWS))
    return SERVO.run(np.asarray(made * 0.01 / np.std(made)), 4)


def streams(recording: Recording, size: int = 20, sent: FloatArray | None = None, behind: int = 0) -> Streams:
    """Blocks of input, output and reference; sent: times of the reference instead of the samples'; behind: its delay in blocks."""
    assert recording.reference is not None
    axes, instants = recording.axes, recording.time if sent is None else sent
    for start in range(0, len(recording.seq) + behind * size, size):
        rows, early = slice(start, start + size), slice(max(start - behind * size, 0), max(start - behind * size + size, 0))
        seq = recording.seq.astype(np.float64)
        values: tuple[tuple[StreamName, FloatArray, FloatArray, slice], ...] = (
            ("voltage", recording.voltage, recording.time, rows),
            ("position", recording.position, recording.time, rows),
            ("reference", recording.reference, instants, early),
        )
        for kind, table, time, part in values:
            if len(seq[part]):
                yield kind, Block(axes, seq[part], time[part], table[part])


def newest(blocks: Streams, settings: IdentifierSettings = JOINT) -> tuple[FitRequest, Identifier]:
    identifier = Identifier(settings, ("x",))
    requests = [request for kind, block in blocks for request in identifier.feed(kind, block)]
    return requests[-1], identifier


def off(frf: FrequencyResponse) -> float:
    """Mean of the response over the truth, less one."""
    return float(abs(np.mean(frf.response[frf.trusted] / SERVO.response(frf.frequency)[frf.trusted]) - 1.0))


def test_live_it_is_right_where_output_over_input_is_not_and_the_same_as_offline(servo: Recording) -> None:
    """H1 is wrong by more than 10 %; joint input-output is within its sigma, and equals the result of the full recording."""
    plain, _ = newest(streams(servo), H1)
    assert off(plain.axes["x"].frf) > 0.1
    request, identifier = newest(streams(servo))
    frf = request.axes["x"].frf
    assert off(frf) < 0.05 and identifier.faults == {}
    distance = np.abs(frf.response - SERVO.response(frf.frequency)) / frf.sigma
    assert 0.75 < np.sqrt(np.mean(distance[frf.trusted] ** 2)) < 1.3
    heard = servo.only(np.arange(ROWS) < request.seq + 1)
    whole = estimate(heard, "x", JOINT).frf
    np.testing.assert_allclose(frf.response, whole.response, rtol=1e-6)
    np.testing.assert_allclose(frf.sigma, whole.sigma, rtol=1e-5)


def test_any_chunking_and_a_late_reference_give_the_same_bit_for_bit(servo: Recording) -> None:
    """Blocks of 1, 7 or 333 samples, a reference that comes half a second late: the same responses."""
    wanted = newest(streams(servo))[0].axes["x"].frf.response
    for size, behind in ((1, 0), (7, 0), (333, 0), (20, 10)):
        assert np.array_equal(newest(streams(servo, size, behind=behind))[0].axes["x"].frf.response, wanted), (size, behind)


def test_a_reference_on_a_clock_that_leads_and_jitters_is_the_same_instrument(servo: Recording) -> None:
    """Sent 7 ms early, with half a period of jitter: a slightly different instrument, without bias."""
    jitter = np.random.default_rng(5).uniform(-0.5, 0.5, ROWS) / SERVO.rate
    request, identifier = newest(streams(servo, sent=servo.time - 0.007 + jitter))
    assert off(request.axes["x"].frf) < 0.05 and identifier.faults == {}
    fit = next(iter([update.axes["x"].fit for update in replay(streams(servo, sent=servo.time - 0.007), JOINT, ("x",))][-1:]))
    assert fit is not None and fit.interval("numerator_0").low <= 1 / SERVO.inertia <= fit.interval("numerator_0").high


def test_samples_without_a_reference_are_no_windows_and_that_is_said(servo: Recording) -> None:
    """No reference: no fit, with the reason; a pause of two seconds: the windows there are dropped."""
    silent = Identifier(JOINT, ("x",))
    assert [one for kind, block in streams(servo) if kind != "reference" for one in silent.feed(kind, block)] == []
    assert silent.faults["no_reference"] > ROWS - JOINT.reorder * SERVO.rate - 40 and "no reference for" in silent.sentences["no_reference"]
    assert silent.waiting["reference"] == -1 and silent.samples == 0
    pause = (servo.time > 10.0) & (servo.time < 12.0)
    request, identifier = newest((kind, block) for kind, block in streams(servo) if kind != "reference" or not pause[int(block.seq[0])])
    assert request.axes["x"].dropped == {"no_reference": 1}
    assert identifier.faults["no_reference"] == pytest.approx((2.0 - JOINT.reorder) * SERVO.rate, abs=45)
    assert off(request.axes["x"].frf) < 0.06


def test_it_goes_on_after_a_restart_from_its_state(servo: Recording) -> None:
    """State of the three pairs, saved and restored: the same response as without the restart; a state of H1 is refused."""
    whole = newest(streams(servo))[0]
    first = Identifier(JOINT, ("x",))
    second = Identifier(JOINT, ("x",))
    found: list[FitRequest] = []
    hop = JOINT.length // 2
    for kind, block in streams(servo, hop):
        if block.seq[0] == 20 * hop and kind == "voltage":
            second.restore(first.state())
        found += (first if block.seq[0] < 20 * hop else second).feed(kind, block)
    a, b = found[-1].axes["x"].frf, whole.axes["x"].frf
    assert abs(a.averages / b.averages - 1.0) < 0.1
    assert np.median(np.abs(a.response - b.response)[b.trusted] / b.sigma[b.trusted]) < 0.5
    with pytest.raises(BadInput, match="saved state: key"):
        second.restore(Identifier(H1, ("x",)).state())


def test_a_bad_reference_is_refused_in_words() -> None:
    """Other columns, NaN, a clock that goes back: counted and reported, without effect on earlier pairs."""
    hold = ReferenceHold(("x",), 0.5)
    three = np.arange(3.0)
    samples = Samples(0, np.zeros((3, 1)), np.zeros((3, 1)), three / 10)
    assert hold.hear(Block(("q",), three, three, np.zeros((3, 1)))) == []
    assert hold.hear(Block(("x",), three, np.array([0.0, np.nan, 0.2]), np.array([[1.0], [2.0], [np.inf]]))) == []
    assert hold.counts == {"wrong_columns": 1, "not_finite": 2}
    (gap,) = hold.take(Gap(0, 1, "lost"))
    assert gap == Gap(0, 1, "lost")
    (first,) = hold.take(replace(samples))
    assert isinstance(first, Samples) and len(first) == 1 and first.reference is not None and first.reference[0, 0] == 1.0
    (rest,) = hold.hear(Block(("x",), three[:1] + 3, np.array([0.2]), np.array([[5.0]])))
    assert isinstance(rest, Samples) and rest.reference is not None and rest.reference.ravel().tolist() == [1.0, 5.0] and rest.seq == 1
    hold.hear(Block(("x",), three[:1] + 4, np.array([-100.0]), np.array([[7.0]])))
    assert "its time went back by 100.2 s" in hold.said["restart"]
