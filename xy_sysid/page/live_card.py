"""Figures of the identifier's results: its response and where its linear fit fails, and the watched resonance over time."""

from __future__ import annotations

from nicegui import ui

from xy_sysid.page.facts import base_fails
from xy_sysid.page.live_figures import failing_words, response_figure, tracking_figure
from xy_sysid.page.plot import Plot
from xy_sysid.page.session import Session


class LiveCards:
    """The figures of the identifier's results in one browser."""

    def __init__(self, session: Session) -> None:
        self._session = session
        with ui.element("section").classes("card linear").props('aria-label="linear fit, live"') as self._card:
            ui.html("<h2>Linear fit, live</h2>", sanitize=False)
            self._words = ui.label("").classes("soft")
            self._plot = Plot(
                "The band narrows with more windows. Residual: measurement minus model in standard errors; above 2 is more than chance."
            )
        with ui.element("section").classes("card").props('aria-label="resonance over time"') as self._track_card:
            ui.html("<h2>Resonance over time</h2>", sanitize=False)
            self._track = Plot("Fitted to the newest windows only. Two fits in a row that differ from the reference raise the alarm.", "resonance")

    async def refresh(self, axis: str, shown: bool) -> None:
        """Redraw what has changed; shown: True if the linear fit is selected."""
        heard = self._session.heard
        key = ("live", axis, heard.version.get(f"axis {axis}", 0))
        frf, comparison = heard.table("frf", axis), heard.table("comparison", axis)
        self._card.set_visibility(shown and frf is not None)
        history = list(heard.resonances.get(axis, ()))
        self._track_card.set_visibility(shown and len(history) > 1)
        if shown and frf is not None:
            told = f"{failing_words(comparison)} {base_fails(heard.stories.get(axis))}".strip()
            self._words.set_text(told)
            await self._plot.show(
                self._session, key, response_figure, frf, comparison, heard.transfer_function(axis), heard.rate(axis), heard.units(f"axis {axis}")
            )
            self._plot.say(f"Frequency response of axis {axis}, live. {told}")
        if shown and len(history) > 1:
            await self._track.show(self._session, ("track", axis, len(history), history[-1].seconds), tracking_figure, history)
            self._track.say(f"Resonance of axis {axis}: {history[-1].frequency:.2f} Hz, reference {history[-1].reference:.2f} Hz")
