"""Every number that decides which experiment is chosen, with its reason.

Probabilities and evidence are those of ``experiment_design.evidence``. Tuned numbers were tuned on development draws (seeds 1 to 9) of the pairs
of ``python -m campaigns.bench settle``; the tables of docs/settle.md are from other draws.
"""

from __future__ import annotations

import math

from xy_sysid.effects._contract import USUAL_WITHIN
from xy_sysid.excitation import trajectory
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
NO_EVIDENCE = _number("no evidence", 1.0, "nats", "expected log likelihood ratio of the longest experiment below which sets count as the same")
MINIMUM = _number("minimum", 2.0, "s", "least motion left in the budget for an experiment: one block")

# beliefs before the experiment
ALLOWED = _number("allowed", 3.0, "nats", "a draw may explain the present data worse than the best by a factor of twenty in likelihood")
FACTOR = _number("usual factor", math.log(USUAL_WITHIN), "1", "standard deviation of the logarithm of a positive parameter before any data")
DRAWS = _number("draws", 6, "draws", "draws of each set's parameters that are simulated: the mean probability of six is known to 0.2")
TRIES = _number("tries", 12, "draws", "draws tried for each accepted one, narrower towards the end")
REACH = _number("usual reach", float(AxisExcitation.model_fields["travel_max"].default), "m", "travel of the usual machine to either side")
STEPS = _number("steps", 3, "steps", "Gauss-Newton steps that refit a model with a hidden effect, fewer if one gains below 0.1 nats")
LEAST_SEEN = _number("least seen", 3e-5, "1", "relative singular value below which a direction in the parameters stays unchanged")

# experiments that are compared
CREST = _number("crest", 4.2, "1", "peak of Gaussian noise over its rms: one sample in 40,000 is beyond")
FULL = _number("full", 0.95, "1", "part of the largest voltage that an experiment uses: the rest is for centring")
QUIETER = _number("quieter", 5, "levels", "amplitudes of each kind, each half of the one before: weak effects show at a sixteenth")
TOP = _number("top", 0.15, "1", "highest frequency proposed, over the sampling rate: beyond it the encoder differs little from its noise")
LONGEST = _number("longest period", 10.0, "s", "of a slow sine: six periods in the usual minute")
SEED = _number("seed", 1, "1", "of the signals, and of the draws of an unknown axis: the same limits give the same experiment")
PLACES = _number("places", 0.75, "1", "part of the room to either side at which the axis is held for an experiment away from its start")

# how experiments are judged
LOOKED = _number("looked", 8.0, "s", "simulated part of each experiment: two periods of the longest sweep; the rest is extrapolated")
COARSE = _number("coarse", 4000.0, "Hz", "rate of the sub-steps of these simulations, as in a screening fit")
ROUNDS = _number("rounds", 20, "steps", "that refit a rival to the experiment, at most: nearly all converge in ten")
CONVERGED = _number("converged", 0.1, "nats", "gain of a step below which a rival is refitted: a tenth of the smallest evidence that counts")
TRIALS = _number("trials", 5, "steps", "of which each is ten times more damped, before a refit ends")
DAMPED = _number("damped", 1e-2, "1", "least damping after a step that does not help, as usual (Marquardt 1963)")
UNLIKE = _number("unlike", 1e6, "nats", "against a rival that runs away: more than any experiment gives")
FINAL = _number("final", 6, "experiments", "that are compared in full for precision, after all were compared with the most likely parameters")
ALIKE = _number("alike", 0.1, "1", "probabilities that differ by less are alike: they are means over few draws")
ENOUGH = _number("enough", 0.95, "1", "fraction of the highest probability of an experiment at which it ends")
CYCLES = _number("cycles", 2, "1", "least number of fitted and held-out blocks in an experiment: with fewer than four own windows it settles nothing")
BLOCK = _number("block", 1.0, "s", "durations of experiments are multiples of this")
MARGIN = _number("margin", 0.15, "1", "part of speed, acceleration and travel that is kept free for errors of the models")

# for precision
DRAWN = _number("drawn", 2, "draws", "draws of the parameters: the interval depends little on them")
SHORTEST = _number("shortest", 4.0, "s", "least duration: a few windows")
LONGER = _number("longer", 1.4, "1", "factor by which an experiment becomes longer if its rehearsal misses the wanted width")
MOST_POINTS = _number("most_points", 10000.0, "Hz", "points of a trajectory per second, at most; no joint follows more")
POINTS_EACH = _number("points", trajectory.POINTS_EACH, "1", "points of a trajectory in a period of the highest frequency that it keeps")
ORDER = _number("order", 4, "1", "of the zero-phase low-pass that makes a trajectory of a motion")
