"""The rungs of a refinement, from the rigid base down to the floor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from xy_sysid.greybox import GreyboxFit
from xy_sysid.one_step_race import Grown
from xy_sysid.race import AT_FLOOR, Candidate


@dataclass(frozen=True, slots=True)
class Step:
    """One rung: the effect added (None for the base alone), the fit with it, and all that was tried for it, best first."""

    added: str | None
    fit: GreyboxFit
    tried: tuple[Candidate, ...]


@dataclass(frozen=True, slots=True)
class Ladder:
    """The rungs from the base down.

    rejected: what was tried last and not taken; effects: what remains after pruning; faint: those of them found below the floor
    """

    steps: tuple[Step, ...]
    rejected: tuple[Candidate, ...]
    final: GreyboxFit
    effects: tuple[str, ...]
    faint: tuple[str, ...] = ()

    @property
    def explained(self) -> bool:
        """The held-out error is at the floor."""
        return self.final.excess < AT_FLOOR


@dataclass(frozen=True, slots=True)
class Move:
    """The next rungs: one, two that were found together, or none, if the floor is reached or nothing helps.

    tried: the candidates; paired: were pairs tried, too; begun: what one-step prediction did not explain yet
    stays: an effect that was found below the floor's threshold, where the mean over the bands hardly misses it
    """

    steps: tuple[Step, ...]
    tried: tuple[Candidate, ...]
    paired: bool = False
    begun: Mapping[str, Grown] = field(default_factory=dict)
    stays: str = ""
