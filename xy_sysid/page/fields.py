"""What a field shows is what counts: it goes with the press of a button, as text typed while the connection was away never reached the server."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from nicegui import ui
from nicegui.events import GenericEventArguments

F = TypeVar("F", ui.input, ui.number)
SHOWN = "() => emit(Object.fromEntries([...document.querySelectorAll('input[data-typed]')].map(box => [box.dataset.typed, box.value])))"


def typed(field: F) -> F:
    """The same field, whose text goes with every press of ``on_press``."""
    field.props(f"data-typed={field.id}")
    return field


def on_press(button: ui.button, fields: Callable[[], Iterable[Any]], act: Callable[[], object]) -> None:
    """Do something at a press of a button, when those of the fields that are ``typed`` have the values that the browser shows in them."""

    def pressed(event: GenericEventArguments) -> None:
        take_over(fields(), event.args)
        act()

    button.on("click", pressed, js_handler=SHOWN)


def take_over(fields: Iterable[Any], shown: Mapping[str, str]) -> None:
    """shown: text of typed fields, by their number."""
    for field in fields:
        text = shown.get(str(field.id))
        if text is not None:
            field.set_value((float(text) if text else None) if isinstance(field, ui.number) else text)
