"""Downloads: the model, the story, the report. The browser receives content and never sends a path."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from pathlib import Path

from nicegui import ui

from xy_sysid.files.story_models import model_text
from xy_sysid.page.beside import asked, waited
from xy_sysid.page.orders import Reading, Source
from xy_sysid.page.session import Session


class Downloads:
    """The buttons, for one axis of one source in one browser."""

    def __init__(self, session: Session, source: Source, axis: Callable[[], str]) -> None:
        self._session, self._source, self._axis = session, source, axis
        with ui.element("div").classes("buttons"):
            ui.button("Model (YAML)", on_click=lambda: self.take("model")).props("outline dense no-caps data-take=model")
            ui.button("Story (JSON)", on_click=lambda: self.take("story")).props("outline dense no-caps data-take=story")
            if not source.live:
                ui.button("Report (HTML)", on_click=self._report).props("outline dense no-caps data-take=report")
        ui.label("To save a figure or its numbers, use the SVG, PNG and CSV buttons below it.").classes("soft small")

    def take(self, kind: str) -> None:
        """Download the newest models of all axes, or the story of the selected axis."""
        source, axis = self._source, self._axis()
        documents = {name: source.document(name) for name in source.axes()}
        found = {name: document for name, document in documents.items() if document}
        if not found:
            self._session.say("There is no story to download yet.")
        elif kind == "model":
            ui.download.content(model_text(source.title, found), f"{plain_name(source.title)}.model.yaml")
        else:
            ui.download.content(json.dumps(found.get(axis, {}), allow_nan=False), f"{plain_name(source.title)}.{axis}.story.json")

    async def _report(self) -> None:
        path = getattr(self._source, "path", None)
        if path is None:
            self._session.say("A report needs a recording. Record a bag and open it.")
            return
        reading = getattr(self._source, "how", self._session.reading)
        page = await waited(self._session, "The report is being written ...", report_text, path, reading)
        if page:
            ui.download.content(page, f"{plain_name(self._source.title)}.report.html")


def report_text(path: Path, reading: Reading) -> str:
    """The report of a recording with these reading options, as ``xy-sysid report`` writes it. Raises BadInput with its error. Takes seconds."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "report.html"
        asked(("report", str(path), "-o", str(out), *reading.words), ("report", "not written", "a recording with a usable axis"))
        return out.read_text(encoding="utf-8")


def plain_name(title: str) -> str:
    """A file name made from a title."""
    return "".join(letter if letter.isalnum() or letter in "-_." else "_" for letter in title)[:60] or "axis"
