"""STOP is on while any node holds it; an override first names the holders."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from xy_sysid.excitation.stop_latch import AGAIN, StopLatch

A, B = b"a", b"b"


def test_only_who_set_it_releases_it() -> None:
    """False from another node has no effect; false from the same node releases; duplicates of a message are ignored."""
    latch = StopLatch()
    latch.heard(A, 1, True)
    latch.heard(B, 1, True)
    latch.heard(B, 2, False)
    assert latch.holders == (A,)
    latch.heard(A, 2, False)
    latch.heard(A, 1, True)  # the first message again, on another subscription
    assert list(latch.holders) == []


def test_an_operator_overrides_whom_he_was_told_of_and_nobody_else() -> None:
    """The first call names the holders; a new holder in between is named again; a late second call counts as a first one."""
    latch = StopLatch()
    assert latch.release(0.0, bytes.decode) == (True, "STOP is not on")
    latch.heard(A, 1, True)
    done, words = latch.release(1.0, bytes.decode)
    assert not done and "held by a:" in words and latch.holders == (A,)
    latch.heard(B, 1, True)
    done, words = latch.release(2.0, bytes.decode)
    assert not done and "held by a and b:" in words
    assert not latch.release(3.0 + AGAIN, bytes.decode)[0]
    done, words = latch.release(4.0 + AGAIN, bytes.decode)
    assert done and "a and b is overridden" in words and list(latch.holders) == []
    latch.heard(A, 2, True)
    assert latch.holders == (A,)


def test_a_short_stop_is_not_forgotten() -> None:
    """True and false between two looks of the drive, or a STOP that arrives with an operator's release: the drive learns of it once."""
    latch = StopLatch()
    assert not latch.asked()
    latch.heard(A, 1, True)
    latch.heard(A, 2, False)
    assert list(latch.holders) == [] and latch.asked() and not latch.asked()
    latch.heard(B, 1, True)
    latch.release(0.0, bytes.decode)
    assert latch.release(1.0, bytes.decode)[0] and list(latch.holders) == []
    assert latch.asked() and not latch.asked()
    latch.heard(A, 3, False)
    assert not latch.asked()


@given(st.lists(st.tuples(st.integers(0, 300), st.booleans()), max_size=400))
def test_it_is_on_exactly_while_somebody_said_so_last(messages: list[tuple[int, bool]]) -> None:
    """With any number of nodes that appear and disappear, no holder is forgotten."""
    latch, last = StopLatch(), dict[int, bool]()
    for number, (publisher, on) in enumerate(messages):
        latch.heard(str(publisher).encode(), number, on)
        last[publisher] = on
    assert {int(one) for one in latch.holders} == {publisher for publisher, on in last.items() if on}
