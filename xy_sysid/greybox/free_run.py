"""Fits of an axis model by free simulation: the base alone or with effects, all parameters together.

A screening fit uses the data of the first stage; a full fit uses all windows that are not held out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from xy_sysid.axis.linear_part import sections
from xy_sysid.axis.model import FINE, STANDARD, AxisModel, Library, undoer
from xy_sysid.effects import Effect, Scene
from xy_sysid.effects._contract import in_time
from xy_sysid.errors import BadInput
from xy_sysid.greybox.axis_data import EPSILON, AxisData, prepare, prepare_all
from xy_sysid.greybox.forces import dry_frictions, force_of, friction_of, position_forces
from xy_sysid.greybox.least_squares import Scale, Schedule, Solution, Target, solve
from xy_sysid.greybox.objective import Objective
from xy_sysid.greybox.parameters import FitProblem, estimates, model_of, problem
from xy_sysid.greybox.score_test import Screen, Trace, bounded, screen
from xy_sysid.greybox.start_inverse import CUTOFFS, inverse_starts, rigid_starts
from xy_sysid.greybox.start_rigid import base_start
from xy_sysid.jit import on_all_cores
from xy_sysid.response.estimate import Estimate
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import USUAL, Units

__all__ = [
    "EPSILON",
    "AxisData",
    "Estimate",
    "GreyboxFit",
    "finish",
    "fit",
    "fit_base",
    "fit_with",
    "look",
    "prepare",
    "prepare_all",
    "screened",
]

POLES = (1e-2, 1e5)  # rad/s: of a start
LEAST_TIMES, MOST_TIMES = 0.3, 3.0  # between these a start multiplies a force that is known

FIRST_LOOK = Schedule(1, 6, 1e-2, 1e-2)
NEARER = Schedule(4, 6, 3e-3, 3e-3)
FINER = Schedule(2, 8, 1e-4, 1e-3)
LONG = Schedule(3, 6, 1e-5, 1e-4)
COARSE, MEDIUM = 2000.0, 4000.0  # Hz: finest sub-steps of score tests and first rounds (errors up to 3e-3 of the motion); of screening fits (6e-4)
LEAST_EXPLAINED = 0.01  # of the residual voltage: an effect that explains less is not simulated before a fit. In 14 s below 10 Hz chance
# explains half of this
LATE = 1.0 / (4.0 * CUTOFFS[-1])  # s; a longer delay, if wrong, hides all traces: a quarter of the shortest period that inverse starts use
FAITHFUL = 0.1  # allowed change of a model's motion with finer sub-steps, relative to its error


@dataclass(frozen=True, slots=True)
class GreyboxFit:
    """An axis model fitted to data.

    parameters:     gain, delay, pole, then ``effect.parameter``, with 95 % intervals
    training_error: rms in the windows of the fit, below the top band, m/s
    held_out_error: the same in the held-out windows
    noise_floor:    encoder noise together with the tolerated part of the motion, m/s; for one-step prediction, encoder noise alone
    excess:         score of the held-out error, nats a line above the floor (``objective``); scores: (windows,) nats of each window
    forced:         lines of a window in which the unmodelled force exceeds the floor
    force:          rms of the unmodelled force (white), V per sample, that explains the held-out error above the floor
    simulated:      (n - r,) velocity over all recordings, m/s; error: (n - r,) measured minus simulated
    held_out_powers: (windows, bands) power of the held-out error, m^2/s^2
    units:          of input and output; m/s above is ``units.speed``
    is_screening:   True for a screening fit: it uses the data of the first stage; errors and simulation cover these data only
    one_step:       True if judged by one-step prediction, not by simulation; errors are then those of the prediction
    """

    model: AxisModel
    parameters: tuple[Estimate, ...]
    training_error: float
    held_out_error: float
    noise_floor: float
    excess: float
    scores: FloatArray
    forced: float
    force: float
    simulated: FloatArray
    error: FloatArray
    runs: int
    converged: bool
    held_out_powers: FloatArray
    is_screening: bool = False
    one_step: bool = False
    units: Units = USUAL

    @property
    def power(self) -> FloatArray:
        """(bands,) power of the held-out error, m^2/s^2."""
        return np.asarray(self.held_out_powers.mean(axis=0))

    def parameter(self, name: str) -> Estimate:
        """The parameter of this name; raises BadInput for an unknown name."""
        for item in self.parameters:
            if item.name == name:
                return item
        raise BadInput("parameter", repr(name), ", ".join(item.name for item in self.parameters), "Choose one of these.")


def fit_base(data: AxisData, library: Library = STANDARD) -> GreyboxFit:
    """Gain, delay and pole, from the best start of the frequency response and of inverse dynamics, the latter with and without its delay."""
    gain, delay, pole = base_start(data.sampling_rate, data.first_stage(data.voltage), data.first_stage(data.velocity))
    models = [AxisModel(gain, delay, pole, library=library)]
    for late in {delay, 0.0}:
        scene = _scene(data, AxisModel(gain, late, pole, library=library), data.first_stage(data.velocity), data.first_stage)
        models += [AxisModel(own, late, float(np.clip(its, *POLES)), library=library) for own, its in rigid_starts(scene)]
    return fit(data, best_start(data, models))


def fit_with(
    data: AxisData,
    base: GreyboxFit,
    names: Iterable[str],
    starts: Mapping[str, tuple[float, ...]] | None = None,
    screening: bool = False,
    give_up_above: float = np.inf,
) -> GreyboxFit:
    """The model of ``base`` with more effects, all parameters fitted together; starts: their start values, else determined from the data.

    If the result is worse than ``base``, it is fitted again from ``base`` with a nearly absent new effect.
    screening: make a screening fit. It stops after its first round if its excess is then above ``give_up_above``, nats a line.
    """
    model = base.model
    for name in names:
        values = (starts or {}).get(name)
        if values is None:
            model = _with_best_start(data, base, model, name)
        else:
            model = model.with_effect(name, bounded(model.library[name], values, data.similar))
    found = fit(data, model, screening, give_up_above)
    return found if screening else never_worse(data, base, found)


def never_worse(data: AxisData, base: GreyboxFit, found: GreyboxFit) -> GreyboxFit:
    """A fit with more effects than ``base``; if it is worse, the better of it and one from ``base`` with nearly absent new effects."""
    if fitted_score(data, found) <= fitted_score(data, base):
        return found
    absent = base.model
    for name, values in found.model.effects:
        if name not in absent:
            least = absent.library[name].parameters[0].low if absent.library[name].parameters[0].positive else 0.0
            absent = absent.with_effect(name, bounded(absent.library[name], (least, *values[1:]), data.similar))
    return min((found, finish(data, absent)), key=lambda one: fitted_score(data, one))


def fitted_score(data: AxisData, fitted: GreyboxFit) -> float:
    """The objective of a fit in its fitted windows, nats a line."""
    power = data.layout.power(data.fitted.spectrum(fitted.error))
    return Objective.of(data.floor).of_power(np.where(np.isfinite(power), power, np.inf))


def _with_best_start(data: AxisData, base: GreyboxFit, model: AxisModel, name: str) -> AxisModel:
    """The model with one more effect, with the best start values from trace, inverse dynamics and joint start."""
    effect = model.library[name]
    traced = model.with_effect(name, look(data, base, [effect])[0].values)
    return best_start(data, [traced, *inverse_start_models(data, base, model, name)])


def inverse_start_models(
    data: AxisData, base: GreyboxFit, model: AxisModel, name: str, scene: Scene | None = None, least: float = 0.0
) -> list[AxisModel]:
    """Start models with one more effect: by inverse dynamics, and with joint start values of base and effect.

    scene: of the base and the first stage's data, if it is known; least: see ``inverse_starts``
    """
    effect, scene = model.library[name], scene or scene_of(data, base)
    candidates = _from_inverse_dynamics(data, model, effect, scene, least)
    if scene.prompt is not None:
        candidates += _from_inverse_dynamics(data, replace(model, delay=0.0), effect, scene.prompt, least)
    if effect.joint is not None:
        for gain, later, pole, values in effect.joint(scene):
            whole = replace(model, gain=gain, delay=max(base.model.delay + later, 0.0), pole=float(np.clip(pole, *POLES)))
            candidates.append(whole.with_effect(name, bounded(effect, values, data.similar)))
    return candidates


def _from_inverse_dynamics(data: AxisData, model: AxisModel, effect: Effect, scene: Scene, least: float) -> list[AxisModel]:
    """Start models with one more effect by inverse dynamics, from a scene with the delay of the model."""
    name, candidates, known = effect.name, [], _friction_split(model)
    by_position, frictions = [own for own in position_forces(known) if own != name], [own for own in dry_frictions(known) if own != name]
    amplified = [own for own, _ in known.effects if known.library[own].category == "input" and own != name]
    if amplified:
        scene = replace(scene, voltage=_amplified(data, known, amplified, data.counts(early=scene.velocity.size == data.first)))
    forces = [force_of(data, known, own, data.counts(early=scene.velocity.size == data.first)) for own in by_position]
    forces += [friction_of(scene, known, own) for own in frictions]
    for start in inverse_starts(effect, scene, scene.velocity.size, forces, bool(frictions), least):
        whole = replace(known, gain=start.gain, pole=float(np.clip(start.pole, *POLES)))
        for own, size in zip((*by_position, *frictions), start.sizes, strict=True):
            whole = whole.with_effect(own, bounded(known.library[own], _scaled(known, own, size), data.similar))
        whole = whole if known is model else whole.joined()
        if all(own in whole for own, _ in model.effects):
            candidates.append(whole.with_effect(name, start.values))
    return candidates


def has_inverse_starts(model: AxisModel) -> bool:
    """True if inverse dynamics can include every effect of a model: position forces, dry friction, and effects of category input."""
    known = {*position_forces(model), *dry_frictions(model), *(name for name, _ in model.effects if model.library[name].category == "input")}
    return all(name in known for name, _ in model.effects)


def _amplified(data: AxisData, model: AxisModel, names: list[str], counts: Sequence[int]) -> FloatArray:
    """(samples,) V, the delayed voltage after some effects of category input; counts: samples of each recording."""
    row = np.array([model.gain, model.delay, model.pole, *(value for name in names for value in dict(model.effects)[name])])
    parts = []
    for run, count in zip(data.runs, counts, strict=True):
        undo = undoer(model.library, names, data.sampling_rate, data.voltage[run], data.position[run])
        parts.append(_delayed(undo(row, count)[0], model.delay * data.sampling_rate))
    return np.concatenate(parts)


def _friction_split(model: AxisModel) -> AxisModel:
    """The model with a friction law that equals a sum of effects replaced by these effects, so that each has its own size."""
    whole = [own for own in dry_frictions(model) if model.library[own].sum_of is not None]
    return model.apart(whole[0]) if whole else model


def _scaled(model: AxisModel, name: str, times: float) -> tuple[float, ...]:
    """The values of an effect whose force is multiplied by ``times``, at most by ``MOST_TIMES``: its size, and every other level of a friction.

    A size of either sign may become 0 or negative; a positive size is multiplied by at least ``LEAST_TIMES``.
    """
    items, values = model.library[name].parameters, dict(model.effects)[name]
    levels = [k == 0 or (model.library[name].is_dry and item.unit == items[0].unit) for k, item in enumerate(items)]
    size = min(max(times, LEAST_TIMES if items[0].positive else -MOST_TIMES), MOST_TIMES)
    return tuple(value * (size if level else 1.0) for value, level in zip(values, levels, strict=True))


def best_start(data: AxisData, candidates: list[AxisModel]) -> AxisModel:
    """The candidate with the least score on the data of the first stage, without a fit."""
    if len(candidates) == 1:
        return candidates[0]
    scores = on_all_cores(partial(first_excess, data), candidates)
    return candidates[scores.index(min(scores))]


def first_excess(data: AxisData, model: AxisModel) -> float:
    """Score over the first stage's data, without a fit."""
    task = problem(data, model, True)
    run, values = task.at(COARSE), task.row
    power = data.layout.power(data.screening_windows.spectrum(data.first_stage(data.velocity) - run(values)))
    power = np.where(np.isfinite(power), power, np.inf)
    return Objective.of(data.floor).of_power(power)


