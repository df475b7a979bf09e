"""A figure as vectors, SVG or PDF, without a browser: Matplotlib draws a Plotly figure.

Supports the elements of this package's figures: lines, markers, areas and bars in rows; logarithmic axes; shapes and text.
"""

from __future__ import annotations

import functools
import io
import re
import tempfile
import textwrap
from collections.abc import Mapping, Sequence
from html import unescape
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import plotly.graph_objects as go

from xy_sysid.errors import MissingExtra
from xy_sysid.report.paper import fit, legend, rows, sheet
from xy_sysid.samples.block import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DASHES = {"solid": "-", "dash": "--", "dot": ":", "dashdot": "-."}
SYMBOLS = {"x-thin": "x", "circle-open": "o", "circle": "o", "diamond": "D"}
RGBA = re.compile(r"rgba?\(([^)]*)\)")
INK = "#24292f"
SANS = "xy_sysid Sans"
FAMILY = (1, 3, 4, 16)  # name records of a font that contain its family
LETTERS = (  # Unicode ranges, end excluded; other characters come from DejaVu Sans itself
    (0x20, 0x180), (0x391, 0x3CA), (0x2010, 0x2040), (0x2070, 0x20A0), (0x2190, 0x2194), (0x2212, 0x2213), (0x221A, 0x221B), (0x2248, 0x2249),
    (0x2264, 0x2266),
)  # fmt: skip
BAR = 0.85  # bar width as a fraction of the spacing
NAME = 20  # letters in a line of a bar's name
DECADES = 1.6  # a logarithmic axis with fewer decades also has labels at 2 and 5


def vectors(figure: go.Figure, kinds: Sequence[str], columns: int = 2) -> dict[str, bytes]:
    """The figure as svg, pdf or both, by kind; it is drawn once. Raises MissingExtra without Matplotlib.

    columns: of a journal, 1 or 2; sets the width; text has the same size in both
    """
    mpl = installed()
    look: Any = {
        "font.family": [_font()[0], "DejaVu Sans"],
        "svg.fonttype": "path",
        "pdf.fonttype": 42,
        "svg.hashsalt": "xy_sysid",
        "font.size": 8.5,
        "text.color": INK,
        "axes.labelcolor": INK,
    }
    with mpl.rc_context(look):
        paper = drawn(figure, columns)
        return {kind: _written(paper, kind) for kind in kinds}


def installed() -> ModuleType:
    """Matplotlib, or MissingExtra."""
    try:
        import matplotlib as mpl
    except ModuleNotFoundError:
        raise MissingExtra("Matplotlib, which draws vectors,", "figures") from None
    return mpl


@functools.cache
def _font() -> tuple[str, tempfile.TemporaryDirectory[str]]:
    """The family of a font with only LETTERS of DejaVu Sans, and a folder that must exist while the font is used.

    A PDF embeds the letters that it uses. Finding them in the full DejaVu Sans takes longer than drawing the figure.
    """
    from fontTools import subset
    from matplotlib.font_manager import findfont, fontManager

    options = subset.Options(hinting=False, layout_features=[], drop_tables=["FFTM", "GDEF", "GPOS", "GSUB", "gasp", "kern"], name_IDs=["*"])
    font = subset.load_font(findfont("DejaVu Sans"), options)
    cutter = subset.Subsetter(options)
    cutter.populate(unicodes=[code for first, last in LETTERS for code in range(first, last)])
    cutter.subset(font)
    for name in font["name"].names:
        if name.nameID in FAMILY:
            name.string = SANS
    folder = tempfile.TemporaryDirectory(prefix="xy_sysid_font_")
    font.save(f"{folder.name}/sans.ttf")
    fontManager.addfont(f"{folder.name}/sans.ttf")
    return SANS, folder


def _written(paper: Figure, kind: str) -> bytes:
    written = io.BytesIO()
    paper.savefig(written, format=kind, metadata={"Date" if kind == "svg" else "CreationDate": None})
    return written.getvalue()


