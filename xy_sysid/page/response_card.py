"""The card of a file that holds a measured frequency response without samples: the response with its fit, and the fit's results."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING

import plotly.graph_objects as go
from nicegui import ui

from xy_sysid.page.plot import Plot
from xy_sysid.page.questions_card import as_html
from xy_sysid.page.session import Session

if TYPE_CHECKING:
    from xy_sysid.page.recordings import OpenRecording

READING = (
    "A response that was measured elsewhere, with its 95 % band, and the fitted transfer function. "
    "Questions that need samples in time cannot be answered from such a file."
)


class ResponseCard:
    """One file in one browser; empty for recordings."""

    def __init__(self, session: Session, source: OpenRecording) -> None:
        self._session, self._source = session, source
        self._plots: dict[str, Plot] = {}
        self._root = ui.element("div").classes("stack").props("data-part=responses")

    async def refresh(self) -> None:
        """Draw the response of the file."""
        for name, told in self._source.about.get("responses", {}).items():
            if name not in self._plots:
                with self._root, ui.element("section").classes("card").props(f'aria-label="response of {name}"'):
                    ui.html(f"<h2>Measured frequency response, {html.escape(name)}</h2>", sanitize=False)
                    self._plots[name] = Plot(READING, f"response_{name}", 460)
                    with ui.element("div").classes("use-text"):
                        ui.html(as_html(told["words"]), sanitize=False)
            await self._plots[name].show(self._session, ("response", self._source.key, name), go.Figure, told["figure"])
            self._plots[name].say(READING)
