"""Which physical effect is missing? A verdict with its evidence, its runner-up, and the experiment that would settle doubt."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy.signal

from xy_sysid.axis_model import STANDARD, Library, simulate
from xy_sysid.comparison import Comparison, compare_velocity
from xy_sysid.errors import BadInput
from xy_sysid.greybox import AxisData, GreyboxFit, excess_of, loosened, prepare
from xy_sysid.ladder import Ladder
from xy_sysid.one_step import change_without
from xy_sysid.race import AT_FLOOR, Candidate
from xy_sysid.refinement import refine
from xy_sysid.stream import FloatArray

Kind = Literal["missing_effect", "nothing_missing", "not_in_library", "not_enough_data"]

TOLERANCES = (1e-3, 1e-2, 3e-2)  # of the signal that a model may leave: real machines need the later ones
CERTAINTY = (1.0, 0.6, 0.4)  # most confidence at each tolerance: a looser floor is reached by wrong models too
TELLING = 1.0  # excess that the base must have at a looser tolerance, for a name that reaches it to mean anything
HOPELESS = 0.6  # excess that the strict ladder's end may have at a looser tolerance for a ladder of its own to be worth its time
FAINT = 0.4  # part of the confidence in an effect that was found in the noise: there many look like one another
CLEAR = 0.3  # excess by which a runner-up must be behind for the confidence to reach 63 % of its most
EXPLAINS = 0.6  # part of the excess that must be gone for a name with a rest left over
FOLLOWS = 0.15  # coherence of input and velocity, mean over an octave: of unrelated signals it is below 0.08
SHORTEST = 4.0  # s
FEWEST_BANDS = 6  # excited bands
LEAST_TRAVEL = 20.0  # encoder counts


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What is missing in the rigid model of one axis.

    verdict:    see Kind; effects: the names, most important first; confidence: 0..1
    tolerance:  of the signal down to which the model explains it
    ladder:     the fits, from the base down; candidates: tried for the first effect, least held-out error first
    where:      the places where the base fails, on held-out data
    """

    verdict: Kind
    effects: tuple[str, ...]
    confidence: float
    tolerance: float
    sentence: str
    ladder: Ladder | None
    candidates: tuple[Candidate, ...]
    where: Comparison | None
    next_experiment: str

    @property
    def effect(self) -> str | None:
        """The first of the effects."""
        return self.effects[0] if self.effects else None


def diagnose(sampling_rate: float, voltage: FloatArray, position: FloatArray, library: Library = STANDARD) -> Diagnosis:
    """Diagnose one axis from gap-free samples (n,), V and m."""
    missing = lacking(sampling_rate, voltage, position)
    if missing:
        return Diagnosis("not_enough_data", (), 1.0, TOLERANCES[0], f"Not enough data: {missing}", None, (), None, missing)
    data = prepare(sampling_rate, voltage, position)
    ladder = refine(data, library)
    first = _judged(data, ladder, library, TOLERANCES[0], CERTAINTY[0])
    if ladder.explained:
        return first
    for tolerance, certainty in zip(TOLERANCES[1:], CERTAINTY[1:], strict=True):
        looser = loosened(data, tolerance)
        if excess_of(looser, ladder.steps[0].fit) < TELLING or excess_of(looser, ladder.final) > HOPELESS:
            continue
        again = refine(looser, library)
        if again.explained:
            found = _judged(looser, again, library, tolerance, certainty)
            if found.verdict == "missing_effect":
                return replace(found, candidates=first.candidates, where=first.where)
            break
    return first


def lacking(sampling_rate: float, voltage: FloatArray, position: FloatArray) -> str:
    """What is missing in the data, in words; empty if they will do."""
    seconds = voltage.size / sampling_rate
    if seconds < SHORTEST:
        return f"{seconds:.3g} s without a gap; record at least {SHORTEST:g} s, better 60 s."
    if float(voltage.std()) == 0.0:
        return "the input does not move; excite the axis."
    if float(position.std()) == 0.0:
        return "the output does not move; excite more, or check the encoder."
    followed = _coherence(sampling_rate, voltage, position)
    if followed < FOLLOWS:
        return f"the output does not follow the input (coherence {followed:.2g} at best, {FOLLOWS:g} is the least); check which signals these are."
    try:
        data = prepare(sampling_rate, voltage, position)
    except BadInput as problem:
        return str(problem)
    if int(data.floor.excited.sum()) < FEWEST_BANDS:
        return f"only {int(data.floor.excited.sum())} bands of frequency are excited; use noise or a multisine over the whole band."
    return ""


