"""Dialog to choose a recording of the shelf; the browser sends a name, never a path."""

from __future__ import annotations

from nicegui import run, ui

from xy_sysid.errors import XySysidError
from xy_sysid.imports import TABLES
from xy_sysid.page.columns_dialog import columns_dialog
from xy_sysid.page.session import Session
from xy_sysid.page.shelf import TEXTS


async def open_dialog(session: Session) -> None:
    """Let the user choose a recording, and open it in addition to the open ones."""
    names = await run.io_bound(session.shelf.names) or await run.io_bound(session.shelf.names, texts=True)
    with ui.dialog() as dialog, ui.element("div").classes("card").style("min-width: min(90vw, 420px)"):
        ui.html("<h2>Open a recording</h2>", sanitize=False)
        ui.label(f"Bags and tables of {session.shelf.folder.name}").classes("soft small")
        if names:
            choice = ui.select(names, value=names[0], label="recording", with_input=len(names) > 8).props("outlined dense")
            texts = ui.checkbox(f"also {', '.join(TEXTS)}").props("data-part=texts")
            texts.on_value_change(lambda event: choice.set_options(session.shelf.names(texts=bool(event.value)), value=choice.value))
        else:
            ui.label("This folder has no recordings. Record a bag, or start the page in another folder.")
        with ui.element("div").classes("buttons"):
            if names:
                ui.button("Open", on_click=lambda: _open(session, str(choice.value), dialog)).props("unelevated")
                ui.button("Columns ...", on_click=lambda: _columns(session, str(choice.value), dialog)).props("outline").bind_visibility_from(
                    choice, "value", backward=lambda name: str(name).lower().endswith(TABLES)
                )
            ui.button("Cancel", on_click=dialog.close).props("flat")
    dialog.on("hide", dialog.delete)
    dialog.open()


async def _columns(session: Session, name: str, dialog: ui.dialog) -> None:
    with ui.context.client.content:  # outside this dialog, which is deleted when it closes
        dialog.close()
        await columns_dialog(session, name)


def _open(session: Session, name: str, dialog: ui.dialog) -> None:
    try:
        session.open(session.shelf.find(name), name)
    except XySysidError as problem:
        session.say(str(problem))
    dialog.close()
