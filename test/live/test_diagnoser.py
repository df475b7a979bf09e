"""The live diagnosis without ROS: memory of the streams, and sequence of the jobs."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from helpers.simulated import recorded

from xy_sysid.axis.model import STANDARD
from xy_sysid.live.diagnoser import Diagnoser, all_at_once
from xy_sysid.live.diagnosis_messages import ladder_message
from xy_sysid.samples.block import Block
from xy_sysid.samples.newest import Newest
from xy_sysid.samples.recording import Recording, Run
from xy_sysid.settings import DiagnoserSettings
from xy_sysid.story.acts import perform
from xy_sysid.story.document import document
from xy_sysid.story.story import tell

AXES = ("x", "y")


@cache
def friction() -> Recording:
    return recorded("x:coulomb_friction", seconds=12.0, axes=AXES)


@cache
def resonance() -> Recording:
    return recorded("x:base_resonance+x:coulomb_friction", seconds=10.0, axes=AXES)


def send(hearing: Newest | Diagnoser, first: int, last: int, size: int = 20, shift: int = 0, recording: Recording | None = None) -> None:
    recording = recording or friction()
    for start in range(first, last, size):
        rows = slice(start, min(start + size, last))
        seq = np.arange(rows.start, rows.stop, dtype=float) - shift
        hearing.feed("voltage", Block(AXES, seq, seq / 2000.0, recording.voltage[rows]))
        hearing.feed("position", Block(AXES, seq, seq / 2000.0, recording.position[rows]))


def test_the_newest_seconds_are_kept_whatever_the_blocks() -> None:
    """Memory is limited to the sample, and independent of the blocks."""
    found = []
    for size in (20, 333):
        hearing = Newest(AXES, memory=4.0, minimum=1.0, reorder=0.5)
        send(hearing, 0, 20_000, size)
        assert hearing.lacking() == ""
        found.append(hearing.newest())
    assert len(found[0].voltage) == 8000 and found[0].seconds == 4.0
    assert found[0].seq == found[1].seq == 12_000
    assert np.array_equal(found[0].position, found[1].position)
    assert np.array_equal(found[0].voltage, friction().voltage[12_000:20_000])


def test_after_a_gap_the_longer_run_serves_until_the_new_one_will_do() -> None:
    """After one lost block the received data remain usable; after a restart of the source they do not."""
    hearing = Newest(AXES, memory=100.0, minimum=3.0, reorder=0.1)
    send(hearing, 0, 10_000)
    send(hearing, 10_020, 12_000)
    assert hearing.faults["lost"] and hearing.newest().seq == 0 and hearing.seconds == 5.0
    send(hearing, 12_000, 17_000)
    assert hearing.newest().seq == 10_020
    send(hearing, 0, 4000)
    assert "without a gap" in hearing.lacking() and "restart" in hearing.lacking()


def test_what_is_not_heard_is_named() -> None:
    """The error names the stream and its axes."""
    hearing = Newest(AXES, memory=100.0, minimum=3.0, reorder=0.1)
    assert "no voltage and no position of axes x, y received yet" in hearing.lacking()
    hearing.feed("voltage", Block(AXES, np.arange(20.0), np.arange(20.0) / 2000.0, np.zeros((20, 2))))
    assert hearing.lacking().startswith("no position of")


def play(diagnoser: Diagnoser) -> list[str]:
    """Perform all waiting jobs like a worker; returns the activities."""
    said = []
    while (job := diagnoser.start()) is not None:
        for doing, story in perform(job, STANDARD):
            diagnoser.progress(doing, story)
            said.append(f"{job.run.axis} {doing}")
        diagnoser.finish()
    return said


def test_requests_are_done_one_after_the_other_and_answered() -> None:
    """diagnose for both axes, then an effect by its parameter; the error falls, and the parameter lists the model's effects."""
    diagnoser = Diagnoser(DiagnoserSettings(minimum=5.0), AXES)
    send(diagnoser, 0, 24_000)
    number = diagnoser.ask("diagnose")
    said = play(diagnoser)
    assert said[:2] == ["x fitting the rigid model", "x the rigid model is fitted"] and said[-1] == "y diagnosed"
    (answer,) = diagnoser.answers()
    assert (answer.request, answer.done) == (number, True)
    assert "axis x: Missing: coulomb_friction" in answer.text and "axis y: Nothing is missing" in answer.text
    diagnoser.have("x", ("coulomb_friction",))
    assert play(diagnoser) == ["x adding coulomb_friction", "x with coulomb_friction"]
    ladder = ladder_message(diagnoser.stories["x"])
    rows = ladder.data.reshape(ladder.sizes)
    assert rows[1, 2] < 0.2 * rows[0, 2] and rows[:, 0].tolist() == [0.0, 1.0]
    assert diagnoser.effects == {"x": ("coulomb_friction",), "y": ()}
    diagnoser.have("x", ())
    assert play(diagnoser)[-1] == "x without coulomb_friction"
    diagnoser.reset_model()
    assert len(diagnoser.stories["x"].rungs) == 1 and diagnoser.stories["x"].diagnosis is not None


