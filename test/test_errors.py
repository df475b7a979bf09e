"""The errors that a user can mend."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Iterator

import pytest

from xy_sysid.errors import XySysidError


def kinds(kind: type[XySysidError]) -> Iterator[type[XySysidError]]:
    yield kind
    for one in kind.__subclasses__():
        yield from kinds(one)


@pytest.mark.parametrize("kind", list(kinds(XySysidError)))
def test_an_error_survives_the_way_from_another_process(kind: type[XySysidError]) -> None:
    """Every kind of error arrives with its text and its parts."""
    _, *names = inspect.signature(kind.__init__).parameters
    error = kind(*(f"the {name}" for name in names))
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        arrived = pickle.loads(pickle.dumps(error, protocol))
        assert type(arrived) is kind and str(arrived) == str(error) and vars(arrived) == vars(error)
