"""Errors in a Python file of the user are reported as errors of that file, with the line.

A file may raise any error, end the process or recurse without end, when it is loaded and whenever its functions are called.
"""

from __future__ import annotations

import gc
import re
import traceback
from pathlib import Path
from types import FunctionType, TracebackType

from xy_sysid.errors import BadInput, XySysidError

LAW = re.compile(r"<function \S+ at 0x([0-9a-fA-F]+)>")  # in numba's message on a law that it cannot compile
COLOUR = re.compile(r"\x1b\[[0-9;]*m")  # numba colours its messages if colorama is installed
CAUSE = re.compile(r"^\s*(\w+Error: .+)$", re.MULTILINE)
_files: set[str] = set()
_loaded: list[Path] = []  # in the order of loading, repeated if loaded again


def run_from(path: Path) -> None:
    """From now on, errors in this file are reported as its own."""
    _files.add(str(path))
    _files.add(str(path.resolve()))
    _loaded.append(path.resolve())


class blamed:
    """Context in which an error in one of those files becomes BadInput with the file and the line.

    loading: every error is attributed to this file, even if Python names no line.
    """

    def __init__(self, loading: Path | None = None) -> None:
        self._loading = loading

    def __enter__(self) -> None:
        self._begun = len(_loaded)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if error is None or not _files or isinstance(error, (KeyboardInterrupt, XySysidError)):
            return
        place = _place(error, trace)
        where = f"{place[0]}, line {place[1]}" if place is not None else self._loading or self._compiled_from(error, trace)
        if where is not None:
            raise BadInput(f"effect file {where}", _said(error), "code that runs through", "Correct it; see docs/your-own-effect.md.") from None

    def _compiled_from(self, error: BaseException, trace: TracebackType | None) -> str | None:
        """The files with compiled laws, if one does not compile or divides by zero: built-in laws do neither, and numba does not name the file."""
        *_, (frame, _) = traceback.walk_tb(trace)
        divides = isinstance(error, ZeroDivisionError) and Path(frame.f_code.co_filename).parent.name == "axis"
        if not (divides or type(error).__module__.startswith("numba.")):
            return None
        return " or ".join(sorted({str(path) for path in _loaded[self._begun :] or _loaded}))


def _place(error: BaseException, trace: TracebackType | None) -> tuple[str, int] | None:
    """File and line of the user's code in which the error occurred; None if there is none."""
    if isinstance(error, SyntaxError) and error.filename in _files:
        return str(error.filename), error.lineno or 1
    frames = [(frame.f_code.co_filename, line) for frame, line in traceback.walk_tb(trace)]
    return next((place for place in reversed(frames) if place[0] in _files), None) or _law(str(error))


def _law(words: str) -> tuple[str, int] | None:
    """File and line of the law in numba's message, if it is from one of those files; laws of several files may have one name."""
    named = {int(place, 16) for place in LAW.findall(words)}
    found = (item for item in gc.get_objects() if type(item) is FunctionType and id(item) in named) if named else ()
    return next(((law.__code__.co_filename, law.__code__.co_firstlineno) for law in found if law.__code__.co_filename in _files), None)


def _said(error: BaseException) -> str:
    """The message of an error in one line; of numba's many lines, the one with the cause."""
    words = COLOUR.sub("", str(error.msg) if isinstance(error, SyntaxError) else str(error))
    causes = [cause for cause in CAUSE.findall(words) if "Failed in" not in cause]
    first = next((line.strip() for line in words.splitlines() if line.strip()), "")
    return causes[-1] if causes and LAW.search(words) else f"{type(error).__name__}: {first}".rstrip(": ")
