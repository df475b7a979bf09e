"""Which of the session's messages one page shows, and how long it shows them."""

from __future__ import annotations

from collections.abc import Iterable

from xy_sysid.page.session import Message

SHOWN = 4  # maximum number of messages on the page
GOOD_STAYS, BAD_STAYS = 8.0, 60.0  # s that a message stays
BEFORE = 30.0  # s before a page opens; messages since then count as new to it, because it may be a reload of a lost page


class Notices:
    """The messages of one page. The display time of a message starts when the page can first show it, even if the page was busy before."""

    def __init__(self, now: float) -> None:
        self._looked = now - BEFORE
        self._since: dict[int, float] = {}

    def shown(self, messages: Iterable[Message], now: float) -> list[Message]:
        """The newest messages whose display time has not ended. now: s, on the clock of the messages."""
        known = list(messages)
        since = {one.number: self._since.get(one.number, now if one.at >= self._looked else one.at) for one in known}
        self._since, self._looked = since, now
        return [one for one in known if now - since[one.number] < (GOOD_STAYS if one.good else BAD_STAYS)][-SHOWN:]
