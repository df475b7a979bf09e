"""Every number that decides which experiment is chosen, with its reason.

Probabilities and evidence are those of ``experiment_design.evidence``. What was measured was measured on development draws (seeds 1 to 9) of the
pairs of ``python -m campaigns.bench settle``; the tables of docs/settle.md are of draws that were never used for it.
"""

from __future__ import annotations

import math

from xy_sysid.effects._contract import USUAL_WITHIN
from xy_sysid.greybox.axis_data import FITTED_BLOCK, HELD_OUT_BLOCK
from xy_sysid.hypotheses.criteria import Criteria
from xy_sysid.settings import AxisExcitation

TABLE = Criteria()
_number = TABLE.number

# when a question counts as settled
SURE = _number("sure", 0.95, "1", "probability with which sets are to be distinguished: the usual one of intervals")
ODDS = math.log(SURE / (1.0 - SURE))  # nats: likelihood ratio at which one of two is that probable (Wald 1945)
JUDGED = HELD_OUT_BLOCK / (FITTED_BLOCK + HELD_OUT_BLOCK)  # fraction of a record for judging
FITTED = FITTED_BLOCK / (FITTED_BLOCK + HELD_OUT_BLOCK)  # fraction of a record for fitting
NO_EVIDENCE = _number("no evidence", 1.0, "nats", "expected likelihood ratio below this by the whole budget: the sets are the same on this machine")
MINIMUM = _number("minimum", 2.0, "s", "less motion than this in the budget is worth no experiment: one block")

# beliefs before the experiment
ALLOWED = _number("allowed", 3.0, "nats", "a draw may explain the data at hand worse than the best by a factor of twenty in likelihood")
FACTOR = _number("usual factor", math.log(USUAL_WITHIN), "1", "standard deviation of the logarithm of a positive parameter that no data show")
DRAWS = _number("draws", 6, "draws", "parameters of each set that are simulated: a probability in the mean over six is known to 0.2")
TRIES = _number("tries", 12, "draws", "draws that are tried for each one wanted, narrower ones towards the end")
REACH = _number("usual reach", float(AxisExcitation.model_fields["travel_max"].default), "m", "travel to either side of the usual machine")
STEPS = _number("steps", 3, "steps", "Gauss-Newton steps in which a model makes room for a hidden effect, fewer if one gains below 0.1 nats")
LEAST_SEEN = _number("least seen", 3e-5, "1", "of the best seen direction in the parameters: one that the data show less is left as it is")

# experiments that are compared
CREST = _number("crest", 4.2, "1", "peak of Gaussian noise over its rms: one sample in 40,000 is beyond")
FULL = _number("full", 0.95, "1", "part of the largest voltage that an experiment plans for: the rest is for centring")
QUIETER = _number("quieter", 5, "levels", "amplitudes of each kind, each half of the one before: weak effects show at a sixteenth")
TOP = _number("top", 0.15, "1", "highest frequency proposed, over the sampling rate: beyond it the encoder differs little from its noise")
LONGEST = _number("longest period", 10.0, "s", "of a slow sine: six periods in the usual minute")
PLACES = _number("places", 0.75, "1", "part of the room to either side at which the axis is held for an experiment away from its start")

# how experiments are judged
LOOKED = _number("looked", 8.0, "s", "of each experiment are simulated: two periods of the longest sweep; longer ones go on as they began")
COARSE = _number("coarse", 4000.0, "Hz", "sub-steps of these simulations, as short as a screening fit takes them")
ROUNDS = _number(
    "rounds", 2, "steps", "Gauss-Newton steps by which a rival suits itself to the experiment: one for a linear law, one more for a curved one"
)
FINAL = _number("final", 6, "experiments", "judged by all draws, after all were judged by the likeliest")
ALIKE = _number("alike", 0.1, "1", "probabilities that differ by less are alike: they are means over few draws")
ENOUGH = _number("enough", 0.95, "1", "part of what an experiment can reach at all, after which more of it is a waste")
CYCLES = _number(
    "cycles", 2, "1", "blocks to fit and to judge that an experiment holds at least: with fewer than four windows of its own it settles nothing"
)
BLOCK = _number("block", 1.0, "s", "experiments last whole multiples of this")
MARGIN = _number("margin", 0.15, "1", "part of speed, acceleration and travel that is kept free for what the models do not know")

# for precision
DRAWN = _number("drawn", 2, "draws", "parameters of the one set whose interval is to become narrow: it depends on them little")
SHORTEST = _number("shortest", 4.0, "s", "of motion at least: a few windows")
LONGER = _number("longer", 1.4, "1", "times as long, where a rehearsal does not reach what was asked for")
POINTS_EACH = _number("points", 8.0, "1", "points of a trajectory in a period of the highest frequency that it keeps")
ORDER = _number("order", 4, "1", "of the low-pass without delay through which a motion becomes a trajectory")
