"""The card *More about this recording*: step tests, servos, and numbers in SI, in the words of the commands."""

from __future__ import annotations

import html
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import ui

from xy_sysid.page.beside import OneCommand, asked
from xy_sysid.page.buttons import heeded
from xy_sysid.page.orders import Source
from xy_sysid.page.session import Session


@dataclass(frozen=True, slots=True)
class Question:
    """A command that analyses a recording. options: its options that are fields of the card."""

    command: str
    text: str
    meaning: str
    options: tuple[str, ...] = ()


QUESTIONS = (
    Question("steps", "Step test", "Short step and ramp tests: gain, time constant, delay and friction (kS, kV, kA).", ("--kt", "--gear")),
    Question(
        "servo",
        "Servo",
        "A position-controlled joint, target to angle: stiffness, damping, friction, torque limit and delay.",
        ("--inertia", "--gear"),
    ),
    Question("diagnose", "What is missing, in SI", "Inertia or mass and friction in SI: give the torque constant of a current.", ("--kt", "--gear")),
    Question("frf", "Response", "The frequency response as a table, with remarks."),
)


class QuestionsCard:
    """One recording in one browser."""

    def __init__(self, session: Session, source: Source) -> None:
        self._session, self._source = session, source
        self._command = OneCommand(session)
        with ui.element("section").classes("card use").props('aria-label="more about this recording"') as self._card:
            ui.html("<h2>More about this recording</h2>", sanitize=False)
            with ui.element("div").classes("buttons"):
                self._fields: dict[str, Any] = {
                    "--kt": ui.number("torque constant (N m/A)", min=1e-9).props("outlined dense data-part=kt").style("width:14rem"),
                    "--gear": ui.input("gear (50, or 5mm)").props("outlined dense data-part=gear").style("width:11rem"),
                    "--inertia": ui.number("inertia (kg m^2)", min=1e-12).props("outlined dense data-part=inertia").style("width:11rem"),
                }
            with ui.element("div").classes("buttons"):
                for question in QUESTIONS:
                    button = ui.button(question.text, on_click=partial(self._ask, question))
                    with heeded(button.props(f"outline dense no-caps data-ask={question.command}")):
                        ui.tooltip(question.meaning).props("delay=700")
            self._text = ui.element("div").classes("use-text").props('tabindex=0 role=region aria-label="answer" data-part=answer')
        self._text.set_visibility(False)

    def refresh(self) -> None:
        """Show the card once the recording is read."""
        self._card.set_visibility(bool(self._source.axes()))

    async def _ask(self, question: Question) -> None:
        path, how = getattr(self._source, "path", None), getattr(self._source, "how", self._session.reading)
        if path is None:
            return
        given = [(option, self._fields[option].value) for option in question.options]
        words = [word for option, value in given if value not in (None, "") for word in (option, str(value))]
        text = await self._command.run(question.command, answer, question.command, path, (*how.words, *words))
        if text:
            self._text.clear()
            with self._text:
                ui.html(as_html(str(text)), sanitize=False)
            self._text.set_visibility(True)


def answer(command: str, path: Path, words: tuple[str, ...]) -> str:
    """The output of a command for a recording with these reading options. Raises BadInput with the command's error."""
    return asked((command, str(path), *words), (command, "not told", "a recording that determines it"))


def as_html(text: str) -> str:
    """The command's printed lines as HTML."""
    return f'<pre class="wrap">{html.escape(text)}</pre>'
