"""python -m campaigns.bench next_part: coverage of a parameter's interval for the next recording of the same machine.

The recordings of real machines in $XY_SYSID_DATA are cut into parts of equal length, and each part is diagnosed as a separate recording. From the
fourth part on, the trend gives a 95 % interval for each parameter of the next part. The table counts how often the parameter is within it, and within
the interval of the previous part alone. A part without an answer, or with other effects than the previous part, does not count.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from campaigns.bench.recordings import asked, markdown, rows
from campaigns.faults.shared import DATA, Shared
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.fleets.history import FEWEST
from xy_sysid.fleets.of_paths import Analysis
from xy_sysid.fleets.parts import rows_of_parts
from xy_sysid.fleets.row import Row
from xy_sysid.fleets.trends import of_rows
from xy_sysid.imports import load

PARTS = 8
SHORT = "gap_foreign/gap_linear_37um.npz"  # a quarter of it is used
COLUMNS = ("recording", "parts", "parameters of a next part", "within the interval with the spread", "within that of the part before alone")


def parts(row: Shared, count: int, seconds: float = math.inf) -> list[Row]:
    """The rows of ``count`` parts of a recording, or of its first seconds. Raises BadInput and BadRecording if it cannot be read."""
    (path,), reading = asked(row)
    read = load(path, reading)
    seconds = min(len(read) / read.sampling_rate, seconds)
    return rows_of_parts(path, seconds / count, Analysis(reading=replace(reading, stop=reading.start + seconds)))


def foretold(found: Sequence[Row]) -> Iterator[tuple[str, bool, bool]]:
    """For each parameter of each part: column, whether it is within the interval with the spread, and within that of the previous part."""
    for count in range(FEWEST, len(found)):
        now, before = found[count], found[count - 1]
        if any(row.get("verdict") in (None, "not_enough_data") for row in (now, before)) or now.get("model") != before.get("model"):
            continue
        try:
            trends = of_rows(found[:count]).trends
        except BadInput:  # fewer than four parts have an answer
            continue
        for one in trends:
            history, value = one.history, now.get(one.history.column)
            if value is not None and np.isfinite(value) and history.dates[-1] == before["date"]:
                yield history.column, one.next[0] <= value <= one.next[1], bool(history.low[-1] <= value <= history.high[-1])


def line(title: str, number: int, each: Sequence[tuple[str, bool, bool]]) -> tuple[str, ...]:
    """A row of the table."""
    with_spread, alone = (np.mean([one[place] for one in each]) for place in (1, 2))
    return title, str(number), str(len(each)), f"{100 * with_spread:.0f} %", f"{100 * alone:.0f} %"


def main(short: bool = False) -> None:
    """Print the table."""
    lines, together = [], list[tuple[str, bool, bool]]()
    for row in rows(False):
        if short and row.path != SHORT:
            continue
        try:
            found = parts(row, *((5, 7.5) if short else (PARTS,)))
        except (BadInput, BadRecording) as refusal:
            sys.stderr.write(f"{row.path}: {str(refusal).replace(f'{DATA}/', '')}\n")
            continue
        each = list(foretold(found))
        together += each
        lines += [line(row.path, len(found), each)] if each else []
        sys.stderr.write(f"{row.path}: {len(each)} parameters of the next parts of {len(found)}\n")
    lines += [line("all", sum(int(one[1]) for one in lines), together)] if together else []
    sys.stdout.write(markdown(COLUMNS, lines) + "\n")


if __name__ == "__main__":
    main()
