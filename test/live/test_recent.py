"""A fault is a warning only as long as it continues."""

from __future__ import annotations

from xy_sysid.live.recent import CLEARS, Recent


def test_a_complaint_clears_when_nothing_new_has_come_for_some_seconds() -> None:
    """It is reported at once, continues while its count grows, ends within 10 s after that, and starts again with the next one."""
    recent = Recent()
    assert not recent.goes_on("refused", 0, 0.0)
    assert recent.goes_on("refused", 1, 1.0) and recent.goes_on("refused", 1, 1.0 + CLEARS - 0.1)
    assert recent.goes_on("refused", 2, 9.0) and recent.goes_on("refused", 2, 16.0)
    assert not recent.goes_on("refused", 2, 9.0 + CLEARS) and CLEARS < 9.0
    assert recent.goes_on("refused", 3, 30.0) and recent.goes_on("another", "words", 30.0)
