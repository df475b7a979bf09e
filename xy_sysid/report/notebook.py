"""A result in a notebook: its line and one figure, which an exported notebook also shows offline."""

from __future__ import annotations

from html import escape
from typing import Any

import plotly.io

from xy_sysid.report import plots
from xy_sysid.report.offline import whole


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
