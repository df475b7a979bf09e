"""The status of the streams."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Literal

from xy_sysid.live.heard import Heard, verdict
from xy_sysid.live.plain_messages import ERROR, OK, STALE, WARN

GOOD = Heard(silent=(), paired=100, refused="", refusals=0, stamps="", sentences={})


def test_nothing_is_ok_while_nothing_is_paired() -> None:
    """Without paired samples the level is never OK."""
    quiet: tuple[tuple[Literal["voltage", "position"], ...], ...] = ((), ("voltage",))
    for silent, refused, stamps, said in itertools.product(quiet, ("", "why"), ("", "clocks"), ({}, {"lost": "2 lost"})):
        heard = Heard(silent=silent, paired=0, refused=refused, refusals=int(bool(refused)), stamps=stamps, sentences=said)
        assert verdict(heard, "well")[0] != OK
    assert verdict(GOOD, "well") == (OK, "well")


def test_what_is_wrong_is_said() -> None:
    """Refused messages with number and reason, clocks, rates; before any message only that nothing is paired."""
    none = replace(GOOD, paired=0)
    assert verdict(none, "well") == (WARN, "nothing is paired yet")
    assert verdict(replace(none, stamps="the clocks are apart"), "well") == (ERROR, "nothing is paired: the clocks are apart")
    level, text = verdict(replace(none, refused="joints a; expected b", refusals=12_191), "well")
    assert (level, text) == (ERROR, "nothing is paired: 12191 messages refused: joints a; expected b")
    assert verdict(replace(GOOD, sentences={"lost": "2 lost"}), "well") == (WARN, "2 lost")
    assert verdict(replace(none, silent=("voltage",)), "well") == (STALE, "no voltage received for a second")
