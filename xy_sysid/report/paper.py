"""Figure size for print: one or two journal columns wide, with margins as wide as the labels need."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MM = 1 / 25.4  # inches
WIDTHS = {1: 88.0 * MM, 2: 181.0 * MM}  # inches of one and two columns, of IEEE; other journals have 80 to 90 and 170 to 190 mm
TALL = {1: 0.72, 2: 1.0}  # fraction of the height on the page
PIXELS = 100.0  # px on the page per inch of height
PAD = 0.04  # inches between the outermost labels and the edge
ROUNDS = 2  # iterations: the margins change the ticks, and the ticks change the margins
MOST = 4  # maximum columns of the legend
TILTED = 30.0  # degrees: rotation of labels under an axis that would overlap


def sheet(height: float, columns: int) -> Figure:
    """An empty sheet. height: of the figure on the page, px; columns: of a journal, 1 or 2."""
    from matplotlib.figure import Figure as Sheet

    return Sheet(figsize=(WIDTHS[columns], TALL[columns] * height / PIXELS + 0.3))


def rows(paper: Figure, layout: Any) -> dict[str, Axes]:
    """One set of axes for each y axis, in its part of the height."""
    found: dict[str, Axes] = {}
    for key in ("yaxis", *(f"yaxis{k}" for k in range(2, 9))):
        if key not in layout:
            continue
        low, high = layout[key].domain or (0.0, 1.0)
        ax = paper.add_axes((0.15, 0.12 + 0.76 * low, 0.8, 0.76 * (high - low)))
        ax.grid(visible=True, color="#dfe3e8", linewidth=0.6)
        ax.set_axisbelow(True)
        for side in ("top", "right"):
            ax.spines[side].set_visible(False)
        found[key.replace("axis", "")] = ax
    return found


def legend(paper: Figure, axes: Mapping[str, Axes], shown: bool | None) -> float:
    """Draw a legend of all names above the axes, in as many columns as fit. Returns its height in inches, 0 without a legend.

    shown: as in Plotly; None: if there is more than one name
    """
    found: dict[str, Any] = {}
    for ax in axes.values():
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    if not found or not (len(found) > 1 if shown is None else shown):
        return 0.0
    for columns in range(min(MOST, len(found)), 0, -1):
        made = paper.legend(
            list(found.values()), list(found), loc="upper left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, ncols=columns, frameon=False,
            fontsize=7.5, columnspacing=1.4, handlelength=1.8,
        )  # fmt: skip
        box = made.get_window_extent()
        if columns == 1 or box.width <= paper.bbox.width:
            break
        made.remove()
    return float(box.height) / paper.dpi


def fit(paper: Figure, axes: Mapping[str, Axes], above: float) -> None:
    """Move and size the axes so that all of their labels are on the paper. above: inches at the top that are already used."""
    wide, high = paper.get_size_inches()
    for turn in range(ROUNDS):
        boxes = [box for ax in axes.values() if (box := ax.get_tightbbox(bbox_extra_artists=ax.texts)) is not None]
        if turn == 0 and _tilt(axes):
            boxes = [box for ax in axes.values() if (box := ax.get_tightbbox(bbox_extra_artists=ax.texts)) is not None]
        places = {name: ax.get_position() for name, ax in axes.items()}
        left, right = min(place.x0 for place in places.values()), max(place.x1 for place in places.values())
        bottom, top = min(place.y0 for place in places.values()), max(place.y1 for place in places.values())
        boxes = [box.transformed(paper.transFigure.inverted()) for box in boxes]
        pads = PAD / wide, PAD / high
        new_left = max(left - min(box.x0 for box in boxes), 0.0) + pads[0]
        new_right = 1 - max(max(box.x1 for box in boxes) - right, 0.0) - pads[0]
        new_bottom = max(bottom - min(box.y0 for box in boxes), 0.0) + pads[1]
        new_top = 1 - max(max(box.y1 for box in boxes) - top, 0.0) - pads[1] - above / high
        across, along = max(new_right - new_left, 0.1) / (right - left), max(new_top - new_bottom, 0.1) / (top - bottom)
        for name, ax in axes.items():
            place = places[name]
            ax.set_position(
                (new_left + (place.x0 - left) * across, new_bottom + (place.y0 - bottom) * along, place.width * across, place.height * along)
            )


def _tilt(axes: Mapping[str, Axes]) -> bool:
    """Rotate overlapping labels under an axis; returns True if any overlapped."""
    tilted = False
    for ax in axes.values():
        labels = [label for label in ax.get_xticklabels() if label.get_visible() and label.get_text()]
        boxes = [label.get_window_extent() for label in labels]
        if any(later.x0 < earlier.x1 for earlier, later in itertools.pairwise(boxes)):
            tilted = True
            for label in labels:
                label.set(rotation=TILTED, ha="right", rotation_mode="anchor")
    return tilted
