"""One source on the page: its axes, their numbers, pictures and story. What has not changed is not drawn again."""

from __future__ import annotations

from collections.abc import MutableMapping
from typing import Any

from nicegui import app, ui

from xy_sysid.page.control import Control
from xy_sysid.page.facts import seconds_text
from xy_sysid.page.numbers_card import Numbers
from xy_sysid.page.picture_card import Cards
from xy_sysid.page.session import Session
from xy_sysid.page.story_card import StoryCard
from xy_sysid.page.wishes import Source

SHORT = 3  # letters of an axis' name that needs the word axis before it


class Panel:
    """A source in one browser."""

    def __init__(self, session: Session, source: Source) -> None:
        self._session, self._source = session, source
        self._axis = ""
        self._axes: tuple[str, ...] = ()
        self._control: Control | None = None
        with ui.element("section").classes("panel").props(f'id={source.key} aria-label="{"machine" if source.live else "recording"}"') as self._root:
            with ui.element("div").classes("head"):
                self._title = ui.label("").classes("grow").props("role=heading aria-level=2").style("font-weight:600;font-size:1.1rem")
                self._choice = ui.toggle({}, on_change=lambda event: self._turn(str(event.value))).props('dense no-caps aria-label="axis"')
                if not source.live:
                    ui.button(icon="close", on_click=lambda: session.close_recording(source.key)).props('flat dense aria-label="close recording"')
            self._problem = ui.label("").classes("notice").props("role=alert")
            self._wait = ui.linear_progress(0, show_value=False).props('instant-feedback aria-label="reading"')
            with ui.element("div").classes("split") as self._split:
                with ui.element("div").classes("stack") as self._pictures:
                    self._numbers = Numbers()
                    self._cards = Cards(session, source)
                with ui.element("div").classes("stack side"):
                    if source.live:
                        self._control = Control(session)
                    self._story = StoryCard(session, source)

    def delete(self) -> None:
        """Take it off the page."""
        self._root.delete()

    async def refresh(self) -> None:
        """Draw what has changed."""
        source = self._source
        self._head()
        axes = source.axes()
        if axes != self._axes:
            self._axes = axes
            wanted = (self._axis, self._tab().get(self._source.key, ""), *axes)
            self._axis = next((axis for axis in wanted if axis in axes), "")
            self._choice.set_options({axis: f"axis {axis}" if len(axis) <= SHORT else axis for axis in axes}, value=self._axis or None)
        if self._control is not None:
            self._control.refresh(self._axes)
        self._pictures.set_visibility(bool(self._axis))
        self._story.root.set_visibility(bool(self._axis))
        if self._axis:
            self._numbers.refresh(self._session, source, self._axis)
            await self._story.refresh(self._axis)
            await self._cards.refresh(self._axis)

    def _head(self) -> None:
        source = self._source
        about: dict[str, Any] = getattr(source, "about", {})
        words = source.title if not source.live else "The machine, live"
        if about:
            words += f" · {seconds_text(about['seconds'])} at {about['rate']:g} Hz"
        self._title.set_text(words)
        problem = source.problem()
        self._problem.set_visibility(bool(problem))
        self._problem.set_text(f"Closed: {problem}" if problem else "")
        reading = getattr(source, "reading", None)
        self._wait.set_visibility(reading is not None)
        if reading is not None:
            self._wait.set_value(reading)
        self._choice.set_visibility(len(self._axes) > 1)
        self._split.set_visibility(source.live or bool(self._axes))

    def _turn(self, axis: str) -> None:
        if axis in self._axes:
            self._axis = axis
            self._tab()[self._source.key] = axis

    def _tab(self) -> MutableMapping[str, Any]:
        """What this tab of the browser keeps over a reload: which axis it shows of each source."""
        return app.storage.tab if ui.context.client.has_socket_connection else {}
