"""Effects that only one-step prediction can judge, such as a gap: when they are tried, from which sets, and whether they win."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp

from xy_sysid.criteria import AT_FLOOR, FEWEST, FILTERED, SIZE
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.greybox.one_step import error_without
from xy_sysid.judge.axis_judge import AxisJudge
from xy_sysid.judge.beside_one_step import Grown, size_ahead, told_apart
from xy_sysid.search.best_first import Node, Search
from xy_sysid.search.simplify import remembered, whole


@dataclass(frozen=True, slots=True)
class Filtered:
    """What one-step prediction found, and what it has beaten.

    rungs: names and fits, the last is the answer; bar: error one sample ahead, m/s, of the best simulation with an autoregressive error
    without: of the same filter with the effect taken out
    """

    rungs: tuple[tuple[str, GreyboxFit], ...]
    bar: float
    without: float

    @property
    def wins(self) -> bool:
        """It explains as much beyond the noise as what is named must, and what is best without it leaves something that can be told."""
        tells = min(self.bar, self.without) >= exp(0.5 * AT_FLOOR) * self.rungs[-1][1].held_out_error
        return tells and self.size >= SIZE

    @property
    def size(self) -> float:
        """What is left one sample ahead without the effect and not with it, over what is left with it, as powers beyond the noise."""
        last = self.rungs[-1][1]
        return size_ahead(min(self.bar, self.without), last.held_out_error, last.noise_floor)


class OneStepTrials:
    """Each is fitted once from a set, and taken if it beats the best simulation with an autoregressive error.

    found: what won
    """

    def __init__(self, judge: AxisJudge, search: Search[GreyboxFit]) -> None:
        self.judge, self.search = judge, search
        whole_record = judge.data.longest() is judge.data
        self.names = tuple(effect.name for effect in judge.library.acting if effect.one_step is not None and whole_record)
        self.fitted: dict[tuple[str, frozenset[str]], Grown] = {}
        self.found: Filtered | None = None
        self.asked: list[frozenset[str]] = []

    @property
    def due(self) -> bool:
        """After the first simulations, where these leave something, once; and once more beside forces that are found later."""
        best = self.search.best
        if not self.names or len(self.search.nodes) <= FEWEST or best.fit.excess < AT_FLOOR:
            return False
        return not self.asked or (len(self.asked) == 1 and best.effects not in self.asked and self._beside(best) is not None)

    def _beside(self, node: Node[GreyboxFit]) -> Node[GreyboxFit] | None:
        """What a filter can have of a set beside the gap, if that is more than the filter has by itself; fitted if it was not."""
        library = self.judge.library
        names = frozenset(name for name in node.effects if told_apart(library[name]) or library[name].is_dry)
        by_itself = {library[name].rubs for name in self.names}
        if not names - by_itself:
            return None
        if names not in self.search.nodes and not self.judge.late():
            less = node.fit.model
            for name in node.effects - names:
                less = less.without(name)
            remembered(self.judge, self.search, names, self.judge.whole(replace(node.fit, model=less)))
        return self.search.nodes.get(names)

    def explains(self) -> bool:
        """Whether one of them explains the axis down to the noise: then no more simulations need to be tried."""
        self.asked.append(self.search.best.effects)
        for name in self.names:
            self.look(name, self.search.best)
        if self.found is not None and self.found.rungs[-1][1].excess >= AT_FLOOR:
            self.found = None
        return self.found is not None

    def look(self, name: str, best: Node[GreyboxFit]) -> None:
        """Take it if it beats a set, and the best of all."""
        if self.found is not None:
            return
        whole(self.judge, self.search.best)
        bar = min(self.judge.ahead(node.fit) for node in (best, self.search.best))
        if not FILTERED * bar > self.judge.data.floor.encoder * self.judge.data.sampling_rate:
            return
        for node in self._begins(best):
            fitted = self._fitted(name, node, FILTERED * bar)
            if fitted is None:
                return
            found = Filtered((*self._up_to(node), *fitted.rungs), bar, error_without(self.judge.data, fitted.found))
            if name in fitted.rungs[-1][1].model and found.wins:
                self.found = found
                return

    def _up_to(self, node: Node[GreyboxFit]) -> list[tuple[str, GreyboxFit]]:
        """Rungs up to a set, of the fits that are known."""
        names = [name for name, _ in node.fit.model.effects]
        known = [(names[count], self.search.nodes.get(frozenset(names[: count + 1]))) for count in range(len(names))]
        return [(name, whole(self.judge, found)) for name, found in known if found is not None]

    def _begins(self, best: Node[GreyboxFit]) -> list[Node[GreyboxFit]]:
        """What a filter can have of the best set, as a large force beside a gap hides it; and the rigid base."""
        rigid, beside = self.search.nodes[frozenset()], self._beside(best)
        return [rigid] if beside is None else [beside, rigid]

    def _fitted(self, name: str, node: Node[GreyboxFit], bar: float) -> Grown | None:
        """The effect and what is beside it, beginning from a set; each is fitted once. None if it is too late."""
        key = name, node.effects
        if key not in self.fitted:
            if self.judge.late():
                self.search.stopped = True
                return None
            self.fitted[key] = self.judge.followed(whole(self.judge, node), name, bar, self.search.least)
        return self.fitted[key]
