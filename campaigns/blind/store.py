"""Results of cases in a file with a JSON line for each, so that a stopped campaign can continue."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from campaigns.blind.cases import Case
from campaigns.blind.foreign import Foreign
from campaigns.blind.judge import Judged


def load(path: Path) -> dict[Case | Foreign, Judged]:
    """Every complete result in the file; empty without a file."""
    found: dict[Case | Foreign, Judged] = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        try:
            row = json.loads(line)
        except ValueError:  # last line of a killed run
            continue
        words, truth = row.pop("case"), tuple(row.pop("truth"))
        case = Foreign(**words) if "loop" in words else Case(**words | {"truth": truth})
        found[case] = Judged(case, **row | {name: tuple(row[name]) for name in ("effects", "phantoms", "unseen", "kinds") if name in row})
    return found


def add(path: Path, item: Judged) -> None:
    """Append one result."""
    row = asdict(item)
    row["truth"] = list(row["case"].pop("truth", ()))
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row, default=_plain) + "\n")


def _plain(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(type(value).__name__)
