"""Effects that only one-step prediction can judge, such as backlash: when they are tried, from which sets, and whether they are accepted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import exp

import numpy as np

from xy_sysid.axis.model import Library
from xy_sysid.effects._contract import Limits
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.greybox.one_step import error_without, noise_of
from xy_sysid.greybox.whitened import enough, whitened_rms
from xy_sysid.hypotheses.companions import Demand, Extended, distinguishable, extended, size_ahead
from xy_sysid.hypotheses.criteria import AT_FLOOR, FEWEST, FILTERED, SIZE, TELLS
from xy_sysid.hypotheses.pool import Node, Pool
from xy_sysid.hypotheses.refusal import refusal


@dataclass(frozen=True, slots=True)
class OneStepResult:
    """The result of one-step prediction, and the errors that it had to beat.

    rungs: names and fits, the last is the answer; bar: error one sample ahead, m/s, of the best simulation with an autoregressive error
    without: of the same filter with the effect taken out
    """

    rungs: tuple[tuple[str, GreyboxFit], ...]
    bar: float
    without: float

    @property
    def is_accepted(self) -> bool:
        """Whether it explains as much above the noise as a named effect must, and the best set without it has an error above the floor."""
        seen = min(self.bar, self.without) >= exp(0.5 * TELLS) * self.rungs[-1][1].held_out_error
        return seen and self.size >= SIZE

    @property
    def size(self) -> float:
        """Power of the error one sample ahead that the effect explains, divided by the power that remains, both above the noise."""
        last = self.rungs[-1][1]
        return size_ahead(min(self.bar, self.without), last.held_out_error, last.noise_floor)


def one_step_names(library: Library) -> tuple[str, ...]:
    """Effects that only one-step prediction can judge. It needs one stretch without a gap."""
    return tuple(effect.name for effect in library.acting if effect.one_step is not None)


@dataclass
class OneStepTrials:
    """Each effect is fitted once from a set, and accepted if it beats the best simulation with an autoregressive error. found: the result."""

    pool: Pool
    found: OneStepResult | None = None
    fitted: dict[tuple[str, frozenset[str], bool], Extended] = field(default_factory=dict)
    asked: set[frozenset[str]] = field(default_factory=set)

    @property
    def names(self) -> tuple[str, ...]:
        """Effects to be tried; none for several stretches."""
        return one_step_names(self.pool.library) if len(self.pool.data.starts) == 1 else ()

    def due(self, last: bool) -> bool:
        """Whether the error of the best set exceeds the floor; checked after the first simulations and at the end of the search (last)."""
        best = self.pool.best
        return bool(self.names) and best.fit.excess >= AT_FLOOR and (last or (not self.asked and len(self.pool.nodes) > FEWEST))

    def tried(self, last: bool) -> Iterator[frozenset[str]]:
        """Try each together with the effects of the best set that a filter can contain, and alone; last: also with the effects that it masks.

        Yields the set that is fitted next.
        """
        best = self.pool.best
        self.asked.add(best.effects)
        for name in self.names:
            for node in self._start_nodes(best):
                for masked in (False, True) if last else (False,):
                    if self.found is not None or self.pool.late():
                        return
                    yield node.effects | {name}
                    self._fit_once(name, node, masked)

    def _explains(self, node: Node) -> bool:
        """A set explains more error power than it leaves, with effects that a filter with a gap can contain; other effects may imitate a gap."""
        library, rigid = self.pool.library, self.pool.nodes[self.pool.kept]
        apart = all(distinguishable(library[name]) or library[name].is_dry for name in node.effects)
        return apart and 2.0 * node.fit.held_out_error**2 < rigid.fit.held_out_error**2

    def _start_nodes(self, best: Node) -> list[Node]:
        """Effects of the best set that a filter can contain, because a large force hides a gap; and the rigid base, unless the set explains most."""
        pool, library = self.pool, self.pool.library
        names = frozenset(name for name in best.effects if distinguishable(library[name]) or library[name].is_dry)
        found = []
        if names - {library[name].start_friction for name in self.names}:
            less = best.fit.model
            for name in sorted(best.effects - names):
                less = less.without(name)
            node = pool.with_screening_fit(names, lambda: [less])
            found += [node] if node is not None and pool.with_full_fit(node).has_full_fit else []
        return found if found and self._explains(found[0]) else list(dict.fromkeys((*found, pool.nodes[pool.kept])))

    def error_one_step_ahead(self, found: GreyboxFit) -> float:
        """Held-out error one sample ahead, m/s, of a simulation with an autoregressive model of its error; 0 if the data are too short for that."""
        data = self.pool.data
        later = np.arange(data.velocity.size) >= data.training
        return whitened_rms(found.error, later) if enough(later) else 0.0

    def _fit_once(self, name: str, node: Node, masked: bool) -> None:
        pool = self.pool
        bar = min(self.error_one_step_ahead(each.fit) for each in {node, pool.best})
        key = (name, node.effects, masked)
        if not FILTERED * bar > noise_of(pool.data) * pool.data.sampling_rate or key in self.fitted:
            return
        demand = Demand(Limits(FILTERED * bar, pool.late), lambda fit: refusal(pool.data, pool.library, fit), masked)
        extension = extended(pool.data, node.fit, pool.library[name], demand)
        self.fitted[key] = extension
        result = OneStepResult((*self._up_to(node), *extension.rungs), bar, error_without(pool.data, extension.found))
        if name in result.rungs[-1][1].model and result.is_accepted and not extension.found.too_small:
            self.found = result

    def _up_to(self, node: Node) -> list[tuple[str, GreyboxFit]]:
        """Rungs up to a set, from the known fits."""
        names = [name for name, _ in node.fit.model.effects]
        known = [(names[n], self.pool.nodes.get(frozenset(names[: n + 1]))) for n in range(len(names))]
        return [(name, item.fit) for name, item in known if item is not None and item.has_full_fit]
