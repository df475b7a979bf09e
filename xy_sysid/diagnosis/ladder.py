"""What a search comes to: the rungs from the rigid base down, what was tried, and how much each effect explains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from xy_sysid.axis.model import Library
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit


@dataclass(frozen=True, slots=True)
class Candidate:
    """One effect tried on the base.

    promised: excess that its trace promised to take away, nats; fit: None if that failed; explained: part of the base's error power
    beyond the noise that is gone with it, 0 for an effect that is judged one sample ahead
    """

    effect: str
    promised: float
    fit: GreyboxFit | None
    explained: float = 0.0


@dataclass(frozen=True, slots=True)
class Step:
    """One rung: the names of the effects that came with it, none for the base alone, and the fit with them."""

    names: tuple[str, ...]
    fit: GreyboxFit

    @property
    def added(self) -> str | None:
        """The names in words; None for the base alone."""
        return " and ".join(self.names) or None


@dataclass(frozen=True, slots=True)
class Rival:
    """Another set of effects that was tried.

    doubt: probability (0..1) that it predicts as well as the one that was taken, parameters at their price
    refused: why it explains nothing, though it may leave as little: in words, or empty
    """

    effects: tuple[str, ...]
    fit: GreyboxFit
    doubt: float
    refused: str = ""


@dataclass(frozen=True, slots=True)
class Ladder:
    """The rungs from the base down.

    final:    the fit with all effects that are named; effects: their names, that which explains most first
    sizes:    what each explains over what is left unexplained, as powers
    helps:    part (0..1) of the base's error power beyond the noise that the best of all sets takes away, be it named or not
    tried:    single effects on the base, least excess first; rivals: other sets, best first
    kept_out: the refused set that would leave least, if that is less than what the final fit leaves
    refused:  (effects, why they explain nothing); explained: part (0..1) of the base's error power beyond the noise that is gone
    noise, discrepancy: of the held-out error, m/s rms: what the encoder adds, and what no effect explains
    stopped:  the budget ended the search
    tried_first: a set that was known before and ended the search, as it explains the data down to the noise floor; see ``first_set``
    """

    steps: tuple[Step, ...]
    final: GreyboxFit
    effects: tuple[str, ...]
    tried: tuple[Candidate, ...] = ()
    rivals: tuple[Rival, ...] = ()
    sizes: Mapping[str, float] = field(default_factory=dict)
    helps: float = 0.0
    kept_out: Rival | None = None
    refused: tuple[tuple[tuple[str, ...], str], ...] = ()
    explained: float = 0.0
    noise: float = 0.0
    discrepancy: float = 0.0
    stopped: bool = False
    tried_first: tuple[str, ...] = ()

    @property
    def base(self) -> GreyboxFit:
        """The rigid base."""
        return self.steps[0].fit


def part_explained(data: AxisData, base: GreyboxFit, final: GreyboxFit) -> float:
    """Part of the base's error power beyond the noise that is gone."""
    noise = float(np.sum(data.layout.lines * data.floor.noise))
    before, after = (float(np.sum(data.layout.lines * fit.power)) - noise for fit in (base, final))
    return min(max(1.0 - max(after, 0.0) / before, 0.0), 1.0) if before > 0.0 else 0.0


def is_taken_for(library: Library, names: frozenset[str], others: frozenset[str]) -> bool:
    """A set differs from another only in an effect whose trace is a reason to try what stands there in the other, which is no relative."""
    here, there = names - others, others - names
    if not len(here) == len(there) == 1:
        return False
    one, other = library[min(here)], library[min(there)]
    return one.name in other.suspects and not (one.family and one.family == other.family)


def contains(library: Library, names: frozenset[str], others: frozenset[str]) -> bool:
    """A set has every law of another: the very effects, others of the same equations, or more general ones."""
    laws = set(names) | {part for name in names if (whole := library[name].sum_of) is not None for part in whole.parts}

    def holds(own: str, name: str) -> bool:
        return library[name].has_equations_of(library[own]) or library[name].is_special_case(library[own])

    return all(name in laws or any(holds(own, name) for own in names) for name in others)