def look(data: AxisData, fitted: GreyboxFit, effects: Iterable[Effect]) -> list[Trace]:
    """The part of the error of a fit that each effect would explain, best first, with start values."""
    return list(screened(data, fitted, effects).traces)


def screened(data: AxisData, fitted: GreyboxFit, effects: Iterable[Effect], scene: Scene | None = None) -> Screen:
    """The score test of effects on the residual error of a fit, alone and together; scene: of the first stage's data (None), or of all."""
    scene = scene or scene_of(data, fitted)
    early = scene.velocity.size == data.first
    task = problem(data, fitted.model, early)
    run, values, scale = task.at(COARSE), task.row, task.scale
    inner = scale.inner(values)
    here = run(values)
    nuisance = on_all_cores(lambda step: run(scale.outer(inner + step)) - here, 1e-4 * np.eye(values.size))
    return screen(effects, scene, np.array(nuisance), data.screening_windows if early else data.fitted, data.floor)


def scene_of(data: AxisData, fitted: GreyboxFit, early: bool = True) -> Scene:
    """The measured motion of the first stage, or of all data, as input to the traces of effects."""
    model, part = fitted.model, data.first_stage if early else np.asarray
    scene = _scene(data, model, fitted.error if fitted.is_screening else part(fitted.error), part)
    prompt = _scene(data, replace(model, delay=0.0), scene.error, part)
    return replace(scene, prompt=prompt) if model.delay > LATE else scene


