"""What the search asks: which moves promise what, how well a set of effects predicts what it has not seen, and which of two is better."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import norm, wilcoxon

from xy_sysid.axis.model import AxisModel, Library
from xy_sysid.criteria import CHANCE, HOPELESS, LEAST
from xy_sysid.effects import Effect
from xy_sysid.effects._contract import Limits, in_time
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.floor import excess
from xy_sysid.greybox.forces import braked, of_one_name, stood_in, taken_over
from xy_sysid.greybox.free_run import GreyboxFit, best_start, finish, first_excess, fit, fit_base, is_read, other_starts, scene_of, screened
from xy_sysid.greybox.one_step import follower, one_step_fit
from xy_sysid.greybox.score_test import bounded
from xy_sysid.greybox.whitened import enough, whitened_rms
from xy_sysid.judge.beside_one_step import Grown, Wanted, grown, put_beside
from xy_sysid.judge.contract import Move
from xy_sysid.judge.moves import Moves
from xy_sysid.judge.refusal import refusal
from xy_sysid.samples.block import FloatArray


class AxisJudge:
    """Fits sets of a library's effects to one axis, and says how well they predict what no fit saw: by simulation, or one sample ahead."""

    def __init__(self, data: AxisData, library: Library, late: Callable[[], bool] = in_time) -> None:
        self.data, self.library, self.late = data, library, late
        self._moves = Moves(data, library, late)

    def begin(self) -> GreyboxFit:
        """The rigid base."""
        return fit_base(self.data, self.library)

    def added(self, now: GreyboxFit, name: str) -> GreyboxFit:
        """A fit with one more effect, unasked; a relative of the same family gives way."""
        effect = self.library[name]
        relative = next((own for own, _ in now.model.effects if effect.family and self.library[own].family == effect.family), None)
        ahead = follower(now.model)
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
        return self._moves.promised(now, brief, early=True)

    def slow_moves(self, now: GreyboxFit, brief: GreyboxFit) -> list[Move]:
        """The same by what is left of all data: several times as long to ask, and for what acts slowly or far out."""
        return self._moves.promised(now, brief, early=False)

    def taken_for(self, now: GreyboxFit) -> list[Move]:
        """Laws that an effect of the best set may have been taken for; see ``Moves``."""
        return self._moves.taken_for(now)

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

    def ahead(self, found: GreyboxFit) -> float:
        """Error one sample ahead, m/s, held out: of a fit that is judged so its own, of a simulation what an autoregressive model leaves.

        0 where the data are too few for any prediction: nothing beats that.
        """
        if found.one_step:
            return found.held_out_error
        later = np.arange(self.data.velocity.size) >= self.data.training
        return whitened_rms(found.error, later) if enough(later) else 0.0

    def followed(self, now: GreyboxFit, name: str, bar: float, least: float, hidden: bool = False) -> Grown:
        """An effect that only one-step prediction can judge, with what acts beside it, and what it hides; see ``beside_one_step``."""
        return grown(self.data, now, self.library[name], Wanted(Limits(bar, self.late), least, self.refusal, hidden))

    def _tried(self, start: AxisModel, hopeless: float = np.inf) -> GreyboxFit | None:
        found = fit(self.data, start, brief=True, hopeless=hopeless, late=self.late)
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
        found = fit(self.data, model, brief=True, hopeless=now.excess + HOPELESS, late=self.late)
        if found.excess < now.excess + HOPELESS:
            found = finish(self.data, found.model, found.runs, self.late)
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
        return refusal(self.data, self.library, found)

    def better(self, one: GreyboxFit, other: GreyboxFit) -> bool:
        """One predicts the held-out windows better than the other, by more than chance: paired over windows, in the mean or in the ranks.

        Where all of them say so and are yet too few to tell, as in short recordings, both are fitted to them as well, and judged by the others:
        then every window counts, each held out once. A fit that was given up, for it was far behind, is worse.
        """
        if other.brief:
            return True
        gain = _scores(other, self.data) - _scores(one, self.data)
        if _is_no_chance(gain):
            return True
        if not np.all(gain > 0.0) or self.late():
            return False
        data = replace(self.data, fitted=self.data.held, held=self.data.fitted)
        one, other = (finish(data, found.model, late=self.late) for found in (one, other))
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
    if not np.all(np.isfinite(gain)):
        return False
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
