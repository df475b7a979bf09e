"""The process that works on stories: each step is reported when done, a killed or cancelled process is replaced, and none is left."""

from __future__ import annotations

import json
import multiprocessing
import time
from collections.abc import Callable, Iterator

import pytest
from helpers.busy import PATIENCE
from helpers.simulated import recorded

from xy_sysid.processes.story_process import JobNews, StoryWorker
from xy_sysid.story.acts import Job


@pytest.fixture
def worker() -> Iterator[StoryWorker]:
    made = StoryWorker()
    yield made
    made.close()
    assert not multiprocessing.active_children()


def job(effects: tuple[str, ...] = ()) -> Job:
    return Job("diagnose", recorded("x:coulomb_friction", seconds=12.0).run("x"), None, effects, 1e-3)


def until(worker: StoryWorker, done: Callable[[JobNews], bool]) -> list[JobNews]:
    """News up to the first that meets the condition."""
    heard: list[JobNews] = []
    end = time.monotonic() + PATIENCE * 120.0  # stories are computed at the lowest priority
    while time.monotonic() < end:
        heard += worker.news()
        if any(done(item) for item in heard):
            return heard
        time.sleep(0.01)
    raise AssertionError(f"not heard: {[item.doing for item in heard]}")


def test_steps_come_one_by_one_and_a_wrong_effect_is_told_in_words(worker: StoryWorker) -> None:
    """Each step with its document; a refusal ends the job, not the process."""
    worker.ask(job(("coulomb_friction",)))
    heard = until(worker, lambda item: item.ended)
    ladders = [len(json.loads(item.text)["ladder"]) for item in heard if item.text]
    assert ladders == [1, 1, 2] and not heard[-1].problem
    (first,) = multiprocessing.active_children()
    worker.ask(job(("friction",)))
    assert "coulomb_friction" in until(worker, lambda item: item.ended)[-1].problem
    assert [process.pid for process in multiprocessing.active_children()] == [first.pid]


def test_a_killed_process_is_told_and_a_cancelled_job_is_not_heard_of(worker: StoryWorker) -> None:
    """The next job starts another process."""
    worker.ask(job())
    until(worker, lambda item: bool(item.doing))
    for process in multiprocessing.active_children():
        process.kill()
    assert "exit code -9" in until(worker, lambda item: item.ended)[-1].problem
    worker.ask(job())
    until(worker, lambda item: bool(item.doing))
    worker.cancel()
    assert worker.news() == []
    worker.ask(job())
    heard = until(worker, lambda item: item.ended)
    assert not heard[-1].problem and heard[-2].story is not None
