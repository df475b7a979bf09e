"""Buttons whose clicks are never lost."""

from __future__ import annotations

from nicegui import ui


def heeded(button: ui.button) -> ui.button:
    """The same button. It may be disabled while a click is on its way from the browser, as on a computer under load: that click counts still,
    and whoever gets it decides, or says why not. NiceGUI would drop it without a word."""
    button.ignores_events_when_disabled = False
    return button