def _coherence(sampling_rate: float, voltage: FloatArray, position: FloatArray) -> float:
    """The best of eight octaves' mean coherence of input and velocity."""
    length = int(2 ** np.floor(np.log2(voltage.size / 16)))
    frequency, value = scipy.signal.coherence(voltage[:-1], np.diff(position), sampling_rate, nperseg=length)
    octave = np.floor(np.log2(np.maximum(frequency, frequency[1]) / frequency[-1])).astype(np.int64)
    means = [float(np.nanmean(np.nan_to_num(value[octave == k]))) for k in range(-8, 0) if int(np.sum(octave == k)) >= 4]
    return max(means, default=0.0)


def _judged(data: AxisData, ladder: Ladder, library: Library, tolerance: float, certainty: float) -> Diagnosis:
    base, final = ladder.steps[0].fit, ladder.final
    tried = ladder.steps[1].tried if len(ladder.steps) > 1 else ladder.rejected
    where = _where(data, base)
    if base.excess < AT_FLOOR and not ladder.effects:
        text = f"Nothing is missing: the rigid model with delay leaves {_mm(base.held_out_error)} mm/s, the floor is {_mm(base.noise_floor)} mm/s."
        return Diagnosis("nothing_missing", (), certainty, tolerance, text, ladder, tried, where, "None is needed.")
    names = _ordered(data, ladder)
    gone = 1.0 - final.excess / base.excess if base.excess > 0.0 else 0.0  # an effect may be found in the noise of a base at the floor
    fall = f"the held-out error falls from {_mm(base.held_out_error)} to {_mm(final.held_out_error)} mm/s (floor {_mm(final.noise_floor)})"
    if names and ladder.explained:
        runner = _runner_up(tried, names, library)
        confidence = certainty * (1.0 - math.exp(-max(_gap(ladder, runner), 0.0) / CLEAR))
        confidence *= FAINT if ladder.faint else 1.0
        down_to = "" if tolerance == TOLERANCES[0] else f", which explains it down to {100 * tolerance:.2g} %"
        sentence = f"Missing: {' and '.join(names)}{down_to}; {fall}."
        if runner is not None and runner.fit is not None:
            sentence += f" Runner-up {runner.effect} leaves {_mm(runner.fit.held_out_error)} mm/s."
        return Diagnosis("missing_effect", names, confidence, tolerance, sentence, ladder, tried, where, _experiment(names[0], library))
    if names and gone >= EXPLAINS:
        sentence = f"{' and '.join(names)} explain most of the error, but a rest is not in the library; {fall}."
        return Diagnosis("not_in_library", names, 0.5 * certainty, tolerance, sentence, ladder, tried, where, _experiment(names[0], library))
    sentence = f"Not in the library: no effect brings the error to the floor; at best {fall}."
    return Diagnosis("not_in_library", (), certainty * (1.0 - max(gone, 0.0)), tolerance, sentence, ladder, tried, where, _UNKNOWN)


def _ordered(data: AxisData, ladder: Ladder) -> tuple[str, ...]:
    """The effects that remain, first the one whose absence would change the motion most, all else as it is.

    Where only one-step prediction can judge the model: change the prediction most.
    """
    final = ladder.final
    if len(ladder.effects) < 2:
        return ladder.effects

    def change(name: str) -> float:
        if final.model.ahead:
            return change_without(data, final.model, name)
        without = simulate(final.model.without(name), data.sampling_rate, data.voltage, data.position)
        return float(np.sum(data.layout.power(data.layout.spectrum(without - final.simulated))))

    return tuple(sorted(ladder.effects, key=change, reverse=True))


_UNKNOWN = "Look at where the model fails, then excite only there: half and double the amplitude, another part of the travel, one direction."


def _where(data: AxisData, fitted: GreyboxFit) -> Comparison | None:
    held = slice(data.training, None)
    try:
        return compare_velocity(fitted.simulated[held], data.voltage[held], data.position[held], data.sampling_rate)
    except BadInput:
        return None


def _runner_up(tried: tuple[Candidate, ...], names: tuple[str, ...], library: Library) -> Candidate | None:
    """The best other candidate, not counting richer relatives that contain the chosen effect."""
    families = {library[name].family for name in names if library[name].family}
    others = [
        c for c in tried if c.fit is not None and c.effect not in names and not (library[c.effect].family in families and library[c.effect].family)
    ]
    return others[0] if others else None


def _gap(ladder: Ladder, runner: Candidate | None) -> float:
    if runner is None or runner.fit is None:
        return 10.0
    first = runner.fit.excess - ladder.steps[1].fit.excess
    return first if first > 0.0 else runner.fit.excess - ladder.final.excess  # of two at once, the first alone need not lead


def _experiment(name: str, library: Library) -> str:
    effect = library[name]
    return f"To tell it from {', '.join(effect.look_alikes)}: {effect.experiment}." if effect.look_alikes else f"{effect.experiment}."


def _mm(value: float) -> str:
    return f"{1e3 * value:.3g}"
