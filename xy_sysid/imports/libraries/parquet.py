"""Parquet, as LeRobot stores episodes, by pyarrow. A column of lists (``observation.state``) becomes a column for each of their numbers."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np


def declared(path: str) -> int:
    """Unpacked size of all columns, bytes."""
    from pyarrow import parquet

    data = parquet.read_metadata(path)
    return sum(data.row_group(number).total_byte_size for number in range(data.num_row_groups))


def leaves(path: str) -> Iterator[tuple[str, Any]]:
    """Columns of numbers, words and instants."""
    import pyarrow
    from pyarrow import compute, parquet

    table = parquet.read_table(path)
    for name, column in zip(table.column_names, table.columns, strict=True):
        kind = column.type
        if pyarrow.types.is_list(kind) or pyarrow.types.is_large_list(kind) or pyarrow.types.is_fixed_size_list(kind):
            if pyarrow.types.is_integer(kind.value_type) or pyarrow.types.is_floating(kind.value_type):
                widths = set(compute.list_value_length(column).to_pylist())
                if len(widths) == 1 and None not in widths:
                    values = np.array(column.to_pylist(), np.float64)
                    yield from ((f"{name}[{place}]", values[:, place]) for place in range(values.shape[1]))
        elif pyarrow.types.is_timestamp(kind) or pyarrow.types.is_duration(kind):
            ticks = column.cast(pyarrow.int64()).to_numpy()
            scale = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[kind.unit]
            yield name, scale * (ticks - ticks[:1])
        elif pyarrow.types.is_integer(kind) or pyarrow.types.is_floating(kind) or pyarrow.types.is_boolean(kind):
            yield name, column.to_numpy().astype(np.float64)
        elif pyarrow.types.is_string(kind) or pyarrow.types.is_large_string(kind):
            yield name, [str(one) for one in column.to_pylist()]
