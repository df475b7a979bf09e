"""Named arrays of a file of others --> its columns: matrices by column, structs by their labels, and channels with times of their own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from xy_sysid.imports import arrays
from xy_sysid.imports.guarded import Leaf
from xy_sysid.imports.sheet import Column, Sheet


def sheet_of_leaves(path: Path, found: Sequence[Leaf]) -> Sheet:
    """Channels with clocks are columns with the instants of these; everything else is read as arrays are."""
    clocks = {leaf.clock for leaf in found if leaf.clock}
    if not clocks:
        return arrays.sheet_of(path, arrays.group(path, {leaf.name: leaf.values for leaf in found}))
    instants = {leaf.name: np.asarray(leaf.values, np.float64).ravel() for leaf in found if leaf.name in clocks}
    columns = []
    for leaf in found:
        if leaf.name not in clocks and leaf.values.ndim == 1 and leaf.values.dtype.kind == "f" and leaf.values.size > 1:
            columns.append(Column(leaf.name, leaf.unit, np.asarray(leaf.values, np.float64), clock=instants.get(leaf.clock)))
    return Sheet(path=path, columns=tuple(arrays.short(columns)), kind="channel")
