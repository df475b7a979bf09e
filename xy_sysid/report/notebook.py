"""A result as a notebook shows it: its line, and the picture that says more."""

from __future__ import annotations

from html import escape
from typing import Any

import plotly.io

from xy_sysid.report import plots


def html(result: Any, picture: str) -> str | None:
    """The line and a figure of ``plots``, drawn by what Plotly has found here (``plotly.io.renderers``); None if there is nothing to draw."""
    if picture == "bode" and len(result) == 0:
        return None
    figure = getattr(plots, picture)(result)
    here = plotly.io.renderers.default or ""
    shown = figure._repr_mimebundle_().get("text/html") if "notebook" in here or "colab" in here else None
    return f"<p>{escape(repr(result))}</p>{shown or figure.to_html(full_html=False, include_plotlyjs='cdn')}"
