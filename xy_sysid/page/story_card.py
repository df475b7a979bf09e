"""The story of an axis in one column: headline, next action, errors of all steps, effects in the model, candidates, look-alikes."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from nicegui import ui

from xy_sysid.errors import XySysidError
from xy_sysid.page.buttons import heeded
from xy_sysid.page.document_words import candidate_rows, ladder_words, look_alike_lines, model_effects, spaced, step_names, verdict_words
from xy_sysid.page.downloads import Downloads
from xy_sysid.page.facts import seconds_text
from xy_sysid.page.orders import OrderKind, Source, Wish
from xy_sysid.page.plot import Plot
from xy_sysid.page.session import Session
from xy_sysid.report import story_figures as draw
from xy_sysid.report.headline import detail, headline, next_act
from xy_sysid.report.story_parts import words
from xy_sysid.units import chosen_units

BUTTONS: tuple[tuple[OrderKind, str, str], ...] = (
    ("diagnose", "Diagnose", "Find the effect that the rigid model misses."),
    ("next", "Find the next", "Add the effect that reduces the error most."),
    ("auto", "Auto", "Add effects until the noise floor is reached or no effect helps, then remove those that are not needed."),
    ("reset", "Start over", "Return to the rigid model with delay."),
)


class StoryCard:
    """One axis of one source, in one browser."""

    def __init__(self, session: Session, source: Source, between: Callable[[], None]) -> None:
        """between: builds the elements between the headline and the evidence."""
        self._session, self._source, self._axis = session, source, ""
        self._shown: object = None
        self._filled: object = None
        self._named = ""
        self._wish = Wish()
        self._buttons: dict[str, ui.button] = {}
        self._rows: list[ui.button] = []
        with ui.element("section").classes("card story").props('aria-label="story"') as self.head:
            self._headline = ui.label("").classes("headline").props("role=heading aria-level=2 aria-live=polite data-part=headline")
            self._verdict = ui.label("").classes("sentence").props("role=status aria-live=polite data-part=verdict")
            self._note = ui.label("").classes("soft")
            with ui.element("div").classes("buttons used") as self._data:
                self._used = ui.label("").classes("soft small grow").props("data-part=used")
                self._button("renew", "Use the newest", "Fit the model with its effects to the newest data.", partial(self._ask, "renew"))
            with ui.element("div").classes("buttons acts"):
                self._button("named", "Add", "Add the named effect and fit all parameters again.", self._add_named)
                self._button("keep", "Download the model", "The newest models of all axes as YAML.", lambda: self._downloads.take("model"))
                for act, text, meaning in BUTTONS:
                    self._button(act, text, meaning, partial(self._ask, act))
            with ui.element("div").classes("buttons busy").props("role=status aria-live=polite") as self._busy:
                ui.spinner(size="1.2em")
                self._doing = ui.label("").classes("grow")
                ui.button("Cancel", on_click=self._cancel).props("outline dense data-act=cancel")
        between()
        with ui.element("section").classes("card evidence").props('aria-label="steps and evidence"') as self.body:
            self._ladder = Plot(
                "Each step adds one effect. The held-out error counts; a complete model reaches the dotted noise floor.", "ladder", 320
            )
            self._model = ui.element("div").classes("stack").style("gap:.3rem")
            with ui.element("div").classes("stack").style("gap:.4rem") as self._evidence:
                ui.html("<h3>What the rigid model misses</h3>", sanitize=False)
                self._told = ui.label("").classes("small").props("data-part=diagnosis")
                self._candidates = Plot("The error that remains with each effect; shortest is best.", "candidates")
                self._ranked = ui.element("div").classes("ranked")
            with ui.element("div").classes("buttons"):
                self._choice = (
                    ui.select({}, label="add any effect", with_input=True).props("outlined dense options-dense").style("flex:1;min-width:12rem")
                )
                self._button("add", "Add", "Add this effect and fit all parameters again.", lambda: self._ask("add", str(self._choice.value or "")))
            self._more = ui.element("div").classes("stack").style("gap:.4rem")
            with ui.expansion("Before and after").classes("w-full").props("dense") as self._overlay:
                with ui.element("div").classes("buttons"):
                    self._first = ui.select({}, label="before", on_change=lambda: self._compare()).props("outlined dense").style("flex:1")
                    self._last = ui.select({}, label="after", on_change=lambda: self._compare()).props("outlined dense").style("flex:1")
                self._before_after = Plot(
                    "Two models overlaid: error over the noise floor, and the error in time around the largest error of the rigid model.",
                    "before_after",
                )
            self._pair: tuple[int, int] = (0, 0)
            with ui.expansion("Download").classes("w-full").props("dense"):
                self._downloads = Downloads(session, source, lambda: self._axis)

    async def refresh(self, axis: str, quiet: bool = False) -> None:
        """Update what has changed; quiet: another action on the page comes first."""
        self._axis = axis
        at = self._source.stamp(axis)  # before the document, which another thread may replace: never an old figure under a new stamp
        job = self._source.job(axis)
        document = self._source.document(axis)
        self._busy.classes(remove="idle" if job is not None else "", add="" if job is not None else "idle")  # keep its space
        if job is not None:
            waits = "" if job.running else "waits: " if not job.said else ""
            self._doing.set_text(f"{waits}{job.words} ({seconds_text(time.monotonic() - job.begun)}){self._wish.words}")
        self._headline.set_text(headline(document, spaced(job.words) if job is not None and job.running else ""))
        able = job is None and self._source.ready(axis)
        wish = self._wish.taken(axis) if able else None
        if wish is not None:
            self._ask(*wish)
            able = False
        for button in (*self._buttons.values(), *self._rows):
            button.set_enabled(able)
        self._buttons["renew"].set_enabled(able and self._source.newer(axis))
        self._data.set_visibility(self._source.live)
        self._data.classes(remove="idle" if document is not None else "", add="" if document is not None else "idle")
        self._used.set_text(self._source.used(axis))
        self._fill(document, able and not quiet)
        effects = self._source.effects()
        if len(effects) != len(self._choice.options):
            self._choice.set_options({name: words(name) for name in effects})
        stamp = (axis, at, chosen_units(), document is None and self._source.words(axis))
        if stamp != self._shown:
            self._shown = stamp
            self._write(document)
        if document is None or not document["ladder"]:
            self._ladder.wait(f"The error ladder of axis {axis}: no step yet." if axis else "")
            return
        key = (self._source.key, axis, at)
        self._ladder.say(ladder_words(document))
        await self._ladder.show(self._session, (*key, "ladder"), draw.ladder, document)
        if document["candidates"]:
            await self._candidates.show(self._session, (*key, "candidates"), draw.candidates, document)
        if self._overlay.value and len(document["steps"]) > 1:
            first, last = self._pair
            await self._before_after.show(self._session, (*key, "pair", first, last), draw.before_after, document, first, last)

    def _button(self, act: str, text: str, meaning: str, do: Callable[[], None]) -> None:
        button = heeded(ui.button(text, on_click=do).props(f"outline dense no-caps data-act={act}"))
        with button:
            ui.tooltip(meaning).props("delay=700")
        self._buttons[act] = button

    def _fill(self, document: dict[str, Any] | None, able: bool) -> None:
        """Highlight the button of the next action, and show the buttons that are only sometimes needed."""
        act, name = next_act(document) or ("", "")
        chosen = {"add": "named"}.get(act, act)
        if (chosen, name, able) == self._filled:
            return
        self._filled = chosen, name, able
        self._named = name
        self._buttons["named"].set_text(f"Add {words(name)}")
        for own, button in self._buttons.items():
            if own in ("named", "keep"):
                button.set_visibility(own == chosen)
            if own == "renew":
                continue  # never the next action
            filled = own == chosen and able
            button.props(add="unelevated" if filled else "outline", remove="outline" if filled else "unelevated")

    def _add_named(self) -> None:
        self._ask("add", self._named)

    def _ask(self, act: OrderKind, argument: str = "") -> None:
        """Give the order, or store it until the current one has ended: the click may have been sent before that one started."""
        if self._source.job(self._axis) is not None:
            self._wish.keep(self._axis, act, argument)
            return
        try:
            self._source.ask(act, self._axis, argument)
        except XySysidError as problem:
            self._session.say(str(problem))

    def _cancel(self) -> None:
        self._wish = Wish()
        self._source.cancel(self._axis)

    def _write(self, document: dict[str, Any] | None) -> None:
        self._verdict.set_text(spaced(detail(document)) if document else self._source.words(self._axis))
        note = spaced(str((document or {}).get("note") or ""))
        self._note.set_text(note)
        self._note.set_visibility(bool(note))
        self._evidence.set_visibility(bool(document and document["candidates"]))
        self._overlay.set_visibility(bool(document and len(document["steps"]) > 1))
        for part in (self._ranked, self._model, self._more):
            part.clear()
        self._rows.clear()
        if document is None:
            with self._model:
                ui.label("Model: rigid with delay, no effects")
            return
        there = model_effects(document)
        self._told.set_text(verdict_words(document) if there else "")
        self._told.set_visibility(bool(there))
        with self._model:
            ui.label("Model: rigid with delay" + ("" if there else ", nothing else"))
            for name in there:
                with ui.element("div").classes("buttons"):
                    ui.label(words(name)).classes("chip")
                    self._row_button("Remove", "remove", name)
        with self._ranked:
            for row in candidate_rows(document):
                with ui.element("div").classes("candidate"):
                    ui.label(f"{words(row.effect)}: {row.evidence}").classes("small")
                    if row.effect not in there:
                        self._row_button("Add", "add", row.effect)
        with self._more:
            for line in look_alike_lines(document):
                ui.label(line).classes("next" if line.startswith("Next") else "small")
        steps = step_names(document)
        self._pair = (min(self._pair[0], len(steps) - 1), len(steps) - 1)
        self._first.set_options(steps, value=self._pair[0])
        self._last.set_options(steps, value=self._pair[1])

    def _row_button(self, text: str, act: OrderKind, name: str) -> None:
        button = heeded(
            ui.button(text, on_click=lambda: self._ask(act, name)).props(f'outline dense no-caps aria-label="{text} {words(name)}" data-{act}={name}')
        )
        button.set_enabled(self._source.job(self._axis) is None)
        self._rows.append(button)

    def _compare(self) -> None:
        if self._first.value is not None and self._last.value is not None:
            self._pair = (int(self._first.value), int(self._last.value))
