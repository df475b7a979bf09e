"""Best-first search over sets of effects: the most promising move next, every fit remembered, simpler sets preferred.

It knows nothing of machines: a judge says what moves promise, fits sets, and compares. It is a generator, so that whoever runs it
shows what is being tried, and stops it at any time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from math import inf, log
from typing import Generic, TypeVar

from xy_sysid.criteria import ALIKE, FEWEST, HOPELESS, LATER, LEAST, OPTIMISM, SIMPLE_FIRST
from xy_sysid.judge.contract import Judge, Judged, Move

F = TypeVar("F", bound=Judged)


@dataclass(eq=False)
class Node(Generic[F]):
    """One set that was fitted.

    parameters: that its effects have; whole: fitted on all data; refused: why it explains nothing, or empty; promised: gain
    shown: largest gain of a move from it over what was promised; tried: moves from it that were tried; brief: excess of its brief fit
    led_on: moves from it are waiting, or were tried; last: those that are tried though none promises enough, None until they are asked for
    """

    effects: frozenset[str]
    fit: F
    brief: F
    parameters: int
    whole: bool
    promised: float = 0.0
    refused: str = ""
    shown: float = 0.0
    tried: int = 0
    leads: bool = True
    later: float = 0.0
    led_on: bool = False
    last: list[Move] | None = None

    @property
    def score(self) -> float:
        """nats; less is better."""
        return inf if self.refused else self.allowed

    @property
    def allowed(self) -> float:
        """The score that it would have if it were not refused."""
        later = 0.0 if self.whole else self.later
        return self.fit.excess + later + LEAST * self.parameters

    def behind(self, other: Node[F]) -> float:
        """How much more it leaves than another, nats; parameters that gain nothing have their price."""
        return self.fit.excess - other.fit.excess + LEAST * (self.parameters - other.parameters)

    @property
    def optimism(self) -> float:
        """How many times more than promised a move from here may gain."""
        most = LATER if self.effects else OPTIMISM
        return most if self.tried < FEWEST else min(LATER * self.shown, most)

    def is_slow(self, least: float) -> bool:
        """All data leave more than the first stage's, enough for an effect that acts slowly or far out."""
        return self.fit.excess - self.brief.excess >= log(1.0 + least)

    def hope(self, move: Move) -> float:
        """The score that a move may reach."""
        left = min(self.fit.excess - move.gain * self.optimism, move.begins)
        return max(left, 0.0) + LEAST * (self.parameters + move.parameters)


