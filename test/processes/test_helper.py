"""Work of a parallel process, and its result if that process ends."""

from __future__ import annotations

import operator
import os
import signal
import time

import pytest

from xy_sysid.processes.helper import Helper


def test_another_process_works_and_answers_in_order() -> None:
    """The caller waits for each result only when it is needed."""
    with Helper("xy_sysid.errors") as helper:
        other, total, mine = helper.begin(os.getpid), helper.begin(operator.add, 2, 3), os.getpid()
        assert total() == 5 and other() != mine


def test_what_a_helper_that_died_left_is_done_here() -> None:
    """By an error of a function, which is raised here unchanged, or killed."""
    with Helper("xy_sysid.errors") as helper:
        wrong, after = helper.begin(operator.truediv, 1, 0), helper.begin(os.getpid)
        with pytest.raises(ZeroDivisionError):
            wrong()
        assert after() == os.getpid()
    with Helper("xy_sysid.errors") as helper:
        os.kill(helper.begin(os.getpid)(), signal.SIGKILL)
        assert helper.begin(operator.add, 2, 3)() == 5


def test_who_leaves_does_not_wait_for_what_nobody_needs_any_more() -> None:
    begun = time.monotonic()
    with Helper("xy_sysid.errors") as helper:
        helper.begin(time.sleep, 600.0)
    assert time.monotonic() - begun < 300.0


def test_on_one_core_nothing_is_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    """The result is computed at the call."""
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    with Helper("xy_sysid.errors") as helper:
        assert helper.begin(os.getpid)() == os.getpid()
