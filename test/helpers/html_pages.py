"""The content of a page of HTML."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from typing import Any


class Elements(HTMLParser):
    """Tags with their attributes, and the text outside scripts and styles."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self.skipping = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self.skipping = tag in ("script", "style")

    def handle_endtag(self, tag: str) -> None:
        self.skipping = self.skipping and tag not in ("script", "style")

    def handle_data(self, data: str) -> None:
        if not self.skipping:
            self.text.append(data)


def parsed(page: str) -> Elements:
    found = Elements()
    found.feed(page)
    return found


def plots(page: str) -> dict[str, Any]:
    match = re.search(r'<script type="application/json" id="plots">(.*?)</script>', page, re.S)
    assert match is not None
    found: dict[str, Any] = json.loads(match.group(1))["plots"]
    return found
