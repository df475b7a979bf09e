"""Which physical effect is missing? A verdict with its evidence, its rivals, what is left, and the experiment that would settle doubt."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.comparison.where_it_fails import Comparison, compare_velocity
from xy_sysid.diagnosis.equal_laws import equals, likelihood
from xy_sysid.diagnosis.first_set import settled
from xy_sysid.diagnosis.ladder import Candidate, Ladder, contains, part_explained
from xy_sysid.diagnosis.refine import Effort, never, refine
from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import AxisData, prepare_all
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.hypotheses.criteria import AT_FLOOR, SIZE
from xy_sysid.hypotheses.enough_data import lacking
from xy_sysid.hypotheses.input_noise import input_noise
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import USUAL, Units, bare, moved

Kind = Literal["missing_effect", "nothing_missing", "not_in_library", "not_enough_data"]
Recordings = Sequence[tuple[FloatArray, FloatArray]]

_UNKNOWN = "Look at where the model fails, then excite only there: half and double the amplitude, another part of the travel, one direction."


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What is missing in the rigid model of one axis.

    verdict:    see Kind; effects: the names, that which explains most first; confidence: 0..1
    tolerance:  part of the motion (rms) that is left unexplained beyond the noise
    ladder:     the fits, from the base down; candidates: tried alone, least held-out error first
    where:      the places where the base fails
    explained:  part (0..1) of the base's held-out error power beyond the noise that the effects take away
    units:      of input and output
    noise, discrepancy: rms, m/s, of what is left: what the encoder adds, and what no effect explains
    stopped:    the time was up before the search ended by itself; refused: (effects, why they explain nothing)
    """

    verdict: Kind
    effects: tuple[str, ...]
    confidence: float
    tolerance: float
    sentence: str
    ladder: Ladder | None = None
    candidates: tuple[Candidate, ...] = ()
    where: Comparison | None = None
    next_experiment: str = ""
    explained: float = 0.0
    noise: float = 0.0
    discrepancy: float = 0.0
    stopped: bool = False
    refused: tuple[tuple[tuple[str, ...], str], ...] = field(default=())
    units: Units = USUAL

    @property
    def effect(self) -> str | None:
        """The first of the effects."""
        return self.effects[0] if self.effects else None

    def why_refused(self, effect: str) -> str:
        """Why an effect alone explains nothing, whatever it leaves; empty if it is not refused."""
        return next((reason for names, reason in self.refused if names == (effect,)), "")


def diagnose(
    sampling_rate: float,
    voltage: FloatArray,
    position: FloatArray,
    library: Library = STANDARD,
    budget: float = math.inf,
    clock: Callable[[], float] = never,
) -> Diagnosis:
    """Diagnose one axis from gap-free samples (n,), V and m. budget: see ``refine``."""
    return diagnose_all(sampling_rate, [(voltage, position)], library, budget, clock)


def diagnose_all(
    sampling_rate: float,
    recordings: Recordings,
    library: Library = STANDARD,
    budget: float = math.inf,
    clock: Callable[[], float] = never,
) -> Diagnosis:
    """Diagnose one axis from several recordings, (voltage (n,), position (n,)) each."""
    missing = lacking(sampling_rate, recordings)
    return not_enough(missing) if missing else diagnose_prepared(prepare_all(sampling_rate, recordings), library, budget, clock)


def diagnose_prepared(
    data: AxisData,
    library: Library = STANDARD,
    budget: float = math.inf,
    clock: Callable[[], float] = never,
    first: tuple[str, ...] = (),
) -> Diagnosis:
    """Diagnose one axis from data that suffice. first: effects that are tried before all others (see ``first_set``)."""
    effort = Effort(budget=budget, clock=clock, size=SIZE)
    begun = effort.now()
    ladder = settled(data, library, first, effort)
    if ladder is None:
        ladder = refine(data, library, effort=replace(effort, budget=budget + begun - effort.now()))
    return judged(data, ladder, library)


def not_enough(missing: str, units: Units = USUAL) -> Diagnosis:
    """The verdict where the data do not suffice."""
    return Diagnosis(
        verdict="not_enough_data",
        effects=(),
        confidence=1.0,
        tolerance=0.0,
        sentence=f"Not enough data: {missing}",
        next_experiment=missing,
        units=units,
    )


