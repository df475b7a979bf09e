"""What a search comes to: the rungs from the rigid base down, what was tried, and how much each effect explains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from xy_sysid.greybox.free_run import GreyboxFit


@dataclass(frozen=True, slots=True)
class Candidate:
    """One effect tried on the base: the excess that its trace promised to take away, nats, and its fit (None if that failed)."""

    effect: str
    promised: float
    fit: GreyboxFit | None


@dataclass(frozen=True, slots=True)
class Step:
    """One rung: the effect added (None for the base alone), and the fit with it."""

    added: str | None
    fit: GreyboxFit


@dataclass(frozen=True, slots=True)
class Rival:
    """Another set of effects that was tried, and how much more it leaves than the one that was taken: nats of excess, and as powers."""

    effects: tuple[str, ...]
    fit: GreyboxFit
    behind: float
    leaves: float


@dataclass(frozen=True, slots=True)
class Ladder:
    """The rungs from the base down.

    final:    the fit with all effects that are named; effects: their names, that which explains most first
    sizes:    what each explains over what is left unexplained, as powers
    astray:   amplitude of what is left where a mode acts, over its own; the largest of all modes
    helps:    part (0..1) of the base's error power beyond the noise that the best of all sets takes away, be it named or not
    tried:    single effects on the base, least excess first; rivals: other sets, best first
    refused:  (effects, why they explain nothing); explained: part (0..1) of the base's error power beyond the noise that is gone
    noise, discrepancy: of the held-out error, m/s rms: what the encoder adds, and what no effect explains
    stopped:  the budget ended the search
    """

    steps: tuple[Step, ...]
    final: GreyboxFit
    effects: tuple[str, ...]
    tried: tuple[Candidate, ...] = ()
    rivals: tuple[Rival, ...] = ()
    sizes: Mapping[str, float] = field(default_factory=dict)
    astray: float = 0.0
    helps: float = 0.0
    refused: tuple[tuple[tuple[str, ...], str], ...] = ()
    explained: float = 0.0
    noise: float = 0.0
    discrepancy: float = 0.0
    stopped: bool = False

    @property
    def base(self) -> GreyboxFit:
        """The rigid base."""
        return self.steps[0].fit
