"""Whether two single-axis models suffice: the verdict on two axes driven at the same time, live or on request for a recording."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from xy_sysid.live.coupling_messages import COUPLING_COLUMNS
from xy_sysid.page.beside import OneCommand, asked
from xy_sysid.page.buttons import heeded
from xy_sysid.page.orders import Source
from xy_sysid.page.plot import Plot
from xy_sysid.page.session import Session
from xy_sysid.page.topics_state import columns
from xy_sysid.report.coupling import CAPTION, bands_figure

TWO = 2


class CouplingCard:
    """The card of one source in one browser; shown for two or more axes."""

    def __init__(self, session: Session, source: Source) -> None:
        self._session, self._source = session, source
        self._found: dict[str, Any] = {}
        self._count = 0
        self._command = OneCommand(session)
        kind = "card coupling live" if source.live else "card coupling"
        with ui.element("section").classes(kind).props('aria-label="two axes at once"') as self._card:
            ui.html("<h2>Two axes at once</h2>", sanitize=False)
            self._words = ui.label("").classes("soft").props("role=status aria-live=polite data-part=coupling")
            with ui.element("div").classes("buttons") as self._buttons:
                heeded(ui.button("Test the coupling", on_click=self._ask).props("outline dense no-caps data-act=coupling"))
            self._plot = Plot(CAPTION, "coupling", 320)

    async def refresh(self) -> None:
        """Redraw what has changed."""
        source = self._source
        axes = source.axes()
        if source.live:
            self._hear(axes)
        self._card.set_visibility(len(axes) >= TWO)
        self._buttons.set_visibility(not source.live)
        self._words.set_text(self._found.get("sentence", "Does the drive of one axis move the other, too? Needs both axes driven at once."))
        self._plot.root.set_visibility(source.live or bool(self._found))  # for the machine, keep the space: the verdict arrives by itself
        if self._found:
            edges, least, most = (np.asarray(self._found[name], dtype=np.float64) for name in ("band_edges", "coupling", "at_most"))
            await self._plot.show(self._session, ("coupling", source.key, self._count), bands_figure, self._found["axes"], edges, least, most)
            self._plot.say(f"{self._found['sentence']} {CAPTION}")

    def _hear(self, axes: tuple[str, ...]) -> None:
        """Show the identifier's result in the words of the command."""
        said, bands = self._session.heard.coupling()
        table = columns(bands) if bands is not None else {}
        if not said or not table or len(axes) < TWO:
            return
        low, high, least, most = (table[name] for name in COUPLING_COLUMNS)
        found = {"axes": axes[:TWO], "sentence": said, "band_edges": [*low, high[-1]], "coupling": [*least], "at_most": [*most]}
        if found != self._found:
            self._found, self._count = found, self._count + 1

    async def _ask(self) -> None:
        path, how = getattr(self._source, "path", None), getattr(self._source, "how", self._session.reading)
        text = await self._command.run("coupling", coupling_text, path, how.words) if path is not None else None
        if text:
            self._found, self._count = json.loads(str(text)), self._count + 1


def coupling_text(path: Path, words: tuple[str, ...]) -> str:
    """The output of ``xy-sysid coupling --json`` for a recording with these reading options. Raises BadInput with the command's error."""
    return asked(("coupling", str(path), *words, "--json"), ("coupling", "not told", "two axes that were driven at once"))
