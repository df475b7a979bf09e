"""The machine's card: nodes, configure, activate and STOP, received data, excitation settings, and recording to a bag."""

from __future__ import annotations

import time
from collections.abc import Callable

from nicegui import run, ui

from xy_sysid.errors import XySysidError
from xy_sysid.live.status_values import SECONDS, WINDOWS, number
from xy_sysid.page import will_move
from xy_sysid.page.buttons import heeded
from xy_sysid.page.facts import dropped_words, seconds_text
from xy_sysid.page.fields import on_press, typed
from xy_sysid.page.session import Session
from xy_sysid.page.settings_form import SettingsForm

STATES = {
    "active": "driving",
    "inactive": "configured; nothing moves yet",
    "unconfigured": "not configured; nothing moves",
    "finalized": "shut down",
    "": "not there",
}


def on_activate(held: bool, others: str) -> tuple[str, str]:
    """(label of the Activate button, question about STOP); the question is empty while STOP is off. others: other nodes that hold STOP."""
    if held and others:
        return "Override STOP", f"STOP is on from {others}. Release it there, or override it here"
    return ("Release STOP and activate", "STOP is on. Activate releases it first") if held else ("Activate", "")


class Control:
    """The machine's card in one browser."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._nodes_shown: object = None
        self._forms: dict[str, SettingsForm] = {}
        self._speed = 0.0
        self._filled: object = None
        with ui.element("section").classes("card machine").props('aria-label="machine"'):
            ui.html("<h2>The machine</h2>", sanitize=False)
            self._nodes = ui.element("div").classes("stack").classes("nodes").props("role=status aria-live=polite data-part=nodes")
            self._state = ui.label("").classes("lifecycle").props("data-part=lifecycle")
            with ui.element("div").classes("buttons"):
                self._configure = heeded(
                    ui.button("Configure", on_click=lambda: self._go("configure")).props("outline dense no-caps data-act=configure")
                )
                self._activate = heeded(ui.button("Activate", on_click=self._ask_activate).props("outline dense no-caps data-act=activate"))
                self._reset = heeded(ui.button("Delete received data", on_click=self._forget).props("flat dense no-caps data-act=forget"))
            self._windows = ui.element("div").classes("rows small windows").props("data-part=windows")
            with ui.expansion("Excitation").classes("w-full").props("dense data-part=excitation"):
                self._settings = ui.element("div").classes("stack")
            with ui.expansion("Record to a bag").classes("w-full").props("dense data-part=record"):
                self._bag()

    def refresh(self, axes: tuple[str, ...], begun: bool) -> bool:
        """Update the card; returns True if the next action is a button here. begun: there is a story, whose actions have priority."""
        session = self._session
        heard, now = session.heard, time.monotonic()
        activate, stop = on_activate(heard.values("excitation").get("stop") == "on", heard.stopped_by_others())
        nodes = tuple((node.name, node.level, stop or node.words if node.name == "excitation" else node.words) for node in heard.nodes(now))
        if nodes != self._nodes_shown:
            self._nodes_shown = nodes
            self._nodes.clear()
            with self._nodes:
                if not nodes:
                    ui.label("No node is running. Start the nodes with xy-sysid run, or try xy-sysid demo.").classes("warn")
                with ui.element("div").classes("buttons"):
                    for name, _, words in [node for node in nodes if not node[1]]:
                        with ui.element("div").classes("buttons well").props(f'tabindex=0 role=group aria-label="{name}: {words}"'):
                            ui.element("span").classes("dot l0").props("aria-hidden=true")
                            ui.label(name)
                            ui.tooltip(words)
                for name, level, words in [node for node in nodes if node[1]]:
                    with ui.element("div").classes("buttons").style("flex-wrap:nowrap;align-items:baseline"):
                        ui.element("span").classes(f"dot l{level}").props("aria-hidden=true")
                        ui.label(name).style("font-weight:600")
                        ui.label(words).classes("bad" if level > 1 else "warn")
        state = heard.lifecycle
        self._state.set_text(f"Excitation: {STATES.get(state, state)}{stop and f'. {stop}.'}")
        self._activate.set_text(activate)
        self._configure.set_enabled(state == "unconfigured")
        self._activate.set_enabled(state == "inactive")
        self._reset.set_enabled("streams" in heard.statuses)
        self._heard(axes)
        for axis in axes:
            if axis not in self._forms and "excitation" in heard.present:
                with self._settings:
                    self._forms[axis] = SettingsForm(session, axis)
        self._recording()
        if not self._speed and "excitation" in heard.present and session.link is not None:
            self._speed = 1.0
            session.link.get_parameters("excitation", ["speed"], self._paced)
        waits = not begun and state in ("unconfigured", "inactive")
        if (waits, state) != self._filled:
            self._filled = waits, state
            for button, own in ((self._configure, "unconfigured"), (self._activate, "inactive")):
                filled = waits and state == own
                button.props(add="unelevated" if filled else "outline", remove="outline" if filled else "unelevated")
        return waits

    def pace(self) -> str:
        """How much faster than real time the simulated machine runs, in words; empty at real time, and for a real machine."""
        if self._speed == 1.0 or not self._speed or "ballscrew" not in self._session.heard.present:
            return ""
        return f" · simulated, {self._speed:g} times faster than real time" if self._speed > 0 else " · simulated, at full speed"

    def _paced(self, values: dict[str, object]) -> None:
        """Store the values; called in the link's thread, read later by ``pace``."""
        speed = values.get("speed")
        if isinstance(speed, float):
            self._speed = speed if speed else -1.0

    def _heard(self, axes: tuple[str, ...]) -> None:
        heard = self._session.heard
        rows = []
        for axis in axes:
            values = heard.values(f"axis {axis}")
            if WINDOWS in values:
                data = seconds_text(number(values, SECONDS, 0.0))
                rows.append((f"axis {axis}", f"{values[WINDOWS]} windows in {data}, dropped: {dropped_words(values)}"))
        if rows == getattr(self, "_rows", None):
            return
        self._rows = rows
        self._windows.clear()
        with self._windows:
            for name, words in rows:
                ui.label(name)
                ui.label(words)

    def _go(self, label: str) -> None:
        session = self._session
        if session.link is not None:

            def told(done: bool, words: str) -> None:
                status = session.heard.statuses.get("excitation")
                why = f": {status.message}" if status else ""
                session.say(words or (f"{label}: done" if done else f"the excitation refused to {label}{why}"), done)

            session.link.transition(label, told)

    def _ask_activate(self) -> None:
        """Ask for confirmation if a real machine will move; a simulated one starts at once. Override another node's STOP only if confirmed."""
        held = self._session.heard.stopped_by_others()
        if held:
            self._ask_override(held)
            return
        words = "Keep your hand at the emergency stop of the machine. STOP in the bar, or Escape, brings the voltage to zero."
        will_move.ask(self._session, words, "Activate", "sure", lambda: self._go("activate"))

    def _ask_override(self, held: str) -> None:
        """Call release_stop twice after the user has seen the names: the first call lists the nodes that hold STOP, the second overrides them.

        If other nodes hold STOP by then, nothing is overridden. It does not activate: the user presses Activate afterwards.
        """
        session = self._session

        def ask(then: Callable[[bool, str], None]) -> None:
            if session.link is not None:
                session.link.trigger("excitation/release_stop", then)

        def told(done: bool, words: str) -> None:
            session.say(words or "the excitation did not answer", done)

        def named(done: bool, words: str) -> None:
            now = session.heard.stopped_by_others()
            if done or not words or now == held:
                told(done, words) if done or not words else ask(told)
            else:
                session.say(f"STOP is now held by {now or 'nobody else'}, no longer by {held}: nothing was overridden")

        words = f"STOP is on from: {held}. Look at the machine and ask the holder before you override it. Then press Activate."
        will_move.confirm("Another user holds STOP", words, "Override STOP", "override", lambda: ask(named))

    def _forget(self) -> None:
        session = self._session
        if session.link is not None:
            session.link.trigger("identifier/reset", lambda done, words: session.say(words or "the identifier did not answer", done))

    # record

    def _bag(self) -> None:
        self._name = typed(ui.input("name of the bag", value=f"xy_{time.strftime('%Y-%m-%d_%H-%M-%S')}"))
        self._name.props("outlined dense data-part=bag").style("width:100%")
        with ui.element("div").classes("buttons"):
            self._begin = ui.button("Record").props("outline dense no-caps data-act=record")
            on_press(self._begin, lambda: [self._name], self._record)
            self._end = ui.button("Finish", on_click=self._finish).props("outline dense no-caps data-act=finish")
            self._open = ui.button("Open it", on_click=self._show).props("outline dense no-caps data-act=open-bag")
        self._told = ui.label("").classes("soft small")

    def _recording(self) -> None:
        recorder = self._session.recorder
        self._begin.set_enabled(not recorder.running)
        self._end.set_enabled(recorder.running)
        self._open.set_enabled(recorder.last is not None and not recorder.running)
        self._told.set_text(recorder.words() or f"Bags are saved in the folder {self._session.shelf.folder.name}.")

    def _record(self) -> None:
        session = self._session
        try:
            session.recorder.start(session.shelf.new(str(self._name.value or "").strip()), session.namespace)
        except XySysidError as problem:
            session.say(str(problem))

    async def _finish(self) -> None:
        session = self._session
        words = await run.io_bound(session.recorder.stop)
        session.say(words or "the page ends", bool(words) and str(words).startswith("recorded"))
        self._name.set_value(f"xy_{time.strftime('%Y-%m-%d_%H-%M-%S')}")

    def _show(self) -> None:
        session = self._session
        if session.recorder.last is not None:
            try:
                session.open(session.recorder.last)
            except XySysidError as problem:
                session.say(str(problem))
