"""The user is informed of the compilation of laws, which takes half a minute once on a computer."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import pytest
from rich.progress import Progress

from xy_sysid.cli import output

CODE = """
from xy_sysid.jit import compiled, tell_compiling
said = []
tell_compiling(lambda: said.append('begins'), lambda: said.append('ends'))
from law import law
assert law(1.0) == 2.0
print(*said)
"""


def test_compiling_is_told_as_a_whole_and_never_where_the_disk_has_it(tmp_path: Path) -> None:
    """The first process compiles a function and another for it, and reports start and end once; the second finds both on the disk."""
    text = "from xy_sysid.jit import compiled\n\n@compiled\ndef one(x):\n    return x + 1.0\n\n@compiled\ndef law(x):\n    return one(x)\n"
    (tmp_path / "law.py").write_text(text, encoding="utf-8")
    told = [subprocess.run([sys.executable, "-c", CODE], cwd=tmp_path, capture_output=True, text=True, check=True).stdout for _ in range(2)]
    assert told == ["begins ends\n", "\n"]


def test_a_bar_moves_while_laws_are_compiled_and_is_gone_after_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a terminal, also during another progress bar; no output without a terminal."""
    for terminal in (True, False):
        written = io.StringIO()
        monkeypatch.setattr(output, "aside", output.Terminal(file=written, force_terminal=terminal, width=100, legacy_windows=False))
        with output.progress() as other:
            other.add_task("axis x", total=2)
            begins, ends = output.compiling()
            begins()
            other.refresh()
            ends()
        assert (output.COMPILING in written.getvalue()) == terminal
        assert not output.aside._live_stack  # the terminal is clean afterwards


def test_the_bar_goes_on_where_the_last_one_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """One bar stands for all laws, which are compiled one after another."""
    monkeypatch.setattr(output, "aside", output.Terminal(file=io.StringIO(), force_terminal=True, width=100, legacy_windows=False))
    begun: list[Progress] = []
    monkeypatch.setattr(Progress, "start", lambda bar: begun.append(bar))
    begins, ends = output.compiling()
    for _ in range(2):
        begins()
        ends()
    assert begun[0].tasks[0].fields["before"] == 0.0 < begun[1].tasks[0].fields["before"]
