"""One source on the page: its axes, numbers, figures and story. Only changes are redrawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from nicegui import ui

from xy_sysid.errors import XySysidError
from xy_sysid.page.address import SourceView
from xy_sysid.page.control import Control
from xy_sysid.page.coupling_card import CouplingCard
from xy_sysid.page.document_words import model_effects
from xy_sysid.page.facts import seconds_text
from xy_sysid.page.failure_card import FailureCard
from xy_sysid.page.live_card import LiveCards
from xy_sysid.page.numbers_card import Numbers
from xy_sysid.page.orders import Source
from xy_sysid.page.picture_card import Cards
from xy_sysid.page.questions_card import QuestionsCard
from xy_sysid.page.recordings import OpenRecording
from xy_sysid.page.response_card import ResponseCard
from xy_sysid.page.session import Session
from xy_sysid.page.settle_card import SettleCard
from xy_sysid.page.story_card import StoryCard
from xy_sysid.page.use_card import UseCard
from xy_sysid.page.views import NOW, View, view_of, views

SHORT = 3  # letters; an axis name of at most this length gets the word axis before it


class Panel:
    """A source in one browser."""

    def __init__(self, session: Session, source: Source, wanted: SourceView) -> None:
        """wanted: the view from the address; its effects are added once the rigid model is fitted, unless the story already has effects."""
        self._session, self._source, self._wanted = session, source, wanted
        self._adding = {} if source.live else dict(wanted.effects)
        self._axis = ""
        self._axes: tuple[str, ...] = ()
        self._control: Control | None = None
        self._views: dict[str, str] = {}
        self._steps: tuple[str, int, tuple[str, ...]] = ("", 0, ())
        with ui.element("section").classes("panel").props(f'id={source.key} aria-label="{"machine" if source.live else "recording"}"') as self._root:
            with ui.element("div").classes("head"):
                self._title = ui.label("").classes("grow").props("role=heading aria-level=2").classes("title")
                with ui.element("div").classes("buttons") as self._model:
                    ui.label("Model shown:").classes("soft")
                    self._view = ui.toggle({}).props('dense no-caps aria-label="model that is shown" data-part=view')
                self._choice = ui.toggle({}, on_change=lambda event: self._turn(str(event.value))).props('dense no-caps aria-label="axis"')
                if not source.live:
                    ui.button(icon="close", on_click=lambda: session.close_recording(source.key)).props('flat dense aria-label="close recording"')
            self._problem = ui.label("").classes("notice").props("role=alert")
            self._reading = ui.label("").props("role=status data-part=reading")
            self._wait = ui.linear_progress(0, show_value=False).props('instant-feedback aria-label="reading"')
            with ui.element("div").classes("split") as self._split:
                with ui.element("div").classes("stack"):
                    self._first = FailureCard(session, source)
                    self._live = LiveCards(session) if source.live else None
                    self._numbers = Numbers()
                    self._cards = Cards(session, source, self._first.plots["frequency"], wanted.pictures)
                with ui.element("div").classes("stack side"):
                    settling = session.settling if source.live else None
                    self._settle = SettleCard(session) if settling is not None and settling.first else None
                    self._story = StoryCard(session, source, self._machine if source.live else lambda: None)
                    self._settle = self._settle or (SettleCard(session) if source.live else None)
                    self._use = UseCard(session, source)
                    self._coupling = CouplingCard(session, source)
                    self._questions = None if source.live else QuestionsCard(session, source)
            self._response = ResponseCard(session, source) if isinstance(source, OpenRecording) else None

    def _machine(self) -> None:
        self._control = Control(self._session)

    def delete(self) -> None:
        """Remove the panel from the page."""
        self._root.delete()

    async def refresh(self) -> None:
        """Redraw what has changed."""
        source = self._source
        self._head()
        axes = source.axes()
        if axes != self._axes:
            self._axes = axes
            wanted = (self._axis, self._wanted.axis, *axes)
            self._axis = next((axis for axis in wanted if axis in axes), "")
            self._choice.set_options({axis: f"axis {axis}" if len(axis) <= SHORT else axis for axis in axes}, value=self._axis or None)
        self._add_wanted()
        begun = source.document(self._axis) is not None
        waits = self._control is not None and self._control.refresh(self._axes, begun)
        axis, view = self._axis, self._choose()  # without an axis every card keeps its space and shows what it waits for
        self._use.refresh()
        self._numbers.refresh(self._session, source, axis, view)  # first the parts that wait for nothing: the browser may disconnect meanwhile
        await self._story.refresh(axis, quiet=waits)
        if self._settle is not None:
            self._settle.refresh(axis)
        await self._first.refresh(axis, view)
        if self._live is not None:
            await self._live.refresh(axis, view.linear)
        await self._coupling.refresh()
        if self._questions is not None:
            self._questions.refresh()
        if self._response is not None:
            await self._response.refresh()
        await self._cards.refresh(axis, view)

    def _choose(self) -> View:
        """The selected model; the newest one whenever the story advances. A choice made before the first model is kept."""
        document = self._source.document(self._axis)
        found = views(document, self._source.live, self._source.awaits(self._axis))
        goes_on = self._axis, len(document["steps"]) if document is not None else 0, tuple(found)
        if goes_on != self._steps:
            awaited = self._steps[:2] == (self._axis, 0) and self._view.value in found
            self._steps, self._views = goes_on, found
            value = self._view.value if awaited else next(iter(found), None)
            if self._wanted.model in found and not self._adding.get(self._axis):
                value, self._wanted = self._wanted.model, replace(self._wanted, model="")
            self._view.set_options(found, value=value)
        elif found != self._views:  # only the wording differs: the choice is kept
            self._views = found
            self._view.set_options(found, value=self._view.value)
        self._model.classes(remove="idle" if len(found) > 1 else "", add="" if len(found) > 1 else "idle")  # keep its space
        return view_of(str(self._view.value or NOW))

    def _head(self) -> None:
        source = self._source
        about: dict[str, Any] = getattr(source, "about", {})
        words = source.title if not source.live else f"The machine, live{self._control.pace() if self._control is not None else ''}"
        if "seconds" in about:
            words += f" · {seconds_text(about['seconds'])} at {about['rate']:g} Hz"
        self._title.set_text(words)
        problem = source.problem()
        self._problem.set_visibility(bool(problem))
        self._problem.set_text(f"Closed: {problem}" if problem else "")
        reading = getattr(source, "reading", None)
        self._wait.set_visibility(reading is not None)
        self._reading.set_visibility(reading is not None)
        self._reading.set_text(f"reading {source.title} ...")
        if reading is not None:
            self._wait.set_value(reading)
        self._choice.set_visibility(len(self._axes) > 1)
        self._split.set_visibility(source.live or bool(self._axes))

    def _turn(self, axis: str) -> None:
        if axis in self._axes:
            self._axis = axis

    def view(self) -> SourceView:
        """The current view, for the address, including requested parts that have not arrived yet."""
        source, chosen = self._source, str(self._view.value or "")
        effects = {axis: tuple(effects_of(source.document(axis))) for axis in self._axes if not source.live}
        for axis, names in self._adding.items():
            effects[axis] = (*effects.get(axis, ()), *names)
        return SourceView(
            name=name_in_address(self._session, source),
            words=self._session.own_words(source) if isinstance(source, OpenRecording) else (),
            axis=self._wanted.axis if not self._axes else "" if self._axis == self._axes[0] else self._axis,
            model=self._wanted.model or ("" if chosen == next(iter(self._views), "") else chosen),
            pictures=self._cards.chosen(),
            effects=effects,
        )

    def _add_wanted(self) -> None:
        """Add the effects from the address one by one. If the story has other effects, a user added them, and it is kept."""
        source = self._source
        for axis, names in list(self._adding.items()):
            if (self._axes and axis not in self._axes) or source.problem():
                del self._adding[axis]
            elif source.ready(axis) and source.job(axis) is None:
                there = effects_of(source.document(axis))
                missing = [name for name in names if name not in there]
                if not missing or set(there) - set(self._wanted.effects[axis]):
                    del self._adding[axis]
                    continue
                self._adding[axis] = tuple(missing[1:])
                try:
                    source.ask("add", axis, missing[0])
                except XySysidError as problem:
                    self._session.say(str(problem))


def effects_of(document: Mapping[str, Any] | None) -> list[str]:
    """Effects of the newest model of a story; none while there is no story."""
    return model_effects(document) if document is not None else []


def name_in_address(session: Session, source: Source) -> str:
    """The name of a source in an address; empty for the machine."""
    return session.name_of(source) if isinstance(source, OpenRecording) else ""
