"""The exceptions of this package.

A failed fit is a result; a wrong call is one of these exceptions. Each text says what was given, what is allowed,
and what to do next, in one line, so that any surface can print it as it is.
"""

from __future__ import annotations

from typing import Any


class XySysidError(Exception):
    """Base of every error that a user can mend; its text is one line, fit to be shown. Another process can hand it back."""

    def __reduce__(self) -> tuple[Any, ...]:
        return Exception.__new__, (type(self), *self.args), self.__dict__


class BadInput(XySysidError):
    """A value is outside what is allowed."""

    def __init__(self, what: str, value: object, allowed: str, act: str) -> None:
        super().__init__(f"{what} is {value}; allowed: {allowed}. {act}".replace("\n", " ").strip())
        self.what, self.value, self.allowed, self.act = what, value, allowed, act


class BadRecording(XySysidError):
    """A file or folder that should hold a recording cannot be read as one."""

    def __init__(self, path: object, problem: str, act: str) -> None:
        super().__init__(f"{path}: {problem}. {act}".replace("\n", " ").strip())
        self.path, self.problem, self.act = path, problem, act


class MissingExtra(XySysidError):
    """An optional part (ROS 2, python-control, ...) is not installed."""

    def __init__(self, what: str, extra: str) -> None:
        super().__init__(f"{what} is not installed. Install it with: pip install 'xy_sysid[{extra}]'")
        self.extra = extra


class ReaderGone(Exception):
    """Who reads what a command says has gone away; not the user's mistake, and nothing is left to be said."""