def _scene(data: AxisData, model: AxisModel, error: FloatArray, part: Callable[[FloatArray], FloatArray]) -> Scene:
    voltage = np.concatenate([_delayed(data.voltage[run], model.delay * data.sampling_rate)[:-1] for run in data.runs])
    return Scene(
        sampling_rate=data.sampling_rate,
        gain=model.gain,
        pole=model.pole,
        voltage=part(voltage),
        velocity=part(data.velocity),
        position=part(data.middle()),
        error=error,
        recordings=data.counts(part is not np.asarray),
        sections=sections(model, data.sampling_rate),
    )


def fit(data: AxisData, start: AxisModel, screening: bool = False, give_up_above: float = np.inf, late: Callable[[], bool] = in_time) -> GreyboxFit:
    """Fit all parameters from the values of ``start``; screening, give_up_above: see ``fit_with``; late: True to end with the best result so far."""
    task = problem(data, start, True)
    rate = sub_steps(data, task, COARSE)
    run, scale = task.at(rate), task.scale
    target = Target(data.first_stage(data.velocity), data.screening_windows, data.floor)
    found = solve(run, target, scale, task.row, replace(FIRST_LOOK, late=late))
    if not (late() or (screening and found.score > give_up_above)):
        nearer = solve(run, target, scale, found.values, replace(NEARER, late=late), found)
        finer = sub_steps(data, problem(data, model_of(data, start, nearer.values), True), MEDIUM)
        if finer != rate:
            run = task.at(finer)
        more = solve(run, target, scale, nearer.values, replace(FINER, late=late), nearer)
        found = replace(more, runs=found.runs + nearer.runs + more.runs)
    if not screening:
        return finish(data, model_of(data, start, found.values), found.runs, late)
    return _result(data, start, scale, found, screening=True)


