"""What acts beside an effect that only one-step prediction can judge: found by its trace in the innovations, added while they fall.

The filter is run with a little of each trace put in; what changes, to first order, is what the effect would explain (the
score test of ``greybox.score_test``, on innovations).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
import scipy.signal

from xy_sysid.axis.loop_source import undoable
from xy_sysid.axis.model import AxisModel, Library
from xy_sysid.effects import Effect, Guess, Scene
from xy_sysid.effects._contract import PATIENT, Beside, Followed, Limits
from xy_sysid.greybox.free_run import AxisData, GreyboxFit
from xy_sysid.greybox.one_step import AT_NOISE, CLEAN, as_beside, beside, error_without, followed
from xy_sysid.greybox.score_test import Trace
from xy_sysid.greybox.start_rigid import mean_velocity_filter
from xy_sysid.samples.block import FloatArray
from xy_sysid.search.criteria import LEAST

# Tuned on development draws of the simulated machine only (blind/cases.py).
SMALL = 0.02  # of the rms voltage or velocity: how much of a trace is put in to see what it does
TRIED = 2  # effects that are fitted beside at each rung, by their share of the innovations
LEAST_SHARE = 0.005  # of the innovations that an effect's trace must explain to be tried
TELLING = 0.02  # the same where the axis is explained already
MIMIC = 0.15  # the same for a suspect, which takes part of the contact's own error
LOUD = 0.08  # share from which an effect is tried beside one that does not explain the axis alone, without being asked for patience
LITTLE_LESS, LESS, MUCH_LESS = 0.97, 0.85, 0.8  # of the held-out innovation that one more effect must leave at most: where next to
# nothing but noise is left, where it is explained, and else
RUBS = 0.05  # Coulomb friction over the rms voltage from which richer laws of it are tried
NEARLY = 30.0  # innovation over the noise up to which they are, and what is not loud is tried, too
AGAIN, LOST = 2.5, 40.0  # innovations over noise between which a first fit is begun again from where it ended
MOST = 3  # effects beside
CLOSED = 2.0  # encoder noises below which a gap is none


@dataclass(frozen=True, slots=True)
class Grown:
    """Rungs, name and fit, and the filter's own result for the last."""

    rungs: tuple[tuple[str, GreyboxFit], ...]
    found: Followed


def grown(
    data: AxisData,
    base: GreyboxFit,
    effect: Effect,
    library: Library,
    limits: Limits = PATIENT,
    refused: Callable[[GreyboxFit], str] = lambda _: "",
) -> Grown:
    """Rungs: the effect with what the base has beside it, then one more beside it at each.

    limits: bar is the error one sample ahead, m/s, of the best without the effect: what cannot come near it ends soon
    refused: why a fit with one more beside it explains nothing, or empty
    """
    fit, found = followed(data, base, effect, limits=limits)
    if found.given_up:
        return Grown(((effect.name, fit),), found)
    on = replace(limits, bar=None)
    fit, found = _settled(data, effect, fit, found, on)
    rungs = [(effect.name, fit)]
    if fit.held_out_error > LITTLE_LESS * error_without(data, found):  # without it the same filter does as well: nothing beside it makes it one
        return Grown(tuple(rungs), found)
    while len(rungs) <= MOST and not limits.late():
        fit = rungs[-1][1]
        explains = fit.excess == 0.0
        if found.values[0] < CLOSED * found.noise and fit.held_out_error < AT_NOISE * fit.noise_floor:
            break  # it is no such effect: without it the same filter explains the axis
        known = {name for name, _ in beside(fit.model, effect)[1]} | {name for name, _ in fit.model.effects}
        # a resonance is not tried: together with a gap it explains too much (cogging at small amplitude, friction that bends)
        open_to = [e for e in library.acting if undoable(e) and e.simulable and e.name not in known and e.category != "motion"]
        rubbing = [] if explains else _rubbing(data, fit, library, found)
        wanted = traces(data, fit.model, effect, found, rubbing) if rubbing else []
        tried = [(trace.effect, *followed(data, fit, effect, [_start(trace, library, found)], found, on)) for trace in wanted]
        if not any(item[1].excess == 0.0 for item in tried):
            seen = traces(data, fit.model, effect, found, [*open_to, *_uneven(effect, library, found)])
            careful = fit.held_out_error < NEARLY * fit.noise_floor
            wanted = [trace for trace in seen if trace.share >= _least(library[trace.effect], effect, explains, careful)][:TRIED]
            tried += [(trace.effect, *followed(data, fit, effect, [_start(trace, library, found)], found, on)) for trace in wanted]
        tried = [item for item in tried if not refused(item[1])]
        if not tried:
            break
        least = min(item[1].held_out_error for item in tried)
        alike = (item for item in tried if 2.0 * np.log(item[1].held_out_error / least) < LEAST)  # then the simplest
        name, better, its = min(alike, key=lambda item: (len(item[1].parameters), item[1].held_out_error))
        most = MUCH_LESS if not explains else LITTLE_LESS if fit.held_out_error < CLEAN * fit.noise_floor else LESS
        if not better.held_out_error < most * fit.held_out_error:
            break
        new = [own for own, _ in better.model.effects if own not in fit.model]
        better, found = _settled(data, effect, better, its, on)
        rungs.append((name if name in better.model else new[-1] if new else name, better))
    return Grown(tuple(rungs), found)


