"""python -m campaigns.bench real_fits FOLDER: relative error of every estimator on the two-inertia bench (multisineA, multisineB).

FOLDER holds ``two_inertia_bench`` (HoriFujimotoLab/FdiTools, MIT). The band is that of the multisine, 10 to 255 Hz; orders are
those that ``fit`` chooses, shown next to the error. Relative error: rms of |measured - model| / |measured| over the lines.
"""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path
from typing import Literal

import xy_sysid as xy
from xy_sysid.fitting import Structure, identify, nllsfdi
from xy_sysid.fitting.choose_orders import choose
from xy_sysid.fitting.structure import Weighting

LOW, HIGH = 10.0, 255.0  # Hz
Ways = tuple[tuple[str, Literal["zoh", "none"], Weighting], ...]
WAYS: Ways = (
    ("sigma, input held", "zoh", "sigma"),
    ("1 / FRF, input held", "zoh", "relative"),
    ("sigma, input not held", "none", "sigma"),
    ("1 / FRF, input not held", "none", "relative"),
)


def row(folder: Path, name: str, ways: Ways) -> list[str]:
    """One cell for each way."""
    response = xy.frf(xy.load(folder / "two_inertia_bench" / f"{name}.npz"), band_low=LOW, band_high=HIGH)
    chosen = choose(response, Structure(hold="none")).fit.structure
    fits = [nllsfdi.fit(response, Structure(weighting="relative"))]
    fits += [identify(response, replace(chosen, hold=hold, weighting=weighting)) for _, hold, weighting in ways]
    cells = []
    for fit in fits:
        orders = f"{fit.structure.numerator_order}/{fit.structure.denominator_order}"
        lightest = min((mode for mode in fit.tf.pole_modes() if mode.frequency > LOW), key=lambda mode: mode.damping)
        cells.append(f"{100.0 * fit.relative_error:.1f} % ({orders}; {lightest.frequency:.2f} Hz)")
    return cells


def main(short: bool = False) -> None:
    """Print the table as Markdown."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else os.environ.get("XY_SYSID_DATA", "../shared/data"))
    names, ways = (("multisineB",), WAYS[:1]) if short else (("multisineA", "multisineB"), WAYS)
    table = {name: row(folder, name, ways) for name in names}
    sys.stdout.write("| way | " + " | ".join(table) + " |\n|---|" + "---|" * len(table) + "\n")
    for number, words in enumerate(("the paper's path: 1 / FRF, delay absorbed", *(words for words, _, _ in ways))):
        sys.stdout.write(f"| {words} | " + " | ".join(cells[number] for cells in table.values()) + " |\n")


if __name__ == "__main__":
    main()
