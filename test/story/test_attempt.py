"""A failed calculation gives the next action, and never the Python name of the error."""

from __future__ import annotations

import pytest

from xy_sysid.errors import BadInput
from xy_sysid.story.attempt import Attempt


@pytest.mark.parametrize(
    "error", [ValueError("min() arg is an empty sequence"), IndexError("7"), KeyError("gain"), MemoryError(), ZeroDivisionError()]
)
def test_an_unforeseen_error_becomes_a_sentence_with_what_to_do(error: Exception) -> None:
    """Its name and place are only in the log."""
    with Attempt() as attempt:
        raise error
    assert "the model stays as it was" in attempt.problem and type(error).__name__ not in attempt.problem
    assert attempt.detail.startswith(f"{type(error).__name__} in test_an_unforeseen")
    assert ". Try another effect" in attempt.problem or "Use a shorter part" in attempt.problem


def test_a_refusal_keeps_its_own_words_and_a_broken_pipe_passes() -> None:
    """BadInput says what to change; a process with a broken pipe must end."""
    with Attempt() as attempt:
        raise BadInput("effect", "'x'", "one of the library", "Choose another.")
    assert "Choose another." in attempt.problem and attempt.detail == ""
    with pytest.raises(BrokenPipeError), Attempt():
        raise BrokenPipeError
    with Attempt() as attempt:
        pass
    assert attempt.problem == ""
