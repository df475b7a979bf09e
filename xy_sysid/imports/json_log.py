"""JSON --> columns: every array of numbers by its path. ``data[*].actions`` joins the arrays of all items of ``data``, a stretch for each item."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

from xy_sysid.errors import BadRecording
from xy_sysid.imports.arrays import rate_of
from xy_sysid.imports.limits import COPY, MOST_COLUMNS, fits
from xy_sysid.imports.sheet import Column, Sheet

COPIES = 8  # bytes in memory for each byte of the file
DEEPEST = 24  # levels
FEW = 32  # numbers of one vector, such as the joints of an arm


def sheet(path: Path) -> Sheet:
    """The columns of one JSON document, or of a file with a document in each line."""
    fits(path, float(COPIES * path.stat().st_size), "as numbers")
    try:
        text = path.read_text("utf-8-sig")
        document = [json.loads(line) for line in text.splitlines() if line.strip()] if path.suffix.lower() != ".json" else json.loads(text)
    except UnicodeDecodeError:
        raise BadRecording(path, "not a text file", "Save it as JSON in UTF-8.") from None
    except (ValueError, RecursionError) as error:
        raise BadRecording(path, f"not readable as JSON ({str(error)[:100]})", COPY) from None
    columns: list[Column] = []
    try:
        for name, values, starts in _columns("", document, 0):
            if len(columns) >= MOST_COLUMNS:
                raise BadRecording(path, f"more than {MOST_COLUMNS} arrays", "Store the signals alone.")
            columns.append(Column(name, "", values, starts=starts))
    except OverflowError:
        raise BadRecording(path, "a whole number that is too large for a sample", "Store the signals alone, as numbers up to 1e308.") from None
    scalars = {key: np.asarray(value) for key, value in document.items() if _is_number(value)} if isinstance(document, dict) else {}
    return Sheet(path=path, columns=tuple(columns), kind="array", fs=rate_of(scalars))


def _columns(path: str, value: Any, depth: int) -> Iterator[tuple[str, Any, tuple[int, ...]]]:
    """Path, numbers and first row of each stretch, for every array."""
    if depth > DEEPEST:
        return
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _columns(f"{path}.{key}" if path else str(key), inner, depth + 1)
    elif isinstance(value, list) and len(value) > 1 and all(map(_is_number, value)):
        yield path, np.array([np.nan if one is None else one for one in value], np.float64), ()
    elif isinstance(value, list) and value and all(isinstance(one, dict) for one in value):
        for key in dict.fromkeys(key for one in value for key in one):
            yield from _together(f"{path}[*].{key}" if path else key, [one.get(key) for one in value], depth + 1)
    elif isinstance(value, list) and value and all(isinstance(one, list) for one in value):
        rows = {len(one) for one in value}
        if len(rows) == 1 and all(_is_number(number) for one in value for number in one):
            matrix = np.array([[np.nan if number is None else number for number in one] for one in value], np.float64)
            yield from ((f"{path}[*][{place}]", matrix[:, place], ()) for place in range(matrix.shape[1]))
        else:
            yield from _together(f"{path}[*]", value, depth + 1)


def _together(path: str, items: list[Any], depth: int) -> Iterator[tuple[str, Any, tuple[int, ...]]]:
    """The columns of one name in all items of a list: from a number in each, an array in each, or deeper levels."""
    if all(map(_is_number, items)):
        if len(items) > 1 and any(one is not None for one in items):
            yield path, np.array([np.nan if one is None else one for one in items], np.float64), ()
    elif all(one is None or (isinstance(one, list) and all(map(_is_number, one))) for one in items):
        parts = [[np.nan if number is None else number for number in one or []] for one in items]
        lengths = {len(part) for part in parts}
        values = np.array([number for part in parts for number in part], np.float64)
        if values.size > 1:
            yield path, values, tuple(accumulate((len(part) for part in parts[:-1]), initial=0))
        if len(lengths) == 1 and 1 < max(lengths) <= FEW:
            matrix = values.reshape(len(parts), -1)
            yield from ((f"{path}[{place}]", matrix[:, place], ()) for place in range(matrix.shape[1]))
    elif all(one is None or isinstance(one, dict) for one in items):
        for key in dict.fromkeys(key for one in items if one for key in one):
            yield from _together(f"{path}.{key}", [None if one is None else one.get(key) for one in items], depth + 1)


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))
