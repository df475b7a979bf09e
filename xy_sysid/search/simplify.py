"""From the best set that the search knows to the simplest that does the same: fewer effects, simpler relatives, one law for several.

What is lost on the way could be feigned by what is left unexplained, or be chance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain
from math import inf

from xy_sysid.axis.model import AxisModel
from xy_sysid.criteria import HOPELESS, LEAST
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.judge.axis_judge import AxisJudge
from xy_sysid.judge.contract import Judge
from xy_sysid.search.best_first import Node, Search


def whole(judge: Judge[GreyboxFit], node: Node[GreyboxFit]) -> GreyboxFit:
    """The fit of a set on all data."""
    if not node.whole or node.fit.brief:
        node.fit, node.whole = judge.whole(node.fit), True
    return node.fit


def remembered(judge: AxisJudge, search: Search[GreyboxFit], effects: frozenset[str], fit: GreyboxFit) -> Node[GreyboxFit]:
    """A set that was fitted on all data, among those that the search knows."""
    parameters = sum(len(judge.library[name].parameters) for name in effects)
    search.nodes[effects] = Node(effects=effects, fit=fit, brief=fit, parameters=parameters, whole=True, refused=judge.refusal(fit))
    return search.nodes[effects]


class Simplifying:
    """From the best set to a simpler one, as long as what is lost could be feigned by what is left unexplained."""

    def __init__(self, judge: AxisJudge, search: Search[GreyboxFit], kept: frozenset[str]) -> None:
        self.judge, self.search, self.kept = judge, search, kept
        self.now = search.best
        self.left: set[frozenset[str]] = set()
        self.again: set[tuple[frozenset[str], frozenset[str]]] = set()

    def step(self) -> bool:
        """Take the first simpler set that loses little; False if none does."""
        whole(self.judge, self.now)
        here = self.judge.rest(self.now.fit, self.now.fit)
        for node in chain(self._simpler_relatives(), self._tried(here), self._without(), self._without_idle()):
            if node.effects == self.now.effects or node.effects in self.left:  # from what was left nothing leads back
                continue
            loss = self.judge.rest(node.fit, self.now.fit) - here
            if loss < self.search.least or not self.judge.better(self.now.fit, node.fit):
                self.left.add(self.now.effects)
                self.now = node
                return True
        return False

    def sizes(self) -> dict[str, float]:
        """What each effect explains over what is left: by the best set known that has no such law, none of its family."""
        here, found = self.judge.rest(self.now.fit, self.now.fit), {}
        for name in self._own():
            node = self.best_without(name)
            found[name] = max(self.judge.rest(node.fit, self.now.fit) - here, 0.0)
        return found

    def best_without(self, name: str) -> Node[GreyboxFit]:
        """The best of the sets that were fitted of the same effects but for one, which was not given; what was given is one, refused or not."""
        sets = (node for node in self.search.nodes.values() if not node.refused or node.effects == self.kept)
        fewer = (node for node in sets if node.effects <= self.now.effects - {name})
        return min(fewer, key=lambda node: self.judge.rest(node.fit, self.now.fit))

    def _tried(self, here: float) -> list[Node[GreyboxFit]]:
        """The simplest other set that was tried, has fewer parameters (or as many, and friction where this has none), and comes near."""
        library = self.judge.library

        def usual(node: Node[GreyboxFit]) -> tuple[int, int]:
            """Of sets that do the same: one effect rather than two, and friction first, as every machine has it."""
            return len(node.effects), sum(not library[name].is_dry for name in node.effects)

        for node in sorted(self.search.nodes.values(), key=lambda node: (node.parameters, round(node.fit.excess, 1), usual(node))):
            same = node.parameters == self.now.parameters and node.fit.excess < self.now.fit.excess + LEAST
            alike = same and usual(node) < usual(self.now)
            simpler = (alike or node.parameters < self.now.parameters) and not node.refused and self.kept <= node.effects
            if simpler and self.judge.rest(node.fit, self.now.fit) - here < self.search.least:
                whole(self.judge, node)
                return [node]
        return []

    def _simpler_relatives(self) -> Iterator[Node[GreyboxFit]]:
        """Sets with a simpler relative in the place of an effect, what came last first; each is fitted when it is asked for."""
        library, now = self.judge.library, self.now
        for name in self._own():
            effect = library[name]
            for relative in sorted(library.acting, key=lambda item: len(item.parameters)):
                alike = effect.family and relative.family == effect.family and relative.simulable and relative.name not in now.effects
                if alike and len(relative.parameters) < len(effect.parameters):
                    yield from self._good(now.effects - {name} | {relative.name}, partial(self.judge.instead, now.fit, name, relative))

    def _without(self) -> Iterator[Node[GreyboxFit]]:
        """Sets without an effect, as before."""
        for name in self._own():
            yield from self._less(self.now, name)

    def _without_idle(self) -> Iterator[Node[GreyboxFit]]:
        """Sets that did as well with an effect in them that the data do not tell from none, or so much better that it pays, without that one."""
        for node in list(self.search.nodes.values()):
            idle = self.judge.idle(node.fit)
            smaller = node.effects - {idle}
            parameters = sum(len(self.judge.library[name].parameters) for name in smaller)
            simpler = parameters < self.now.parameters and node.fit.excess < self.now.fit.excess + LEAST
            pays = node.fit.excess + LEAST * parameters < self.now.score - LEAST
            if idle and (simpler or pays) and smaller and self.kept <= smaller:
                yield from self._less(node, idle)

    def _less(self, node: Node[GreyboxFit], name: str) -> Iterator[Node[GreyboxFit]]:
        """A set without one effect, begun from what there is of the others, and from what each was alone: one may have stood back."""
        smaller = node.effects - {name}
        alone = [self.search.nodes[one].fit.model for other in smaller if (one := frozenset((other,))) in self.search.nodes]
        yield from self._good(smaller, partial(self.judge.without, node.fit, name, alone))

    def _own(self) -> list[str]:
        return [name for name, _ in reversed(self.now.fit.model.effects) if name not in self.kept]

    def _good(self, effects: frozenset[str], begin: Callable[[], AxisModel]) -> Iterator[Node[GreyboxFit]]:
        """The set, if it stands; for an effect in it that the data do not tell from none, each of its relatives that was tried alone."""
        node = self._node(effects, begin)
        if node is None or node.refused:
            return
        idle = self.judge.idle(node.fit)
        if not idle:
            yield node
            return
        library, less = self.judge.library, node.fit.model.without(idle)
        for relative in library.acting:
            alone, others = self.search.nodes.get(frozenset((relative.name,))), effects - {idle} | {relative.name}
            simpler = sum(len(library[name].parameters) for name in others) < self.now.parameters
            if alone is not None and simpler and relative.name not in effects and relative.family and relative.family == library[idle].family:
                other = self._node(others, partial(less.with_effect, *alone.fit.model.effects[0]))
                if other is not None and not other.refused and not self.judge.idle(other.fit):
                    yield other

    def _node(self, effects: frozenset[str], begin: Callable[[], AxisModel]) -> Node[GreyboxFit] | None:
        """The set as it is known, or fitted from a model that begins where the best set is; a known fit that went astray again, once."""
        known = self.search.nodes.get(effects)
        if known is None or not (known.whole or known.fit.excess < self.now.fit.excess + HOPELESS):
            start = None if self.judge.late() else begin()
            return self._fitted(effects, start, inf) or known
        start = self._way_back(known, begin)
        if start is None:
            whole(self.judge, known)
            return known
        return self._fitted(effects, start, known.fit.excess - LEAST) or known

    def _way_back(self, known: Node[GreyboxFit], begin: Callable[[], AxisModel]) -> AxisModel | None:
        """Where a known fit begins again if it went astray from elsewhere: it leaves more than this model does without any fit, or is refused."""
        way = known.effects, self.now.effects
        if self.judge.late() or way in self.again or known.fit.excess <= self.now.fit.excess + LEAST:
            return None
        start = begin()
        if not known.refused and known.fit.excess <= self.judge.begins(self.now.fit, start) + LEAST:
            return None
        self.again.add(way)
        return start

    def _fitted(self, effects: frozenset[str], start: AxisModel | None, below: float) -> Node[GreyboxFit] | None:
        """The set fitted from a model, and remembered, if that leaves less excess than ``below``."""
        fit = None if start is None or self.judge.late() else self.judge.again(self.now.fit, start)
        if fit is None or fit.excess >= below:
            return None
        return remembered(self.judge, self.search, effects, fit)
