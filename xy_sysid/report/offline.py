"""Figures that an exported notebook also shows without a network."""

from __future__ import annotations

import importlib
from html import escape
from typing import Any

import plotly.graph_objects as go
import plotly.io

from xy_sysid.errors import MissingExtra
from xy_sysid.report.vector import vectors


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


def _bundle(figure: Any, *arguments: Any, **options: Any) -> dict[str, Any]:
    """What a notebook keeps of a figure: as Plotly gives it, and as HTML that needs no other file."""
    bundle: dict[str, Any] = go.Figure._repr_mimebundle_(figure, *arguments, **options)
    return {"text/html": whole(figure)} | bundle


def _show(figure: Any, *arguments: Any, **options: Any) -> None:
    """Show a figure, in a notebook with all that it keeps."""
    if arguments or options or "mimetype" not in (plotly.io.renderers.default or ""):
        go.Figure.show(figure, *arguments, **options)
        return
    importlib.import_module("IPython.display").display(_bundle(figure), raw=True)


_AS_KEPT = {"_repr_mimebundle_": _bundle, "_ipython_display_": _show, "show": _show, "__doc__": "A Plotly figure that a notebook keeps."}
_Picture = type("Picture", (go.Figure,), _AS_KEPT)


def picture(figure: go.Figure) -> go.Figure:
    """The same figure, which a notebook keeps offline."""
    return _Picture(figure)
