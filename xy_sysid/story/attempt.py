"""A calculation that may fail: any error in it becomes a sentence with the next action, and the process continues."""

from __future__ import annotations

import traceback
from types import TracebackType

from xy_sysid.errors import XySysidError

LONGEST = 200  # characters of an error message that are kept
UNFORESEEN = (
    "This step could not be calculated, and the model stays as it was. Try another effect or another part of the recording. "
    "If it happens again, please report it with the recording and the log."
)
BROKEN = "This failed because of an error in xy_sysid. Try other data; if it fails again, please report it with the recording and the log."
NO_MEMORY = "There is not enough memory for this step, and the model stays as it was. Use a shorter part of the recording, or close others."


class Attempt:
    """Context for a calculation. problem: the sentence, empty on success; detail: type, text and place of an unforeseen error, for a log.

    Errors of a broken pipe or file are raised: they end the process that uses it.
    """

    def __init__(self, unforeseen: str = UNFORESEEN) -> None:
        """unforeseen: the sentence for an unforeseen error."""
        self.problem, self.detail = "", ""
        self._unforeseen = unforeseen

    def __enter__(self) -> Attempt:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> bool:
        if not isinstance(error, Exception) or isinstance(error, (OSError, EOFError)):
            return False
        if isinstance(error, XySysidError):
            self.problem = str(error)
            return True
        frames = traceback.extract_tb(trace)
        place = f" in {frames[-1].name}, line {frames[-1].lineno}" if frames else ""
        self.detail = f"{type(error).__name__}{place}: {' '.join(str(error).split())[:LONGEST]}"
        self.problem = NO_MEMORY if isinstance(error, MemoryError) else self._unforeseen
        return True
