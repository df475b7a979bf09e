"""Effects that only one-step prediction can judge, alone or with others beside them, as fits like all others.

Their error is the filter's innovation, measured minus predicted position one sample ahead, times the sampling rate: m/s,
as for a free simulation. Their floor is the encoder's noise. What acts beside them is taken out of the recording first,
with numbers that are fitted together with theirs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xy_sysid.axis_model import AxisModel, Library, undoer
from xy_sysid.effect_code import undoable
from xy_sysid.effects import Effect
from xy_sysid.effects.contract import NO_FRICTION, Beside, DryFriction, Followed, arguments
from xy_sysid.errors import BadInput
from xy_sysid.greybox import Z95, AxisData, Estimate, GreyboxFit, unit_of
from xy_sysid.spectral_cost import count_size
from xy_sysid.stream import FloatArray
from xy_sysid.traces import bounded

AT_NOISE = 3.5  # held-out innovation over the encoder's noise up to which an effect explains the axis
BETTER = 2.0  # innovation without the effect over that with it, at least
CLEAN = 1.6  # innovation over the noise up to which next to nothing else is left in it,
LITTLE_BETTER = 1.03  # and what is enough there in the place of BETTER: a gap of one encoder count makes 1.04 to 1.07
TELLING = 0.005  # dry friction over the rms voltage from which it is named

Others = Sequence[tuple[str, tuple[float, ...]]]


def one_step_fit(data: AxisData, base: GreyboxFit, effect: Effect, new: Others = (), begin: Followed | None = None) -> GreyboxFit:
    """An effect, and what ``base`` has beside it, by one-step prediction; excess is 0 where that explains the axis.

    new: more effects beside it, with start values; begin: an earlier result without them. Raises BadInput if it cannot.
    """
    return followed(data, base, effect, new, begin)[0]


def followed(data: AxisData, base: GreyboxFit, effect: Effect, new: Others = (), begin: Followed | None = None) -> tuple[GreyboxFit, Followed]:
    """As ``one_step_fit``, with the filter's own result, from which a next fit can begin."""
    if effect.one_step is None:
        raise BadInput(f"effect {effect.name}", "no one-step prediction", "an effect that has one", "Fit it by simulation.")
    dry, others = beside(base.model, effect)
    rubbing = [DryFriction(name, values) for name, values in new if name in effect.one_step.frictions]
    dry = rubbing[-1] if rubbing else dry
    others += tuple((name, values) for name, values in new if name not in effect.one_step.frictions)
    first = data.training if any(_ages(base.model.library[name]) for name, _ in others) else data.first
    stages = first, data.training, data.position.size - 1
    start = base.model.gain, base.model.delay, base.model.pole
    found = effect.one_step.fit(data.sampling_rate, start, noise_of(data), stages, as_beside(data, base.model.library, others), dry, begin)
    return _result(data, base.model.library, effect, [name for name, _ in others], found), found


def _ages(effect: Effect) -> bool:
    """True if the law knows the time: the first stage is too short to see it."""
    return any("t" in arguments(function) for function in effect.functions.values())


def beside(model: AxisModel, effect: Effect) -> tuple[DryFriction, tuple[tuple[str, tuple[float, ...]], ...]]:
    """Dry friction of a model and its effects that can be taken out of a recording; raises BadInput for others."""
    assert effect.one_step is not None
    dry, others = NO_FRICTION, []
    for name, values in model.effects:
        if name in effect.one_step.frictions:
            dry = DryFriction(name, values)
        elif undoable(model.library[name]):
            others.append((name, values))
        elif name != effect.name:
            known = ", ".join(effect.one_step.frictions)
            raise BadInput("effects", f"{effect.name} with {name}", f"{effect.name} with {known}, or what does not heed speed", "Leave it out.")
    return dry, tuple(others)