def finish(data: AxisData, start: AxisModel, runs: int = 0, late: Callable[[], bool] = in_time) -> GreyboxFit:
    """Only the second stage of a fit, on all windows that are not held out, from a model close to the result."""
    task = problem(data, start, False)
    run = task.at(sub_steps(data, task, FINE))
    found = solve(run, Target(data.velocity, data.fitted, data.floor), task.scale, task.row, replace(LONG, late=late))
    return _result(data, start, task.scale, replace(found, runs=runs + found.runs))


def joined(data: AxisData, found: GreyboxFit, late: Callable[[], bool] = in_time) -> GreyboxFit:
    """The fit with several effects merged into one law that is their sum; the given fit if that is worse (a load larger than the friction)."""
    whole = found.model.joined()
    if whole is found.model:
        return found
    one = finish(data, whole, late=late)
    return one if float(np.sum(one.scores)) < float(np.sum(found.scores)) + 1.0 else found


def sub_steps(data: AxisData, task: FitProblem, finest: float) -> float:
    """Hz, rate of the longest sub-steps (a sample, its half, ...) whose motion hardly differs from that with half as long ones.

    The difference may be a tenth of the error or of the noise floor, in amplitude, averaged over the excited bands.
    """
    rate = min(data.sampling_rate, finest)
    if rate == finest:
        return rate
    windows, measured = (data.screening_windows, data.first_stage(data.velocity)) if task.early else (data.fitted, data.velocity)

    def moved(rate: float) -> FloatArray:
        return task.at(rate)(task.row)

    def power(signal: FloatArray) -> FloatArray:
        return data.layout.power(windows.spectrum(signal))[data.floor.excited]

    now, least = moved(rate), data.floor.power[data.floor.excited]
    while rate < finest:
        finer = min(2.0 * rate, finest)
        then = moved(finer)
        with np.errstate(over="ignore", invalid="ignore"):  # a diverging model, for which no step is short enough
            apart = float(np.mean(power(then - now) / (power(measured - then) + least)))
        if not apart > FAITHFUL**2:
            break
        rate, now = finer, then
    return rate


