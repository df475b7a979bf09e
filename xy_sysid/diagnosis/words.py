"""The sentences of an answer: its verdict, what each candidate leaves, why the runner-up lost, and what the named effect can be taken for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xy_sysid.axis.model import Library
from xy_sysid.diagnosis.answer import Answer, LookAlike, Tried
from xy_sysid.diagnosis.equal_laws import equals, likelihood
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.hypotheses.criteria import AT_FLOOR, DOUBTFUL
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import bare, moved


def missing(data: AxisData, found: Answer, unsure: Sequence[str], with_all: float) -> str:
    """These effects are missing. unsure: effects that may be missing, too; with_all: the confidence if they are named as well."""
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


def nothing_missing(data: AxisData, base: GreyboxFit, input_noise: float | None, hides: float) -> str:
    """The base suffices. input_noise: rms, that would leave what it leaves, None at the floor; hides: part of the motion that could hide in it."""
    unit = data.units.judged
    why = f"at the noise floor ({moved(base.noise_floor, unit)})"
    if input_noise is not None:
        why = f"what white noise of {input_noise:.3g} {data.units.input} rms on the input would leave"
    said = f"Nothing is missing: the rigid model with delay leaves {moved(base.held_out_error, unit)}, which is {why}."
    return f"{said} What changes the motion by less than {percent(hides)} could hide in it."


def not_in_library(data: AxisData, found: Answer) -> str:
    """No effect explains what the base leaves."""
    base, names, unit = found.base, found.best, data.units.judged
    beyond, motion = data.layout.rms(_beyond_noise(data, base)), max(data.layout.rms(data.floor.motion), 1e-300)
    said = f"Not in the library: no effect explains what the rigid model leaves ({moved(base.held_out_error, unit)}). Beyond the encoder's "
    said += f"noise that is {moved(beyond, unit)}, {percent(beyond / motion)} of the motion{_mostly(data, base)}."
    if found.force is not None:
        low, high = found.force.mostly
        said += f" At the motor that is a force of {moved(found.force.rms, data.units.input)} rms, of {moved(found.force.input, data.units.input)} "
        said += f"of the input, mostly between {low:.3g} and {high:.3g} Hz."
    if names and found.explained > 0.0:
        said += f" At best {listed(names)} {'explain' if len(names) > 1 else 'explains'} {percent(found.explained)} of the error's power."
    return said


def kept_out(found: Answer) -> str:
    """The refused set that would leave least; empty without one."""
    if found.kept_out is None:
        return ""
    names, several = found.kept_out.effects, len(found.kept_out.effects) > 1
    leaves = f"{'would leave' if several else 'alone would leave'} {moved(found.kept_out.rung.held_out_error, found.units.judged)}"
    return f" {listed(names)} {leaves}, and {'are' if several else 'is'} refused: {found.kept_out.refused}."


def not_tried(data: AxisData, found: Answer, library: Library) -> str:
    """Effects that ask for one stretch without a gap, where there are several and something is left to explain; empty otherwise."""
    names = [effect.name for effect in library.acting if effect.one_step is not None]
    if len(data.starts) < 2 or not names or found.final.excess < AT_FLOOR:
        return ""
    return (
        f" {listed(names)} {'was' if len(names) == 1 else 'were'} not tried: that takes one stretch without a gap, and there are {len(data.starts)}."
    )


def experiment(name: str, library: Library) -> str:
    """What distinguishes an effect from those that it can be taken for."""
    effect = library[name]
    return f"To tell it from {', '.join(effect.look_alikes)}: {effect.experiment}." if effect.look_alikes else f"{effect.experiment}."


def evidence(found: Answer, item: Tried) -> str:
    """What speaks for and against one candidate."""
    unit, error = found.units.judged, moved(item.rung.held_out_error, found.units.judged)
    if item.rung.one_step:
        said = f"judged one sample ahead, as no free simulation can tell: with it {error} are left, "
        said += f"the encoder's noise alone is {bare(item.rung.noise_floor, unit)}"
    else:
        said = f"alone it explains {100 * item.explained:.3g} % of the error's power: {bare(found.rungs[0].held_out_error, unit)} -> {error}"
    return f"{said}; it is refused ({item.refused})" if item.refused else said


def runner_up(found: Answer) -> str:
    """Why the best other set of effects was not taken; empty without one."""
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
            text = f"{other}, with more parameters, was not fitted: nothing in these data asks for more than {name}"
        elif rung is None:
            apart, text = True, f"the error has no trace of {other}, or a weak one"
        elif rung.excess > own.excess + AT_FLOOR:
            apart, text = True, f"{other} leaves {moved(rung.held_out_error, unit)}, {name} {bare(own.held_out_error, unit)}"
        elif richer:
            text = f"{other} contains {name} and does as well; nothing in these data asks for more than {name}"
        else:
            text = f"these data cannot tell {name} from {other}"
        alike.append(LookAlike(other, apart, text, library[name].experiment))
    return tuple(alike)


def listed(names: Sequence[str]) -> str:
    """Names in a sentence."""
    return " and ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else "".join(names)


def percent(part: float) -> str:
    """A part in per cent."""
    return f"{100.0 * part:.3g} %"


def _also_called(final: GreyboxFit, names: Sequence[str]) -> str:
    """What has the very law of an effect that is named, and how much likelier that is."""
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
    return f"What is left: {beyond}{part}, beyond the encoder's noise of {noise}{_mostly(data, final)}."


def _mostly(data: AxisData, fit: GreyboxFit) -> str:
    """The frequencies that hold most of the remaining error, in words."""
    power = data.layout.lines * _beyond_noise(data, fit)
    if not float(power.sum()) > 0.0:
        return ""
    edges, share = data.layout.edges(), np.cumsum(power) / power.sum()
    low, high = (int(np.searchsorted(share, at)) for at in (0.1, 0.8))
    return f", mostly between {edges[low]:.3g} and {edges[min(high + 1, edges.size - 1)]:.3g} Hz"


def _beyond_noise(data: AxisData, fit: GreyboxFit) -> FloatArray:
    """(bands,) power of the held-out error beyond the encoder's noise, band by band: noise that one band has less of hides nothing in another."""
    return np.asarray(np.maximum(fit.power - data.floor.noise, 0.0))
