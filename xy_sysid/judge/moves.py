"""What may be done next from a set of effects, and what each of these moves promises: a joint score test, so that pairs cost no fit."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from xy_sysid.axis.model import AxisModel, Library
from xy_sysid.criteria import ALIKE, WIDTH
from xy_sysid.effects import Effect, Scene
from xy_sysid.effects._contract import in_time
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.forces import taken_for
from xy_sysid.greybox.free_run import TOLD, GreyboxFit, first_excess, is_read, other_starts, scene_of, screened
from xy_sysid.greybox.score_test import Gain, Trace
from xy_sysid.judge.contract import Move

NOTHING = Gain(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class _Here:
    """A fit, the same set's on the first stage's data, and the data that are looked at as its effects see them."""

    fit: GreyboxFit
    brief: GreyboxFit
    scene: Scene


class Moves:
    """Of one axis, among the effects of a library."""

    def __init__(self, data: AxisData, library: Library, late: Callable[[], bool] = in_time) -> None:
        self.data, self.library, self.late = data, library, late

    def promised(self, now: GreyboxFit, brief: GreyboxFit, early: bool) -> list[Move]:
        """What may be added, alone or two at once, and what may take the place of a relative; most promising first, of each kind.

        Nothing when it is late. brief: the same set on the first stage's data; early: these are looked at, else all.
        """
        if self.late():
            return []
        model = now.model
        families = {self.library[name].family: name for name, _ in model.effects if self.library[name].family}
        open_to = [
            e for e in self.library.acting if e.simulable and e.name not in model and (e.repeats or not (self.data.passed_once and e.is_by_place))
        ]
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
        starts = other_starts(self.data, here.fit, model, effect.name, here.scene, TOLD)
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