def change_without(data: AxisData, model: AxisModel, name: str) -> float:
    """Mean square of what the innovations over the noise would change by, were one effect of a model absent and all else as it is."""
    effect = model.ahead
    assert effect is not None
    least = (effect.parameters[0].low, *dict(model.effects)[effect.name][1:])
    nothing = model.with_effect(name, least) if name == effect.name else model.without(name)
    return float(np.mean((_innovation(data, nothing, effect) - _innovation(data, model, effect)) ** 2))


def _innovation(data: AxisData, model: AxisModel, effect: Effect) -> FloatArray:
    """(n,) innovations over the noise of a model as it is."""
    assert effect.one_step is not None
    dry, others = beside(model, effect)
    values = dict(model.effects)[effect.name]
    found = Followed(
        (model.gain, model.delay, model.pole), values, (0.0, 0.0, 0.0), (0.0,) * len(values), dry, ((), ()), np.empty(0), 0.0, noise_of(data), 0
    )
    return effect.one_step.innovation(data.sampling_rate, found, as_beside(data, model.library, others), data.position.size - 1)


def noise_of(data: AxisData) -> float:
    """Standard deviation of the encoder, m."""
    count = count_size(data.position)
    return min(data.floor.encoder, max(count / np.sqrt(12.0), 1e-12)) if count > 0.0 else data.floor.encoder


def as_beside(data: AxisData, library: Library, others: Others) -> Beside:
    """Effects with start values, ready to be fitted and taken out of the recording."""
    names = [name for name, _ in others]
    items = [item for name in names for item in library[name].parameters]
    return Beside(
        np.array([value for name, values in others for value in bounded(library[name], values)]),
        np.array([item.low for item in items]),
        np.array([item.high for item in items]),
        np.array([unit_of(item) for item in items]),
        np.array([item.positive for item in items], dtype=np.bool_),
        undoer(library, names, data.sampling_rate, data.voltage, data.position),
    )


def _result(data: AxisData, library: Library, effect: Effect, names: Sequence[str], found: Followed) -> GreyboxFit:
    error = found.innovation * data.sampling_rate
    settled = min(int(0.5 * data.sampling_rate), data.training // 4)
    held = float(np.sqrt(np.mean(error[data.training :] ** 2)))
    noise_floor = found.noise * data.sampling_rate
    worse = found.without * data.sampling_rate or held  # not known where the effect explains too little, or is too small to be one
    told = held < CLEAN * noise_floor and worse > LITTLE_BETTER * held
    far = max(held / (AT_NOISE * noise_floor), 0.0 if told else BETTER * held / worse)
    rows: list[tuple[str, tuple[float, ...], tuple[float, ...]]] = [(effect.name, bounded(effect, found.values), found.spread)]
    dry = found.dry
    if dry.values[0] > TELLING * float(np.std(data.voltage)) and dry.values[0] > 5.0 * dry.spread[0]:
        rows.append((dry.effect, bounded(library[dry.effect], dry.values), dry.spread))
    values, spread = iter(found.beside[0]), iter(found.beside[1])
    rows += [(name, tuple(next(values) for _ in library[name].names), tuple(next(spread) for _ in library[name].names)) for name in names]
    gain, delay, pole = found.base
    model = AxisModel(gain, max(delay, 0.0), pole, library=library)
    estimates = [
        Estimate(key, value, unit, value - Z95 * s, value + Z95 * s)
        for key, unit, value, s in zip(("gain", "delay", "pole"), ("m/s/V", "s", "rad/s"), found.base, found.base_spread, strict=True)
    ]
    for name, own, errors in rows:
        model = model.with_effect(name, bounded(library[name], own))
        estimates += [
            Estimate(f"{name}.{item.name}", value, item.unit, value - Z95 * s, value + Z95 * s)
            for item, value, s in zip(library[name].parameters, own, errors, strict=True)
        ]
    return GreyboxFit(
        model,
        tuple(estimates),
        float(np.sqrt(np.mean(error[settled : data.training] ** 2))),
        held,
        noise_floor,
        max(0.0, 2.0 * float(np.log(far))),
        data.velocity - error,
        error,
        found.runs,
        True,
    )