def _result(data: AxisData, start: AxisModel, scale: Scale, found: Solution, screening: bool = False) -> GreyboxFit:
    model = model_of(data, start, found.values)
    task = problem(data, model, screening)
    simulated = task.at(MEDIUM if screening else FINE)(task.row)
    error = (data.first_stage(data.velocity) if screening else data.velocity) - simulated
    fitted, judging = (data.screening_windows, data.first_windows()) if screening else (data.fitted, data.held_out)
    held = data.layout.powers(judging.spectrum(error))
    objective = Objective.of(data.floor)
    expected = objective.spectrum(held.mean(axis=0))
    return GreyboxFit(
        model=model,
        parameters=estimates(data, model, scale, found),
        training_error=data.layout.rms(data.layout.power(fitted.spectrum(error))),
        held_out_error=data.layout.rms(held.mean(axis=0)),
        noise_floor=data.noise_floor,
        excess=objective.score(held.mean(axis=0), expected),
        scores=objective.each(held, expected),
        forced=objective.forced(expected),
        force=math.sqrt(objective.unmodelled(held.mean(axis=0))[0]),
        simulated=simulated,
        error=error,
        runs=found.runs,
        converged=found.converged,
        held_out_powers=held,
        is_screening=screening,
        units=data.units,
    )


def _delayed(voltage: FloatArray, samples: float) -> FloatArray:
    """Mean over each sample of the voltage delayed by ``samples``; 0 before the start."""
    whole = int(samples)
    part = samples - whole
    padded = np.concatenate((np.zeros(whole + 1), voltage))
    return np.asarray(part * padded[: voltage.size] + (1.0 - part) * padded[1 : voltage.size + 1])
