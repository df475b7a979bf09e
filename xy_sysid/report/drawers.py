"""Draws the figures of stories in other processes while the next story is computed. Matplotlib would block this process's interpreter."""

from __future__ import annotations

import multiprocessing
from collections.abc import Sequence
from multiprocessing.pool import AsyncResult
from types import TracebackType
from typing import Any

from xy_sysid.processes.deaf import deaf
from xy_sysid.report.gallery import drawings, written
from xy_sysid.report.story_parts import Document
from xy_sysid.report.vector import installed

Drawn = dict[str, dict[str, bytes]]


class Drawers:
    """Call ask(name, document) to start drawing an axis, then drawn(name) for its figures by title and kind. Raises MissingExtra at once.

    kinds: svg, pdf, csv; columns: of a journal, 1 or 2; share: number of processes, each of which draws a part of every story
    """

    def __init__(self, kinds: Sequence[str], columns: int, share: int) -> None:
        if {*kinds} - {"csv"}:
            installed()
        self._kinds, self._columns, self._share = tuple(kinds), columns, share
        self._asked: dict[str, tuple[list[str], list[AsyncResult[Drawn]]]] = {}

    def __enter__(self) -> None:
        with deaf():
            self._pool = multiprocessing.get_context("spawn").Pool(self._share)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._pool.terminate()

    def ask(self, name: str, document: Document) -> None:
        """Start drawing."""
        titles = list(drawings(document))
        parts = [titles[first :: self._share] for first in range(self._share)]
        self._asked[name] = titles, [self._pool.apply_async(written, (document, self._kinds, self._columns, part)) for part in parts]

    def drawn(self, name: str) -> Drawn:
        """All figures; waits until they are drawn."""
        titles, parts = self._asked[name]
        found: dict[str, Any] = {title: content for part in parts for title, content in part.get().items()}
        return {title: found[title] for title in titles}
