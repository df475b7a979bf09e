"""python -m campaigns.bench settle_precision: are intervals as narrow as predicted by the experiment designed for them?"""

from __future__ import annotations

import sys

from campaigns.bench.recordings import markdown
from campaigns.bench.settle_pairs import PAIRS, carry_out, first_recording, limits, machine
from xy_sysid.axis.model import STANDARD
from xy_sysid.experiment_design.precision import Precision, sharpest
from xy_sysid.experiment_design.rivals import standing
from xy_sysid.greybox.axis_data import prepare_all
from xy_sysid.greybox.free_run import fit

CASES = ((0, "coulomb_friction.coulomb", 0.002), (5, "pole", 0.0025), (5, "gain", 0.0004), (2, "constant_load.load", 0.003), (9, "pole", 0.002))
SEEDS = (103, 104)  # never used during development
NEAR = 0.2  # allowed relative difference of an interval from the predicted one
COLUMNS = ("machine of", "parameter", "before", "asked for", "experiment", "seconds", "expected", "reached", "ratio")


def main(short: bool = False) -> None:
    """Print one line for each case, and the number of cases that met the prediction."""
    rows, near = [], 0
    for place, name, width in CASES[1:2] if short else CASES:
        for seed in SEEDS[: 1 if short else None]:
            pair = PAIRS[place]
            made, asked, target = machine(pair, 0, seed), limits(pair), Precision(name, width)
            first = first_recording(pair, made, seed)
            data = prepare_all(made.rate, [first])
            known = standing(data, STANDARD, [pair.sets[0]]).fits[0]
            best = sharpest(data, known, asked, target)
            if best.experiment is None:
                rows.append((pair.name, name, f"{best.before:.3%}", f"{width:.3%}", "none", "", "", "", ""))
                continue
            found = fit(prepare_all(made.rate, [first, carry_out(made, best.experiment)]), known.model)
            reached = target.of_interval(found.parameter(name))
            near += int(abs(reached / best.width - 1.0) <= NEAR)
            figures = (f"{best.experiment.seconds:.0f}", f"{best.width:.3%}", f"{reached:.3%}", f"{reached / best.width:.2f}")
            rows.append((pair.name, name, f"{best.before:.3%}", f"{width:.3%}", best.experiment.words, *figures))
    sys.stdout.write(markdown(COLUMNS, rows) + "\n\n")
    sys.stdout.write(f"{near} of {len(rows)} intervals are within {NEAR:.0%} of the expected width.\n")


if __name__ == "__main__":
    main()
