"""Report section: whether two single-axis models suffice for two axes that were driven at the same time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go

from xy_sysid.report.parts import frequency_axis, plain, rows
from xy_sysid.report.theme import axis_colour
from xy_sysid.response.coupling import SUFFICES, Coupling
from xy_sysid.samples.block import FloatArray

CAPTION = (
    "Coupling is the motion of one axis caused by the input of the other, divided by the geometric mean of the responses "
    "of both axes to their own inputs: the larger of both directions, rms in each band. "
    "Solid and dotted: lower and upper 95 % limit. Dashed: below it two single-axis models suffice."
)


def coupling_figure(found: Coupling) -> go.Figure:
    """Coupling in each band, and its 95 % limit, in per cent over log frequency."""
    return bands_figure(found.axes, found.band_edges, found.coupling, found.at_most)


def bands_figure(axes: Sequence[str], band_edges: FloatArray, least: FloatArray, most: FloatArray) -> go.Figure:
    """The figure of ``coupling_figure`` from its arrays. band_edges: (bands + 1,) Hz; least, most: (bands,) fractions of the axis's own motion."""
    figure = rows(1, shared=False, gap=0.0)
    edges = np.repeat(band_edges, 2)[1:-1]
    one, other = (plain(axis) for axis in axes)
    for values, name, dash in ((least, f"{one} and {other}, at least", "solid"), (most, "at most", "dot")):
        shown = 100 * np.where(values > 0.0, values, np.nan)
        figure.add_scatter(
            x=edges, y=np.repeat(shown, 2), mode="lines", line={"color": axis_colour(0), "width": 1.6, "dash": dash}, name=name, connectgaps=False
        )
    line = {"color": axis_colour(1), "width": 1.2, "dash": "dash"}
    figure.add_scatter(x=edges[[0, -1]], y=[100 * SUFFICES] * 2, mode="lines", line=line, name="two models suffice below")
    frequency_axis(figure, 1, [band_edges])
    figure.update_yaxes(title_text="coupling (%)", type="log", dtick=1, tickformat="~g")
    return figure
