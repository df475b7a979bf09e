"""Two axes at once, live: the verdict and the topics of the cross responses are those of the recording."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from xy_sysid.live.coupling_messages import COUPLING_COLUMNS, CROSS_COLUMNS
from xy_sysid.live.fitter import Update
from xy_sysid.live.identifier import FitRequest, Identifier
from xy_sysid.live.plain_messages import OK, WARN
from xy_sysid.report.coupling import coupling_figure
from xy_sysid.report.written import coupled
from xy_sysid.response.coupling import coupling
from xy_sysid.response.windows import WindowShape
from xy_sysid.samples.block import Samples
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings

RATE = 500.0
SETTINGS = IdentifierSettings(length=256, band_low=2.0, band_high=100.0)


def machine(cross: float, same: bool = False, seconds: float = 200.0) -> Recording:
    """Two axes, each moved by a fraction of the other's motion; same: one signal drives both."""
    random = np.random.default_rng(3)
    u = random.normal(size=(int(seconds * RATE), 2))
    u[:, 1] = u[:, 0] if same else u[:, 1]
    own = np.column_stack([signal.lfilter([0.1], [1.0, -1.0 + p, 0.0], u[:, k]) for k, p in enumerate((0.1, 0.2))])
    position = np.cumsum(own + cross * own[:, ::-1], axis=0) / RATE + 1e-7 * random.normal(size=u.shape)
    return Recording.from_arrays(RATE, u, position)


def heard(recording: Recording, block: int, settings: IdentifierSettings = SETTINGS) -> FitRequest:
    """The last request after all samples, in blocks of this length."""
    one, requests = Identifier(settings, recording.axes), []
    for k in range(0, len(recording), block):
        part = slice(k, k + block)
        requests += one.take(Samples(seq=k, voltage=recording.voltage[part], position=recording.position[part]), RATE)
    return requests[-1]


@pytest.mark.parametrize(("cross", "level", "words"), [(0.0, OK, "two single-axis models suffice"), (0.1, WARN, "do not suffice there")])
def test_the_topics_tell_cross_responses_bands_and_verdict(cross: float, level: int, words: str) -> None:
    """In any chunking, and equal to the result of the recording with the same windows."""
    recording = machine(cross)
    request = heard(recording, 20)
    update = Update(request, {})
    arrays = {message.topic: message for message in update.arrays()}
    assert set(arrays) == {"cross_frf/x_from_y", "cross_frf/y_from_x", "coupling/x_and_y"}
    assert arrays["cross_frf/x_from_y"].labels == ("line", ",".join(CROSS_COLUMNS))
    assert arrays["coupling/x_and_y"].labels == ("band", ",".join(COUPLING_COLUMNS))
    status = update.statuses()[-1]
    assert status.name == "coupling of x and y" and status.level == level and words in status.message
    for message in Update(heard(recording, 777), {}).arrays():
        np.testing.assert_array_equal(message.data, arrays[message.topic].data)
    part = recording.position[: request.seq]
    offline = coupling(Recording.from_arrays(RATE, recording.voltage[: request.seq], part), WindowShape.of("hann", 1024, 0.5), (2.0, 100.0))
    rows = arrays["cross_frf/x_from_y"].data.reshape(arrays["cross_frf/x_from_y"].sizes)
    same, one, other = np.intersect1d(rows[:, 0].round(6), offline.frequency.round(6), return_indices=True)
    gap = np.abs(rows[one, 1] + 1j * rows[one, 2] - offline.response[other, 0, 1]) / offline.sigma[other, 0, 1]
    assert same.size > 50 and float(np.median(gap)) < 0.5


def test_nothing_is_told_of_one_axis_in_closed_loop_or_with_one_signal() -> None:
    """There is no verdict if the inputs do not distinguish the axes."""
    assert heard(machine(0.0, same=True), 500).coupling is None
    assert heard(machine(0.0), 500, SETTINGS.model_copy(update={"response": "local_polynomial"})).coupling is None
    recording = machine(0.0)
    alone = Recording.from_arrays(RATE, recording.voltage[:, 0], recording.position[:, 0])
    assert heard(alone, 500).coupling is None


def test_the_report_says_and_draws_it_or_says_why_not() -> None:
    """The verdict is on the two chosen axes; with one signal on both, there is a note instead."""
    found, notes = coupled(machine(0.1), ("y", "x"), SETTINGS)
    assert found is not None and found.axes == ("y", "x") and not notes
    names = [trace.name for trace in coupling_figure(found).data]
    assert names == ["y and x, at least", "at most", "two models suffice below"]
    nothing, why = coupled(machine(0.1, same=True), ("x", "y"), SETTINGS)
    assert nothing is None and "was not judged" in why[0] and "alike" in why[0]
    assert coupled(machine(0.1), ("x",), SETTINGS) == (None, ())