def drawn(figure: go.Figure, columns: int) -> Figure:
    """The figure on a sheet of the journal's width."""
    layout = figure.layout
    paper = sheet(float(layout.height or 400), columns)
    axes = rows(paper, layout)
    previous: dict[str, tuple[FloatArray, FloatArray]] = {}
    for trace in figure.data:
        name = str(trace.yaxis or "y")
        ax = axes[name]
        if trace.type == "bar":
            _bars(ax, trace, [other for other in figure.data if other.type == "bar" and str(other.yaxis or "y") == name])
        else:
            x, y = _numbers(trace.x), _numbers(trace.y)
            _area(ax, trace, (x, y), previous.get(name))
            _line(ax, trace, x, y)
            previous[name] = x, y
    for name, ax in axes.items():
        _scales(ax, layout, name)
    for shape in layout.shapes:
        _shape(axes, shape)
    for note in layout.annotations:
        _note(paper, axes, note)
    fit(paper, axes, legend(paper, axes, layout.showlegend))
    return paper


def _line(ax: Axes, trace: Any, x: FloatArray, y: FloatArray) -> None:
    mode = str(trace.mode or "lines")
    colour, shown = _colour(trace.line.color), trace.showlegend is not False and bool(trace.name)
    label = _words(trace.name) if shown else "_nolegend_"
    width = 0.75 * float(trace.line.width if trace.line.width is not None else 1.5)
    if "lines" in mode and width > 0:
        ax.plot(x, y, color=colour, linestyle=DASHES.get(str(trace.line.dash or "solid"), "-"), linewidth=width, label=label)
        label = "_nolegend_"
    if "markers" in mode:
        symbol, size = SYMBOLS.get(str(trace.marker.symbol), "o"), 0.6 * float(trace.marker.size or 6)
        face = "none" if str(trace.marker.symbol) == "circle-open" else None
        own = _colour(trace.marker.color or trace.marker.line.color or trace.line.color)
        ax.plot(x, y, linestyle="none", marker=symbol, markersize=size, color=own, markerfacecolor=face or own, label=label)


def _area(ax: Axes, trace: Any, curve: tuple[FloatArray, FloatArray], before: tuple[FloatArray, FloatArray] | None) -> None:
    x, y = curve
    colour = _colour(trace.fillcolor)
    if trace.fill == "toself":
        label = _words(trace.name) if trace.showlegend is not False and trace.name else "_nolegend_"
        for piece in np.split(np.arange(x.size), np.flatnonzero(np.isnan(x))):
            known = piece[np.isfinite(x[piece]) & np.isfinite(y[piece])]
            if known.size:
                ax.fill(x[known], y[known], color=colour, linewidth=0, label=label)
                label = "_nolegend_"
    elif trace.fill == "tozeroy":
        ax.fill_between(x, y, np.full(x.size, 1e-9), color=colour, linewidth=0)
    elif trace.fill == "tonexty" and before is not None and before[0].size == x.size:
        ax.fill_between(x, y, before[1], color=colour, linewidth=0)


def _bars(ax: Axes, trace: Any, together: Sequence[Any]) -> None:
    """Draw horizontal bars with their names, or vertical bars. together: all bars on these axes; the two closest set the width."""
    colours = [_colour(each) for each in trace.marker.color] if isinstance(trace.marker.color, (list, tuple)) else _colour(trace.marker.color)
    label = _words(trace.name) if trace.showlegend is not False and trace.name else "_nolegend_"
    if trace.orientation != "h":
        places = np.unique(np.concatenate([_numbers(each.x) for each in together]))
        width = BAR * float(np.min(np.diff(places))) if places.size > 1 else BAR
        x, y = (_numbers(values) if len(trace.x) else np.array([np.nan]) for values in (trace.x, trace.y))  # the legend shows its colour
        ax.bar(x, y, width=width, color=colours, linewidth=0, label=label)
        return
    names = ["\n".join(textwrap.wrap(_words(name), NAME)) for name in trace.y]
    ax.barh(names, _numbers(trace.x), color=colours, label=label)
    for name, text in zip(names, trace.text or (), strict=False):
        ax.annotate(_words(text), (0.0, name), xytext=(2.0, 0.0), textcoords="offset points", va="center", fontsize=7.5, color=INK)


