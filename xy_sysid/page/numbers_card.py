"""The card of numbers: the transfer function as mathematics, and each number with what it means."""

from __future__ import annotations

from typing import Any

import numpy as np
from nicegui import ui

from xy_sysid.page.facts import Fact, facts, story_facts, transfer_function_html
from xy_sysid.page.session import Session
from xy_sysid.page.wishes import Source


class Numbers:
    """What is known of one axis in figures."""

    def __init__(self) -> None:
        self._shown: object = None
        with ui.element("div").classes("card") as self._card:
            self._math = ui.element("div").classes("math").props('tabindex=0 aria-label="transfer function"')
            self._facts = ui.element("div").classes("facts")

    def refresh(self, session: Session, source: Source, axis: str) -> None:
        """Write them again if they have changed."""
        stamp = (source.key, axis, source.stamp(axis), session.heard.version.get(f"axis {axis}", 0) if source.live else 0)
        if stamp == self._shown:
            return
        self._shown = stamp
        found, words = numbers_of(session, source, axis)
        self._card.set_visibility(bool(found))
        self._math.clear()
        with self._math:
            ui.html(words, sanitize=False)
        self._facts.clear()
        with self._facts:
            for fact in found:
                show(fact)


def show(fact: Fact) -> None:
    """One number with its meaning as a tooltip, which a screen reader reads too."""
    state = {True: " good", False: " bad", None: ""}[fact.good]
    with ui.element("div").classes(f"fact{state}").props("tabindex=0 role=group") as card:
        card.props["aria-label"], card.props["aria-description"] = fact.label, fact.meaning
        ui.label(fact.label).classes("label")
        ui.label(fact.text).classes("value")
        ui.tooltip(fact.meaning)


def numbers_of(session: Session, source: Source, axis: str) -> tuple[list[Fact], str]:
    """The numbers and the mathematics: live from the identifier, else from the story."""
    document = source.document(axis)
    if source.live:
        tf = session.heard.transfer_function(axis)
        words = "" if tf is None else transfer_function_html(tf.numerator, tf.denominator, tf.delay)
        return facts(session.heard.values(f"axis {axis}"), session.heard.arrays.get(f"frf/{axis}")), words
    if document is None or not document.get("model"):
        return [], ""
    linear: dict[str, Any] = document["model"]["linear"]
    return story_facts(document), transfer_function_html(np.array(linear["numerator"]), np.array(linear["denominator"]), linear["delay"])
