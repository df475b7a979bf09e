"""Colours and templates of the figures: lines that read on white and on near-black, ink that follows the page."""

from __future__ import annotations

from typing import Any

AXES = ("#2f7fd0", "#d9691e", "#1a9a6c", "#9a62d0", "#c9478a", "#8a8420")
METHODS = {"measured": "#7f8993", "LLS": "#d9691e", "NLLS": "#9a62d0", "ML": "#2f7fd0"}
DRIFT = "#9a62d0"
BEFORE, AFTER = "#2f7fd0", "#d9691e"
MEASURED, MODEL, FLOOR, FAILS, UNTRUSTED = "#2f7fd0", "#d9691e", "#1a9a6c", "#c9478a", "#7f8993"  # of a story, each with a dash or marker too
FONT = "system-ui, -apple-system, 'Segoe UI', 'Liberation Sans', Arial, sans-serif"
ROW = 230  # height of a row of a figure, px
INK = {"light": ("#24292f", "#dfe3e8", "#aab2bb", "#ffffff"), "dark": ("#d7dce1", "#30363d", "#59636e", "#22272e")}


def template(mode: str) -> dict[str, Any]:
    """Plotly layout template of the light or the dark page."""
    ink, grid, line, panel = INK[mode]
    axis = {
        "gridcolor": grid,
        "linecolor": line,
        "zerolinecolor": line,
        "tickcolor": line,
        "ticks": "outside",
        "ticklen": 4,
        "showline": True,
        "automargin": True,
        "title": {"standoff": 6},
    }
    return {
        "layout": {
            "font": {"family": FONT, "size": 12, "color": ink},
            "paper_bgcolor": "rgba(0,0,0,0)",
            "plot_bgcolor": "rgba(0,0,0,0)",
            "xaxis": axis,
            "yaxis": axis,
            "hoverlabel": {"bgcolor": panel, "bordercolor": line, "font": {"color": ink}},
            "legend": {"orientation": "h", "x": 0, "y": 1.0, "xanchor": "left", "yanchor": "bottom", "bgcolor": "rgba(0,0,0,0)"},
            "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": line, "activecolor": ink},
            "annotationdefaults": {"font": {"color": ink, "size": 12}},
        }
    }


def fade(colour: str, opacity: float) -> str:
    """The colour as rgba."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{opacity})"


def axis_colour(number: int) -> str:
    """Colour of the n-th axis of a machine."""
    return AXES[number % len(AXES)]