def judged(data: AxisData, ladder: Ladder, library: Library) -> Diagnosis:
    """The verdict on a search that has ended."""
    every, (ladder, sure) = ladder.effects, _surest(data, ladder)
    base, final, names = ladder.base, ladder.final, ladder.effects
    motion = max(data.layout.rms(data.floor.motion), 1e-300)
    left = ladder.discrepancy / motion
    where, unit = where_base_fails(data, base), data.units.judged
    explained = ladder.explained
    hides = math.sqrt(math.expm1(AT_FLOOR)) * data.layout.rms(data.floor.power) / motion  # in the noise
    if names and (explained >= 1.0 - explained or final.excess < AT_FLOOR):
        verdict: Kind = "missing_effect"
        confidence, experiment = sure, _experiment(names[0], library)
        sentence = f"Missing: {_listed(names)}. {'They explain' if len(names) > 1 else 'It explains'} {_percent(explained)} of the error's power"
        sentence += f" ({bare(base.held_out_error, unit)} -> {moved(final.held_out_error, unit)}). {_left(data, ladder, left)}"
        if len(every) > len(names):
            also = "may also be present (below 50 %)" if len(every) == len(names) + 1 else "may also be present (each below 50 %)"
            sentence += f" {_listed(every[len(names) :])} {also}."
        sentence += _also_called(final, names)
        if ladder.rivals:
            rival = ladder.rivals[0]
            why = f" (refused, {rival.refused})" if rival.refused else ""
            sentence += f" Runner-up {' and '.join(rival.effects)}: {moved(rival.fit.held_out_error, unit)}{why}."
    elif base.excess < AT_FLOOR or (noise := input_noise(data, base)) is not None:
        verdict, names, explained, experiment = "nothing_missing", (), 0.0, "None is needed."
        sentence = f"Nothing is missing: the rigid model with delay leaves {moved(base.held_out_error, unit)}, which is "
        if base.excess < AT_FLOOR:
            trust = 1.0 - max(base.excess, 0.0)
            sentence += f"at the noise floor ({moved(base.noise_floor, unit)})."
        else:
            trust, hides = 1.0 - ladder.helps, max(left, hides)
            sentence += f"what white noise of {noise:.3g} {data.units.input} rms on the input would leave."
        confidence = trust * (1.0 - _hidden(hides, data.floor.epsilon))
        sentence += f" What changes the motion by less than {_percent(hides)} could hide in it."
    else:
        verdict, experiment = "not_in_library", _UNKNOWN
        confidence = (1.0 - ladder.helps) * (1.0 - _hidden(max(left, hides), data.floor.epsilon))
        beyond = data.layout.rms(_beyond_noise(data, base))
        sentence = f"Not in the library: no effect explains what the rigid model leaves ({moved(base.held_out_error, unit)}). Beyond the encoder's "
        sentence += f"noise that is {moved(beyond, unit)}, {_percent(beyond / motion)} of the motion{_mostly(data, base)}."
        if names and explained > 0.0:
            sentence += f" At best {_listed(names)} {'explain' if len(names) > 1 else 'explains'} {_percent(explained)} of the error's power."
    if ladder.kept_out is not None and verdict != "nothing_missing":
        several = len(ladder.kept_out.effects) > 1
        leaves = "would leave" if several else "alone would leave"
        sentence += f" {_listed(ladder.kept_out.effects)} {leaves} {moved(ladder.kept_out.fit.held_out_error, unit)}, and"
        sentence += f" {'are' if several else 'is'} refused: {ladder.kept_out.refused}."
    if ladder.stopped:
        sentence += " The search was stopped by its budget."
        confidence *= 0.8
    return Diagnosis(
        verdict=verdict,
        effects=names if verdict == "missing_effect" else (),
        confidence=float(confidence),
        tolerance=left,
        sentence=sentence,
        ladder=ladder,
        candidates=tuple(sorted(ladder.tried, key=lambda item: item.effect not in names)),
        where=where,
        next_experiment=experiment,
        explained=explained,
        noise=ladder.noise,
        discrepancy=ladder.discrepancy,
        stopped=ladder.stopped,
        refused=ladder.refused,
        units=data.units,
    )


def _surest(data: AxisData, ladder: Ladder) -> tuple[Ladder, float]:
    """The ladder down to where each of its effects is surer than not, and the confidence in all of these together.

    Where two sets do the same, what they share is sure, and what they differ in is not. If nothing is surer than not, all are told.
    """
    together = ladder.final.one_step  # judged one sample ahead, as one: a rung may have brought two of them
    for count in range(len(ladder.effects), len(ladder.effects) - 1 if together else 0, -1):
        names = ladder.effects[:count]
        surest = min(_confidence(ladder, (name,)) for name in names)
        rungs = (place for place, step in enumerate(ladder.steps) if {name for name, _ in step.fit.model.effects} == set(names))
        place = next(rungs, None)
        if place is None and names != ladder.effects:
            continue
        fit = ladder.final if place is None or names == ladder.effects else ladder.steps[place].fit
        explained = ladder.explained if fit is ladder.final else part_explained(data, ladder.base, fit)
        if surest < 0.5 or explained < 0.5:
            continue
        if fit is ladder.final:
            return ladder, _confidence(ladder, names)
        library = fit.model.library
        rivals = tuple(rival for rival in ladder.rivals if not contains(library, frozenset(rival.effects), frozenset(names)))
        told = replace(
            ladder,
            steps=ladder.steps[: (len(ladder.steps) if place is None else place) + 1],
            final=fit,
            effects=names,
            rivals=rivals,
            explained=explained,
            discrepancy=math.sqrt(max(fit.held_out_error**2 - data.noise**2, 0.0)),
        )
        return told, _confidence(ladder, names)
    return ladder, _confidence(ladder, ladder.effects)