@dataclass
class Search(Generic[F]):
    """A search from a set that is given.

    clock: s of processor time; budget: s until it stops; most: effects; least: what one must explain over what is left unexplained
    nodes: every set that was fitted
    stopped: the budget ended it, not that nothing promised anything any more; until: when it does, s of the clock
    """

    judge: Judge[F]
    clock: Callable[[], float]
    budget: float
    most: int
    least: float
    nodes: dict[frozenset[str], Node[F]] = field(default_factory=dict)
    waiting: list[tuple[Node[F], Move]] = field(default_factory=list)
    stopped: bool = False
    until: float = inf

    @property
    def best(self) -> Node[F]:
        """The set with the least score, of those whose last effects explain what is asked of them."""
        return min((node for node in self.nodes.values() if node.leads), key=lambda node: (node.score, not node.whole))

    def steps(self, start: F, effects: frozenset[str] = frozenset()) -> Iterator[frozenset[str]]:
        """Search; yields each set that is about to be fitted."""
        self.until = self.clock() + self.budget
        first = Node(
            effects=effects,
            fit=start,
            brief=self.judge.brief(start, Move(effects=effects, gain=0.0, rest=0.0, parameters=0, starts=())) or start,
            parameters=0,
            whole=True,
        )
        self.nodes[effects] = first
        yield from self.steps_from(first)

    def steps_from(self, start: Node[F]) -> Iterator[frozenset[str]]:
        """Search on from a set, unless that was done."""
        if self.goes_on(start):
            self.waiting += self._moves(start)
        while self.best.fit.excess >= LEAST:
            open_to = [item for item in self.waiting if self._promising(*item)] or self._last()
            if not open_to:
                return
            if self.clock() > self.until:
                self.stopped = True
                return
            parent, move = self._simpler(*min(open_to, key=self._order))
            self.waiting.remove((parent, move))
            yield move.effects
            before = self.best.score
            node = self._fitted(parent, move)
            self._lead_on(node, before)
            if node is not None and node.leads and node.allowed < before - LEAST:
                yield from self._taken_for(node)

    def _lead_on(self, node: Node[F] | None, before: float) -> None:
        """Go on from what is better than the best was."""
        if node is not None and node.whole and node.leads and node.score < before - LEAST and node.fit.excess >= LEAST:
            self.waiting += self._moves(node)

    def _taken_for(self, node: Node[F]) -> Iterator[frozenset[str]]:
        """Beside what is the best, or were it if it were not refused, try what one of its effects may have been taken for; yields as ``steps``."""
        for move in self.judge.taken_for(node.fit) if node.refused or node.fit.excess >= LEAST else ():
            known = self.nodes.get(move.effects)  # what leaves more than the set that it stood in for went astray, and is fitted again
            if (known is None or known.fit.excess > node.fit.excess + LEAST) and self.clock() <= self.until:
                yield move.effects
                before = self.best.score
                self._lead_on(self._fitted(node, move), before)

    def goes_on(self, node: Node[F]) -> bool:
        """Whether there may be moves from a set that were not asked for yet."""
        return not node.led_on and node.fit.excess >= LEAST and len(node.effects) < self.most

    def rivals(self, taken: frozenset[str], most: int = 2) -> Iterator[frozenset[str]]:
        """Fit what promised as much as the last effect of a set that was taken, and was not tried as it did well; yields as ``steps``."""
        for parent, move in sorted(self.waiting, key=lambda item: -item[1].gain):
            known = [node.promised for node in self.nodes.values() if parent.effects < node.effects <= taken]
            if most == 0 or not known:
                continue
            if move.effects not in self.nodes and len(move.effects) <= len(taken) and move.gain > ALIKE * max(known):
                most -= 1
                yield move.effects
                self._fitted(parent, move)

    def _last(self) -> list[tuple[Node[F], Move]]:
        """Where nothing promises enough: what all data show of the best set, if they show what its brief fit does not; else, once, what
        promises most beside it, and richer relatives of what it has: of laws that bend first order sees a part, or nothing."""
        best = self.best
        if best.last is None:
            best.last = []
            if best.is_slow(self.least):
                slow = [(best, move) for move in self.judge.slow_moves(best.fit, best.brief) if len(move.effects) <= self.most]
                self.waiting += slow
                best.tried, best.shown = 0, 0.0  # what the first stage's promises were worth says nothing of these
                return [item for item in slow if self._promising(*item)]
            if best.effects:
                single = [move for node, move in self.waiting if node is best and _new(node, move) == 1 and not self._known(node, move)]
                most = max(single, key=lambda move: move.gain, default=None)
                best.last = [move for move in single if move.replaced is not None or (move is most and move.gain >= LEAST)]
        return [item for item in self.waiting if item[0] is best and item[1] in best.last and not self._known(*item)]

    def _promising(self, parent: Node[F], move: Move) -> bool:
        """It may become better than the best, and what is new may be more than what is left unexplained could feign."""
        promised = move.rest * parent.optimism >= _new(parent, move) * log(1.0 + self.least)
        nameable = promised or move.expected or move.begins < parent.fit.excess or move.effects in self.nodes  # which then went astray
        simpler = self.nodes.get(move.simpler) if move.simpler else None
        if simpler is not None and simpler.led_on:  # from there it begins better
            return False
        return nameable and not self._known(parent, move) and parent.hope(move) <= self.best.score - LEAST

    def _simpler(self, parent: Node[F], move: Move) -> tuple[Node[F], Move]:
        """The move itself, or one to the simpler relative of what it brings, which comes first."""
        first = (item for item in self.waiting if item[0] is parent and item[1].effects == move.simpler and move.simpler not in self.nodes)
        return next(first, (parent, move))

    def _known(self, parent: Node[F], move: Move) -> bool:
        """The set was fitted. One that left more than a set which it contains, or far more than the move does before any fit, went astray, and may be
        fitted again from another; one of which there is a brief fit alone is not known where all data show more."""
        known = self.nodes.get(move.effects)
        if known is None or (parent.is_slow(self.least) and not known.whole):
            return False
        inside = (node.fit.excess for effects, node in self.nodes.items() if effects < move.effects and not node.refused)
        return known.fit.excess <= min(move.begins + HOPELESS, *(left + LEAST for left in inside), inf)

    def _order(self, item: tuple[Node[F], Move]) -> tuple[bool, float, bool]:
        """What begins with far less than there was is certain, and comes before all promises. Then what may become best; simple and single
        moves are quick, and often enough; of equals what every machine has."""
        parent, move = item
        hope = parent.hope(move) + SIMPLE_FIRST * move.parameters * max(_new(parent, move), 1)
        return move.begins > parent.fit.excess - HOPELESS, round(hope, 1), not move.expected

    def _moves(self, node: Node[F]) -> list[tuple[Node[F], Move]]:
        if len(node.effects) >= self.most:
            return []
        node.led_on = True
        return [(node, move) for move in self.judge.moves(node.fit, node.brief) if not self._known(node, move) and len(move.effects) <= self.most]

    def _fitted(self, parent: Node[F], move: Move) -> Node[F] | None:
        best, later = self.best, parent.fit.excess - parent.brief.excess  # what a whole fit will change, as it did for the parent
        hopeless = min(best.fit.excess - later + HOPELESS, parent.brief.excess)
        known = self.nodes.get(move.effects)
        if known is not None and not known.whole and parent.is_slow(self.least) and known.brief.excess < parent.brief.excess + LEAST:
            brief: F | None = known.brief  # which is as good as another: what all data show is asked
        else:
            brief = self.judge.brief(parent.fit, move, hopeless)
        if brief is None or parent.brief.excess - brief.excess < (1.0 - ALIKE) * move.gain:
            brief = self._merged(parent, move, brief)
        parent.tried += move.gain > 0.0
        if brief is None:
            return None
        parent.shown = max(parent.shown, (parent.brief.excess - brief.excess) / move.gain if move.gain > 0.0 else 0.0)
        parameters = parent.parameters + move.parameters
        least = (1.0 + self.least) ** _new(parent, move)
        leads = self.judge.size(brief, parent.brief) >= least - 1.0 or (bool(parent.refused) and brief.excess < parent.brief.excess + LEAST)
        astray = brief.excess >= parent.brief.excess + LEAST and not parent.is_slow(self.least)
        slow = move.rest >= log(least) and not astray and brief.excess + later < best.fit.excess + HOPELESS
        whole = brief.excess + later + LEAST * parameters < best.score - LEAST if leads else slow
        found = self.judge.whole(brief) if whole else brief
        if whole and not leads:  # what acts slowly does not show in a brief fit, but promised a name on all data
            leads = self.judge.size(found, parent.fit) >= least - 1.0
        node = Node(
            effects=move.effects,
            fit=found,
            brief=brief,
            parameters=parameters,
            whole=whole,
            promised=move.gain,
            refused=self.judge.refusal(found),
            leads=leads,
            later=later,
        )
        if known is None or node.score < known.score:
            self.nodes[move.effects] = node
        return node

    def _merged(self, parent: Node[F], move: Move, brief: F | None) -> F | None:
        """What is new may have led the base elsewhere, so that a fit which begins from here goes astray: the better of it and of one that
        begins where the new effects were alone."""
        alone = self.nodes.get(move.effects - parent.effects)
        if alone is None or alone.refused or not parent.effects or not parent.effects < move.effects:
            return brief
        fits = (brief, self.judge.merged(alone.fit, parent.fit))
        return min((fit for fit in fits if fit is not None), key=lambda fit: fit.excess, default=None)


def _new(parent: Node[F], move: Move) -> int:
    """How many effects a move brings, each of which must be worth a name."""
    return len(move.effects - parent.effects) - len(move.stays)
