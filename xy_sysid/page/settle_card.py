"""The card *what to measure next*: it designs and runs the next experiment until the diagnosis is settled."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from xy_sysid.errors import XySysidError
from xy_sysid.page import will_move
from xy_sysid.page.buttons import heeded
from xy_sysid.page.document_words import spaced
from xy_sysid.page.session import Session

ABOUT = "Designs the experiment that distinguishes what the data leave open, within the limits of the excitation. Each step is recorded."


class SettleCard:
    """The card next to the story of the machine."""

    def __init__(self, session: Session) -> None:
        self._session, self._axis = session, ""
        self._shown: object = None
        early = session.settling is not None and session.settling.first
        with (
            ui.element("section").classes("card settle early" if early else "card settle").props('aria-label="what to measure next" data-part=settle')
        ):
            ui.html("<h2>What to measure next</h2>", sanitize=False)
            self._state = ui.label(ABOUT).classes("sentence").props("role=status aria-live=polite data-part=settle-state")
            self._steps = ui.element("div").classes("stack").style("gap:.4rem")
            with ui.element("div").classes("buttons"):
                self._design = heeded(ui.button("Design the next experiment", on_click=self._begin).props("outline dense no-caps data-act=design"))
                self._run = heeded(ui.button("Run it", on_click=self._ask_run).props("outline dense no-caps data-act=run-it"))
                self._end = heeded(ui.button("End here", on_click=self._stop).props("outline dense no-caps data-act=end-settle"))

    def refresh(self, axis: str) -> None:
        """Update the card."""
        settling = self._session.settling
        if settling is None:
            return
        settling.attend(self._session.live)
        self._axis = axis
        self._design.set_enabled(bool(axis) and not settling.running)
        self._run.set_enabled(settling.waits)
        self._end.set_enabled(settling.running)
        filled = settling.waits
        self._run.props(add="unelevated" if filled else "outline", remove="outline" if filled else "unelevated")
        part = f" ({100.0 * settling.part:.0f} %)" if settling.doing.startswith("diagnosing") and settling.part else ""
        self._state.set_text(f"Axis {settling.axis}: {settling.doing}{part} ..." if settling.doing else settling.problem or ABOUT)
        shown = len(settling.steps), settling.running
        if shown != self._shown:
            self._shown = shown
            self._write(settling.steps)

    def _write(self, steps: tuple[dict[str, Any], ...]) -> None:
        self._steps.clear()
        with self._steps:
            for number, step in enumerate(steps):
                last = number == len(steps) - 1
                with ui.element("div").classes("stack").style("gap:.15rem").props(f"data-step={number}"):
                    ui.label(f"{self._named(number)}: {spaced(step['diagnosis'])}").classes("small soft")
                    ui.label(spaced(step["sentence"])).classes("sentence" if last else "small")
                    if step["words"]:
                        ui.label(f"Next: {step['words']}, for {step['lasts']:.0f} s.").classes("next" if last else "small")

    def _named(self, number: int) -> str:
        return "First recording" if number == 0 else f"With experiment {number}"

    def _begin(self) -> None:
        if self._session.settling is not None:
            try:
                self._session.settling.start(self._axis)
            except XySysidError as problem:
                self._session.say(str(problem))

    def _ask_run(self) -> None:
        """Ask for confirmation if a real machine will move, as for Activate."""
        settling = self._session.settling
        if settling is None or not settling.waits:
            return
        words = "It continues automatically until no question is open. Keep your hand at the emergency stop. STOP, or Escape, ends it."
        will_move.ask(self._session, words, "Run it", "sure-run", settling.go)

    def _stop(self) -> None:
        if self._session.settling is not None:
            self._session.settling.end()
