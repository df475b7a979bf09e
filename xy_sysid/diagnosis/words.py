"""The sentences of an answer: verdict, error with each candidate, why the runner-up lost, and look-alikes of the named effect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xy_sysid.axis.model import Library
from xy_sysid.diagnosis.answer import Answer, LookAlike, Tried
from xy_sysid.diagnosis.equal_laws import equals, likelihood
from xy_sysid.diagnosis.unmodelled import main_range
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.greybox.one_step import one_step_effect
from xy_sysid.hypotheses.criteria import AT_FLOOR, DOUBTFUL
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import bare, listed, moved

EPS = float(np.finfo(np.float64).eps)


def missing(data: AxisData, found: Answer, unsure: Sequence[str], with_all: float) -> str:
    """These effects are missing. unsure: effects that may also be missing; with_all: the confidence if they are named as well."""
    names, final, unit = found.best, found.final, data.units.judged
    said = f"Missing: {listed(names)}. {'They explain' if len(names) > 1 else 'It explains'} {percent(found.explained)} of the error's power"
    said += f" ({bare(found.base.held_out_error, unit)} -> {moved(final.held_out_error, unit)}). {_left(data, found)}"
    if unsure:
        said += f" {listed(unsure)} may also be present; with {'it' if len(unsure) == 1 else 'them'} the confidence is {with_all:.2f}."
    said += _also_called(final, names)
    if found.rivals:
        rival = found.rivals[0]
        why = f" (refused, {rival.refused})" if rival.refused else ""
        said += f" Runner-up {found.runner_up}: {moved(rival.rung.held_out_error, unit)}{why}."
    return said


def nothing_missing(data: AxisData, base: GreyboxFit, input_noise: float | None) -> str:
    """Nothing is missing. input_noise: rms of white input noise with the same error, None at the floor."""
    unit = data.units.judged
    why = f"at the noise floor ({moved(base.noise_floor, unit)})"
    if input_noise is not None:
        why = f"the error that white noise of {input_noise:.3g} {data.units.input} rms on the input would cause"
    return f"Nothing is missing: the residual error of the rigid model with delay is {moved(base.held_out_error, unit)}, which is {why}."


def hidden(part: float) -> str:
    """What these data cannot show. part: of the motion."""
    return f" An effect that changes the motion by less than {percent(part)} could be hidden."


def not_in_library(data: AxisData, found: Answer) -> str:
    """No effect explains the error of the rigid model."""
    base, names, unit = found.base, found.best, data.units.judged
    beyond, motion = data.layout.rms(_beyond_noise(data, base)), max(data.layout.rms(data.floor.motion), 1e-300)
    said = f"Not in the library: no effect explains the error of the rigid model ({moved(base.held_out_error, unit)}). "
    said += f"Error above the encoder noise: {moved(beyond, unit)}, {percent(beyond / motion)} of the motion{_mostly(data, base)}."
    if found.force is not None and found.force.rms > EPS * found.force.input:  # a likeliest force of 0 is only approached
        low, high = found.force.mostly
        force, drive = (moved(value, data.units.input) for value in (found.force.rms, found.force.input))
        said += f" This corresponds to an unmodelled force of {force} rms at the motor (input: {drive}), mostly between {low:.3g} and {high:.3g} Hz."
    if names and found.explained > 0.0:
        said += f" At best {listed(names)} {'explain' if len(names) > 1 else 'explains'} {percent(found.explained)} of the error's power."
    return said


def kept_out(found: Answer) -> str:
    """The refused set with the smallest error; empty without one."""
    if found.kept_out is None:
        return ""
    names, several = found.kept_out.effects, len(found.kept_out.effects) > 1
    with_it = f"With {listed(names)}{'' if several else ' alone'} the error would be {moved(found.kept_out.rung.held_out_error, found.units.judged)}"
    return f" {with_it}, but {'they are' if several else 'it is'} refused: {found.kept_out.refused}."


def not_tried(names: tuple[str, ...], longest: float) -> str:
    """Says that effects were not tried, because the longest stretch is too short; empty if all effects were tried. longest: s."""
    if not names:
        return ""
    need = "needs" if len(names) == 1 else "need"
    return f" Not tried: {listed(names)}, which {need} a longer stretch without a gap (the longest is {longest:.3g} s)."


def of_one_stretch(found: Answer, seconds: float) -> str:
    """Says that the answer is about the longest stretch alone; empty if it is about all. seconds: of the longest stretch."""
    needs = one_step_effect(found.final.model)
    if found.stretch is None or needs is None:
        return ""
    return f" {about_longest(needs.name, seconds)}"


def about_longest(name: str, seconds: float) -> str:
    """Says that only the longest stretch, s, is used, because an effect needs one stretch without a gap."""
    return f"This is about the longest stretch alone, {seconds:.3g} s, as {name} needs one without a gap."


def experiment(name: str, library: Library) -> str:
    """The experiment that distinguishes an effect from its look-alikes."""
    effect = library[name]
    return f"To distinguish it from {', '.join(effect.look_alikes)}: {effect.experiment}." if effect.look_alikes else f"{effect.experiment}."


def evidence(found: Answer, item: Tried) -> str:
    """The evidence for and against one candidate."""
    unit, error = found.units.judged, moved(item.rung.held_out_error, found.units.judged)
    if item.rung.one_step:
        said = f"judged one sample ahead, because a free simulation cannot follow it: the error with it is {error}, "
        said += f"encoder noise alone is {bare(item.rung.noise_floor, unit)}"
    else:
        said = f"alone it explains {100 * item.explained:.3g} % of the error's power: {bare(found.rungs[0].held_out_error, unit)} -> {error}"
    return f"{said}; it is refused ({item.refused})" if item.refused else said


def runner_up(found: Answer) -> str:
    """Why the second-best set of effects was not chosen; empty without one."""
    if found.verdict != "missing_effect" or not found.rivals:
        return ""
    rival, name, taken = found.rivals[0], found.runner_up, " and ".join(found.effects)
    if rival.doubt < DOUBTFUL:
        left, right = (moved(rung.held_out_error, found.units.judged) for rung in (rival.rung, found.rungs[-1]))
        return f"with {name} instead of {taken} the held-out error is {left}, not {right}."
    if rival.refused:
        return f"{name} predicts nearly as well as {taken}, but {rival.refused}."
    return f"{name} predicts nearly as well as {taken}: these data hardly distinguish them; the simpler one is taken."


def look_alikes(found: Answer, library: Library) -> tuple[LookAlike, ...]:
    """Effects that can be mistaken for the first named effect, and whether these data distinguish them."""
    rungs, unit = {item.name: item.rung for item in found.candidates}, found.units.judged
    name = found.effect
    if name is None or name not in rungs:
        return ()
    own, alike = rungs[name], []
    for other in library[name].look_alikes:
        if other not in library.effects or library[other].category == "base":
            continue
        rung, richer = rungs.get(other), library[name].is_special_case(library[other])
        apart = False
        if rung is None and richer:
            text = f"{other} has more parameters and was not fitted: these data do not need more than {name}"
        elif rung is None:
            apart, text = True, f"the error shows no trace of {other}, or only a weak one"
        elif rung.excess > own.excess + AT_FLOOR:
            apart, text = True, f"the error with {other} is {moved(rung.held_out_error, unit)}, with {name} {bare(own.held_out_error, unit)}"
        elif richer:
            text = f"{other} contains {name} and predicts as well; these data do not need more than {name}"
        else:
            text = f"these data cannot distinguish {name} from {other}"
        alike.append(LookAlike(other, apart, text, library[name].experiment))
    return tuple(alike)


def percent(part: float) -> str:
    """A part in per cent."""
    return f"{100.0 * part:.3g} %"


def _also_called(final: GreyboxFit, names: Sequence[str]) -> str:
    """Effects whose equations equal those of a named one, and the probability of the name."""
    library, said = final.model.library, ""
    for name, values in final.model.effects:
        others = [other.name for other in equals(library, name) if other.name != name] if name in names else []
        if others:
            sure = percent(round(likelihood(library, name, values), 2))
            said += f" A motor encoder cannot distinguish {name} from {listed(others)}: their equations are the same."
            said += f" Typical values favour {name} ({sure})."
    return said


def _left(data: AxisData, found: Answer) -> str:
    final = found.final
    noise, beyond, least = (moved(value, data.units.judged) for value in (found.noise, found.discrepancy, final.noise_floor))
    if final.excess < AT_FLOOR or not found.discrepancy > 0.0:
        return f"The residual error is at the noise floor ({least})."
    part = "" if final.one_step else f", {percent(found.tolerance)} of the motion"
    return f"Residual error above the encoder noise of {noise}: {beyond}{part}{_mostly(data, final)}."


def _mostly(data: AxisData, fit: GreyboxFit) -> str:
    """The frequency range of most of the residual error, in words."""
    power = data.layout.lines * _beyond_noise(data, fit)
    if not float(power.sum()) > 0.0:
        return ""
    low, high = main_range(data.layout.edges()[:-1], data.layout.edges()[1:], power)
    return f", mostly between {low:.3g} and {high:.3g} Hz"


def _beyond_noise(data: AxisData, fit: GreyboxFit) -> FloatArray:
    """(bands,) power of the held-out error above the encoder noise, band by band: little noise in one band does not offset error in another."""
    return np.asarray(np.maximum(fit.power - data.floor.noise, 0.0))
