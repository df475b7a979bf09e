"""The holders of STOP: each publisher that requested it, until it releases its STOP or an operator overrides it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

AGAIN = 30.0  # s in which an operator may confirm an override after the answer that names the holders
KEPT = 100  # most publishers without a STOP whose last message is stored


@dataclass(frozen=True, slots=True)
class _Said:
    """The last message of a publisher: its number, and whether STOP is on."""

    number: int
    on: bool


class StopLatch:
    """``heard`` takes messages of publishers, ``release`` requests of an operator; STOP is on while any publisher holds it."""

    def __init__(self) -> None:
        self._said: dict[bytes, _Said] = {}
        self._asked = False
        self._named: tuple[float, frozenset[bytes]] = (0.0, frozenset())  # s until which the operator may confirm, and the named holders

    @property
    def holders(self) -> tuple[bytes, ...]:
        """Publishers that hold STOP, in the order of their first messages."""
        return tuple(publisher for publisher, said in self._said.items() if said.on)

    def asked(self) -> bool:
        """True if any publisher requested STOP since the last call, even if it has released it meanwhile: a short STOP stops, too."""
        asked, self._asked = self._asked, False
        return asked

    def heard(self, publisher: bytes, number: int, on: bool) -> None:
        """Take a message and its number; one older than the last of its publisher came by the second subscription, and is ignored."""
        before = self._said.get(publisher)
        if before is not None and number < before.number:
            return
        self._said[publisher] = _Said(number, on)
        self._asked = self._asked or on
        silent = [one for one, said in self._said.items() if not said.on and one != publisher]
        for one in silent[: max(0, len(silent) - KEPT)]:
            del self._said[one]

    def release(self, now: float, name: Callable[[bytes], str]) -> tuple[bool, str]:
        """Handle an operator's release at a time, s: returns whether STOP is off, and the answer.

        The first call names the holders and changes nothing; a second one within AGAIN overrides them, unless there is a new holder.
        """
        holders = self.holders
        if not holders:
            return True, "STOP is not on"
        names = " and ".join(name(one) for one in holders)
        until, named = self._named
        if now > until or not set(holders) <= named:
            self._named = now + AGAIN, frozenset(holders)
            return False, f"STOP is held by {names}: call again within {AGAIN:g} s to override that"
        for one in holders:
            self._said[one] = _Said(self._said[one].number, False)
        self._named = 0.0, frozenset()
        return True, f"STOP of {names} is overridden: activate is allowed again"
