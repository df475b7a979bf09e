"""Fitting an axis model to a recording: the base alone, or with chosen effects, all parameters together.

First on the first 14 s, where a step is quick, then on two thirds of the record; the last third is held out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.axis_model import FINE, STANDARD, AxisModel, Library, sample_velocity, simulator
from xy_sysid.base_start import base_start
from xy_sysid.effects import Effect, Parameter, Scene
from xy_sysid.errors import BadInput
from xy_sysid.inverse_start import inverse_starts
from xy_sysid.spectral_cost import Bands, Floor, bands, encoder_noise, excess, floor
from xy_sysid.stream import FloatArray
from xy_sysid.traces import Trace, bounded, screen
from xy_sysid.velocity_fit import Round, Scale, Solution, solve

FIRST = 14.0  # s of the first stage
TRAINING = 2.0 / 3.0  # of the record; the rest is held out
BRIEF = (Round(6, 1e-2), Round(6, 3e-3), Round(8, 1e-4))  # weights are worked out before each round
LONG = (Round(4, 1e-3), Round(6, 1e-5))
COARSE, MIDDLING = 2000.0, 4000.0  # Hz: sub-steps of first rounds (errors up to 3e-3 of the motion) and of brief fits (6e-4)
EPSILON = 1e-3  # of the signal that a model may leave (the next rungs of the ladder are 1 % and 3 %)
Z95 = 1.959964


@dataclass(frozen=True, slots=True)
class AxisData:
    """One axis of a recording without gaps, ready to be fitted, with what its data allow.

    voltage, position: (n,) V and m; velocity: (n - 1,) mean of each sample, m/s; training, first: samples of the two stages
    """

    sampling_rate: float
    voltage: FloatArray
    position: FloatArray
    velocity: FloatArray
    layout: Bands
    training: int
    first: int
    floor: Floor
    held_floor: Floor

    @property
    def noise_floor(self) -> float:
        """rms of the least held-out error, m/s."""
        return _rms(self.layout, self.held_floor.power)


def prepare(sampling_rate: float, voltage: FloatArray, position: FloatArray, epsilon: float = EPSILON) -> AxisData:
    """One axis for fitting. Raises BadInput for less than 256 samples or arrays that do not fit together."""
    if voltage.shape != position.shape or voltage.ndim != 1:
        raise BadInput("shape of voltage and position", f"{voltage.shape} and {position.shape}", "one and the same (n,)", "Give one axis.")
    if voltage.size < 256:
        raise BadInput("number of samples", voltage.size, "256 or more", "Record for longer.")
    if not (np.all(np.isfinite(voltage)) and np.all(np.isfinite(position))):
        raise BadInput("samples", "not finite", "finite numbers", "Remove what is not a number.")
    velocity = sample_velocity(sampling_rate, position)
    training = int(TRAINING * velocity.size)
    first = min(int(FIRST * sampling_rate), training)
    layout = bands(sampling_rate, first)
    encoder = encoder_noise(sampling_rate, position)
    return AxisData(
        sampling_rate,
        voltage,
        position,
        velocity,
        layout,
        training,
        first,
        floor(layout, velocity[:training], encoder, epsilon),
        floor(layout, velocity[training:], encoder, epsilon),
    )


def loosened(data: AxisData, epsilon: float) -> AxisData:
    """The same axis with another tolerance."""
    encoder, velocity = data.floor.encoder, data.velocity
    return replace(
        data,
        floor=floor(data.layout, velocity[: data.training], encoder, epsilon),
        held_floor=floor(data.layout, velocity[data.training :], encoder, epsilon),
    )


@dataclass(frozen=True, slots=True)
class Estimate:
    """One parameter with its 95 % interval."""

    name: str
    value: float
    unit: str
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class GreyboxFit:
    """An axis model fitted to data.

    parameters:     gain, delay, pole, then ``effect.parameter``, with 95 % intervals
    training_error: rms on the data of the fit, below the top band, m/s
    held_out_error: the same on the last third, which no fit saw
    noise_floor:    the least that this could be, m/s
    excess:         mean ln(power of the held-out error / floor) over the excited bands; 0 is nothing left
    simulated:      (n - 1,) velocity over the whole record, m/s; error: (n - 1,) measured minus simulated
    """

    model: AxisModel
    parameters: tuple[Estimate, ...]
    training_error: float
    held_out_error: float
    noise_floor: float
    excess: float
    simulated: FloatArray
    error: FloatArray
    runs: int
    converged: bool

    def parameter(self, name: str) -> Estimate:
        """The parameter of this name; raises BadInput."""
        for item in self.parameters:
            if item.name == name:
                return item
        raise BadInput("parameter", repr(name), ", ".join(item.name for item in self.parameters), "Choose one of these.")


def excess_of(data: AxisData, fitted: GreyboxFit) -> float:
    """What a fit leaves on the held-out data, against the floor of ``data``."""
    return excess(data.layout, fitted.error[data.training :], data.held_floor)


def fit_base(data: AxisData, library: Library = STANDARD) -> GreyboxFit:
    """Gain, delay and pole without a start value."""
    gain, delay, pole = base_start(data.sampling_rate, data.voltage[: data.first], data.velocity[: data.first])
    return fit(data, AxisModel(gain, delay, pole, library=library))


def fit_with(
    data: AxisData,
    base: GreyboxFit,
    names: Iterable[str],
    starts: Mapping[str, tuple[float, ...]] | None = None,
    brief: bool = False,
    hopeless: float = np.inf,
) -> GreyboxFit:
    """The model of ``base`` with more effects, all refitted together; starts: their first values, else read from the data.

    brief: on the first stage's data only, and no longer than a first round if that leaves more excess than ``hopeless``
    """
    model = base.model
    for name in names:
        values = (starts or {}).get(name)
        model = _begun(data, base, model, name) if values is None else model.with_effect(name, bounded(model.library[name], values))
    return fit(data, model, brief, hopeless)


def fit_instead(data: AxisData, base: GreyboxFit, own: str, name: str, brief: bool = False, hopeless: float = np.inf) -> GreyboxFit:
    """The model of ``base`` with the effect ``name`` in the place of its relative ``own``, all refitted together.

    Where ``own`` is the sum of others and one of these is the relative, the rest of them stay.
    """
    library = base.model.library
    model = base.model if library[own].family == library[name].family and not library[own].sum_of else base.model.taken_apart(own)
    place = next(key for key, _ in model.effects if library[key].family == library[name].family)
    known = dict(zip(library[place].names, dict(model.effects)[place], strict=True))
    rest, effect = model.without(place), library[name]
    starts = (look(data, base, [effect])[0].values, effect.typical)
    shared = [tuple(known.get(key, value) for key, value in zip(effect.names, start, strict=True)) for start in starts]
    candidates = [rest.with_effect(name, bounded(effect, values)) for values in shared]
    return fit(data, min(candidates, key=lambda candidate: _misfit(data, candidate)), brief, hopeless)


def _begun(data: AxisData, base: GreyboxFit, model: AxisModel, name: str) -> AxisModel:
    """The model with one more effect, its start read from the data: the best of trace, inverse and joint starts."""
    effect = model.library[name]
    candidates = [model.with_effect(name, look(data, base, [effect])[0].values)]
    scene = _scene(data, base)
    for gain, pole, values in inverse_starts(effect, scene, data.first):
        whole = replace(model, gain=gain, pole=min(max(pole, 1e-2), 1e5))
        candidates.append(whole.with_effect(name, bounded(effect, values)))
    if effect.joint is not None:
        for gain, later, pole, values in effect.joint(scene):
            whole = replace(model, gain=gain, delay=max(base.model.delay + later, 0.0), pole=min(max(pole, 1e-2), 1e5))
            candidates.append(whole.with_effect(name, bounded(effect, values)))
    return min(candidates, key=lambda candidate: _misfit(data, candidate))


def _misfit(data: AxisData, model: AxisModel) -> float:
    """Excess over the first stage's data, without a fit, plus ln(power of the whole error / floor).

    The second part is for real machines, whose small errors in many high bands would else hide a large one in a few low
    bands: on EMPS it chooses the valley with the true friction.
    """
    run, values, _ = _problem(data, model, data.first, COARSE)
    error = data.velocity[: data.first] - run(values)
    whole = _rms(data.layout, data.layout.power(data.layout.spectrum(error))) / _rms(data.layout, data.floor.power)
    return excess(data.layout, error, data.floor) + 2.0 * float(np.log(max(whole, 1e-6)))


def look(data: AxisData, fitted: GreyboxFit, effects: Iterable[Effect]) -> list[Trace]:
    """What each effect would explain of the error of a fit, best first, with start values."""
    model, n = fitted.model, data.training
    run, values, scale = _problem(data, model, n, COARSE)
    inner = scale.inner(values)
    here, nuisance = run(values), []
    for k in range(values.size):
        moved = inner.copy()
        moved[k] += 1e-4
        nuisance.append(run(scale.outer(moved)) - here)
    return screen(effects, _scene(data, fitted), np.array(nuisance), data.layout, data.floor, data.first)


def _scene(data: AxisData, fitted: GreyboxFit) -> Scene:
    model, n = fitted.model, data.training
    return Scene(
        data.sampling_rate,
        model.gain,
        model.pole,
        _delayed(data.voltage[: n + 1], model.delay * data.sampling_rate)[:n],
        data.velocity[:n],
        0.5 * (data.position[1 : n + 1] + data.position[:n]),
        fitted.error[:n],
    )


def fit(data: AxisData, start: AxisModel, brief: bool = False, hopeless: float = np.inf) -> GreyboxFit:
    """All parameters of a model, from where it is; brief, hopeless: see ``fit_with``."""
    run, values, scale = _problem(data, start, data.first, COARSE)
    velocity = data.velocity[: data.first]
    found = solve(run, velocity, data.layout, data.floor, scale, values, BRIEF[:1])
    if not (brief and excess(data.layout, velocity - run(found.values), data.floor) > hopeless):
        run, _, _ = _problem(data, start, data.first, MIDDLING)
        more = solve(run, velocity, data.layout, data.floor, scale, found.values, BRIEF[1:])
        found = replace(more, runs=found.runs + more.runs)
    if not brief:
        return finish(data, _model(start, found.values), found.runs)
    return _result(data, start, scale, found, found.runs)


def finish(data: AxisData, start: AxisModel, runs: int = 0) -> GreyboxFit:
    """The second stage alone, on all of the training data, from a model that is nearly there."""
    run, values, scale = _problem(data, start, data.training)
    found = solve(run, data.velocity[: data.training], data.layout, data.floor, scale, values, LONG)
    return _result(data, start, scale, found, runs + found.runs)


def _result(data: AxisData, start: AxisModel, scale: Scale, found: Solution, runs: int) -> GreyboxFit:
    model = _model(start, found.values)
    run, _, _ = _problem(data, start, data.velocity.size)
    simulated = run(found.values)
    error = data.velocity - simulated
    held = error[data.training :]
    inner, spread = scale.inner(found.values), Z95 * np.sqrt(np.diag(found.covariance))
    wide = Scale(np.where(scale.positive, scale.low, -np.inf), np.full_like(scale.high, np.inf), scale.positive, scale.unit)
    low, high = wide.outer(inner - spread), np.where(np.isinf(spread), np.inf, wide.outer(inner + spread))
    units = ["m/s/V", "s", "rad/s", *(item.unit for name, _ in model.effects for item in model.library[name].parameters)]
    estimates = tuple(
        Estimate(name, value, unit, float(min(a, b)), float(max(a, b)))
        for (name, value), unit, a, b in zip(model.values().items(), units, low, high, strict=True)
    )
    return GreyboxFit(
        model,
        estimates,
        _rms(data.layout, data.layout.power(data.layout.spectrum(error[: data.training]))),
        _rms(data.layout, data.layout.power(data.layout.spectrum(held))),
        data.noise_floor,
        excess(data.layout, held, data.held_floor),
        simulated,
        error,
        runs,
        found.converged,
    )


def _problem(data: AxisData, model: AxisModel, samples: int, fine: float = FINE) -> tuple[Callable[[FloatArray], FloatArray], FloatArray, Scale]:
    """Simulation of the first samples in sub-steps of ``fine`` Hz, the model's parameters as a row, and how each may move."""
    names = [name for name, _ in model.effects]
    run = simulator(model.library, names, data.sampling_rate, data.voltage[: samples + 1], data.position[: samples + 1], fine)
    items = [item for name in names for item in model.library[name].parameters]
    values = np.array([model.gain, model.delay, model.pole, *(value for _, row in model.effects for value in row)])
    scale = Scale(
        np.array([-np.inf, 0.0, 1e-2, *(item.low for item in items)]),
        np.array([np.inf, max(data.first / data.sampling_rate / 4.0, model.delay), 1e5, *(item.high for item in items)]),
        np.array([False, False, True, *(item.positive for item in items)]),
        np.array([abs(model.gain) or 1.0, 20.0 / data.sampling_rate, 1.0, *(unit_of(item) for item in items)]),
    )
    return run, values, scale


def unit_of(item: Parameter) -> float:
    """Size of 1 in a solver, for a parameter that is not fitted as a logarithm."""
    return abs(item.typical) or min(1.0, item.high - item.low)


def _model(start: AxisModel, values: FloatArray) -> AxisModel:
    rest = iter(values[3:].tolist())
    effects = tuple((name, tuple(next(rest) for _ in row)) for name, row in start.effects)
    return replace(start, gain=float(values[0]), delay=float(values[1]), pole=float(values[2]), effects=effects)


def _delayed(voltage: FloatArray, samples: float) -> FloatArray:
    """Mean over each sample of the voltage that many samples ago, before the start 0."""
    whole = int(samples)
    part = samples - whole
    padded = np.concatenate((np.zeros(whole + 1), voltage))
    return np.asarray(part * padded[: voltage.size] + (1.0 - part) * padded[1 : voltage.size + 1])


def _rms(layout: Bands, power: FloatArray) -> float:
    lines = np.bincount(layout.band, minlength=layout.count)
    return float(np.sqrt(np.sum(lines * power) * 2.0 / layout.length))
