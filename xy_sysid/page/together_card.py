"""Several recordings, axes and models in one figure; the user chooses from everything that is open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from nicegui import ui

from xy_sysid.page.orders import Source
from xy_sysid.page.plot import Plot
from xy_sysid.page.session import Session
from xy_sysid.report.story_together import Entry, together

Models = Literal["newest", "every", "none"]
MODELS: dict[Models, str] = {"newest": "newest models", "every": "every model", "none": "measured only"}
FIRST = 4  # entries drawn before the user chooses
READING = "One colour for each axis of a recording, dashes for its models. Bottom: where each model fails, in multiples of its noise floor."


@dataclass(frozen=True, slots=True)
class Choice:
    """One axis that can be drawn: its key, display name, story, and a counter that grows with each change."""

    key: str
    name: str
    document: Mapping[str, Any]
    stamp: int


class TogetherCard:
    """The figure and its choices; shown as soon as there are two axes to compare."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._known: dict[str, str] = {}
        with ui.element("section").classes("card").props('id=together aria-label="in one picture"') as self._card:
            ui.html("<h2>In one picture</h2>", sanitize=False)
            with ui.element("div").classes("buttons"):
                self._chosen = ui.select({}, multiple=True, value=[], label="what is drawn").props('outlined dense use-chips data-part="together"')
                self._models = ui.toggle(dict(MODELS), value="newest").props('dense no-caps aria-label="models that are drawn"')
            self._plot = Plot(READING, "in_one_picture")
        self._card.set_visibility(False)  # until it is known that there are two

    async def refresh(self, found: list[Choice]) -> None:
        """Redraw what has changed. found: the axes that can be drawn."""
        self._card.set_visibility(len(found) > 1)
        if len(found) < 2:
            return
        named = {item.key: item.name for item in found}
        if named != self._known:
            fresh = [key for key in named if key not in self._known]
            kept = [key for key in self._chosen.value if key in named]
            self._known = named
            self._chosen.set_options(named, value=(kept + fresh)[: max(FIRST, len(kept))])
        chosen = [item for item in found if item.key in self._chosen.value]
        models: Models = self._models.value
        key = ("together", models, tuple((item.key, item.stamp) for item in chosen))
        entries = [Entry(item.name, item.document, steps_of(item.document, models)) for item in chosen]
        await self._plot.show(self._session, key, together, entries)
        self._plot.say(f"Responses of {', '.join(item.name for item in chosen) or 'nothing'} over each other, {MODELS[models]}. {READING}")


def choices(sources: list[Source]) -> list[Choice]:
    """Every axis of every source that has a response; a live one once it has a first model, because the cards above still grow until then."""
    found = []
    for source in sources:
        for axis in source.axes():
            stamp, document = source.stamp(axis), source.document(axis)  # read the stamp first: see StoryCard
            if document is not None and document["measured"] is not None and (document["steps"] or not source.live):
                title = "live" if source.live else source.title
                found.append(Choice(f"{source.key}/{axis}", f"{title}, {axis}", document, stamp))
    return found


def steps_of(document: Mapping[str, Any], models: Models) -> tuple[int, ...]:
    """Indices of the story's steps that are drawn."""
    count = len(document["steps"])
    if models == "none" or not count:
        return ()
    return tuple(range(count)) if models == "every" else (count - 1,)
