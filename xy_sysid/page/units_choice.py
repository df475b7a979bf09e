"""The units in which one browser shows lengths and angles: one choice in the bar for each quantity that an open source has."""

from __future__ import annotations

from collections.abc import Sequence

from nicegui import ui

from xy_sysid.page.orders import Source
from xy_sysid.units import CHOICES

ABOVE = 7001  # z-index above the bar
NAMES = {"m": "unit of lengths", "rad": "unit of angles"}


class UnitsChoice:
    """The choices; hidden if no source has such a quantity, for example encoder counts, which are shown unchanged."""

    def __init__(self, wanted: Sequence[str]) -> None:
        """wanted: the units from the address."""
        self._selects: dict[str, ui.select] = {}
        for kind, name in NAMES.items():
            options = list(CHOICES[kind])
            value = next((unit for unit in options if unit in wanted), options[0])
            made = ui.select(options, value=value).props(f'dense borderless options-dense aria-label="{name}" data-part=units-{kind}')
            made.props(f'popup-content-style="z-index: {ABOVE}"').classes("hide").set_visibility(False)
            self._selects[kind] = made

    def refresh(self, sources: Sequence[Source]) -> None:
        """Show the choices that apply to the open sources."""
        documents = [source.document(axis) for source in sources for axis in source.axes()]
        outputs = {str(document["units"]["output"]) for document in documents if document}
        for kind, select in self._selects.items():
            select.set_visibility(kind in outputs)

    @property
    def chosen(self) -> tuple[str, ...]:
        """The choices that differ from the default."""
        return tuple(str(select.value) for kind, select in self._selects.items() if select.value != next(iter(CHOICES[kind])))
