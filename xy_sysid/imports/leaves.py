"""Named arrays of a foreign file --> its columns: matrices by column, structs by their labels, and channels with their own times."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from xy_sysid.imports import arrays
from xy_sysid.imports.guarded import Leaf
from xy_sysid.imports.sheet import Column, Sheet


def sheet_of_leaves(path: Path, found: Sequence[Leaf]) -> Sheet:
    """The columns: channels with clocks get the instants of these; leaves without any clock are read as arrays."""
    clocks = {leaf.clock for leaf in found if leaf.clock}
    if not clocks:
        return arrays.sheet_of(path, arrays.group(path, {leaf.name: leaf.values for leaf in found}))
    instants = {leaf.name: np.asarray(leaf.values, np.float64).ravel() for leaf in found if leaf.name in clocks}
    columns = []
    for leaf in found:
        if leaf.name not in clocks and leaf.values.ndim == 1 and leaf.values.dtype.kind == "f" and leaf.values.size > 1:
            columns.append(Column(leaf.name, leaf.unit, np.asarray(leaf.values, np.float64), clock=instants.get(leaf.clock)))
    return Sheet(path=path, columns=tuple(arrays.short(columns)), kind="channel")
