"""Every number that decides which effects are named, with its reason.

Scores are in nats of the objective (``greybox.objective``). The size of an effect is the power of the unmodelled force that it explains, divided by
the power that remains unexplained. Measured on development draws of the blind campaign and on the recordings of docs/real-machines.md.
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


N = TypeVar("N", int, float)


class Criteria(list[Criterion]):
    """A table of such numbers, which grows by one wherever a module gives itself one."""

    def number(self, name: str, value: N, unit: str, because: str) -> N:
        """The value, which stands in the table with its reason."""
        self.append(Criterion(name, value, unit, because))
        return value


TABLE = Criteria()
_number = TABLE.number

PRICE = _number("price", 4.0, "nats", "cost of a parameter: half the logarithm of the number of independent lines (Schwarz 1978)")
CHANCE = _number("chance", 0.977, "1", "least probability that a held-out gain is real: two standard errors")
OVERLAP = _number("overlap", 1.5, "windows", "half-overlapping Hann windows per independent window (Welch 1967)")
WHITE = _number("white", 0.01, "1", "accepted risk of taking white noise on the input for a missing effect")
DOUBTFUL = _number("doubtful", 0.1, "1", "a rival is mentioned if it predicts as well with at least this probability")
SIZE = _number("size", 0.7, "1", "least size of an effect; an unmodelled force could imitate a smaller one")
RICHER = _number("richer", 0.25, "1", "least size of a richer law compared with the simpler one that it replaces")
WIDTH = _number("width", 6, "moves", "most replacements, and most pairs, from one set; the true one was among the first four")
ALMOST = _number("almost", 0.7, "1", "above this ratio two gains or sizes count as equal: dry friction is named first, and no pair is tried")
OPTIMISM = _number("optimism", 3.0, "1", "a fit gains at most this multiple of its first-order prediction")
HOPELESS = _number(
    "hopeless", 1.5, "nats a line", "a fit to part of the data stops if it is this far behind after one round; no such fit came near the best"
)
NEAR = _number("near", 0.03, "1", "a set whose score on part of the data is within this fraction of the best gain is fitted to all data")
AT_FLOOR = _number("at the floor", 0.2, "nats a line", "below this the error is noise; clean axes have 0.03, the weakest effects 1")
LEAST = _number("least one step ahead", 0.03, "nats", "least gain in log error power; repeated fits agree within 0.02")
OPTIMISM_AHEAD = _number("optimism one step ahead", 5.0, "1", "optimism for gains one step ahead, with backlash")
ALIKE = _number("alike one step ahead", 0.7, "1", "with backlash, effects that promise this part of the best gain are fitted")
TELLS = _number("tells", 0.15, "nats", "least gain of backlash in log error power; without backlash, filters differ by less")
FILTERED = (1.0 + SIZE) ** -0.5  # innovation of a filter over that of the best simulation with an autoregressive error: the same size
STILL = _number("still", 0.1, "1", "a window with less than this part of the strongest motion is at standstill")
FEWEST = _number("fewest", 3, "1", "least number of input tones, excited bands and moving held-out windows (twice as many fitted windows)")
MOST_EFFECTS = _number("most effects", 4, "1", "most effects in a model; blind tests have three, one real machine needs four")
STRONGEST = 0.9  # quantile of the windows' motion that is the strongest: a single jerk is not
TONE = 1e-5  # power of a line of the input over the largest, -50 dB; the window's side lobes are at -92 dB
PARTS, SHORTEST = (16, 8), 32  # windows of the coherence of input and motion; samples of one at least
HIGHEST_MODE, BEYOND = 0.4, 1.5  # of the sampling rate, and of the highest excited frequency: up to these a mode is believed
AT_BOUND = 0.99  # of the longest delay: a delay there is at its bound
LEAST_DRY = 1e-3  # V: a start of dry friction beside backlash is at least this
LARGEST = 50.0  # logarithm of a size, where its exponential ends
KNOWN = 4.0  # the ends of the interval of a size that is known differ by this factor at most
UNSURE = 0.5  # most confidence in a set with an undetermined size, or with an effect that was not tried
STOPPED = 0.8  # factor of the confidence after a search that its budget stopped
WORK = 1.5e8  # samples times sub-steps simulated for one axis, about 10 s, the default budget: a limit for the waiting time, not a criterion
WORK_EACH = 400.0  # the same for each sample of the record, so that long records are searched as far as short ones
