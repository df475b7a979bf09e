"""Effects that only one-step prediction can judge, such as a gap: when they are tried, from which sets, and whether they win."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp

from xy_sysid.axis.model import AxisModel
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
        less = node.fit.model
        for name in node.effects - names:
            less = less.without(name)
        return self._node(less, node)

    def _apart(self, node: Node[GreyboxFit]) -> Node[GreyboxFit] | None:
        """A set whose sums are written as their parts, if it has any: what is one law without a gap is two where the parts act on its two sides."""
        model = node.fit.model
        for name, _ in node.fit.model.effects:
            model = model.apart(name)
        return None if model is node.fit.model else self._node(model, node)

    def _node(self, model: AxisModel, like: Node[GreyboxFit]) -> Node[GreyboxFit] | None:
        """The set of a model, fitted if it was not; None if it is too late for that."""
        names = frozenset(name for name, _ in model.effects)
        if names not in self.search.nodes and not self.judge.late():
            remembered(self.judge, self.search, names, self.judge.whole(replace(like.fit, model=model)))
        return self.search.nodes.get(names)

    def explains(self) -> bool:
        """Whether one of them explains the axis down to the noise: then no more simulations need to be tried."""
        self.asked.append(self.search.best.effects)
        for name in self.names:
            self.look(name, self.search.best)
        if self.found is not None and self.found.rungs[-1][1].excess >= AT_FLOOR:
            self.found = None
        return self.found is not None

    def look(self, name: str, best: Node[GreyboxFit], last: bool = False, hidden: bool = False) -> None:
        """Take it if it beats a set, and the best of all. last: no simulation is tried any more; hidden: beside what it hides."""
        if self.found is not None:
            return
        whole(self.judge, self.search.best)
        bar = min(self.judge.ahead(node.fit) for node in (best, self.search.best))
        if not FILTERED * bar > self.judge.data.floor.encoder * self.judge.data.sampling_rate:
            return
        for node in self._begins(best, last):
            fitted = self._fitted(name, node, FILTERED * bar, hidden)
            if fitted is None:
                return
            found, left = Filtered((*self._up_to(node), *fitted.rungs), bar, error_without(self.judge.data, fitted.found)), fitted.rungs[-1][1]
            if name in left.model and found.wins and (self.found is None or left.held_out_error < self.found.rungs[-1][1].held_out_error):
                self.found = found
                if left.excess < AT_FLOOR:
                    return

    def _up_to(self, node: Node[GreyboxFit]) -> list[tuple[str, GreyboxFit]]:
        """Rungs up to a set, of the fits that are known."""
        names = [name for name, _ in node.fit.model.effects]
        known = [(names[count], self.search.nodes.get(frozenset(names[: count + 1]))) for count in range(len(names))]
        return [(name, self._whole(found)) for name, found in known if found is not None]

    def _whole(self, node: Node[GreyboxFit]) -> GreyboxFit:
        """A set's fit on all data. One that is not worth its names stays as the search knows it: it may yet be asked for."""
        return whole(self.judge, node) if node.leads or node.whole else self.judge.whole(node.fit)

    def _begins(self, best: Node[GreyboxFit], last: bool) -> list[Node[GreyboxFit]]:
        """What a filter can have of the best set, as a large force beside a gap hides it; the rigid base; and, if the best explains less than
        it leaves, the same of the set that leaves least, be its effects worth their names or not, as a gap hides these; at last that apart."""
        nodes = self.search.nodes
        rigid = nodes[frozenset()]
        begins = [self._beside(best), rigid]
        if 2.0 * self.judge.rest(best.fit, rigid.fit) > 1.0:
            least = self._beside(min((node for node in nodes.values() if not node.refused), key=lambda node: node.allowed))
            begins += [least, self._apart(least) if last and least is not None else None]
        return list(dict.fromkeys(node for node in begins if node is not None))

    def _fitted(self, name: str, node: Node[GreyboxFit], bar: float, hidden: bool) -> Grown | None:
        """The effect and what is beside it, beginning from a set; each is fitted once. None if it is too late."""
        key = name, node.effects | (set(self.judge.library[name].hides) if hidden else set())
        if key not in self.fitted:
            if self.judge.late():
                self.search.stopped = True
                return None
            self.fitted[key] = self.judge.followed(self._whole(node), name, bar, self.search.least, hidden)
        return self.fitted[key]