def test_once_a_resonance_is_in_the_model_the_next_effects_are_found() -> None:
    """By add_next and by auto, and again after a reset of the model."""
    diagnoser = Diagnoser(DiagnoserSettings(minimum=5.0), AXES)
    send(diagnoser, 0, 20_000, recording=resonance())
    diagnoser.have("x", ("base_resonance",))
    play(diagnoser)
    diagnoser.ask("add_next", ["x"])
    play(diagnoser)
    assert diagnoser.effects["x"] == ("base_resonance", "coulomb_friction")
    diagnoser.reset_model()
    diagnoser.ask("auto", ["x"])
    play(diagnoser)
    assert set(diagnoser.effects["x"]) == {"base_resonance", "coulomb_friction"}
    assert all(answer.done for answer in diagnoser.answers())


def test_the_live_document_is_the_offline_one() -> None:
    """The same samples, the same core, the same numbers."""
    diagnoser = Diagnoser(DiagnoserSettings(minimum=5.0), AXES)
    send(diagnoser, 0, 24_000)
    live = all_at_once(diagnoser, STANDARD)
    u, y = friction().axis("x")
    assert document(live["x"]) == document(tell(Run("x", 2000.0, u, y)))


def test_a_diagnosis_falls_due_by_seconds_of_data() -> None:
    """Every interval once, not while one waits."""
    diagnoser = Diagnoser(DiagnoserSettings(minimum=1.0, interval=2.0), AXES)
    send(diagnoser, 0, 3800)
    assert not diagnoser.busy
    send(diagnoser, 3800, 14_000)
    assert diagnoser.busy
    jobs = []
    while (job := diagnoser.start()) is not None:
        jobs.append(job.run.axis)
        diagnoser.finish("not done here")
    assert jobs == ["x", "y"]
    (answer,) = diagnoser.answers()
    assert not answer.done and "not done here" in answer.text
    send(diagnoser, 14_000, 18_000)
    assert diagnoser.busy


def test_cancelling_answers_everybody_and_keeps_the_stories() -> None:
    """Waiting requests are cancelled, too; equal waiting ones were joined."""
    diagnoser = Diagnoser(DiagnoserSettings(minimum=1.0), AXES)
    send(diagnoser, 0, 8000)
    first, second, third = diagnoser.ask("diagnose"), diagnoser.ask("auto"), diagnoser.ask("auto")
    assert second == third != first
    job = diagnoser.start()
    assert job is not None and job.run.voltage.shape == (8000,)
    assert diagnoser.start() is None, "one at a time"
    assert diagnoser.cancel() == "cancelled axis x: fitting the rigid model"
    assert [(answer.request, answer.text) for answer in diagnoser.answers()] == [(first, "cancelled"), (second, "cancelled")]
    assert diagnoser.cancel() == "nothing was running" and not diagnoser.busy


