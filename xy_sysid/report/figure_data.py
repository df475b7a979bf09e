"""The numbers of a figure as a table, so that it can be plotted elsewhere."""

from __future__ import annotations

import base64
import csv
import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def table(figure: Mapping[str, Any], start: str = "") -> str:
    """CSV of a figure in Plotly's JSON: two columns for each curve, named by ``start``, the curve and the titles of its axes."""
    layout = figure.get("layout", {})
    columns: list[tuple[str, list[str]]] = []
    for number, trace in enumerate(figure.get("data", ())):
        name = str(trace.get("name") or f"curve {number + 1}").replace("<br>", " ")
        told = trace.get("meta") or {}
        for letter in ("x", "y"):
            values = trace.get(letter)
            if values is None:
                continue
            title = _title(layout, letter, str(trace.get(f"{letter}axis") or letter))
            columns.append((f"{start}{name}: {title or told.get(letter, letter)}", [_text(value) for value in _row(values)]))
    written = io.StringIO()
    writer = csv.writer(written, lineterminator="\n")
    writer.writerow([name for name, _ in columns])
    longest = max((len(values) for _, values in columns), default=0)
    for place in range(longest):
        writer.writerow([values[place] if place < len(values) else "" for _, values in columns])
    return written.getvalue()


def _title(layout: Mapping[str, Any], letter: str, axis: str) -> str:
    """The title of the axis, or of the axis that it is matched to; among shared axes the lowest has the title."""
    own = layout.get(f"{letter}axis{axis[1:]}") or {}
    text = (own.get("title") or {}).get("text")
    if not text:
        others = [item for name, item in layout.items() if name.startswith(f"{letter}axis") and isinstance(item, Mapping)]
        told = [str(item["title"]["text"]) for item in others if (item.get("title") or {}).get("text")]
        text = told[-1] if len(set(told)) == 1 else ""
    return str(text or "")


def _row(values: Any) -> Sequence[Any]:
    """A row of numbers; Plotly writes them as lists or as typed bytes."""
    if isinstance(values, Mapping):
        made = np.frombuffer(base64.b64decode(values["bdata"]), dtype=np.dtype(values["dtype"]))
        return list(made.tolist())
    return list(values)


def _text(value: Any) -> str:
    if value is None or (isinstance(value, float) and not np.isfinite(value)):
        return ""
    return f"{value:.7g}" if isinstance(value, (float, np.floating)) else str(value)
