"""Every number that decides which effects are named, and what it was measured on.

Scores are in nats of the objective (``greybox.objective``). A size is the power of the unmodelled force that an effect explains, over what is left
without a name. Measured on development draws of the blind campaign and on the recordings of docs/real-machines.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar


@dataclass(frozen=True, slots=True)
class Criterion:
    """One number: its name, value, unit, and why it is what it is."""

    name: str
    value: float
    unit: str
    because: str


TABLE: list[Criterion] = []
N = TypeVar("N", int, float)


def _number(name: str, value: N, unit: str, because: str) -> N:
    TABLE.append(Criterion(name, value, unit, because))
    return value


PRICE = _number("price", 4.0, "nats", "of a parameter: half the logarithm of the number of independent lines (Schwarz 1978), which is 3 to 6")
CHANCE = _number("chance", 0.977, "1", "probability that a gain over the held-out windows is real: two standard errors")
OVERLAP = _number("overlap", 1.5, "windows", "half overlapping Hann windows for each independent one (Welch 1967)")
DOUBTFUL = _number("doubtful", 0.1, "1", "probability that a rival predicts as well, above which the two are said to be hardly distinguished")
SIZE = _number("size", 0.7, "1", "an effect explains at least so much of what is left unexplained, else what no law explains could feign it")
WORTH = _number("worth adding", 0.25, "1", "the same for an effect that is added without being named: real machines have small effects, too")
WIDTH = _number("width", 6, "moves", "from one set that are tried at most, of each kind: the truth was among the first four")
RIVAL = _number("rival", 0.7, "1", "part of the gain promised by what was taken from which another effect is tried as its rival")
OPTIMISM = _number("optimism", 3.0, "1", "a fit gains up to three times what a move promises to first order")
HOPELESS = _number("hopeless", 1.5, "nats a line", "more than a quick fit may leave after its first round: none such ended near the best")
NEAR = _number("near", 0.03, "1", "part of the best gain by which a quick fit may stand behind the best and is still fitted on all data")
AT_FLOOR = _number(
    "at the floor", 0.2, "nats a line", "an error within a tenth of the floor (rms) is explained: clean axes have 0.03, the weakest effects 1"
)
LEAST = _number("least one step ahead", 0.03, "nats", "of the logarithm of the power one step ahead: less is chance, refits repeat within 0.02")
OPTIMISM_AHEAD = _number("optimism one step ahead", 5.0, "1", "a fit beside a gap gains up to five times what its trace promises to first order")
ALIKE = _number("alike one step ahead", 0.7, "1", "part of the best promise from which another effect beside a gap is tried, too")
TELLS = _number("tells", 0.15, "nats", "by which one-step prediction must beat the best without the effect: less is within what filters differ by")
FILTERED = (1.0 + SIZE) ** -0.5  # innovation of a filter over that of the best simulation with an autoregressive error: the same size
STILL = _number("still", 0.1, "1", "part of the liveliest motion below which a window stands")
FEWEST = _number("fewest", 3, "1", "tones of an input, bands that it excites, held-out windows that move (twice as many to fit)")
MOST_EFFECTS = _number("most effects", 4, "1", "in a model: the blind sets have three at most, and of the real machines one takes four")
WORK = 1.5e8  # samples times sub-steps simulated for one axis, about 10 s, where nobody gives another budget: no criterion, but what people wait for
WORK_EACH = 400.0  # the same for each sample of the record, so that long records are searched as far as short ones
