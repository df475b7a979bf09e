"""The browser sends the text of typed fields with each button press, because text typed while it was offline never reached the server."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from nicegui import ui
from nicegui.events import GenericEventArguments

F = TypeVar("F", ui.input, ui.number)
SHOWN = "() => emit(Object.fromEntries([...document.querySelectorAll('input[data-typed]')].map(box => [box.dataset.typed, box.value])))"


def typed(field: F) -> F:
    """Mark the field so that its text is sent with every press of ``on_press``; returns the same field."""
    field.props(f"data-typed={field.id}")
    return field


def on_press(button: ui.button, fields: Callable[[], Iterable[Any]], act: Callable[[], object]) -> None:
    """Call ``act`` when the button is pressed, after the ``typed`` fields have received the values that the browser shows."""

    def pressed(event: GenericEventArguments) -> None:
        take_over(fields(), event.args)
        act()

    button.on("click", pressed, js_handler=SHOWN)


def take_over(fields: Iterable[Any], shown: Mapping[str, str]) -> None:
    """Copy the browser's values to the fields. shown: text of typed fields, by number."""
    for field in fields:
        text = shown.get(str(field.id))
        if text is not None:
            field.set_value((float(text) if text else None) if isinstance(field, ui.number) else text)
