"""The card of numbers: the transfer function as a formula, and each number with its meaning."""

from __future__ import annotations

from typing import Any

import numpy as np
from nicegui import ui

from xy_sysid.page.facts import MEANINGS, Fact, base_fails, facts, story_facts, transfer_function_html
from xy_sysid.page.live_figures import failing
from xy_sysid.page.orders import Source
from xy_sysid.page.session import Session
from xy_sysid.page.views import View
from xy_sysid.report.parts import plain
from xy_sysid.report.story_parts import pictured
from xy_sysid.report.story_parts import words as spoken
from xy_sysid.units import chosen_units

AWAITED = ("held-out error", "noise floor", "worst place", "linear part", "gain", "delay", "pole")  # of the rigid model, before it is fitted


class Numbers:
    """The numbers of one axis."""

    def __init__(self) -> None:
        self._shown: object = None
        with ui.element("div").classes("card numbers") as self._card:
            self._math = ui.element("div").classes("math").props('tabindex=0 aria-label="transfer function"')
            self._facts = ui.element("div").classes("facts")

    def refresh(self, session: Session, source: Source, axis: str, view: View) -> None:
        """Update the numbers if they have changed."""
        heard = session.heard.version.get(f"axis {axis}", 0) if view.linear else 0
        stamp = (source.key, axis, source.stamp(axis), view, heard, chosen_units())
        if stamp == self._shown:
            return
        self._shown = stamp
        found, words = numbers_of(session, source, axis, view)
        if not found and not view.linear:
            found = [Fact(label, "…", MEANINGS[label], sure=False) for label in AWAITED]
        self._card.set_visibility(bool(found))
        self._math.clear()
        with self._math:
            ui.html(words, sanitize=False)
        self._facts.clear()
        with self._facts:
            for fact in found:
                show(fact)


def show(fact: Fact) -> None:
    """Show one number with its meaning as a tooltip, which a screen reader reads too."""
    state = {True: " good", False: " bad", None: ""}[fact.good] + ("" if fact.sure else " unsure")
    with ui.element("div").classes(f"fact{state}").props("tabindex=0 role=group") as card:
        card.props["aria-label"], card.props["aria-description"] = fact.label, fact.meaning
        ui.label(fact.label).classes("label")
        ui.label(fact.text).classes("value")
        ui.tooltip(fact.meaning)


def numbers_of(session: Session, source: Source, axis: str, view: View) -> tuple[list[Fact], str]:
    """The numbers and the formula of the selected model: the story's, or the identifier's linear fit."""
    document = source.document(axis)
    if view.linear:
        tf = session.heard.transfer_function(axis)
        words = "" if tf is None else transfer_function_html(tf.numerator, tf.denominator, tf.delay)
        fails = bool(failing(session.heard.table("comparison", axis)) or base_fails(document))
        return facts(session.heard.values(f"axis {axis}"), session.heard.table("frf", axis), fails), words
    shown = None if document is None else pictured(document, view.step)
    if document is None or shown is None:
        return [], ""
    linear: dict[str, Any] = shown["pictures"]["linear"]
    words = transfer_function_html(np.array(linear["numerator"]), np.array(linear["denominator"]), linear["delay"])
    beside = "".join(f" and {plain(spoken(name))}" for name in shown["effects"])
    return story_facts(document, view.step), words + (f'<span class="with">{beside.strip()}</span>' if beside else "")
