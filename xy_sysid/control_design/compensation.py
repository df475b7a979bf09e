"""Which laws of a model the feedforward should compensate along a path: those that help in simulation, for every sample of the parameters.

The complete feedforward inverts every law. This does harm if a parameter is uncertain, if the feedback reacts to a sudden voltage worse than to a
slow force, or if a load presses one flank of a gap. So each sample of the parameters follows the path in simulation, with the controller that will
be used. A law is left out if the worst sample has a smaller error without it. If kS, kV and kA are better for any sample, only these are used;
also if a parameter of a law is at its bound.

The samples cover the parameters' intervals, and laws that data cannot distinguish (``Effect.sum_of``): friction that differs between the directions
may be friction with a load.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.axis.model import AxisModel
from xy_sysid.control_design.closed_loop import Controller, Encoder, follow_path, rms, shake
from xy_sysid.control_design.gains import Gains, simple_feedforward
from xy_sysid.control_design.inverse import feedforward
from xy_sysid.control_design.laws import along, ask, force, of_category
from xy_sysid.control_design.limits import RESERVE
from xy_sysid.control_design.path import Moves, SampledPath, of_position
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

ACROSS = 0.02  # s in which the correction by direction crosses a gap: a step would cause an impact
SLOWED, SLOWINGS = 0.7, 6  # speed factor, and its repetitions, if the drive would reach its limit
GONE = 0.01  # fraction of friction that is negligible
RIGID = "base"  # part of every model: gain, pole and delay
SIMPLE = "kS kV kA"


@dataclass(frozen=True, slots=True)
class Compensation:
    """How a path is followed.

    path: the path in encoder readings; voltage: (n,) V, added to the feedback
    terms: compensated laws; left: (law, why) of the others
    feedback, simple, chosen: tracking error of the worst sample of the parameters, m rms: feedback alone, with kS kV kA, with the chosen compensation
    centre: the same three of the model itself; largest: the largest voltage of any sample, V
    inverse: the model with the compensated laws, whose feedforward is ``voltage``; None with kS, kV and kA
    """

    path: SampledPath
    voltage: FloatArray
    terms: tuple[str, ...]
    left: tuple[tuple[str, str], ...]
    feedback: float
    simple: float
    chosen: float
    largest: float
    centre: tuple[float, float, float]
    inverse: AxisModel | None


def left_words(left: Sequence[tuple[str, str]]) -> str:
    """``, but not A and B (why)`` for the laws that are left out; empty if none is."""
    names: dict[str, list[str]] = {}
    for name, why in left:
        names.setdefault(why, []).append(name)
    return "".join(f", but not {' and '.join(own)} ({why})" for why, own in names.items())


@dataclass(frozen=True, slots=True)
class _Tried:
    """A choice of laws: the commanded encoder readings, the feedforward, V, the error of each sample, m rms, and the largest voltage, V.

    inverse: the model with these laws; None with kS, kV and kA
    """

    terms: tuple[str, ...]
    path: SampledPath
    voltage: FloatArray
    errors: FloatArray
    largest: float
    inverse: AxisModel | None = None

    def against(self, other: _Tried) -> float:
        """The error of the worst sample over that of another choice."""
        return float(np.max(self.errors / np.maximum(other.errors, 1e-300)))


def asked_of_encoder(model: AxisModel, path: SampledPath, terms: Sequence[str]) -> SampledPath:
    """The encoder readings with the load on the path: with the scale's error, and half the gap towards the flank in contact.

    terms: effects that are corrected
    """
    kept = replace(model, effects=tuple(item for item in model.effects if item[0] in terms))
    position = path.position + along(kept, path.position, "scale")
    for name, values in kept.effects:
        own = dict(zip(model.library[name].names, values, strict=True))
        if "gap" in own:
            flank = _flank(model, path, own.get("rub", 0.0))
            length = max(round(ACROSS * path.sampling_rate), 1)
            soft = np.convolve(np.concatenate((np.zeros(length), flank)), np.full(length + 1, 1.0 / (length + 1)), mode="valid")
            position = position + 0.5 * own["gap"] * soft
    return of_position(position, path.sampling_rate)


def _flank(model: AxisModel, path: SampledPath, rub: float) -> FloatArray:
    """(n,) the flank of a gap that is in contact: 1 forward, -1 backward, 0 if unknown.

    Dry friction of the carried mass (``rub``, V) keeps the flank behind it in contact. A load larger than that friction keeps one flank in
    contact, if it acts behind the gap; a motor encoder does not show on which side it acts. So the flank is known where both cases agree.
    """
    way = np.sign(path.speed)
    last = np.maximum.accumulate(np.where(way != 0.0, np.arange(way.size), -1))
    way = np.where(last >= 0, way[np.maximum(last, 0)], 0.0)
    load = along(model, path.position, "force") + force(model, 0.0, 0.0, of_speed=False, by_place=False)
    return np.asarray(0.5 * (way + np.sign(load * math.copysign(1.0, model.gain) + rub * way)))


def alike(model: AxisModel, sampling_rate: float) -> tuple[AxisModel, ...]:
    """The model rewritten with other effects whose law is the same while sliding and differs at rest.

    In these models, parts are joined to one effect, one effect is split into its parts, half of its second part is split off, or Coulomb
    friction replaces friction whose breakaway ends within one sample. sampling_rate: Hz
    """
    joined = model.joined()
    found: list[AxisModel] = [joined, _without_breakaway(model, sampling_rate)]
    for name, values in joined.effects:
        whole = joined.library[name].sum_of
        if whole is None or any(part in dict(joined.effects) for part in whole.parts):
            continue
        apart = joined.apart(name)
        first, second = whole.apart(values)
        half = (0.5 * second[0], *second[1:])
        added = dict(apart.effects)[whole.parts[1]]
        rest = tuple(item for item in joined.effects if item[0] != name)
        both = ((name, whole.joined((first, half))), (whole.parts[1], (0.5 * added[0], *added[1:])))
        found += [apart, replace(joined, effects=(*rest, *both), per_recording=())]
    return tuple(item for item in found if item.effects != model.effects)


def _without_breakaway(model: AxisModel, sampling_rate: float) -> AxisModel:
    """The model with Coulomb friction instead of friction whose breakaway ends within one sample."""
    for effect, values in of_category(model, "friction"):
        words = {"direction": 1.0}
        level_alone = [other.name for other in model.library.acting if other.is_dry and other.family == effect.family and len(other.parameters) == 1]
        breakaway, slides = (ask(effect, values, "level", {**words, "v": v}) for v in (0.0, abs(model.gain)))
        after = abs(model.gain) * model.pole * (breakaway - slides) / sampling_rate
        is_gone = after > 0.0 and abs(ask(effect, values, "level", {**words, "v": after}) - slides) < GONE * slides
        if level_alone and level_alone[0] not in model and is_gone:
            rest = tuple(item for item in model.effects if item[0] != effect.name)
            return replace(model, effects=(*rest, (level_alone[0], (slides,))), per_recording=())
    return model


def at_its_bound(model: AxisModel) -> str:
    """The first share or ratio that ended at a bound of its law other than 0; empty if none did.

    The data exceed what the law can represent. Parameters that were fitted together with it compensate the rest, and are unreliable, too.
    """
    for name, values in model.effects:
        for item, value in zip(model.library[name].parameters, values, strict=True):
            if not item.unit and value != 0.0 and value in (item.low, item.high):
                return f"{name}.{item.name}"
    return ""


def compensate(models: Sequence[AxisModel], found: Gains, path: SampledPath, controller: Controller, encoder: Encoder | None = None) -> Compensation:
    """The laws of the first model whose compensation helps along the path.

    models: the model and samples of its parameters (``uncertain.samples``); encoder: its noise relaxes presliding friction while the axis rests
    """
    others = alike(models[0], path.sampling_rate)
    judges = (*models, *others)

    def judged(terms: tuple[str, ...], wanted: SampledPath, voltage: FloatArray, inverse: AxisModel | None = None) -> _Tried:
        runs = [follow_path(model, wanted, controller, voltage, encoder) for model in judges]
        errors = np.array([rms(path.position - run.carried) for run in runs])
        largest = max(float(np.max(np.abs(run.voltage))) for run in runs)
        return _Tried(terms=terms, path=wanted, voltage=voltage, errors=errors, largest=largest, inverse=inverse)

    noise = shake(models[0], float(path.position[0]), path.sampling_rate, controller, encoder or Encoder())

    def undoing(model: AxisModel) -> Callable[[tuple[str, ...]], _Tried]:
        def these(terms: tuple[str, ...]) -> _Tried:
            kept = replace(model, effects=tuple(item for item in model.effects if item[0] in terms))
            wanted = asked_of_encoder(model, path, terms)
            return judged(terms, wanted, feedforward(kept, wanted, noise).voltage, kept)

        return these

    simple = judged((), path, simple_feedforward(found, path))
    stretched = at_its_bound(models[0])
    better = "they are better than the whole feedforward for a sample of the parameters"
    reason = f"{stretched} is at its bound, so another law probably acts" if stretched else better
    best, left = simple, tuple((name, reason) for name, _ in models[0].effects)
    for model in (models[0], *others) if not stretched else ():
        whole, gone = _worth_undoing(model, undoing(model), simple)
        if whole.against(simple) < best.against(simple):
            best, left = whole, tuple((name, "undoing it makes the error of the worst sample of the parameters larger") for name in gone)
    alone = judged((), path, np.zeros(path.position.size))
    return Compensation(
        path=best.path,
        voltage=best.voltage,
        terms=(SIMPLE,) if best is simple else (RIGID, *best.terms),
        left=left,
        feedback=float(np.max(alone.errors)),
        simple=float(np.max(simple.errors)),
        chosen=float(np.max(best.errors)),
        largest=best.largest,
        centre=(float(alone.errors[0]), float(simple.errors[0]), float(best.errors[0])),
        inverse=best.inverse,
    )


def compensate_within(
    models: Sequence[AxisModel], found: Gains, moves: Moves, controller: Controller, encoder: Encoder | None = None
) -> tuple[SampledPath, Compensation]:
    """The path of the moves, slowed until every sample of the parameters leaves ``RESERVE`` of the limit free; and its compensation.

    Raises BadInput if even the slowest path needs more, for example with a controller that does not come to rest.
    """
    for scale in SLOWED ** np.arange(SLOWINGS):
        path = moves.sampled(float(scale))
        made = compensate(models, found, path, controller, encoder)
        if made.largest <= (1.0 - RESERVE) * controller.limit:
            return path, made
    allowed = f"up to {(1.0 - RESERVE) * controller.limit:.3g} V on a path of {scale * moves.bounds.speed:.3g} m/s"
    raise BadInput("voltage", f"{made.largest:.3g} V", allowed, "Lower the controller's gains, or stay away from what holds the axis.")


def _worth_undoing(model: AxisModel, undoing: Callable[[tuple[str, ...]], _Tried], simple: _Tried) -> tuple[_Tried, tuple[str, ...]]:
    """The best choice of a model's laws, and those that are left out: laws are removed one by one as long as the worst sample improves."""
    best = undoing(tuple(name for name, _ in model.effects))
    gone: tuple[str, ...] = ()
    while best.terms:
        fewer = [undoing(tuple(name for name in best.terms if name != one)) for one in best.terms]
        tried = min(fewer, key=lambda item: item.against(simple))
        if tried.against(simple) >= best.against(simple):
            break
        gone = (*gone, *set(best.terms).difference(tried.terms))
        best = tried
    return best, gone
