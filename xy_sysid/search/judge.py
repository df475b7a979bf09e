"""What the search asks: which moves promise what, how well a set of effects predicts what it has not seen, and which of two is better."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.stats import norm, wilcoxon

from xy_sysid.axis.model import AxisModel, Library
from xy_sysid.effects import Effect, Scene
from xy_sysid.effects._contract import Limits, in_time
from xy_sysid.effects._scene import smoothed
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.floor import excess
from xy_sysid.greybox.forces import SMOOTH, braked, of_one_name, stood_in, taken_for, taken_over
from xy_sysid.greybox.free_run import GreyboxFit, best_start, finish, first_excess, fit, fit_base, is_read, other_starts, scene_of, screened
from xy_sysid.greybox.one_step import one_step_fit
from xy_sysid.greybox.score_test import Gain, Trace, bounded
from xy_sysid.samples.block import FloatArray
from xy_sysid.search.beside_one_step import put_beside
from xy_sysid.search.criteria import ALIKE, CHANCE, FEWEST, HOPELESS, LEAST, STILL, WIDTH

NOTHING = Gain(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Move:
    """From one set of effects to another.

    gain, rest: nats that the score test promises, of excess and of the whole error
    begins: excess with which it begins, where that is known (else infinite)
    parameters: that the new set has more; starts: first values of what is new; replaced: an effect that gives way
    expected: every machine has it (friction): it comes first among moves that promise the same, and is tried whatever the whole error promises,
        for to first order its trace tells little where it bends
    simpler: for a richer law of friction the set with the simplest in its place, else empty
    stays: parts of what is replaced that stay beside what takes its place, with their values
    """

    effects: frozenset[str]
    gain: float
    rest: float
    parameters: int
    starts: tuple[tuple[str, tuple[float, ...]], ...]
    replaced: str | None = None
    begins: float = np.inf
    expected: bool = False
    simpler: frozenset[str] = frozenset()
    stays: tuple[tuple[str, tuple[float, ...]], ...] = ()


@dataclass(frozen=True, slots=True)
class _Here:
    """A fit, the same set's on the first stage's data, and the data that are looked at as its effects see them."""

    fit: GreyboxFit
    brief: GreyboxFit
    scene: Scene


class FreeRunJudge:
    """Judges by free simulation of one axis; sets are those of a library."""

    def __init__(self, data: AxisData, library: Library, late: Callable[[], bool] = in_time) -> None:
        self.data, self.library, self.late = data, library, late
        self.reach = float(np.min(data.position)), float(np.max(data.position))
        travel = self.reach[1] - self.reach[0]
        way = float(np.sum(np.abs(smoothed(data.sampling_rate, data.velocity, SMOOTH)))) / data.sampling_rate
        self.passed_once = way < (1.0 + 2.0 * STILL) * travel

    def begin(self) -> GreyboxFit:
        """The rigid base."""
        return fit_base(self.data, self.library)

    def added(self, now: GreyboxFit, name: str) -> GreyboxFit:
        """A fit with one more effect, unasked; a relative of the same family gives way."""
        effect = self.library[name]
        relative = next((own for own, _ in now.model.effects if effect.family and self.library[own].family == effect.family), None)
        ahead = now.model.ahead
        if effect.one_step is not None:
            return one_step_fit(self.data, now, effect, limits=Limits(late=self.late))
        if ahead is not None:
            return put_beside(self.data, now, ahead, effect)
        model = now.model if relative is None else now.model.without(relative)
        traced = model.with_effect(name, screened(self.data, now, [effect]).traces[0].values)
        return fit(self.data, best_start(self.data, [traced, *other_starts(self.data, now, model, name)]), late=self.late)

    def moves(self, now: GreyboxFit, brief: GreyboxFit) -> list[Move]:
        """What may be added, alone or two at once, and what may take the place of a relative; most promising first, of each kind.

        Nothing when it is late. brief: the same set on the first stage's data, which are looked at.
        """
        return self._promised(now, brief, early=True)

    def slow_moves(self, now: GreyboxFit, brief: GreyboxFit) -> list[Move]:
        """The same by what is left of all data: several times as long to ask, and for what acts slowly or far out."""
        return self._promised(now, brief, early=False)

    def _promised(self, now: GreyboxFit, brief: GreyboxFit, early: bool) -> list[Move]:
        if self.late():
            return []
        model = now.model
        families = {self.library[name].family: name for name, _ in model.effects if self.library[name].family}
        open_to = [e for e in self.library.acting if e.simulable and e.name not in model and (e.repeats or not (self.passed_once and e.is_by_place))]
        here = _Here(now, brief, scene_of(self.data, now, early))
        screen = screened(self.data, now, open_to, here.scene)
        traces = {trace.effect: trace for trace in screen.traces}
        own = frozenset(name for name, _ in model.effects)
        gains = {name: screen.gain([name]) for name in screen.rows}
        found = (self._single(here, families, traces[e.name], gains.get(e.name, NOTHING)) for e in open_to)
        singles = sorted((move for move in found if move is not None), key=lambda move: -move.gain)
        kept = self._with_relatives(singles[:WIDTH], singles)
        kept += [move for move in singles if move not in kept and move.begins < now.excess]
        pairs = []
        for one, other in combinations(self._leaders(gains, families), 2):
            if self.library[one].family and self.library[one].family == self.library[other].family:
                continue
            both = screen.gain((one, other))
            if ALIKE * both.excess > max(gains[one].excess, gains[other].excess):
                starts = tuple((name, traces[name].values) for name in sorted((one, other), key=lambda name: -gains[name].excess))
                pairs.append(
                    Move(
                        effects=own | {one, other},
                        gain=ALIKE * both.excess,
                        rest=ALIKE * both.rest,
                        parameters=self._count((one, other)),
                        starts=starts,
                    )
                )
        pairs.sort(key=lambda move: -move.gain)
        return [move for move in (*kept, *pairs[:WIDTH]) if not self._twice(move.effects)]

    def taken_for(self, now: GreyboxFit) -> list[Move]:
        """What an effect of a set may have been taken for: laws that name it as a reason to try them, in its place, pushing as it does."""
        model, scene = now.model, scene_of(self.data, now)
        found = []
        for name, _ in model.effects if not self.late() else ():
            for other in self.library.acting:
                asked = name in other.suspects and other.name not in model and not (other.angular and self.data.units.output != "rad")
                begun = taken_for(self.data, model, name, other, scene) if asked else None
                if begun is not None:
                    found.append(
                        Move(
                            effects=frozenset(own for own, _ in begun.effects),
                            gain=0.0,
                            rest=0.0,
                            parameters=len(other.parameters) - len(self.library[name].parameters),
                            starts=((other.name, dict(begun.effects)[other.name]),),
                            replaced=name,
                        )
                    )
        return found

    def _leaders(self, gains: Mapping[str, Gain], families: dict[str, str]) -> list[str]:
        """What has no family, and of each family that is not in the set yet its simplest and its most promising member."""
        members: dict[str, list[str]] = {}
        for name in sorted(gains, key=lambda name: len(self.library[name].parameters)):
            members.setdefault(self.library[name].family or name, []).append(name)
        free = [names for family, names in members.items() if family not in families]
        return [name for names in free for name in dict.fromkeys((names[0], max(names, key=lambda name: gains[name].excess)))]

    def _twice(self, names: frozenset[str]) -> bool:
        """One law is in a set twice: as itself, and as a part of what is the sum of several."""
        sums = ((name, self.library[name].sum_of) for name in names)
        return any(whole is not None and names & set(whole.parts) for _, whole in sums)

    def _single(self, here: _Here, families: dict[str, str], trace: Trace, gain: Gain) -> Move | None:
        model = here.fit.model
        effect, own = self.library[trace.effect], frozenset(name for name, _ in model.effects)
        starts = ((effect.name, trace.values),)
        relative = families.get(effect.family) if effect.family else None
        if relative is None:
            return Move(
                effects=own | {effect.name},
                gain=gain.excess,
                rest=gain.rest,
                parameters=len(effect.parameters),
                starts=starts,
                begins=self._begins(here, model, effect) if effect.joint is not None or is_read(model) else np.inf,
                expected=effect.is_dry,
                simpler=self._simplest(own, effect),
            )
        more = len(effect.parameters) - len(self.library[relative].parameters)
        if more <= 0 and self.library[relative].sum_of is None:
            return None
        stays = self._stays(model, relative) if more > 0 else ()
        rest = model.without(relative)
        for name, values in stays:
            rest = rest.with_effect(name, values)
        return Move(
            effects=frozenset(name for name, _ in rest.effects) | {effect.name},
            gain=gain.excess,
            rest=gain.rest,
            parameters=more + self._count(name for name, _ in stays),
            starts=starts,
            replaced=relative,
            begins=self._begins(here, rest, effect) if is_read(rest) else np.inf,
            stays=stays,
        )

    def _stays(self, model: AxisModel, replaced: str) -> tuple[tuple[str, tuple[float, ...]], ...]:
        """The parts of a sum that its relatives do not have, with their values."""
        family = self.library[replaced].family
        return tuple((name, values) for name, values in model.apart(replaced).effects if name not in model and self.library[name].family != family)

    def _begins(self, here: _Here, model: AxisModel, effect: Effect) -> float:
        """Excess at starts that are read without the model: it may have been led so far astray that traces tell little.

        It is known of the first stage, where that is looked at; what the motion there is quieter or livelier than in the whole is taken off.
        """
        if here.scene.velocity.size > self.data.first:
            return np.inf
        starts = other_starts(self.data, here.fit, model, effect.name, here.scene)
        if not starts:
            return np.inf
        return here.fit.excess + min(first_excess(self.data, start) for start in starts) - here.brief.excess

    def _simplest(self, own: frozenset[str], effect: Effect) -> frozenset[str]:
        """The set with the simplest law of friction, for a richer one: without it the base takes friction for drag, and traces tell little."""
        family = [item for item in self.library.acting if effect.family and item.family == effect.family and item.simulable and item.is_dry]
        simplest = min(family, key=lambda item: len(item.parameters), default=effect)
        return own | {simplest.name} if len(simplest.parameters) < len(effect.parameters) else frozenset()

    def _with_relatives(self, kept: list[Move], every: list[Move]) -> list[Move]:
        """The rest of a family of which one is among the first two: relatives share their trace."""
        wanted = {self.library[name].family for move in kept[:2] for name, _ in move.starts} - {""}
        return [*kept, *(move for move in every if move not in kept and self.library[move.starts[0][0]].family in wanted)]

    def _count(self, names: Iterable[str]) -> int:
        return sum(len(self.library[name].parameters) for name in names)

    def brief(self, now: GreyboxFit, move: Move, hopeless: float = np.inf) -> GreyboxFit | None:
        """The set of a move on the first stage's data; given up where it leaves more excess than ``hopeless``. None if there is no fit."""
        begun = self._started(now, move)
        found = self._tried(begun, hopeless)
        if move.replaced is not None and not move.stays and (found is None or found.excess >= hopeless):
            harder = braked(self.data, now.model, move.replaced, self.library[move.starts[0][0]])
            others = [*harder, *(start for start in self._in_place(now, move) if start != begun)] if harder else []
            again = self._tried(best_start(self.data, others), hopeless + HOPELESS) if others else None
            found = min((one for one in (found, again) if one is not None), key=lambda one: one.excess, default=None)
        return found

    def _tried(self, start: AxisModel, hopeless: float = np.inf) -> GreyboxFit | None:
        try:
            found = fit(self.data, start, brief=True, hopeless=hopeless, late=self.late)
        except np.linalg.LinAlgError:
            return None
        return found if np.isfinite(found.excess) else None

    def merged(self, now: GreyboxFit, others: GreyboxFit) -> GreyboxFit | None:
        """The first stage's fit of one set with the effects of another, begun from the base of the one and the values of both."""
        model = now.model
        for name, values in others.model.effects:
            model = model.with_effect(name, values)
        return self._tried(model)

    def _started(self, now: GreyboxFit, move: Move) -> AxisModel:
        model = now.model
        if move.replaced is not None:
            begun = self._in_place(now, move)
            rest = begun[0].without(move.starts[0][0])
            return best_start(self.data, [*begun, *other_starts(self.data, now, rest, move.starts[0][0])] if is_read(rest) else begun)
        for name, values in move.starts:
            more = model.with_effect(name, bounded(self.library[name], values, self.data.similar))
            model = best_start(self.data, [more, *other_starts(self.data, now, model, name)])
        return model

    def _in_place(self, now: GreyboxFit, move: Move) -> list[AxisModel]:
        """The model with a relative in the place of an effect: what both have keeps its value, the rest is as its trace tells, or usual."""
        assert move.replaced is not None
        name, values = move.starts[0]
        effect, model = self.library[name], now.model
        old = dict(zip(self.library[move.replaced].names, dict(model.effects)[move.replaced], strict=True))
        rest, usual = model.without(move.replaced), tuple(item.typical for item in effect.on(self.data.similar))
        for part, size in move.stays:
            rest = rest.with_effect(part, size)
        shared = [tuple(old.get(key, value) for key, value in zip(effect.names, row, strict=True)) for row in (values, usual)]
        return [rest.with_effect(name, bounded(effect, row, self.data.similar)) for row in shared]

    def whole(self, found: GreyboxFit) -> GreyboxFit:
        """The same set on all data that are not held out."""
        return finish(self.data, found.model, found.runs, self.late)

    def without(self, now: GreyboxFit, name: str, alone: Sequence[AxisModel] = ()) -> AxisModel:
        """Where the same set but for one effect begins: as it is, as it is read without a model, or, one of the others may have stood back
        for it, as that was alone (models of single effects)."""
        less, scene = now.model.without(name), scene_of(self.data, now)
        begun = [less.with_effect(other, values) for model in alone for other, values in model.effects]
        read = [start for other, _ in less.effects for start in other_starts(self.data, now, less.without(other), other, scene)]
        return best_start(self.data, [less, taken_over(self.data, now.model, name), *begun, *read])

    def instead(self, now: GreyboxFit, name: str, relative: Effect) -> AxisModel:
        """Where the same set with a relative in the place of one effect begins."""
        return best_start(self.data, [make(self.data, now.model, name, relative) for make in (of_one_name, stood_in)])

    def begins(self, now: GreyboxFit, model: AxisModel) -> float:
        """Excess with which a model begins that differs little from that of a fit, as all data would show it."""
        return now.excess + first_excess(self.data, model) - first_excess(self.data, now.model)

    def again(self, now: GreyboxFit, model: AxisModel) -> GreyboxFit | None:
        """A model beside one that is there: fitted wholly only where it comes near."""
        try:
            found = fit(self.data, model, brief=True, hopeless=now.excess + HOPELESS, late=self.late)
            if found.excess < now.excess + HOPELESS:
                found = finish(self.data, found.model, found.runs, self.late)
        except np.linalg.LinAlgError:
            return None
        return found if np.isfinite(found.excess) else None

    def idle(self, found: GreyboxFit) -> str:
        """The effect whose size the data do not tell from none beside the others: its interval, in numbers and not in factors, holds 0."""
        for name, _ in found.model.effects if not found.brief else ():
            size = self.library[name].parameters[0]
            known = found.parameter(f"{name}.{size.name}")
            if size.positive and math.isfinite(known.high) and known.value >= math.e * known.low:
                return name
        return ""

    def refusal(self, found: GreyboxFit) -> str:
        """Why a fit explains nothing, whatever it leaves: in words, or empty."""
        low, high = self.data.sampling_rate * 0.0, 0.4 * self.data.sampling_rate
        excited = self.data.layout.edges()[:-1][self.data.floor.excited]
        if excited.size:
            low, high = float(excited[0]), min(high, 1.5 * float(self.data.layout.edges()[1:][self.data.floor.excited][-1]))
        for name, values in found.model.effects:
            effect = self.library[name]
            why = effect.refusal(values, self.reach) if effect.refusal is not None else ""
            if why:
                return f"{name}: {why}"
            if self.passed_once and effect.is_by_place and not self._repeats(effect, values):
                return f"{name}: each place is passed once, so that what acts by place cannot be told from what drifts"
            for k, (item, value) in enumerate(zip(effect.on(self.data.similar), values, strict=True)):
                edge = value >= item.high * (1.0 - 1e-6) or (k == 0 and not item.positive and value <= item.low * (1.0 + 1e-6) and item.low > 0.0)
                if k == 0 and edge:
                    return f"{name}: {item.name} is at its bound"
                known = found.parameter(f"{name}.{item.name}")
                judged = k == 0 and item.positive and not found.brief and math.isfinite(known.high)
                if judged and known.low <= item.low * (1.0 + 1e-6):
                    return f"{name}: {item.name} cannot be told from 0"
                if item.name == effect.mode_frequency and not low <= value <= high:
                    return f"{name}: a mode at {value:.3g} Hz, outside of what these data excite and see ({low:.3g} to {high:.3g} Hz)"
        limit = self.data.first / self.data.sampling_rate / 4.0
        if found.model.delay >= 0.99 * limit:
            return f"time_delay: {found.model.delay:.3g} s is at its bound"
        return ""

    def _repeats(self, effect: Effect, values: Sequence[float]) -> bool:
        """A law by place that repeats often enough on the travel to be seen in one pass."""
        period = values[effect.names.index("period")] if "period" in effect.names else 2.0 * math.pi
        return effect.repeats and (self.reach[1] - self.reach[0]) / period >= FEWEST

    def better(self, one: GreyboxFit, other: GreyboxFit) -> bool:
        """One predicts the held-out windows better than the other, by more than chance: paired over windows, in the mean or in the ranks.

        Where these are too few to tell, as in short recordings, both are fitted to them as well, and judged by the others: then every
        window counts, each held out once. A fit that was given up, for it was far behind, is worse.
        """
        if other.brief:
            return True
        gain = _scores(other, self.data) - _scores(one, self.data)
        if _is_no_chance(gain):
            return True
        if not float(np.mean(gain)) > 0.0 or self.late():
            return False
        data = replace(self.data, fitted=self.data.held, held=self.data.fitted)
        try:
            one, other = (finish(data, found.model, late=self.late) for found in (one, other))
        except np.linalg.LinAlgError:
            return False
        return _is_no_chance(np.concatenate((gain, _scores(other, data) - _scores(one, data))))

    def size(self, found: GreyboxFit, before: GreyboxFit) -> float:
        """What a fit explains of what one before it left, over what it leaves itself, as powers: of the whole beyond the noise, or over the bands."""
        rest = self.data.floor.rest(before.power)
        return max(rest(before.power) / rest(found.power), float(np.exp(before.excess - found.excess))) - 1.0

    def rest(self, found: GreyboxFit, reference: GreyboxFit) -> float:
        """Power of the held-out error beyond the noise over that of a reference; see ``Floor.rest``."""
        return self.data.floor.rest(reference.power)(found.power)


def _is_no_chance(gain: FloatArray) -> bool:
    """(windows,) gains, half overlapping, are more than chance in the mean or in the ranks.

    The ranks (Wilcoxon 1945), as a law that acts far out alone explains much in few windows, and a little in all.
    """
    spread = float(np.std(gain, ddof=1)) / np.sqrt(max(gain.size / 1.5, 1.0)) if gain.size > 1 else 0.0
    if float(np.mean(gain)) > CHANCE * spread:
        return True
    return bool(np.any(gain != 0.0)) and float(wilcoxon(gain, alternative="greater").pvalue) < norm.sf(CHANCE)


def _scores(found: GreyboxFit, data: AxisData) -> FloatArray:
    """(windows,) excess of each held-out window."""
    return np.array([excess(row, data.floor) for row in found.held])


def joined(data: AxisData, found: GreyboxFit, late: Callable[[], bool] = in_time) -> GreyboxFit:
    """One law for several that are the same; where it is not, as a load is larger than the friction, they stay."""
    whole = found.model.joined()
    if whole is found.model:
        return found
    one = finish(data, replace(whole), late=late)
    return one if one.excess < found.excess + LEAST else found
