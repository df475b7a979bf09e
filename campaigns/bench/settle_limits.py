"""python -m campaigns.bench settle_limits: do experiments with predicted motion within the limits stay within them on the machine?

For each draw of each pair, experiments are drawn from those that keep the limits in every model that the short recording allows;
the machine carries them out.
"""

from __future__ import annotations

import sys

import numpy as np

from campaigns.bench.settle_pairs import PAIRS, carry_out, first_recording, left_limits, limits, machine
from xy_sysid.axis.forward import move
from xy_sysid.axis.model import STANDARD
from xy_sysid.experiment_design.criteria import COARSE
from xy_sysid.experiment_design.proposals import proposals
from xy_sysid.experiment_design.rivals import beliefs_of, standing
from xy_sysid.greybox.axis_data import prepare_all

SEEDS = range(101, 103)
EACH = 12  # experiments for each draw
SECONDS = 8.0


def main(short: bool = False) -> None:
    """Print the number of experiments, and of those that exceeded a limit."""
    ran = left = near = 0
    sys.stdout.write("Experiments that keep within the limits by every model that a short recording allows:\n\n")
    for pair in PAIRS[5:6] if short else PAIRS:
        for seed, truth in [(seed, truth) for seed in SEEDS for truth in (0, 1)][: 1 if short else None]:
            made, asked = machine(pair, truth, seed), limits(pair)
            data = prepare_all(made.rate, [first_recording(pair, made, seed)])
            models = [model for belief in beliefs_of(data, STANDARD, standing(data, STANDARD, pair.sets), asked.travel, 4) for model in belief.draws]
            every = proposals(asked, made.rate)
            chosen = 0
            for place in np.random.default_rng([seed, truth]).permutation(len(every)):
                item = every[int(place)]
                drive = item.drive(made.rate, SECONDS, 0.0)
                if chosen == (2 if short else EACH) or any(asked.broken(move(model, made.rate, drive, COARSE)) for model in models):
                    continue
                chosen += 1
                found = carry_out(made, item.lasting(SECONDS))
                ran, left = ran + 1, left + left_limits(pair, [found])
                near += int(np.max(np.abs(found[1])) > (1.0 - asked.margin) * pair.reach)
        sys.stdout.write(f"- {pair.name}: {ran} run in all, {left} left a limit\n")
    sys.stdout.write(f"\n{ran} experiments were run; {left} left a limit, and {near} came into its margin.\n")


if __name__ == "__main__":
    main()
