"""Sets of effects with their best fits, and the best-first search over them: the move with the best predicted score is fitted next."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from math import inf

import numpy as np

from xy_sysid.axis.model import AxisModel, Library
from xy_sysid.effects._contract import in_time
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit, best_start, finish, first_excess, fit
from xy_sysid.hypotheses import starts
from xy_sysid.hypotheses.compare import force_explained, gain, size
from xy_sysid.hypotheses.criteria import AT_FLOOR, HOPELESS, MOST_EFFECTS, NEAR, OPTIMISM, PRICE, RICHER, SIZE
from xy_sysid.hypotheses.moves import Move, count, moves
from xy_sysid.hypotheses.refusal import refusal


@dataclass(eq=False)
class Node:
    """One candidate: a set of effects with its fits.

    screening, fit: screening fit and full fit (the screening fit again if no full fit was made); refused: why the fit does not count, or empty
    is_large: its gain over the best set that it contains is large enough; is_better: and larger than chance
    predicted_gain: predicted before the fit, nats a line
    moves: possible moves from it; None until asked for
    """

    effects: frozenset[str]
    parameters: int
    screening: GreyboxFit
    fit: GreyboxFit
    refused: str = ""
    is_large: bool = True
    is_better: bool = True
    predicted_gain: float = 0.0
    moves: list[Move] | None = None

    @property
    def has_full_fit(self) -> bool:
        """Whether a full fit was made, on all windows that are not held out."""
        return not self.fit.is_screening


@dataclass
class Pool:
    """The sets of one axis. most: largest number of effects; late: time is up; kept: effects of every set.

    tried: (from, to) of the moves that were fitted
    """

    data: AxisData
    library: Library
    kept: frozenset[str] = frozenset()
    most: int = MOST_EFFECTS
    late: Callable[[], bool] = in_time
    nodes: dict[frozenset[str], Node] = field(default_factory=dict)
    tried: set[tuple[frozenset[str], frozenset[str]]] = field(default_factory=set)

    @property
    def scale(self) -> float:
        """Nats over all held-out windows that correspond to one nat a line."""
        lines = self.data.floor.lines @ self.data.floor.excited
        return max(0.5 * float(lines) * self.data.held_out.begins.size, 1.0)

    def score(self, node: Node) -> float:
        """Score of the held-out windows in nats, with the penalty for parameters; less is better."""
        if not node.has_full_fit:
            return inf
        return float(np.sum(node.fit.scores)) + PRICE * node.parameters

    @property
    def best(self) -> Node:
        """The set with the least score, among those whose effects are large enough."""
        return min((node for node in self.nodes.values() if node.is_better and not node.refused and node.has_full_fit), key=self.score)

    @property
    def answer(self) -> Node:
        """The best set whose held-out error in velocity (rms) is below that of every set that it contains, or the first.

        Among equally good sets with as many effects, the one with dry friction, because every machine has friction.
        """
        first = self.nodes[self.kept]
        better = [
            node for node in self.nodes.values() if node.is_better and not node.refused and node.has_full_fit and self._lowers_held_out_error(node)
        ]
        if self.best is first or not better:
            return first
        best = min(better, key=self.score)
        same = (node for node in better if len(node.effects) == len(best.effects) and self.score(node) < self.score(best) + PRICE)
        return min(same, key=lambda node: (-sum(self.library[name].is_dry for name in node.effects), self.score(node)))

    def _lowers_held_out_error(self, node: Node) -> bool:
        """Whether its held-out error is below that of every set that it contains."""
        return all(node.fit.held_out_error < less.fit.held_out_error for less in self._subsets(node))

    def add_first(self, start: GreyboxFit) -> Node:
        """Add the set from which the search starts; start: its full fit. Returns its node with a screening fit as well."""
        screening = fit(self.data, start.model, screening=True, late=self.late)
        return self.remember(frozenset(name for name, _ in start.model.effects), screening, start)

    def remember(
        self, effects: frozenset[str], screening: GreyboxFit, found: GreyboxFit, is_better: bool = True, predicted_gain: float = 0.0
    ) -> Node:
        """Store a set with its fit; it replaces a worse fit of the same set. Only another full fit replaces a full fit."""
        parameters, known = count(self.library, effects - self.kept), self.nodes.get(effects)
        is_better = is_better or (known is not None and known.is_better)
        node = Node(
            effects,
            parameters,
            screening,
            found,
            refused=self._refusal(effects, found),
            is_large=is_better,
            is_better=is_better,
            predicted_gain=predicted_gain,
        )
        lower = known is None or screening.excess < known.screening.excess - PRICE / self.scale
        if known is not None and not node.has_full_fit and not (lower and (not known.has_full_fit or self.with_full_fit(node).has_full_fit)):
            return known
        if known is not None and known.has_full_fit and node.has_full_fit and self.score(known) <= self.score(node) and not known.refused:
            return known
        self.nodes[effects] = node
        return node

    def _refusal(self, effects: frozenset[str], found: GreyboxFit) -> str:
        return refusal(self.data, self.library, found, self.kept) if effects > self.kept else ""

    def search(self) -> Iterator[frozenset[str]]:
        """Try moves until none predicts a better set; yields each set before it is fitted."""
        if self.nodes[self.kept].moves is None:
            yield from self._try_single_effects()
        while not self.late():
            best = self.best
            if best.fit.excess < AT_FLOOR:
                return
            for node in dict.fromkeys((best, self.answer, self._likeliest)):  # confirmed, to be said, or not confirmed yet
                if node.moves is None and len(node.effects - self.kept) < self.most:
                    node.moves = self._moves(node)
            refused = self._best_refused()
            if refused is not None and refused.moves is None:  # its laws may do, by other names, or without the one that is refused
                refused.moves = [*self._without_refused(refused), *(move for move in self._moves(refused) if not move.effects >= refused.effects)]
            move = self._next()
            if move is None:
                return
            yield move[1].effects
            self._try(*move)

    def _try_single_effects(self) -> Iterator[frozenset[str]]:
        """Try each effect alone before two are combined, the most promising first; yields as ``search``.

        Predicted gains are unreliable if the first model is far from the data.
        """
        first = self.nodes[self.kept]
        first.moves = self._moves(first)
        for move in sorted(first.moves, key=lambda move: -move.predicted_gain):
            if self.late() or self.best.fit.excess < AT_FLOOR:
                return
            if len(move.effects - self.kept) == 1 and self.scale * move.predicted_gain > PRICE * move.parameters:
                yield move.effects
                self._try(first, move)
        alone = [node for node in self.nodes.values() if node is not first and node.is_large and node.has_full_fit and not node.refused]
        for node in sorted(alone, key=self.score):  # the best single effect need not be in the best pair
            node.moves = self._moves(node)
            chosen = self._next([node])
            if chosen is not None and not self.late():
                yield chosen[1].effects
                self._try(*chosen)

    def suspected(self) -> Iterator[frozenset[str]]:
        """Try the look-alikes of the laws in the answer, even if no gain is predicted; yields as ``search``.

        If one predicts as well, the name is uncertain.
        """
        node = self.answer
        node.moves = self._moves(node) if node.moves is None and not self.late() else node.moves
        for move in node.moves or ():
            gone = node.effects - move.effects
            if any(gone & set(self.library[name].suspects) for name in move.effects) and self._is_open(node, move) and not self.late():
                yield move.effects
                self._try(node, move)

    @property
    def _likeliest(self) -> Node:
        """The set with the lowest score of those whose gain is large enough, even if it may be chance. One more effect may make it sure."""
        return min((node for node in self.nodes.values() if node.is_large and node.has_full_fit and not node.refused), key=self.score)

    def _best_refused(self) -> Node | None:
        """The best of the refused sets, if its score is better than that of all others."""
        refused = [node for node in self.nodes.values() if node.refused and node.has_full_fit and self.score(node) < self.score(self.best)]
        return min(refused, key=self.score, default=None)

    def _without_refused(self, node: Node) -> list[Move]:
        """The set without the effect for which it is refused."""
        name = node.refused.partition(":")[0]
        if name not in node.effects - self.kept:
            return []
        less = node.effects - {name}
        start_models = partial(starts.dropped, self.data, node.fit, name, self._single_effects(less))
        return [move for move in [Move(less, -count(self.library, [name]), 0.0, start_models)] if self._is_open(node, move)]

    def _single_effects(self, effects: frozenset[str]) -> list[AxisModel]:
        """Models with single effects of a set, if they are known."""
        return [self.nodes[one].fit.model for other in sorted(effects) if (one := self.kept | {other}) in self.nodes]

    def _moves(self, node: Node, early: bool = True) -> list[Move]:
        found = moves(self.data, self.library, node.fit, node.screening, early)
        allowed = (move for move in found if self.kept <= move.effects and len(move.effects - self.kept) <= self.most)
        return [move for move in allowed if self._is_open(node, move)]

    def _is_open(self, parent: Node, move: Move) -> bool:
        """A set that is not known, not even by other names of its effects; or one whose fit failed from one start, and that has another start: in the
        place of a law, or without one."""
        laws = self._laws(move.effects)
        if any(node.has_full_fit and not node.refused and self._laws(effects) == laws for effects, node in self.nodes.items()):
            return False
        known = self.nodes.get(move.effects)
        return known is None or (
            (not known.has_full_fit or known.refused != "")
            and len(move.effects) <= len(parent.effects)
            and (parent.effects, move.effects) not in self.tried
        )

    def _laws(self, effects: frozenset[str]) -> frozenset[str]:
        """One name for each law: effects with equal equations count as one."""
        return frozenset(self._names.get(name, name) for name in effects)

    @cached_property
    def _names(self) -> dict[str, str]:
        acting = self.library.acting
        return {one.name: other.name for k, one in enumerate(acting) for other in acting[:k] if one.has_equations_of(other)}

    def _next(self, nodes: Sequence[Node] = ()) -> tuple[Node, Move] | None:
        """The move with the best predicted score, if that is better than the score of the present answer; from some sets, or from all.

        Two effects at once only if no other move from their set predicts that: one after the other costs less, and shows which of them helps.
        Sets that raise the held-out error are continued last.
        """
        least, options = self.score(self.answer) - PRICE, []
        for node in nodes or self.nodes.values():
            own = [
                (self._predicted_score(node, move), move) for move in node.moves or () if self._is_open(node, move) and self._may_be_worth(node, move)
            ]
            own = [(predicted, move) for predicted, move in own if predicted < least]
            lowers = bool(own) and self._lowers_held_out_error(node)
            single = [item for item in own if len(item[1].effects - node.effects) < 2]
            options += [(not lowers, predicted, node, move) for predicted, move in single or own]
        return min(options, key=lambda item: item[:2])[2:] if options else None

    def _predicted_score(self, node: Node, move: Move) -> float:
        """The predicted score of a move, nats."""
        return self.score(node) - self.scale * move.predicted_gain + PRICE * move.parameters

    def _may_be_worth(self, node: Node, move: Move) -> bool:
        """Whether the new effect is large enough if its gain is a few times its first-order prediction."""
        lines = max(node.fit.forced, 1.0) * self.data.held_out.begins.size
        most = OPTIMISM * 2.0 * self.scale * move.predicted_gain / lines
        return move.parameters <= 0 or most >= len(move.effects - node.effects) * math.log1p(SIZE)

    def _try(self, parent: Node, move: Move) -> Node | None:
        """Fit the set of a move; a full fit only if it is near the best."""
        self.tried.add((parent.effects, move.effects))
        start_models = [*move.starts()]
        new = move.effects - parent.effects
        alone = self.nodes.get(new | self.kept)
        if move.effects > parent.effects > self.kept and alone is not None:
            start_models += starts.merged(parent.fit.model, alone.fit.model)
        limit = parent.screening.excess + (self._full_fit_limit() - self.score(parent) - PRICE * move.parameters) / self.scale
        screening = fit(self.data, best_start(self.data, start_models), screening=True, give_up_above=limit + HOPELESS, late=self.late)
        if not np.isfinite(screening.excess):
            parent.moves = [item for item in parent.moves or () if item is not move]
            return None
        found = screening
        if screening.excess < limit:
            found = finish(self.data, screening.model, screening.runs, self.late)
        node = self.remember(move.effects, screening, found, predicted_gain=move.predicted_gain)
        subsets = self._subsets(node)
        simpler = min(subsets, key=self.score, default=None)
        node.is_large = node.has_full_fit and (simpler is None or self._is_large(node, simpler))
        node.is_better = node.has_full_fit and (simpler is None or self._is_better(node, simpler))
        return node

    def _full_fit_limit(self) -> float:
        """The score up to which a screening fit is followed by a full fit."""
        best, first = self.score(self.answer), self.score(self.nodes[self.kept])
        return best + NEAR * (first - best) + PRICE

    def _subsets(self, node: Node) -> list[Node]:
        """The smaller sets within a set that have a full fit and are not refused."""
        return [item for item in self.nodes.values() if item.effects < node.effects and item.has_full_fit and not item.refused]

    def _is_better(self, node: Node, simpler: Node) -> bool:
        """Better than a simpler set by more than chance, and by the least size of its effects."""
        return self._is_large(node, simpler) and gain(*comparable_fits(node, simpler)).is_sure

    def _is_large(self, node: Node, simpler: Node) -> bool:
        """Better than a simpler set including the penalty for parameters, and by the least size of its effects.

        A richer law in the place of a simpler one must have the size RICHER. Compared with a set at the floor nothing more is needed.
        """
        one, other = comparable_fits(node, simpler)
        if other.excess < AT_FLOOR:
            return False
        new = len(node.effects) - len(simpler.effects)
        least = (1.0 + SIZE) ** new - 1.0 if new > 0 else RICHER
        return gain(one, other).nats > PRICE * (node.parameters - simpler.parameters) and size(one, other) >= least

    def simplified(self) -> Iterator[frozenset[str]]:
        """Try simpler sets than the best; yields as ``search``. Effects whose gain is chance or too small are removed.

        When time is up, only sets with a full fit are compared.
        """
        while True:
            best, simpler = self.best, None
            for effects, start_models in self._simpler(best):
                if effects not in self.nodes and not self.late():
                    yield effects
                node = self.with_screening_fit(effects, start_models)
                if node is None or self._is_better(best, node):
                    continue
                self.with_full_fit(node)  # a full fit may change whether the set is refused
                if node.has_full_fit and not node.refused and not self._is_better(best, node):
                    simpler = node
                    break
            if simpler is None:
                return
            best.is_large = best.is_better = False
            simpler.is_large = simpler.is_better = True

    def _simpler(self, best: Node) -> Iterator[tuple[frozenset[str], Callable[[], Sequence[AxisModel]]]]:
        """Sets without an effect, or with a simpler relative in its place, and their start values."""
        data, library, model = self.data, self.library, best.fit.model
        for name, _ in reversed(model.effects):
            if name in self.kept:
                continue
            effect = library[name]
            alone = self._single_effects(best.effects - {name})
            for relative in sorted(library.acting, key=lambda item: len(item.parameters)):
                fits = relative.simulable and relative.name not in best.effects and (data.units.output == "rad" or not relative.angular)
                if fits and relative.is_special_case(effect):
                    yield best.effects - {name} | {relative.name}, partial(starts.swapped, data, best.fit, name, relative, None)
            yield best.effects - {name}, partial(starts.dropped, data, best.fit, name, alone)

    def with_screening_fit(self, effects: frozenset[str], start_models: Callable[[], Sequence[AxisModel]]) -> Node | None:
        """The node of a set, with a screening fit; a known set is fitted again if a start model is already better than its fit.

        The first set stays as given, because every answer is compared with its error.
        """
        known = self.nodes.get(effects)
        if self.late() or (known is not None and effects == self.kept):
            return known
        start = best_start(self.data, list(start_models()))
        if known is not None and first_excess(self.data, known.fit.model) <= first_excess(self.data, start) + PRICE / self.scale:
            return known
        screening = fit(self.data, start, screening=True, late=self.late)
        return self.remember(effects, screening, screening, is_better=False) if np.isfinite(screening.excess) else known

    def with_full_fit(self, node: Node, shown: bool = False) -> Node:
        """The same node with a full fit, unless time is up. shown: the answer shows this set, so it is fitted in any case."""
        if not node.has_full_fit and (shown or not self.late()):
            node.fit = finish(self.data, node.screening.model, node.screening.runs, in_time if shown else self.late)
            node.refused = self._refusal(node.effects, node.fit)
        return node

    def without(self, node: Node, name: str) -> tuple[float, float]:
        """Size of one effect of a set, and its size by the unmodelled force alone.

        Both compare the set with the best set that has the same effects except this one.
        """
        fewer = [comparable_fits(node, item) for item in self.nodes.values() if item.effects <= node.effects - {name}]
        return max(min(size(*pair) for pair in fewer), 0.0), max(min(force_explained(*pair) for pair in fewer), 0.0)


def comparable_fits(one: Node, other: Node) -> tuple[GreyboxFit, GreyboxFit]:
    """Fits of two sets to the same data: full fits if both sets have one, else screening fits."""
    return (one.fit, other.fit) if one.has_full_fit and other.has_full_fit else (one.screening, other.screening)