def _confidence(ladder: Ladder, names: tuple[str, ...]) -> float:
    """How likely no other set is as good, how much larger each effect is than what is left, and how likely the name of one is that shares
    its law with others; of what is undetermined half at most."""
    library = ladder.final.model.library
    rivals = (rival for rival in ladder.rivals if not contains(library, frozenset(rival.effects), frozenset(names)))
    doubt = max((rival.doubt for rival in rivals), default=0.0)
    size = min((ladder.sizes[name] for name in names if name in ladder.sizes), default=0.0)
    likely = math.prod(likelihood(library, name, values) for name, values in ladder.final.model.effects if name in names)
    sure = (1.0 - doubt) * size / (size + 1.0) * likely
    return min(sure, 0.5) if any(_undetermined(ladder.final, name) for name in names) else sure


def _undetermined(final: GreyboxFit, name: str) -> bool:
    """The size of an effect is not distinguished from zero, or is known to worse than a factor of two, in every recording."""
    item = final.parameter(f"{name}.{final.model.library[name].parameters[0].name}")
    return not any(_is_known(one.low, one.high) for one in item.recordings or (item,))


def _is_known(low: float, high: float) -> bool:
    """An interval does not hold zero, and its ends differ by a factor of four at most."""
    near, far = sorted((abs(low), abs(high)))
    return low * high > 0.0 and math.isfinite(far) and far <= 4.0 * near


def _hidden(left: float, trusted: float) -> float:
    """Part of all sizes that what is left could hide, on a logarithmic scale from what laws are trusted to up to the whole motion.

    left, trusted: parts of the motion. Jeffreys 1946: of a size, nobody knows the order of magnitude.
    """
    return min(max(math.log(max(left, trusted) / trusted) / math.log(1.0 / trusted), 0.0), 1.0)


def _also_called(final: GreyboxFit, names: Sequence[str]) -> str:
    """What has the very law of an effect that is named, and how much likelier that is."""
    library, said = final.model.library, ""
    for name, values in final.model.effects:
        others = [other.name for other in equals(library, name) if other.name != name] if name in names else []
        if others:
            sure = _percent(round(likelihood(library, name, values), 2))
            said += f" A motor encoder cannot distinguish {name} from {_listed(others)}: their equations are the same."
            said += f" Typical values favour {name} ({sure})."
    return said


def _left(data: AxisData, ladder: Ladder, left: float) -> str:
    noise, beyond, least = (moved(value, data.units.judged) for value in (ladder.noise, ladder.discrepancy, ladder.final.noise_floor))
    if ladder.final.excess < AT_FLOOR or not ladder.discrepancy > 0.0:
        return f"The residual error is at the noise floor ({least})."
    words = "" if ladder.final.one_step else f", {_percent(left)} of the motion"
    return f"What is left: {beyond}{words}, beyond the encoder's noise of {noise}{_mostly(data, ladder.final)}."


def _mostly(data: AxisData, final: GreyboxFit) -> str:
    """Where in frequency most of what is left lies."""
    power = data.layout.lines * _beyond_noise(data, final)
    if not float(power.sum()) > 0.0:
        return ""
    edges, share = data.layout.edges(), np.cumsum(power) / power.sum()
    low, high = (int(np.searchsorted(share, at)) for at in (0.1, 0.8))
    return f", mostly between {edges[low]:.3g} and {edges[min(high + 1, edges.size - 1)]:.3g} Hz"


def _beyond_noise(data: AxisData, fit: GreyboxFit) -> FloatArray:
    """(bands,) power of the held-out error beyond the encoder's noise, band by band: noise that one band has less of hides nothing in another."""
    return np.asarray(np.maximum(fit.power - data.floor.noise, 0.0))


def where_base_fails(data: AxisData, fitted: GreyboxFit) -> Comparison | None:
    """The places where a fit fails, over the longest recording."""
    run, step = max(zip(data.runs, data.steps, strict=True), key=lambda pair: pair[1].stop - pair[1].start)
    try:
        return compare_velocity(fitted.simulated[step], data.voltage[run], data.position[run], data.sampling_rate, data.units)
    except (BadInput, ValueError):
        return None


def _experiment(name: str, library: Library) -> str:
    effect = library[name]
    return f"To tell it from {', '.join(effect.look_alikes)}: {effect.experiment}." if effect.look_alikes else f"{effect.experiment}."


def _listed(names: Sequence[str]) -> str:
    return " and ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else "".join(names)


def _percent(part: float) -> str:
    return f"{100.0 * part:.3g} %"