def test_a_diagnosis_that_is_asked_for_twice_is_made_once() -> None:
    """A repeated request joins the running one if its answer was lost; after a reset of the data it is a new request."""
    diagnoser = Diagnoser(DiagnoserSettings(minimum=1.0), AXES)
    send(diagnoser, 0, 8000)
    number = diagnoser.ask("diagnose")
    assert diagnoser.start() is not None and diagnoser.ask("diagnose") == number
    diagnoser.finish("lost")
    assert diagnoser.start() is not None and diagnoser.ask("diagnose") == number, "of the second axis, too"
    diagnoser.reset()
    assert diagnoser.ask("diagnose") != number
    diagnoser.cancel()
    send(diagnoser, 8000, 16_000)
    first = diagnoser.ask("add_next")
    assert diagnoser.start() is not None and diagnoser.ask("add_next") != first, "twice the next effect is two effects"


@pytest.mark.parametrize("names", [[""], [], ["", " "]])
def test_an_empty_name_is_no_effect(names: list[str]) -> None:
    """ROS parameter files have no empty lists."""
    assert DiagnoserSettings(effects={"x": names}).chosen("x") == ()


def test_each_axis_is_asked_for_by_itself() -> None:
    """Diagnose on x starts nothing for y; a waiting job of y can be cancelled while x continues."""
    diagnoser = Diagnoser(DiagnoserSettings(minimum=1.0), AXES)
    send(diagnoser, 0, 8000)
    first = diagnoser.ask("diagnose", ["x"])
    assert diagnoser.start() is not None and diagnoser.doings() == {"x": "fitting the rigid model"}
    second = diagnoser.ask("diagnose", ["y"])
    assert diagnoser.doings() == {"x": "fitting the rigid model", "y": "waits"}
    assert diagnoser.cancel(["y"]) == "cancelled axis y: waits"
    assert [(answer.request, answer.done) for answer in diagnoser.answers()] == [(second, False)]
    assert diagnoser.under_way == "x" and diagnoser.doings() == {"x": "fitting the rigid model"}
    diagnoser.finish("not done here")
    assert diagnoser.start() is None and [answer.request for answer in diagnoser.answers()] == [first]


def test_giving_up_one_axis_of_a_request_leaves_the_others() -> None:
    """The running axis is cancelled; the one waiting in the same request is next."""
    diagnoser = Diagnoser(DiagnoserSettings(minimum=1.0), AXES)
    send(diagnoser, 0, 8000)
    number = diagnoser.ask("diagnose")
    assert diagnoser.start() is not None
    assert diagnoser.cancel(["x"]) == "cancelled axis x: fitting the rigid model"
    job = diagnoser.start()
    assert job is not None and job.run.axis == "y"
    diagnoser.finish("not done here")
    assert diagnoser.start() is None and [(answer.request, answer.done) for answer in diagnoser.answers()] == [(number, False)]


def test_it_says_which_seconds_a_story_is_about_and_renews_it() -> None:
    """The used range since the first sample; after renew, the model has its effects on the newest samples, without a diagnosis."""
    diagnoser = Diagnoser(DiagnoserSettings(minimum=5.0, memory=6.0), AXES)
    send(diagnoser, 0, 16_000)
    diagnoser.ask("begin", ["x"])
    play(diagnoser)
    assert diagnoser.used("x") == pytest.approx((2.0, 8.0), abs=0.1) and diagnoser.used("y") is None
    diagnoser.have("x", ("coulomb_friction",))
    play(diagnoser)
    send(diagnoser, 16_000, 24_000)
    assert diagnoser.used("x") == pytest.approx((2.0, 8.0), abs=0.1)
    diagnoser.ask("renew", ["x"])
    assert play(diagnoser) == ["x fitting the rigid model", "x the rigid model is fitted", "x adding coulomb_friction", "x with coulomb_friction"]
    assert diagnoser.used("x") == pytest.approx((6.0, 12.0), abs=0.1) and diagnoser.stories["x"].effects == ("coulomb_friction",)
    diagnoser.reset()
    assert diagnoser.used("x") is None
