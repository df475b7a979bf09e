"""Any error in a user's effect file gives one line with the file and the line number."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.cli_tools import cli, npz

from campaigns.faults.strange import GOOD_EFFECT as GOOD
from xy_sysid.files import blame

LOADED = {
    "exit": ("import sys\n\nsys.exit(3)\n", 3, "SystemExit: 3"),
    "exit in words": ("raise SystemExit('see\\nyou')\n", 1, "SystemExit: see"),
    "syntax": ("a = 1\n\ndef f(:\n", 3, "SyntaxError: "),
    "indentation": ("if True:\na = 1\n", 2, "IndentationError: "),
    "recursion": ("def f(n):\n    return f(n + 1)\n\nf(0)\n", 2, "RecursionError: "),
    "division": ("a = 1\nb = a / 0\n", 2, "ZeroDivisionError: "),
    "assertion": ("assert False\n", 1, "AssertionError"),
    "key": ("\n\n{}['a']\n", 3, "KeyError: 'a'"),
    "own kind": ("class Own(BaseException):\n    pass\n\nraise Own('mine')\n", 4, "Own: mine"),
    "missing file": ("open('/nonexistent/file')\n", 1, "FileNotFoundError: "),
    "import": ("import nothing_of_that_name\n", 1, "ModuleNotFoundError: "),
}


@pytest.mark.parametrize("name", LOADED)
def test_an_error_while_the_file_is_loaded(name: str, tmp_path: Path) -> None:
    """Exit code 2, one line, the file, the line in it, and Python's message."""
    text, line, words = LOADED[name]
    file = tmp_path / "own.py"
    file.write_text(text)
    said = cli("effects", "--effect-file", file)
    assert said.code == 2 and said.out == "" and said.err.count("\n") == 1, said
    assert said.err.startswith(f"xy-sysid: effect file {file}, line {line} is {words}"), said.err


def test_an_error_that_has_no_line(tmp_path: Path) -> None:
    """A binary file: the error names at least the file."""
    for content in (b"a = 1\0\n", b"\xff\xfe\x00"):
        file = tmp_path / "own.py"
        file.write_bytes(content)
        said = cli("effects", "--effect-file", file)
        assert said.code == 2 and said.err.count("\n") == 1 and f"effect file {file}" in said.err and "Error: " in said.err, said


USED = {
    "guesses exit": ("    v = scene.smooth", "    raise SystemExit(1)\n    v = scene.smooth", 12, "SystemExit: 1"),
    "guesses recursion": ("    v = scene.smooth", "    list(guesses(scene))\n    v = scene.smooth", 12, "RecursionError"),
    "guesses key": ("    v = scene.smooth", "    v = {}['speed']\n    v = scene.smooth", 12, "KeyError"),
    "law does not compile": ("return coefficient *", "return nothing_of_that_name *", 5, "NameError: "),
}


@pytest.mark.parametrize("name", USED)
def test_an_error_while_its_functions_are_used(name: str, tmp_path: Path) -> None:
    """Also during a search, and if the law cannot be compiled."""
    before, after, line, words = USED[name]
    file = tmp_path / "own.py"
    assert before in GOOD
    file.write_text(GOOD.replace(before, after))
    said = cli("refine", npz(tmp_path / "rec.npz", rows=8000), "--effect-file", file, "--add", "own_drag")
    assert said.code == 2 and said.out == "" and said.err.count("\n") == 1, said
    assert f"effect file {file}, line {line} is {words}" in said.err, said.err


@pytest.mark.parametrize(("bold", "plain"), [("", ""), ("\x1b[1m", "\x1b[0m")])
def test_the_cause_is_found_in_a_message_of_numba_with_colours_and_without(bold: str, plain: str) -> None:
    """With colorama installed numba writes in bold."""
    words = f"{bold}No implementation of <function force at 0x7f96b27791c0>:{plain}\n  {bold}NameError: name 'gone' is not defined{plain}\n"
    assert blame._said(ValueError(words)) == "NameError: name 'gone' is not defined"


WRONG = {
    "five samples": ("columns(abs(v) * v)", "columns(abs(v[:5]) * v[:5])", "columns that own_drag guesses is of shape 1 x 5"),
    "no numbers": ("columns(abs(v) * v)", "columns(v * float('nan'))", "columns that own_drag guesses is not finite"),
    "three values": ("(max(float(c[0]), 1e-3),)", "(1.0, 2.0, 3.0)", "values that own_drag guesses is 1.0, 2.0, 3.0; allowed: a number for each"),
    "a word": ("(max(float(c[0]), 1e-3),)", "('word',)", "values that own_drag guesses is word"),
    "no function": ("guesses=guesses", "guesses=3", "guesses is 3"),
    "text for a force": ("return coefficient * abs(v) * v", "return 'word'", "effect file {file} is "),
    "division": ("return coefficient * abs(v) * v", "return coefficient / 0.0", "effect file {file} is ZeroDivisionError"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_its_functions_give_wrong_is_named(name: str, tmp_path: Path) -> None:
    """Wrong columns and values, and laws that cannot be computed: one line with the given and the required input."""
    before, after, words = WRONG[name]
    file = tmp_path / "own.py"
    assert before in GOOD
    file.write_text(GOOD.replace(before, after))
    said = cli("refine", npz(tmp_path / "rec.npz", rows=8000), "--effect-file", file, "--add", "own_drag")
    assert said.code == 2 and said.out == "" and said.err.count("\n") == 1, said
    assert words.format(file=file.resolve()) in said.err, said.err