def _shape(axes: Mapping[str, Axes], shape: Any) -> None:
    place = str(shape.yref or "y").removesuffix(" domain")
    ax = axes.get(place)
    if ax is None:
        return
    colour, style = _colour(shape.line.color), DASHES.get(str(shape.line.dash or "solid"), "-")
    across, along = str(shape.yref).endswith("domain"), str(shape.xref).endswith("domain")
    if shape.type == "rect" and across:
        ax.axvspan(float(shape.x0), float(shape.x1), color=_colour(shape.fillcolor), linewidth=0)
    elif shape.type == "rect" and along:
        ax.axhspan(float(shape.y0), float(shape.y1), color=_colour(shape.fillcolor), linewidth=0, zorder=0.5)
    elif shape.type == "line" and across:
        ax.axvline(float(shape.x0), color=colour, linestyle=style, linewidth=0.8)
    elif shape.type == "line" and along:
        ax.axhline(float(shape.y0), color=colour, linestyle=style, linewidth=1.0)


def _note(paper: Figure, axes: Mapping[str, Axes], note: Any) -> None:
    text = _words(note.text)
    if not text:
        return
    horizontal = {"left": "left", "right": "right"}.get(str(note.xanchor), "center")
    vertical = {"top": "top", "bottom": "bottom"}.get(str(note.yanchor), "center")
    style: dict[str, Any] = {"ha": horizontal, "va": vertical, "fontsize": 7.5, "color": _colour(note.font.color) if note.font.color else INK}
    ax = axes.get(str(note.yref or "y").removesuffix(" domain"))
    if ax is None:
        paper.text(float(note.x), float(note.y), text, **style)
        return
    x, y = note.x, float(note.y)
    across, along = str(note.yref).endswith("domain"), str(note.xref).endswith("domain")
    value = float(x) if along or ax.get_xscale() != "log" else 10.0 ** float(x)
    level = y if across or ax.get_yscale() != "log" else 10.0**y
    turned = ax.get_xaxis_transform() if across and not along else ax.get_yaxis_transform() if along and not across else None
    shift = (2.0 if horizontal == "left" else 0.0, 0.75 * float(note.yshift or 0) + 1.0)
    ax.annotate(
        text, (value, level), xycoords=turned or ("axes fraction" if along else "data"), xytext=shift,
        textcoords="offset points", annotation_clip=False, **style,
    )  # fmt: skip


def _scales(ax: Axes, layout: Any, name: str) -> None:
    from matplotlib.ticker import LogLocator

    number = name[1:]
    own, across = layout[f"yaxis{number}"], layout[f"xaxis{number}"]
    for axis, letter in ((across, "x"), (own, "y")):
        if axis.type == "log":
            getattr(ax, f"set_{letter}scale")("log")
            low, high = axis.range if axis.range is not None else (0.0, DECADES)
            if float(high) - float(low) < DECADES:
                getattr(ax, f"{letter}axis").set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            getattr(ax, f"{letter}axis").set_major_formatter("{x:g}")
            getattr(ax, f"{letter}axis").set_minor_locator(LogLocator(subs=(2.0, 5.0)))
            getattr(ax, f"{letter}axis").set_minor_formatter("")
        if axis.range is not None:
            low, high = (10.0 ** float(end) if axis.type == "log" else float(end) for end in axis.range)
            getattr(ax, f"set_{letter}lim")(low, high)
        if axis.title.text:
            getattr(ax, f"set_{letter}label")(_words(axis.title.text))
    if across.tickvals is not None:
        ax.set_xticks([float(value) for value in across.tickvals], [_words(text) for text in across.ticktext])
    if own.autorange == "reversed":
        ax.invert_yaxis()
    if not across.title.text and across.matches:
        ax.tick_params(labelbottom=False)
    for axis, shown in ((ax.xaxis, across.visible), (ax.yaxis, own.visible)):
        if shown is False:
            axis.set_visible(False)


def _numbers(values: Any) -> FloatArray:
    return np.array([np.nan if value is None else float(value) for value in values], dtype=np.float64)


def _colour(text: Any) -> Any:
    """A colour in Matplotlib's notation."""
    found = RGBA.fullmatch(str(text)) if text is not None else None
    if found is None:
        return str(text) if text else INK
    red, green, blue, *opacity = (float(part) for part in found.group(1).split(","))
    return red / 255, green / 255, blue / 255, opacity[0] if opacity else 1.0


def _words(text: Any) -> str:
    """The text without markup; <br> becomes a new line."""
    return unescape(re.sub(r"<[^>]*>", "", re.sub(r"<br\s*/?>", "\n", str(text or ""))))