def put_beside(data: AxisData, now: GreyboxFit, effect: Effect, other: Effect) -> GreyboxFit:
    """One more beside an effect that the fit has already, in the place of its relatives. Raises BadInput if the filter cannot have it."""
    assert effect.one_step is not None
    library, model = now.model.library, now.model.without(effect.name)
    for name, _ in model.effects:
        if other.family and library[name].family == other.family:
            model = model.without(name)
    beside(model.with_effect(other.name), effect)
    rubs = other.is_dry and other.name != effect.rubs
    if not (undoable(other) or rubs):
        return followed(data, replace(now, model=model.with_effect(other.name)), effect)[0]
    without = replace(now, model=now.model.without(effect.name) if rubs else model)
    _, found = followed(data, without, effect)
    trace = traces(data, without.model, effect, found, [other])[0]
    return followed(data, without, effect, [_start(trace, library, found)], found)[0]


def _rubbing(data: AxisData, fit: GreyboxFit, library: Library, found: Followed) -> list[Effect]:
    """Laws of dry friction that say more than the one that the filter has now, where it is large and the fit is near its end.

    Their traces do not tell: friction that bends or sticks changes what the filter believes of the gap.
    """
    if not found.dry.values or found.dry.values[0] < RUBS * float(np.std(data.voltage)) or fit.held_out_error > NEARLY * fit.noise_floor:
        return []
    return [law for law in library.acting if law.is_dry and len(law.parameters) > len(found.dry.values) and law.sum_of is None]


def _uneven(effect: Effect, library: Library, found: Followed) -> list[Effect]:
    """Friction that is Coulomb's and a load at the motor: its trace does tell."""
    if found.dry.names != (effect.rubs,):
        return []
    return [law for law in library.acting if law.is_dry and law.sum_of is not None]


def _start(trace: Trace, library: Library, found: Followed) -> tuple[str, tuple[float, ...]]:
    """Name and values to begin with: friction at the level that it has already."""
    if not library[trace.effect].is_dry:
        return trace.effect, trace.values
    rest = trace.values[1:] if library[trace.effect].sum_of is None else (0.0,) * (len(trace.values) - 1)
    return trace.effect, (max(*found.dry.values[:1], 1e-3), *rest)


def _settled(data: AxisData, effect: Effect, fit: GreyboxFit, found: Followed, limits: Limits) -> tuple[GreyboxFit, Followed]:
    """Once more from where a fit ended, if it may have ended too soon: richer friction moves slowly."""
    least = AGAIN if found.dry.names == (effect.rubs,) else CLEAN
    if least * fit.noise_floor < fit.held_out_error < LOST * fit.noise_floor:
        again, its = followed(data, fit, effect, (), found, limits)
        if again.held_out_error < fit.held_out_error:
            return again, its
    return fit, found


def _least(other: Effect, effect: Effect, explains: bool, patient: bool) -> float:
    """Share of the innovations from which an effect is tried: more of what the contact's own imperfections look like."""
    least = TELLING if explains else LEAST_SHARE if patient else LOUD
    return max(least, MIMIC) if other.name in effect.suspects else least


