"""Layout of the page in one browser: bar with STOP, notices, one panel for the machine and one for each recording."""

from __future__ import annotations

import time

from nicegui import ui

from xy_sysid.page.address import PageView, query_of
from xy_sysid.page.files_dialog import open_dialog
from xy_sysid.page.notices import Notices
from xy_sysid.page.orders import Source
from xy_sysid.page.panel import Panel, name_in_address
from xy_sysid.page.session import Session
from xy_sysid.page.together_card import TogetherCard, choices
from xy_sysid.page.trend_card import TrendCard
from xy_sysid.page.units_choice import UnitsChoice
from xy_sysid.units import shown_in

EVERY = 0.4  # s between two updates
THEMES, DARK = ("", "light", "dark"), (None, False, True)  # theme names in the address, and the corresponding values for NiceGUI


def build(session: Session, view: PageView) -> None:
    """Build the page as the address describes it; update it until the browser disconnects."""
    page = Page(session, view)
    ui.timer(EVERY, page.refresh)


class Page:
    """One browser's view of the session."""

    def __init__(self, session: Session, view: PageView) -> None:
        self._session, self._client = session, ui.context.client
        self._wanted, self._query = view, ""
        self._panels: dict[str, Panel] = {}
        self._messages = Notices(time.monotonic())
        self._told: list[int] = []
        self._alarms: list[str] = []
        self._bar()
        with ui.element("main").classes("pages") as main:
            self._alarm = ui.element("div").classes("notices").props("role=alert")
            self._notices = ui.element("div").classes("notices").props("role=status aria-live=polite")
            self._empty = ui.element("div").classes("card")
            self._empty.set_visibility(False)  # until it is known that there are no sources
            with self._empty:
                ui.label("No recording is open. Open one from the folder in which the page was started.")
                with ui.element("div").classes("buttons"):
                    ui.button("Open a recording", on_click=lambda: open_dialog(session)).props("unelevated dense no-caps")
            self._grid = ui.element("div").classes("panels")
            self._together = TogetherCard(session)
            TrendCard(session)
        ui.skip_link("to the pictures", target=main)

    async def refresh(self) -> None:
        """Redraw what has changed, in this browser's units."""
        with shown_in(self._units.chosen):
            await self._refresh()

    async def _refresh(self) -> None:
        session = self._session
        if session.live is not None:
            session.live.begin()
        sources = session.sources()
        for source in sources:
            if source.key not in self._panels:
                with self._grid:
                    self._panels[source.key] = Panel(session, source, self._wanted.of(name_in_address(session, source)))
        for key in set(self._panels) - {source.key for source in sources}:
            self._panels.pop(key).delete()
        self._empty.set_visibility(not sources)
        self._units.refresh(sources)
        self._tell(sources)
        compared = choices(sources)  # before the panels are drawn: a panel that grows later would move this card
        for panel in list(self._panels.values()):
            if not self._client.is_deleted:  # the browser may disconnect during the update
                await panel.refresh()
        if not self._client.is_deleted:
            self._keep_address()
            await self._together.refresh(compared)

    def _keep_address(self) -> None:
        """Write the current view to the browser's address, so that a reload or a link restores it."""
        view = PageView(tuple(panel.view() for panel in self._panels.values()), THEMES[self._theme.value], self._units.chosen)
        query = query_of(view)
        if query != self._query:
            self._query = query
            ui.navigate.history.replace(f"/?{query}" if query else "/")

    def _bar(self) -> None:
        session = self._session
        with ui.header(elevated=False).classes("bar").props("role=banner"):
            ui.html("<h1>xy_sysid</h1>", sanitize=False)
            self._state = ui.label("").classes("say grow").props("role=status")
            ui.button("Open a recording", on_click=lambda: open_dialog(session)).props(
                'flat dense no-caps icon=folder_open aria-label="Open a recording"'
            ).classes("opener")
            self._units = UnitsChoice(self._wanted.units)
            chosen = THEMES.index(self._wanted.theme)
            dark = ui.dark_mode(DARK[chosen])
            self._theme = ui.toggle({0: "auto", 1: "light", 2: "dark"}, value=chosen, on_change=lambda event: dark.set_value(DARK[event.value]))
            self._theme.props('flat dense no-caps aria-label="light or dark"').classes("hide")
            if session.live is not None:
                with ui.button(color=None).classes("stop").props('id=stop aria-label="STOP: zero volts, now. Key: Escape"') as stop:
                    ui.html('STOP<span class="hint">Esc</span>', sanitize=False)
                stop.on("click", js_handler="() => window.xyStop()")

    def _tell(self, sources: list[Source]) -> None:
        """Show the bar's line, alarms, and the newest messages."""
        session = self._session
        self._state.set_text(state_words(session, sources))
        alarms = session.heard.alarms()
        if alarms != self._alarms:
            self._alarms = alarms
            self._alarm.clear()
            with self._alarm:
                for words in alarms:
                    ui.label(f"Alarm: {words}").classes("notice")
        shown = self._messages.shown(list(session.messages), time.monotonic())
        numbers = [message.number for message in shown]
        if numbers != self._told:
            self._told = numbers
            self._notices.clear()
            with self._notices:
                for message in shown:
                    ui.label(f"{message.clock}  {message.words}").classes("notice good" if message.good else "notice warn")


def state_words(session: Session, sources: list[Source]) -> str:
    """The line in the bar."""
    parts = []
    if session.live is not None:
        if session.link is not None and session.link.problem:
            parts.append(session.link.problem)
        elif session.stopping:
            parts.append("stopping ...")
        else:
            parts.append(
                {"active": "driving", "inactive": "ready, not driving", "unconfigured": "not configured"}.get(
                    session.heard.lifecycle, "no excitation"
                )
            )
    if session.recorder.running:
        parts.append(session.recorder.words())
    names = [source.title for source in sources if not source.live]
    if names:
        parts.append(", ".join(names))
    return " · ".join(parts)
