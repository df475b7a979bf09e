"""Buttons whose clicks are never lost."""

from __future__ import annotations

from nicegui import ui


def heeded(button: ui.button) -> ui.button:
    """Accept clicks on this button although it was disabled while the click was on its way from the browser. Returns the same button.

    The handler decides what to do with such a click, or gives a reason. NiceGUI would drop it silently.
    """
    button.ignores_events_when_disabled = False
    return button
