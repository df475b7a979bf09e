"""The first figure of an axis: where the selected model fails, by frequency, speed, position and time, on one scale."""

from __future__ import annotations

import asyncio
from functools import partial
from typing import get_args

from nicegui import ui

from xy_sysid.page.orders import Source
from xy_sysid.page.plot import Plot
from xy_sysid.page.session import Session
from xy_sysid.page.views import View
from xy_sysid.report.story_failure import HEIGHT, By, failure, failure_words

READING: dict[By, str] = {
    "frequency": "by frequency: a resonance, a lag",
    "speed": "by speed: friction, drag, saturation",
    "position": "by position: cogging, lead error, a spring",
    "time": "over time: drift, warming",
}


class FailureCard:
    """Four small plots."""

    def __init__(self, session: Session, source: Source) -> None:
        self._session, self._source = session, source
        self.plots: dict[By, Plot] = {}
        with ui.element("section").classes("card first").props('aria-label="where the model fails"') as self._card:
            ui.html("<h2>Where the model fails: error on held-out data, in multiples of the noise floor</h2>", sanitize=False)
            with ui.element("div").classes("four"):
                for by in get_args(By):
                    self.plots[by] = Plot(READING[by], f"fails_by_{by}", HEIGHT)

    async def refresh(self, axis: str, view: View) -> None:
        """Redraw what has changed."""
        stamp = self._source.stamp(axis)  # read before the document: see StoryCard
        document = self._source.document(axis)
        self._card.set_visibility(not view.linear)
        if view.linear:
            return
        if document is None or not document["steps"]:
            for by, plot in self.plots.items():
                plot.wait(f"Where the model fails, by {by}, axis {axis}: not fitted yet.")
            return
        key = self._source.key, axis, stamp, view.step, "fails"
        shows = [plot.show(self._session, (*key, by), partial(failure, by=by), document, step=view.step) for by, plot in self.plots.items()]
        await asyncio.gather(*shows)  # all at once, so that plots of different steps are never shown together for long
        for by, plot in self.plots.items():
            plot.say(failure_words(document, by, view.step))
