"""Which physical effect is missing? A verdict with its evidence, its rivals, the residual error, and the experiment that would resolve doubt."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.comparison.where_it_fails import Comparison, compare_velocity
from xy_sysid.diagnosis import words
from xy_sysid.diagnosis.answer import Answer, Kind, Rung
from xy_sysid.diagnosis.equal_laws import likelihood
from xy_sysid.diagnosis.first_set import answer_of_known_set
from xy_sysid.diagnosis.refine import Effort, never, refine
from xy_sysid.diagnosis.sets import contains, part_explained
from xy_sysid.diagnosis.unmodelled import unmodelled_force
from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import AxisData, one_stretch
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.hypotheses.criteria import AT_FLOOR, KNOWN, STOPPED, UNSURE
from xy_sysid.hypotheses.enough_data import prepared
from xy_sysid.hypotheses.input_noise import input_noise
from xy_sysid.hypotheses.refusal import at_bound
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import USUAL, Units

_UNKNOWN = "Look at where the model fails, then excite only there: half and double the amplitude, another part of the travel, one direction."


def diagnose(
    sampling_rate: float,
    voltage: FloatArray,
    position: FloatArray,
    library: Library = STANDARD,
    budget: float = math.inf,
    clock: Callable[[], float] = never,
) -> Answer:
    """Diagnose one axis from gap-free samples (n,), V and m. budget: see ``refine``."""
    data = prepared(sampling_rate, [(voltage, position)])
    return not_enough(data) if isinstance(data, str) else diagnose_prepared(data, library, budget, clock)


def diagnose_prepared(
    data: AxisData,
    library: Library = STANDARD,
    budget: float = math.inf,
    clock: Callable[[], float] = never,
    first: tuple[str, ...] = (),
) -> Answer:
    """Diagnose one axis from data that suffice. first: effects that are tried before all others (see ``first_set``)."""
    effort = Effort(budget=budget, clock=clock)
    begun = effort.now()
    found = answer_of_known_set(data, library, first, effort)
    if found is None:
        found = refine(data, library, effort=replace(effort, budget=budget + begun - effort.now()))
    return judged(data, found, library)


def not_enough(missing: str, units: Units = USUAL) -> Answer:
    """The verdict where the data do not suffice."""
    sentence = f"Not enough data: {missing}"
    return Answer((), verdict="not_enough_data", confidence=1.0, sentence=sentence, next_experiment=missing, units=units)


def judged(data: AxisData, found: Answer, library: Library) -> Answer:
    """The verdict on a search that has ended."""
    data = data if found.stretch is None else one_stretch(data, found.stretch)
    every, with_all, (found, sure) = found.best, _confidence(data, found, found.final), _named(data, found)
    motion = max(data.layout.rms(data.floor.motion), 1e-300)
    left = found.discrepancy / motion
    found, base, names = replace(found, tolerance=left, force=unmodelled_force(data, found.final)), found.base, found.best
    in_noise = math.sqrt(math.expm1(AT_FLOOR)) * data.layout.rms(data.floor.power) / motion
    could_hide, noise = max(left, in_noise), None
    if names and (found.explained >= 1.0 - found.explained or found.final.excess < AT_FLOOR):
        verdict: Kind = "missing_effect"
        confidence, experiment = sure, words.experiment(names[0], library)
        sentence = words.missing(data, found, every[len(names) :], with_all)
    elif base.excess < AT_FLOOR or (noise := input_noise(data, base)) is not None:
        verdict, names, experiment = "nothing_missing", (), "None is needed."
        found, trust = replace(found, explained=0.0, kept_out=None), 1.0 - (max(base.excess, 0.0) if noise is None else found.helps)
        confidence = trust * (1.0 - _part_hidden(could_hide, data.floor.epsilon))
        sentence = words.nothing_missing(data, base, noise)
    else:
        verdict, experiment = "not_in_library", _UNKNOWN
        confidence = (1.0 - found.helps) * (1.0 - _part_hidden(could_hide, data.floor.epsilon))
        found = replace(found, force=unmodelled_force(data, base))
        sentence = words.not_in_library(data, found)
    sentence += words.hidden(could_hide) + words.kept_out(found)
    seconds = max(run.stop - run.start for run in data.runs) / data.sampling_rate
    sentence += words.not_tried(found.untried, seconds) if verdict != "nothing_missing" else ""
    sentence += words.of_one_stretch(found, seconds)
    if found.stopped:
        sentence += " The search was stopped by its budget."
        confidence *= STOPPED
    found = replace(
        found,
        verdict=verdict,
        could_hide=could_hide,
        confidence=float(confidence),
        sentence=sentence,
        candidates=tuple(sorted(found.candidates, key=lambda item: item.name not in names)),
        where=where_base_fails(data, base),
        next_experiment=experiment,
    )
    return replace(found, look_alikes=words.look_alikes(found, library))


def _named(data: AxisData, found: Answer) -> tuple[Answer, float]:
    """The answer up to the rung that is most worth naming, and the confidence in its effects.

    The measure is the logarithm of the fall of the held-out error, times the confidence. So a second effect is named if it explains much or is sure.
    An effect that explains little and is unsure does not make the first one unsure.
    """
    if found.final.one_step:  # judged one sample ahead, as one: a rung may have brought two of them
        return found, _confidence(data, found, found.final)

    def worth_naming(rung: Rung) -> float:
        return _confidence(data, found, rung.fit) * math.log(found.base.held_out_error / max(rung.held_out_error, 1e-300))

    last = len(found.rungs) - 1
    most = max(range(1, last + 1), key=lambda place: worth_naming(found.rungs[place]), default=last)
    if most == last:
        return found, _confidence(data, found, found.final)
    return _cut_after(data, found, most), _confidence(data, found, found.rungs[most].fit)


def _could_be(untried: tuple[str, ...], names: tuple[str, ...], library: Library) -> bool:
    """An effect that was not tried is often taken for one of those that are named."""
    return any(name in library[other].suspects for other in untried for name in names)


def _cut_after(data: AxisData, found: Answer, place: int) -> Answer:
    """The answer without the rungs after one of them."""
    fit = found.rungs[place].fit
    names = tuple(name for name in found.best if name in fit.model)
    return replace(
        found,
        rungs=found.rungs[: place + 1],
        best=names,
        settled=None,
        rivals=tuple(rival for rival in found.rivals if not contains(fit.model.library, frozenset(rival.effects), frozenset(names))),
        explained=part_explained(data, found.base, fit),
        discrepancy=math.sqrt(max(fit.held_out_error**2 - data.noise**2, 0.0)),
    )


def _confidence(data: AxisData, found: Answer, named: GreyboxFit) -> float:
    """How likely no other set is as good, how much larger each effect is than what is left, and how likely the name of one is that shares
    its law with others; of what is undetermined half at most. named: the fit whose effects are named, which may have less than the last."""
    library, names = named.model.library, tuple(name for name in found.best if name in named.model)
    rivals = (rival for rival in found.rivals if not contains(library, frozenset(rival.effects), frozenset(names)))
    doubt = max((rival.doubt for rival in rivals), default=0.0)
    size = min((found.sizes[name] for name in names if name in found.sizes), default=0.0)
    likely = math.prod(likelihood(library, name, values) for name, values in found.final.model.effects if name in names)
    sure = (1.0 - doubt) * size / (size + 1.0) * likely
    doubtful = any(_undetermined(data, fit, name) for fit in (named, found.final) for name in names)
    return min(sure, UNSURE) if doubtful or _could_be(found.untried, names, library) else sure


def _undetermined(data: AxisData, fit: GreyboxFit, name: str) -> bool:
    """The size of an effect is not distinguished from zero, is known to worse than a factor of two, in every recording, or ends at a bound."""
    effect = fit.model.library[name]
    size = effect.on(data.similar)[0]
    item = fit.parameter(f"{name}.{size.name}")
    return at_bound(size, item.value) or not any(_is_known(one.low, one.high) for one in item.recordings or (item,))


def _is_known(low: float, high: float) -> bool:
    """An interval does not hold zero, and its ends differ by the factor KNOWN at most."""
    near, far = sorted((abs(low), abs(high)))
    return low * high > 0.0 and math.isfinite(far) and far <= KNOWN * near


def _part_hidden(left: float, trusted: float) -> float:
    """Part of all sizes that what is left could hide, on a logarithmic scale from what laws are trusted to up to the whole motion.

    left, trusted: parts of the motion. Prior of Jeffreys 1946: the order of magnitude of a size is unknown.
    """
    return min(max(math.log(max(left, trusted) / trusted) / math.log(1.0 / trusted), 0.0), 1.0)


def where_base_fails(data: AxisData, fitted: GreyboxFit) -> Comparison | None:
    """The places where a fit fails, over the longest recording."""
    run, step = max(zip(data.runs, data.steps, strict=True), key=lambda pair: pair[1].stop - pair[1].start)
    try:
        return compare_velocity(fitted.simulated[step], data.voltage[run], data.position[run], data.sampling_rate, data.units)
    except (BadInput, ValueError):
        return None
