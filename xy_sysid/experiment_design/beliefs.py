"""A set of effects with its parameters and their uncertainty, given the present data.

Parameters are Gaussian in the coordinates of the fit (``greybox.least_squares.Scale``: the logarithm of positive ones). Their precision is
the information of the data plus a weak prior: a positive parameter is known to a factor of two before any measurement, and the shape of a
law (parameters that may be zero or negative) to the usual size over the machine's travel. Draws that contradict the data are omitted, and so are
laws that are not valid over the travel (``Effect.refusal``): a short motion hardly determines a shape, and its fit may be absurd farther out.
An effect that is not visible in the data keeps its usual size, if the data allow it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from xy_sysid.axis.model import AxisModel
from xy_sysid.effects import Effect, Parameter
from xy_sysid.effects._similarity import Similarity
from xy_sysid.experiment_design.criteria import ALLOWED, FACTOR, LEAST_SEEN, REACH, STEPS, TRIES
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.floor import Windows
from xy_sysid.greybox.free_run import MEDIUM, GreyboxFit
from xy_sysid.greybox.least_squares import STEP, Scale
from xy_sysid.greybox.objective import Objective
from xy_sysid.greybox.parameters import problem, unit_of
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True)
class Belief:
    """effects: names; model: the most likely one; draws: models that the data allow, ``model`` first
    scale: coordinates of each parameter; precision: (k, k) in these coordinates; free: parameters of the effects
    force, motion: power of the unmodelled force, V^2, and of the unmodelled motion, m^2/s^2
    """

    effects: tuple[str, ...]
    model: AxisModel
    draws: tuple[AxisModel, ...]
    scale: Scale
    precision: FloatArray
    free: int
    force: float
    motion: float

    @property
    def name(self) -> str:
        """The names of the effects in words."""
        return " and ".join(self.effects) or "the rigid model"

    def inner(self, model: AxisModel) -> FloatArray:
        """(k,) coordinates of a model with the same effects."""
        return self.scale.inner(model.row)

    def moved(self, inner: FloatArray) -> AxisModel:
        """The model at these coordinates."""
        return with_row(self.model, self.scale.outer(inner))


class Evidence:
    """How well models explain the present data: in nats over every window, fitted or held out."""

    def __init__(self, data: AxisData, travel: tuple[float, float] | None = None) -> None:
        """travel: (low, high) of the machine, m; None: the range of the data."""
        self.travel = travel
        self.machine = data.similar if travel is None else replace(data.similar, length=0.5 * (travel[1] - travel[0]) / REACH)
        self.data, self.windows = data, Windows(data.layout, np.sort(np.concatenate((data.fitted.begins, data.held_out.begins))))
        self.objective = Objective.of(data.floor)
        self.measured = self.windows.spectrum(data.velocity)

    def sizes(self, effect: Effect) -> list[Parameter]:
        """The effect's parameters: usual sizes from the data, and for shapes from the travel."""
        pairs = zip(effect.on(self.data.similar), effect.on(self.machine), strict=True)
        return [seen if seen.positive else over for seen, over in pairs]

    def valid(self, model: AxisModel) -> bool:
        """True if the model's laws are valid over the travel."""
        told = [(model.library[name].refusal, values) for name, values in model.effects]
        return self.travel is None or not any(refusal(values, self.travel) for refusal, values in told if refusal is not None)

    def error(self, model: AxisModel) -> NDArray[np.complex128]:
        """(windows, lines) velocity error of a model."""
        task = problem(self.data, model, False)
        return np.asarray(self.measured - self.windows.spectrum(task.at(MEDIUM)(task.row)))

    def nats(self, model: AxisModel, error: NDArray[np.complex128] | None = None) -> float:
        """Nats in excess of an error that equals the noise floor; infinite for a model that diverges."""
        error = self.error(model) if error is None else error
        power = self.data.layout.power(error)
        if not np.all(np.isfinite(power)):
            return math.inf
        return self.objective.nats(self.objective.of_power(power), self.windows.begins.size)

    def spectrum(self, error: NDArray[np.complex128]) -> tuple[FloatArray, float, float]:
        """(bands,) expected power of an error, and the powers of the unmodelled force and motion."""
        force, motion = self.objective.unmodelled(self.data.layout.power(error))
        return self.objective.floor + force * self.objective.response + motion, force, motion

    def whitened(self, model: AxisModel, scale: Scale) -> tuple[FloatArray, FloatArray]:
        """(k, m) derivatives of the error by the coordinates, and (m,) the error, both divided by its expected size."""
        error = self.error(model)
        spectrum, _, _ = self.spectrum(error)
        weight = ((self.objective.lines > 0.0) / np.sqrt(spectrum))[self.data.layout.band]
        rows = derivatives(self.error, model, scale, error) * weight
        return np.nan_to_num(rows.reshape(len(rows), -1).view(np.float64)), np.nan_to_num((error * weight).ravel().view(np.float64))


