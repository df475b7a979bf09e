"""Colours and templates of the figures: lines readable on white and near-black, text colour from the page."""

from __future__ import annotations

from typing import Any

# distinguishable without red, green or blue vision, and readable on white and on near-black: test_report_theme.py
AXES = ("#1e8fe4", "#e85a0d", "#257250", "#8a36ec", "#c9478a", "#8a8420")
METHODS = {"measured": "#7f8993", "LLS": "#e85a0d", "NLLS": "#8a36ec", "ML": "#1e8fe4"}
DRIFT = "#8a36ec"
BEFORE, AFTER = "#1e8fe4", "#e85a0d"
MEASURED, MODEL, FLOOR, FAILS, UNTRUSTED = "#1e8fe4", "#e85a0d", "#257250", "#ba189d", "#87959f"  # of a story; each also has its own dash or marker
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
