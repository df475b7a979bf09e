"""Every number that steers the search, and what it was measured on.

Excess is in nats: the mean over the excited bands of ln(power of the held-out error / floor). A size is what an effect explains over
what is left without a name, as powers. Measured on development draws of the blind campaign (exact machines and machines with dirt)
and on the recordings of docs/real-machines.md; reporting draws were never looked at.
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


LEAST = _number(
    "least",
    0.03,
    "nats",
    "what is left, or gained, below it cannot be told: clean exact axes stay below 0.02, refits repeat within 0.02; and the price of a parameter: "
    "a richer law fits a hair better by chance, on clean axes by less than 0.01 each",
)
OPTIMISM = _number(
    "optimism", 5.0, "1", "a fit gains up to five times what the score test promises to first order, until tries from that set say otherwise"
)
LATER = _number(
    "optimism later",
    1.5,
    "1",
    "the same from sets that are not the rigid base, and of what tries have shown: what is left there is small, and to first order nearly right",
)
SIMPLE_FIRST = _number("simple first", 0.15, "nats", "for each parameter, in the order of tries: simple laws are quick to fit, and often enough")
WIDTH = _number("width", 5, "moves", "of one set that are kept for each kind of move, most promising first; the truth was among the first four")
ALIKE = _number(
    "alike",
    0.7,
    "1",
    "part of a promise from which another is as good: one effect against two at once (on EMPS 0.6 is too little), a rival against what was taken",
)
HOPELESS = _number("hopeless", 1.5, "nats", "more than the best so far after the first steps of a fit: none that left so much ended better")
CHANCE = _number("chance", 2.0, "standard errors", "a gain on the held-out windows, or a coherence, that is real: the usual one in twenty")
SIZE = _number("size", 0.7, "1", "an effect explains at least so much of what is left unexplained, else what no law explains could feign it")
WORTH = _number("worth adding", 0.25, "1", "the same for an effect that is added without being named: real machines have small effects, too")
FREE = _number(
    "free", 0.8, "1", "part of the budget for new sets; the rest is for simpler ones, rivals, and the rungs of the ladder: mostly below 1.5 s"
)
FILTERED = (1.0 + SIZE) ** -0.5  # innovation of a filter over that of the best simulation with an autoregressive error: the same size
AT_FLOOR = _number(
    "at the floor",
    0.15,
    "nats",
    "what leaves less is explained (clean exact axes stay below 0.02, the weakest effect of the standard set has 0.3); the doubt that a rival "
    "leaves falls with it: a tie is half a confidence",
)
STILL = _number("still", 0.1, "1", "part of the liveliest motion below which a window stands")
FEWEST = _number(
    "fewest",
    3,
    "1",
    "tones of an input, bands that it excites, held-out windows that move (twice as many to fit): less, and any law fits; tries from a set "
    "after which it is known what its promises are worth",
)
MOST_EFFECTS = _number("most effects", 4, "1", "in a model: the blind sets have three at most, and of the real machines one takes four")
BUDGET = 10.0  # s of processor time for one axis, where nobody says another (--budget): no criterion, but what people wait for
IN_HAND = 0.92  # of it, after which nothing more is begun: the step in hand then takes the rest
