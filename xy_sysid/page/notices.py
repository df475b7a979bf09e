"""Which of the session's messages one page shows, and for how long."""

from __future__ import annotations

from collections.abc import Iterable

from xy_sysid.page.session import Message

SHOWN = 4  # messages on the page at a time
GOOD_STAYS, BAD_STAYS = 8.0, 60.0  # s that a message stays
BEFORE = 30.0  # s before a page is opened whose messages are new to it: it may be a page that was lost, and is loaded again


class Notices:
    """The messages of one page. A message stays for its time from when the page could first show it, however long the page was at work before."""

    def __init__(self, now: float) -> None:
        self._looked = now - BEFORE
        self._since: dict[int, float] = {}

    def shown(self, messages: Iterable[Message], now: float) -> list[Message]:
        """The newest messages whose time is not over. now: s, on the clock of the messages."""
        known = list(messages)
        since = {one.number: self._since.get(one.number, now if one.at >= self._looked else one.at) for one in known}
        self._since, self._looked = since, now
        return [one for one in known if now - since[one.number] < (GOOD_STAYS if one.good else BAD_STAYS)][-SHOWN:]
