"""A complaint is a warning as long as it goes on, and no longer."""

from __future__ import annotations

from xy_sysid.live.recent import CLEARS, Recent


def test_a_complaint_clears_when_nothing_new_has_come_for_some_seconds() -> None:
    """It is said at once, goes on while its count grows, is over within 10 s after that, and begins anew with the next one."""
    recent = Recent()
    assert not recent.goes_on("refused", 0, 0.0)
    assert recent.goes_on("refused", 1, 1.0) and recent.goes_on("refused", 1, 1.0 + CLEARS - 0.1)
    assert recent.goes_on("refused", 2, 9.0) and recent.goes_on("refused", 2, 16.0)
    assert not recent.goes_on("refused", 2, 9.0 + CLEARS) and CLEARS < 9.0
    assert recent.goes_on("refused", 3, 30.0) and recent.goes_on("another", "words", 30.0)