def traces(data: AxisData, model: AxisModel, effect: Effect, found: Followed, effects: Iterable[Effect]) -> list[Trace]:
    """How much of the innovations' power each effect beside would explain, to first order, best first, with start values."""
    assert effect.one_step is not None
    library, fs, n = model.library, data.sampling_rate, data.first
    names = [name for name, _ in beside(model, effect)[1]]
    pairs = (
        zip(names, np.split(np.array(found.beside[0]), np.cumsum([len(library[name].names) for name in names])[:-1]), strict=True) if names else ()
    )
    own = as_beside(data, library, [(name, tuple(values)) for name, values in pairs])
    numbers = np.array([*found.base, *found.beside[0]])
    voltage, position, against, through = own.undo(numbers, n)
    still = np.zeros(0)

    def seen(by: Beside, what: Followed = found) -> FloatArray:
        assert effect.one_step is not None
        return effect.one_step.innovation(fs, what, by, n)

    def recording(u: FloatArray, y: FloatArray, f: FloatArray) -> Beside:
        return Beside(
            start=still,
            low=still,
            high=still,
            unit=still,
            positive=still.astype(np.bool_),
            undo=lambda _, samples: (u[:samples], y[: samples + 1], f[:samples], through),
            similar=own.similar,
            swing=own.swing,
        )

    here = seen(recording(voltage, position, against))
    skip = min(int(0.5 * fs), n // 4)
    error = _missing_velocity(data, found, here)
    scene = Scene(
        sampling_rate=fs,
        gain=found.base[0],
        pole=found.base[2],
        voltage=_late(voltage, found.base[1] * fs),
        velocity=data.velocity[:n],
        position=0.5 * (position[1:] + position[:-1]),
        error=error,
    )

    def change(guess: Guess, column: FloatArray, side: int) -> FloatArray:
        size = SMALL * float(np.std(data.velocity if guess.at_encoder else voltage)) / (float(np.std(column)) + abs(float(np.mean(column))) + 1e-300)
        put = size * column
        other = recording(voltage, position - np.concatenate(([0.0], np.cumsum(put))) / fs, against) if guess.at_encoder else None
        both = against.copy()
        both[side] += put
        return (seen(other or recording(voltage, position, both)) - here)[skip:] / size

    nuisance = np.stack(
        [(seen(recording(*own.undo(moved, n)[:3]), replace(found, base=tuple(moved[:3]))) - here)[skip:] for moved in _moved(numbers)]
    )
    basis = np.linalg.qr(nuisance.T)[0]
    target = here[skip:] - basis @ (basis.T @ here[skip:])
    best: list[Trace] = []
    for item in effects:
        trace = Trace(item.name, 0.0, tuple(own.typical for own in item.on(scene.similar)))
        for guess in item.guessed(scene):
            columns = np.stack([change(guess, column[:n], int(item.on_table)) for column in guess.columns])
            columns = columns - (columns @ basis) @ basis.T
            size = np.linalg.norm(columns, axis=1) + 1e-300
            unit = columns / size[:, None]
            inside = unit @ target
            coefficients = np.linalg.pinv(unit @ unit.T, rcond=1e-10, hermitian=True) @ inside
            share = float(inside @ coefficients) / float(target @ target + 1e-300)
            if share > trace.share:
                trace = Trace(item.name, share, item.read(guess, -coefficients / size, scene.similar))
        best.append(trace)
    return sorted(best, key=lambda trace: -trace.share)


def _moved(numbers: FloatArray) -> list[FloatArray]:
    found = []
    for k in range(3):
        moved = numbers.copy()
        moved[k] *= 1.001
        found.append(moved)
    return found


def _missing_velocity(data: AxisData, found: Followed, innovation: FloatArray) -> FloatArray:
    """(n,) m/s: what the forces that the innovations tell of would do to the base. Right but for its size and a short delay."""
    gain, _, pole = found.base
    b, a = mean_velocity_filter(gain, pole, data.sampling_rate)
    force = innovation * found.noise * data.sampling_rate**2 / (gain * pole)
    return np.asarray(scipy.signal.lfilter(b, a, force))


def _late(voltage: FloatArray, samples: float) -> FloatArray:
    whole = int(samples + 0.5)
    return np.concatenate((np.zeros(whole), voltage))[: voltage.size]
