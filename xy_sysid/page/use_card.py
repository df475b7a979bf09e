"""The card *Use the model*: numbers to paste and files, as ``xy-sysid use`` gives them; in the demo, also the following of a path."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

from nicegui import ui

from xy_sysid.live.status_values import METRES
from xy_sysid.page.beside import OneCommand
from xy_sysid.page.buttons import heeded
from xy_sysid.page.downloads import plain_name
from xy_sysid.page.orders import Source
from xy_sysid.page.session import Session
from xy_sysid.page.use_job import used_files, used_text

FOLLOWER = "demo_follower"  # the node of ``xy-sysid demo --use``
BUSY = ("stopping the excitation", "designing", "following")


class UseCard:
    """One source in one browser."""

    def __init__(self, session: Session, source: Source) -> None:
        self._session, self._source = session, source
        self._shown: object = None
        self._command = OneCommand(session)
        with ui.element("section").classes("card use").props('aria-label="use the model"') as self._card:
            ui.html("<h2>Use the model</h2>", sanitize=False)
            ui.label("Numbers for your controller, and files for other programs, from the newest models.").classes("soft small")
            with ui.element("div").classes("buttons"):
                self._limit = ui.number("limit of the drive", min=1e-9).props("outlined dense clearable data-part=use-limit").style("width:9rem")
                self._numbers = heeded(ui.button("Numbers to paste", on_click=self._tell).props("outline dense no-caps data-act=use-numbers"))
                self._files = heeded(ui.button("Files (ZIP)", on_click=self._pack).props("outline dense no-caps data-act=use-files"))
            self._text = ui.element("div").classes("use-text").props('tabindex=0 role=region aria-label="numbers to paste" data-part=use-text')
            with ui.element("div").classes("stack").style("gap:.3rem") as self._path:
                self._go = heeded(ui.button("Use it", on_click=self._follow).props("unelevated dense no-caps data-act=use-it"))
                self._state = ui.label("").classes("soft small").props("role=status aria-live=polite data-part=use-state")
                self._errors = ui.element("div").classes("rows small").props("data-part=use-errors")
        self._text.set_visibility(False)

    def refresh(self) -> None:
        """Update the card."""
        documents = self._documents()
        for button in (self._numbers, self._files):
            button.set_enabled(bool(documents) and not self._command.running)
        there = self._source.live and FOLLOWER in self._session.heard.present
        self._path.set_visibility(there)
        if there:
            values = self._session.heard.values(FOLLOWER)
            status = self._session.heard.statuses.get(FOLLOWER)
            self._go.set_enabled(0 < len(documents) == len(self._source.axes()) and values.get("state") not in BUSY)
            self._state.set_text(f"A path on the simulated machine: {status.message if status else 'not begun'}.")
            self._write(values)

    def _asked(self) -> tuple[dict[str, dict[str, Any]], Path | None, tuple[str, ...], float | None]:
        """Models, the recording and its reading options, and the drive's limit."""
        path, how = getattr(self._source, "path", None), getattr(self._source, "how", self._session.reading)
        return self._documents(), path, how.words, self._limit.value

    def _documents(self) -> dict[str, dict[str, Any]]:
        found = {axis: self._source.document(axis) for axis in self._source.axes()}
        return {axis: document for axis, document in found.items() if document and document.get("model")}

    def _write(self, values: dict[str, str]) -> None:
        rows = [(key.removesuffix(METRES), f"{1e6 * float(value):.3g} um rms") for key, value in values.items() if key.endswith(METRES)]
        if rows != self._shown:
            self._shown = rows
            self._errors.clear()
            with self._errors:
                for name, text in rows:
                    ui.label(name)
                    ui.label(text)

    def _follow(self) -> None:
        if self._session.link is not None:
            self._session.link.trigger(
                f"{FOLLOWER}/use", lambda done, words: self._session.say(words or "the demo's controller did not answer", done)
            )

    async def _tell(self) -> None:
        text = await self._command.run("use", used_text, *self._asked())
        if text:
            self._text.clear()
            with self._text:
                ui.html(_lines(str(text)), sanitize=False)
            self._text.set_visibility(True)

    async def _pack(self) -> None:
        packed = await self._command.run("use", used_files, *self._asked())
        if packed:
            ui.download.content(packed, f"{plain_name(self._source.title)}.use.zip")


def _lines(text: str) -> str:
    """The command's tables unchanged; its indented sentences wrap."""
    made = [html.escape(line) for line in text.splitlines()]
    return "".join(f"<p>{line}</p>" if line.startswith("  ") and line.endswith(".") else f"<pre>{line}</pre>" for line in made)
