"""A result in a notebook: its line and one figure, which an exported notebook also shows offline."""

from __future__ import annotations

from html import escape
from typing import Any

import plotly.graph_objects as go
import plotly.io

from xy_sysid.errors import MissingExtra
from xy_sysid.report import plots
from xy_sysid.report.vector import vectors


def html(result: Any, picture: str) -> str | None:
    """The line and a figure of ``plots`` as HTML; None if there is nothing to draw.

    A notebook that loads plotly.js (``plotly.io.renderers``) draws the figure with it. Otherwise the output itself holds the figure: as vectors,
    or, without Matplotlib, together with plotly.js.
    """
    if picture == "bode" and len(result) == 0:
        return None
    figure = getattr(plots, picture)(result)
    here = plotly.io.renderers.default or ""
    shown = figure._repr_mimebundle_().get("text/html") if "notebook" in here.split("+") or "colab" in here else None
    return f"<p>{escape(repr(result))}</p>{shown or whole(figure)}"


def whole(figure: go.Figure) -> str:
    """The figure as HTML that needs no other file."""
    try:
        svg = vectors(figure, ["svg"])["svg"].decode()
    except MissingExtra:
        return str(figure.to_html(full_html=False, include_plotlyjs=True))
    titles = [axis.title.text for axis in (*figure.select_yaxes(), *figure.select_xaxes())]
    ticks = [text for axis in figure.select_xaxes() for text in axis.ticktext or ()]
    words = dict.fromkeys(str(text).replace("<br>", " ") for text in (*titles, *(trace.name for trace in figure.data), *ticks) if text)
    label = escape(", ".join(words))
    return f'<div role="img" aria-label="{label}" style="max-width: 181mm; background: white">{svg[svg.index("<svg") :]}</div>'
