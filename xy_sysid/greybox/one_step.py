"""Fits of effects that only one-step prediction can judge, alone or together with others.

The error is the innovation of the filter, measured minus predicted position one sample ahead, times the sampling rate: m/s,
as for a free simulation. The floor is the encoder noise. Other effects are first removed from the recording,
with parameters that are fitted together with those of the effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from xy_sysid.axis.loop_source import undoable
from xy_sysid.axis.model import AxisModel, Library, undoer
from xy_sysid.effects import Effect
from xy_sysid.effects._contract import PATIENT, Companions, DryFriction, FilterFit, Limits, OneStepTask, arguments
from xy_sysid.errors import BadInput
from xy_sysid.greybox.floor import count_size
from xy_sysid.greybox.free_run import AxisData, GreyboxFit
from xy_sysid.greybox.parameters import unit_of
from xy_sysid.greybox.score_test import bounded
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import Z95

AT_NOISE = 3.5  # held-out innovation over encoder noise up to which an effect explains the axis
BETTER = 2.0  # least ratio of the innovation without the effect to that with it
CLEAN = 1.6  # innovation over noise up to which it contains hardly anything else;
BETTER_AT_NOISE = 1.03  # replaces BETTER there: a gap of one encoder count gives 1.04 to 1.07
TELLING = 0.005  # dry friction over rms voltage above which it is named,
ERRORS = 5.0  # if it is this many standard errors
SETTLING = 0.5  # s until a filter has forgotten its start

FILTER_WORK = 4.0  # samples times sub-steps of Stribeck friction that are simulated in the time that the filter takes for one sample

Others = Sequence[tuple[str, tuple[float, ...]]]


def one_step_fit(
    data: AxisData, base: GreyboxFit, effect: Effect, new: Others = (), earlier: FilterFit | None = None, limits: Limits = PATIENT
) -> GreyboxFit:
    """Fit an effect together with those of ``base`` by one-step prediction; excess is 0 if that explains the axis.

    new: additional effects, with start values; earlier: an earlier result without them; limits: see ``Limits``, bar in m/s.
    Raises BadInput if ``base`` has an effect that cannot be included.
    """
    return filter_fit(data, base, effect, new, earlier, limits)[0]


def filter_fit(
    data: AxisData, base: GreyboxFit, effect: Effect, new: Others = (), earlier: FilterFit | None = None, limits: Limits = PATIENT
) -> tuple[GreyboxFit, FilterFit]:
    """As ``one_step_fit``, and the result of the filter, which a next fit can use as ``earlier``."""
    if effect.one_step is None:
        raise BadInput(f"effect {effect.name}", "no one-step prediction", "an effect that has one", "Fit it by simulation.")
    if len(data.starts) > 1:
        raise BadInput(f"stretches for {effect.name}", len(data.starts), "one, as a filter runs through it", "Give one recording without a gap.")
    library = base.model.library
    dry, others = companions(base.model, effect)
    for name, values in new:
        if library[name].is_dry:
            dry = _with_law(dry, library[name], values, effect)
        else:
            others += ((name, values),)
    first = data.training if any(_depends_on_time(library[name]) for name, _ in others) else data.first
    found = effect.one_step.fit(
        OneStepTask(
            sampling_rate=data.sampling_rate,
            base=(base.model.gain, base.model.delay, base.model.pole),
            noise=noise_of(data),
            stages=(first, data.training, data.position.size - 1),
            companions=as_companions(data, library, others),
            dry=dry,
            earlier=earlier,
            limits=replace(limits, bar=None if limits.bar is None else limits.bar / data.sampling_rate),
        )
    )
    data.work.add(FILTER_WORK * found.filtered)
    return _result(data, library, effect, [name for name, _ in others], found), found


def _with_law(dry: DryFriction, law: Effect, values: tuple[float, ...], effect: Effect) -> DryFriction:
    """Add a law of dry friction, which replaces those of its family and the default friction of the effect."""
    kept = [
        (own, its)
        for own, its, _ in dry.rows()
        if own.name not in (law.name, effect.start_friction) and not (law.family and own.family == law.family)
    ]
    return DryFriction((*(own for own, _ in kept), law), (*(value for _, its in kept for value in its), *values))


def _depends_on_time(effect: Effect) -> bool:
    """True if the law depends on time; the first stage is too short for such a law."""
    return any("t" in arguments(function) for function in effect.functions.values())


def companions(model: AxisModel, effect: Effect) -> tuple[DryFriction, tuple[tuple[str, tuple[float, ...]], ...]]:
    """Dry friction of a model, and its other effects that can be removed from a recording: the companions of ``effect``.

    Raises BadInput if the model has an effect that is neither.
    """
    dry_friction, others = [], []
    for name, values in model.effects:
        own = model.library[name]
        if own.is_dry:
            dry_friction.append((own, values))
        elif undoable(own):
            others.append((name, values))
        elif name != effect.name:
            raise BadInput(
                "effects", f"{effect.name} with {name}", f"{effect.name} with dry friction, or effects that do not depend on speed", "Leave it out."
            )
    if not dry_friction and effect.start_friction in model.library.effects:
        first = model.library[effect.start_friction]
        dry_friction = [(first, tuple(item.low for item in first.parameters))]
    return DryFriction(tuple(own for own, _ in dry_friction), tuple(value for _, values in dry_friction for value in values)), tuple(others)


def one_step_effect(model: AxisModel) -> Effect | None:
    """The effect of a model that only one-step prediction can judge, if there is one."""
    return next((model.library[name] for name, _ in model.effects if model.library[name].one_step is not None), None)


def noise_of(data: AxisData) -> float:
    """Standard deviation of the encoder, m."""
    count = count_size(data.position)
    return min(data.encoder, max(count / np.sqrt(12.0), 1e-12)) if count > 0.0 else data.encoder


def as_companions(data: AxisData, library: Library, others: Others) -> Companions:
    """Companions from effects with start values, ready to be fitted and removed from the recording."""
    names = [name for name, _ in others]
    items = [item for name in names for item in library[name].on(data.similar)]
    return Companions(
        start=np.array([value for name, values in others for value in bounded(library[name], values, data.similar)]),
        low=np.array([item.low for item in items]),
        high=np.array([item.high for item in items]),
        unit=np.array([unit_of(item) for item in items]),
        positive=np.array([item.positive for item in items], dtype=np.bool_),
        undo=undoer(library, names, data.sampling_rate, data.voltage, data.position),
        similar=data.similar,
        swing=data.swing,
    )


def _result(data: AxisData, library: Library, effect: Effect, names: Sequence[str], found: FilterFit) -> GreyboxFit:
    error = found.innovation * data.sampling_rate
    settled = min(int(SETTLING * data.sampling_rate), data.training // 4)
    held = float(np.sqrt(np.mean(error[data.training :] ** 2)))
    noise_floor = found.noise * data.sampling_rate
    worse = held if found.too_small else error_without(data, found)
    explains_all = held < CLEAN * noise_floor and worse > BETTER_AT_NOISE * held
    far = max(held / (AT_NOISE * noise_floor), 0.0 if explains_all else BETTER * held / worse)
    rows: list[tuple[str, tuple[float, ...], tuple[float, ...]]] = [(effect.name, bounded(effect, found.values, data.similar), found.spread)]
    for law, its, errors in found.dry.rows():
        if its[0] > TELLING * float(np.std(data.voltage)) and its[0] > ERRORS * errors[0]:
            rows.append((law.name, bounded(law, its, data.similar), errors))
    values, spread = iter(found.companions[0]), iter(found.companions[1])
    rows += [(name, tuple(next(values) for _ in library[name].names), tuple(next(spread) for _ in library[name].names)) for name in names]
    gain, delay, pole = found.base
    model = AxisModel(gain, max(delay, 0.0), pole, library=library)
    estimates = [
        Estimate(name=key, value=value, unit=data.units.of(unit), low=value - Z95 * s, high=value + Z95 * s)
        for key, unit, value, s in zip(("gain", "delay", "pole"), ("m/s/V", "s", "rad/s"), found.base, found.base_spread, strict=True)
    ]
    for name, own, errors in rows:
        model = model.with_effect(name, bounded(library[name], own, data.similar))
        estimates += [
            Estimate(name=f"{name}.{item.name}", value=value, unit=data.units.of(item.unit), low=value - Z95 * s, high=value + Z95 * s)
            for item, value, s in zip(library[name].parameters, own, errors, strict=True)
        ]
    return GreyboxFit(
        model=model,
        parameters=tuple(estimates),
        training_error=float(np.sqrt(np.mean(error[settled : data.training] ** 2))),
        held_out_error=held,
        noise_floor=noise_floor,
        excess=max(0.0, 2.0 * float(np.log(far))),
        scores=np.zeros(data.held_out.begins.size),
        forced=1.0,
        force=0.0,
        simulated=data.velocity - error,
        error=error,
        runs=found.runs,
        converged=not found.given_up,
        held_out_powers=data.layout.powers(data.held_out.spectrum(error)),
        one_step=True,
        units=data.units,
    )


def error_without(data: AxisData, found: FilterFit) -> float:
    """Held-out one-step error, m/s, of the same filter without the effect, all else refitted: the effect must have a smaller one."""
    return float(np.sqrt(np.mean(found.without[data.training :] ** 2))) * data.sampling_rate
