"""Sets of effects: how much of the error one explains, and which laws it has."""

from __future__ import annotations

import numpy as np

from xy_sysid.axis.model import Library
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit


def part_explained(data: AxisData, base: GreyboxFit, final: GreyboxFit) -> float:
    """Part of the base's error power beyond the noise that is gone."""
    noise = float(np.sum(data.layout.lines * data.floor.noise))
    before, after = (float(np.sum(data.layout.lines * fit.power)) - noise for fit in (base, final))
    return min(max(1.0 - max(after, 0.0) / before, 0.0), 1.0) if before > 0.0 else 0.0


def is_mistaken_for(library: Library, names: frozenset[str], others: frozenset[str]) -> bool:
    """Whether two sets differ in one effect each, and the trace of the first is a reason to suspect the second, of another family."""
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
