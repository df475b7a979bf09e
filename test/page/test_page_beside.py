"""Any error in a worker becomes a sentence with the next action: never the name of a Python error on the page."""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from helpers.ros_tools import needs_ros

from xy_sysid.errors import BadInput
from xy_sysid.page import worker
from xy_sysid.page.beside import asked, beside
from xy_sysid.page.orders import Reading, WorkerNews
from xy_sysid.story.attempt import BROKEN

WHAT = ("report", "not written", "a recording with a usable axis")
TRACE = 'Traceback (most recent call last):\n  File "x.py", line 3, in f\nValueError: min() arg is an empty sequence\n'


class Heard:
    """The messages of a session."""

    def __init__(self) -> None:
        self.words: list[str] = []

    def say(self, words: str, good: bool = False) -> None:
        self.words.append(words)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ValueError("min() arg is an empty sequence"), BROKEN),
        (KeyError("gain"), BROKEN),
        (BadInput("table", "'a'", "one of the list", "Choose one."), "table is 'a'; allowed: one of the list. Choose one."),
        (PermissionError(13, "Permission denied", "/data/a.parquet"), "/data/a.parquet: Permission denied"),
    ],
    ids=lambda item: type(item).__name__,
)
def test_work_that_fails_is_told_in_a_sentence(error: Exception, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Errors of trend, columns, report and use of a model; the place of the error is in the log."""
    session: Any = Heard()

    async def fails() -> int:
        raise error

    assert asyncio.run(beside(session, fails)) is None
    assert session.words == [words]
    assert ("in fails" in capsys.readouterr().err) == (words == BROKEN)


def test_work_that_succeeds_is_given_on() -> None:
    """Without a message."""
    session: Any = Heard()

    async def works() -> int:
        return 3

    assert asyncio.run(beside(session, works)) == 3 and session.words == []


@pytest.mark.parametrize(
    ("code", "said", "words"),
    [(1, TRACE, BROKEN), (-9, "", BROKEN), (2, "note: short\nxy-sysid: axis is q; allowed: x. Choose one.\n", "axis is q; allowed: x. Choose one.")],
)
def test_a_command_that_fails_is_told_by_its_own_line_or_a_sentence(code: int, said: str, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A traceback goes to the log."""
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: subprocess.CompletedProcess([], code, "", said))
    with pytest.raises(BadInput) as caught:
        asked(("report", "a.npz"), WHAT)
    assert words in str(caught.value) and "ValueError" not in str(caught.value)


def test_a_recording_that_cannot_be_opened_for_an_error_of_ours_is_closed_with_a_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The worker does not end silently."""
    sent: list[WorkerNews] = []

    def broken(*_: object) -> None:
        raise ValueError("min() arg is an empty sequence")

    class Words:
        def send(self, news: WorkerNews) -> None:
            sent.append(news)

    words: Any = Words()
    monkeypatch.setattr(worker, "Desk", broken)
    monkeypatch.setattr(signal, "signal", lambda *_: None)
    worker.main("a.npz", Reading(), words, words)
    assert [(news.kind, news.words) for news in sent] == [("closed", BROKEN)]
    assert "a.npz: ValueError in broken" in capsys.readouterr().err


@needs_ros
def test_a_walk_that_fails_is_told_in_a_sentence() -> None:
    """Design the next experiment, Run it: an internal error ends it with the next action, and its name is in the log."""
    from xy_sysid.nodes.settle import Settler
    from xy_sysid.nodes.wall import Wall

    said: list[str] = []
    logged: list[str] = []

    class Node:
        def get_logger(self) -> Any:
            return self

        def error(self, words: str) -> None:
            logged.append(words)

    settler: Any = object.__new__(Settler)
    settler._wall, settler._node, settler._say, settler.problem, settler.doing = Wall(lambda words: None), Node(), said.append, "", ""

    def broken() -> None:
        raise ValueError("min() arg is an empty sequence")

    settler.settings = broken
    assert settler.run() is False and settler.problem == BROKEN and said == [BROKEN]
    assert "ValueError" in logged[0]


def test_every_worker_of_the_page_is_behind_such_a_sentence() -> None:
    """All work in other threads or processes of the page uses ``beside``, except the drawing of figures; other processes return their errors."""
    folder = Path(sys.modules["xy_sysid.page.beside"].__file__ or "").parent
    bold = {
        f"{path.name}: {line.strip()}"
        for path in folder.glob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if ("io_bound(" in line or "cpu_bound(" in line) and ("beside(" not in line or ("cpu_bound(" in line and "returned," not in line))
    }
    assert bold == {
        "files_dialog.py: names = await run.io_bound(session.shelf.names) or await run.io_bound(session.shelf.names, texts=True)",
        "control.py: words = await run.io_bound(session.recorder.stop)",
        "plot.py: drawn = await run.io_bound(copy_context().run, session.figure, key, lambda: plain(make(*arguments, **named)))",
    }