def derivatives(
    of: Callable[[AxisModel], NDArray[np.complex128]], model: AxisModel, scale: Scale, now: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """(k, windows, lines) derivatives of a spectrum of a model by the coordinates of the scale; now: (windows, lines) the spectrum itself."""
    inner, found = scale.inner(model.row), []
    for k in range(inner.size):
        step = STEP if scale.outer(inner)[k] < scale.high[k] else -STEP
        moved = inner.copy()
        moved[k] += step
        found.append((of(with_row(model, scale.outer(moved))) - now) / step)
    return np.array(found)


def with_row(model: AxisModel, row: FloatArray) -> AxisModel:
    """The model with these parameter values, in the order of ``AxisModel.row``."""
    rest = iter(row[3:].tolist())
    effects = tuple((name, tuple(next(rest) for _ in values)) for name, values in model.effects)
    return replace(model, gain=float(row[0]), delay=float(row[1]), pole=float(row[2]), effects=effects, per_recording=())


def usual_precision(evidence: Evidence, model: AxisModel, scale: Scale) -> FloatArray:
    """(k, k) prior precision: a factor of two for positive parameters, the usual size for the others."""
    usual = np.array([*scale.unit[:3], *(unit_of(item) for name, _ in model.effects for item in evidence.sizes(model.library[name]))])
    each = np.where(scale.positive, 1.0 / FACTOR**2, (scale.unit / usual) ** 2)
    each[:3] = 1e-6  # the data determine the base best
    return np.diag(each)


def believed(evidence: Evidence, found: GreyboxFit, count: int, seed: int = 0) -> Belief:
    """The belief from a fit, with draws around it that the data allow."""
    model = _valid(evidence, replace(found.model, per_recording=()))
    scale = _scale(evidence.data, model)
    slopes, _ = evidence.whitened(model, scale)
    precision = slopes @ slopes.T + usual_precision(evidence, model, scale)
    spread = _root(precision)
    random, best, draws = np.random.default_rng(seed), evidence.nats(model), [model]
    inner = scale.inner(model.row)
    for tried in range(TRIES * count):
        if len(draws) >= count:
            break
        width = 0.5 ** (3.0 * tried / (TRIES * count))  # closer draws, if the likelihood is curved
        drawn = with_row(model, scale.outer(inner + width * spread @ random.standard_normal(inner.size)))
        if evidence.valid(drawn) and evidence.nats(drawn) - best < ALLOWED:
            draws.append(drawn)
    return _belief(evidence, model, draws, scale, precision)


def hidden(evidence: Evidence, rest: AxisModel, name: str, best: float, count: int) -> Belief | None:
    """The belief in a model that explains the data and an effect that the data do not show, with usual sizes that the data allow.

    The new effect replaces one of its family, and parameters of the same name keep their values. None if the data allow no such size.
    best: nats of the model that explains the data best; count: number of draws
    """
    found: list[AxisModel] = []
    shared = _shared(rest, name)
    own = {key for key in rest.library[name].names if key not in shared}
    for drawn in _usual(evidence, rest, name, TRIES * count):
        model = _settled(evidence, drawn, {f"{name}.{key}" for key in own})
        if evidence.valid(model) and evidence.nats(model) - best < ALLOWED:
            found.append(model)
        if len(found) >= count:
            break
    if not found:
        return None
    model = found[0]
    scale = _scale(evidence.data, model)
    slopes, _ = evidence.whitened(model, scale)
    return _belief(evidence, model, found, scale, slopes @ slopes.T + usual_precision(evidence, model, scale))


def _valid(evidence: Evidence, model: AxisModel) -> AxisModel:
    """The model without shapes of laws that are not valid over the travel, unless the data require them."""
    if evidence.valid(model):
        return model
    plain, fixed = [], set()
    for name, values in model.effects:
        items = model.library[name].parameters
        flat = not evidence.valid(replace(model, effects=((name, values),)))
        shapes = [flat and not item.positive for item in items]
        fixed |= {f"{name}.{item.name}" for item, shape in zip(items, shapes, strict=True) if shape}
        plain.append((name, tuple(0.0 if shape else value for value, shape in zip(values, shapes, strict=True))))
    found = _settled(evidence, replace(model, effects=tuple(plain)), fixed)
    return found if evidence.valid(found) and evidence.nats(found) - evidence.nats(model) < ALLOWED else model


def _relative(model: AxisModel, name: str) -> str | None:
    """The effect of a model that is replaced by another of its family."""
    effect = model.library[name]
    return next((own for own, _ in model.effects if effect.family and model.library[own].family == effect.family), None)


def _shared(model: AxisModel, name: str) -> dict[str, float]:
    """Values of a relative's parameters that have the same name in this effect."""
    relative = _relative(model, name)
    known = dict(zip(model.library[relative].names, dict(model.effects)[relative], strict=True)) if relative else {}
    return {key: known[key] for key in model.library[name].names if key in known}


def _usual(evidence: Evidence, rest: AxisModel, name: str, count: int) -> Iterator[AxisModel]:
    random, data = np.random.default_rng([0, 1]), evidence.data
    both = [np.concatenate((signal, -signal)) for signal in (data.voltage, data.velocity)]  # an offset is a part of the size
    moved, shared = rest.library[name].on(Similarity.of(data.sampling_rate, *both)), _shared(rest, name)
    items = [item if item.positive else over for item, over in zip(moved, evidence.sizes(rest.library[name]), strict=True)]
    relative = _relative(rest, name)
    less = rest if relative is None else rest.without(relative)
    for number in range(count):
        z = random.standard_normal(len(items)) if number else np.zeros(len(items))
        values = []
        for item, value in zip(items, z.tolist(), strict=True):
            size = abs(item.typical) or min(1.0, item.high - item.low)
            drawn = item.typical * math.exp(FACTOR * value) if item.positive else item.typical + size * value
            values.append(shared.get(item.name, min(max(drawn, item.low), item.high)))
        yield less.with_effect(name, values)


def _settled(evidence: Evidence, model: AxisModel, fixed: set[str]) -> AxisModel:
    """Gauss-Newton steps of all parameters except the fixed ones, so that the others adapt to these."""
    scale = _scale(evidence.data, model)
    free = np.array([key not in fixed for key in model.values()])
    now = evidence.nats(model)
    for _ in range(STEPS):
        slopes, error = evidence.whitened(model, scale)
        if not (np.all(np.isfinite(slopes)) and np.all(np.isfinite(error))):
            break
        inner = scale.inner(model.row)  # directions that the data do not determine stay unchanged
        inner[free] -= np.clip(np.linalg.lstsq(slopes[free].T, error, rcond=LEAST_SEEN)[0], -0.5, 0.5)
        moved = with_row(model, scale.outer(inner))
        then = evidence.nats(moved)
        if not then < now - 0.1:
            break
        model, now = moved, then
    return model


def _scale(data: AxisData, model: AxisModel) -> Scale:
    task = problem(data, model, False)
    scale, size = task.scale, model.row.size
    return Scale(scale.low[:size], scale.high[:size], scale.positive[:size], scale.unit[:size]) if task.row.size > size else scale


def _root(precision: FloatArray) -> FloatArray:
    """(k, k) matrix whose product with standard normal numbers has this precision."""
    unit = np.sqrt(np.diag(precision))
    values, vectors = np.linalg.eigh(precision / np.outer(unit, unit))
    return np.asarray(vectors / np.sqrt(np.maximum(values, 1e-12)) / unit[:, None])


def _belief(evidence: Evidence, model: AxisModel, draws: list[AxisModel], scale: Scale, precision: FloatArray) -> Belief:
    _, force, motion = evidence.spectrum(evidence.error(model))
    return Belief(
        effects=tuple(name for name, _ in model.effects),
        model=model,
        draws=tuple(draws),
        scale=scale,
        precision=precision,
        free=sum(len(values) for _, values in model.effects),
        force=force,
        motion=motion,
    )
