"""The confirmation before the machine moves, and of other acts that a click alone must not do."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from xy_sysid.page.session import Session

SIMULATED = "ballscrew"  # node of the simulated machine


def ask(session: Session, words: str, button: str, part: str, go: Callable[[], object]) -> None:
    """Call ``go`` once the user has agreed that a real machine moves; for a simulated one, at once.

    words: the expected motion; button: label of the button that agrees; part: its data-act
    """
    if SIMULATED in session.heard.present:
        go()
    else:
        confirm("The machine will move", words, button, part, go)


def confirm(title: str, words: str, button: str, part: str, go: Callable[[], object]) -> None:
    """Call ``go`` once the user has pressed the button in a dialog; part: its data-act."""

    def sure() -> None:
        dialog.close()
        go()

    with ui.dialog() as dialog, ui.element("div").classes("card"):
        ui.html(f"<h2>{title}</h2>", sanitize=False)
        ui.label(words)
        with ui.element("div").classes("buttons"):
            ui.button(button, on_click=sure).props(f"unelevated no-caps data-act={part}")
            ui.button("Cancel", on_click=dialog.close).props("flat no-caps")
    dialog.on("hide", dialog.delete)
    dialog.open()
