"""python -m campaigns.bench peers [PART ...]: our fits compared with least squares, on recordings of real machines; writes docs/real-machines.md.

Models: a rigid axis (gain, delay, pole), and the same with Coulomb friction. Peers of the same structure, with numpy and scipy alone:
inverse dynamics (lstsq of the input on acceleration, velocity, optionally a load, and the direction; Gautier & Khalil 1990), and output error
(``scipy.optimize.least_squares`` on the velocity in the windows of our fit, from three starts). Both use our simulator, and
are judged in held-out windows. PART: only recordings whose path contains this word; then nothing is written.
"""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import dataclass

import numpy as np
import scipy.optimize
import scipy.signal

from campaigns.bench.recordings import axes, markdown, rows, written
from xy_sysid.axis.model import FINE, STANDARD, AxisModel, simulator, start_of
from xy_sysid.greybox.axis_data import AxisData
from xy_sysid.greybox.floor import Windows
from xy_sysid.greybox.free_run import GreyboxFit, fit_base, fit_with
from xy_sysid.greybox.objective import Objective
from xy_sysid.hypotheses.enough_data import prepared
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import moved

COULOMB = "coulomb_friction"
CUTOFF = 25.0  # Hz, of the low-pass of inverse dynamics
POLES = (1e-3, 1e6)  # rad/s, bounds of the pole in output error
REST = 0.05  # fraction of the highest speed; inverse dynamics uses faster samples only
SUB_STEPS = 4000.0  # Hz, of the simulation within a fit by output error
GOAL = 1.15  # largest ratio to the peer's held-out error
COLUMNS = ("recording", "structure", "ours", "peer", "which", "ratio", "objective, ours / peer", "seconds, ours / peer")


@dataclass(frozen=True, slots=True)
class Judged:
    """A model on data. error: rms of the velocity held out, m/s; score: by our objective, of the windows of the fit, nats a line."""

    model: AxisModel
    error: float
    score: float


def simulated(data: AxisData, model: AxisModel, fine: float = FINE) -> FloatArray:
    """(n - r,) simulated velocity of all recordings, each from its own start speed."""
    parts = []
    for run in data.runs:
        u, x = data.voltage[run], data.position[run]
        names = [name for name, _ in model.effects]
        parts.append(simulator(model.library, names, data.sampling_rate, u, x, fine)(model.row, start_of(model, data.sampling_rate, u, x)))
    return np.concatenate(parts)


def judged(data: AxisData, model: AxisModel) -> Judged:
    """Held-out error and score of a model."""
    error = data.velocity - simulated(data, model)

    def power(windows: Windows) -> FloatArray:
        found = data.layout.power(windows.spectrum(error))
        return np.asarray(np.where(np.isfinite(found), found, np.inf))

    return Judged(model, data.layout.rms(power(data.held_out)), Objective.of(data.floor).of_power(power(data.fitted)))


def made(gain: float, delay: float, pole: float, coulomb: float | None) -> AxisModel:
    """An axis model, with Coulomb friction unless it is None."""
    rigid = AxisModel(gain, delay, pole, library=STANDARD)
    return rigid if coulomb is None else rigid.with_effect(COULOMB, (coulomb,))


def inverse_dynamics(data: AxisData, friction: bool, load: bool) -> tuple[float, float, float] | None:
    """(gain, pole, Coulomb friction) by linear least squares in the samples in motion; None if inertia or drag is negative."""
    sides = scipy.signal.butter(2, min(CUTOFF, 0.2 * data.sampling_rate), fs=data.sampling_rate)
    columns = []
    for run, step in zip(data.runs, data.steps, strict=True):
        u, v = (scipy.signal.filtfilt(*sides, signal) for signal in (data.voltage[run][:-1], data.velocity[step]))
        columns.append(np.array([u, np.gradient(v) * data.sampling_rate, v, np.sign(v), np.ones_like(v)]))
    u, acceleration, v, direction, ones = np.concatenate(columns, axis=1)
    used = [acceleration, v, *([direction] if friction else []), *([ones] if load else [])]
    moving = np.abs(v) > REST * float(np.max(np.abs(v)))
    inertia, drag, *more = np.linalg.lstsq(np.array(used).T[moving], u[moving], rcond=None)[0].tolist()
    if not inertia * drag > 0.0:
        return None
    return 1.0 / drag, drag / inertia, max(more[0], 0.0) if friction else 0.0


def guess(data: AxisData, pole: float) -> tuple[float, float, float]:
    """(gain, pole, Coulomb friction) for a pole: the gain that explains the velocity best, and friction of a tenth of the input."""
    unit = simulated(data, made(1.0, 0.0, pole, None), SUB_STEPS)
    return float(unit @ data.velocity) / float(unit @ unit), pole, 0.1 * float(np.std(data.voltage))


def output_error(data: AxisData, start: tuple[float, float, float], friction: bool) -> tuple[float, AxisModel]:
    """(cost, model) of least squares of the velocity's error in the windows of the fit, from a start (gain, pole, Coulomb friction)."""
    gain, pole, coulomb = start[0], min(max(start[1], 1e-2), 1e5), max(start[2], 1e-3 * float(np.std(data.voltage)))
    starts = [start_of(made(gain, 0.0, pole, None), data.sampling_rate, data.voltage[run], data.position[run]) for run in data.runs]
    names = [COULOMB] if friction else []
    runs = [simulator(STANDARD, names, data.sampling_rate, data.voltage[run], data.position[run], SUB_STEPS) for run in data.runs]

    def model(x: FloatArray) -> AxisModel:  # every coordinate is 1 at the start
        return made(gain * x[0], (x[1] - 1.0) / data.sampling_rate, pole * np.exp(x[2] - 1.0), coulomb * np.exp(x[3] - 1.0) if friction else None)

    def left(x: FloatArray) -> FloatArray:
        row = model(x).row
        velocity = np.concatenate([run(row, speed) for run, speed in zip(runs, starts, strict=True)])
        error = data.fitted.spectrum(data.velocity - velocity)
        return np.nan_to_num(np.stack((error.real, error.imag)).ravel(), nan=1e6, posinf=1e6, neginf=-1e6)

    size = 4 if friction else 3
    low, high = np.full(size, -np.inf), np.full(size, np.inf)
    low[1], high[1] = 1.0, 1.0 + 0.25 * data.first
    low[2:], high[2:] = 1.0 - np.log(1e7), 1.0 + np.log(1e7)
    low[2], high[2] = 1.0 + np.log(np.array(POLES) / pole)
    found = scipy.optimize.least_squares(left, np.ones(size), bounds=(low, high), diff_step=np.full(size, 1e-4), x_scale="jac", max_nfev=60)
    return float(found.cost), model(found.x)


def peers(data: AxisData, friction: bool) -> dict[str, Judged]:
    """The result of each peer: the best of inverse dynamics with and without a load, and of output error from three starts."""
    read = [inverse_dynamics(data, friction, load) for load in (False, True)]
    inverse = [judged(data, made(one[0], 0.0, min(max(one[1], 1e-2), 1e5), one[2] if friction else None)) for one in read if one is not None]
    other = read if friction else [*read, inverse_dynamics(data, True, True)]
    starts = [one for one in other if one is not None]
    starts = [*starts, *(guess(data, pole) for pole in (10.0, 1.0, 100.0))][: max(3, len(starts) + 1)]
    best = min((output_error(data, start, friction) for start in starts), key=lambda item: item[0])
    found = {"output error": judged(data, best[1])}
    return found | ({"inverse dynamics": min(inverse, key=lambda one: one.error)} if inverse else {})


def ours(data: AxisData) -> dict[str, tuple[GreyboxFit, float]]:
    """Our fit of each structure, and its processor time, s; the one with friction starts from the rigid one."""
    begun = time.process_time()
    base = fit_base(data)
    rigid = time.process_time() - begun
    more = fit_with(data, base, [COULOMB])
    return {"rigid": (base, rigid), "rigid, Coulomb friction": (more, time.process_time() - begun)}


def compared(title: str, data: AxisData) -> list[tuple[str, ...]]:
    """The rows of one axis."""
    found: list[tuple[str, ...]] = []
    unit = data.units.judged
    for structure, (fit, seconds) in ours(data).items():
        begun = time.process_time()
        reached = peers(data, COULOMB in fit.model)
        spent = time.process_time() - begun
        which = min(reached, key=lambda name: reached[name].error)
        peer, own = reached[which], judged(data, fit.model)
        ratio = f"{own.error / peer.error:.2f}"
        sys.stderr.write(f"{title}, {structure}: {ratio} of {which}; objective {own.score:.4f} / {peer.score:.4f}\n")
        objective = f"{own.score:.2f} / {peer.score:.2f}"
        found.append((title, structure, moved(own.error, unit), moved(peer.error, unit), which, ratio, objective, f"{seconds:.1f} / {spent:.1f}"))
    return found


def main(short: bool = False) -> None:
    """Print the table as Markdown, and write it to the page."""
    warnings.simplefilter("ignore")  # of diverging trial models
    words, lines, refused = sys.argv[1:], [], []
    for row in rows(short):
        if words and not any(word in row.path for word in words):
            continue
        for axis in axes(row):
            signals = [(run.voltage, run.position) for run in axis.runs]
            ready = axis.refused or prepared(axis.runs[0].sampling_rate, signals, units=axis.runs[0].units)
            if isinstance(ready, str):
                refused.append(f"- {axis.name}: {ready}")
            else:
                lines += compared(axis.name, ready)
    table = markdown(COLUMNS, lines)
    above = sum(float(line[5]) > GOAL for line in lines)
    count = f"{len(lines) - above} of {len(lines)} rows are at most {GOAL:g} times the better peer."
    told = "\n\n".join([table, count, *(["Not compared:\n\n" + "\n".join(refused)] if refused else [])])
    sys.stdout.write(told + "\n")
    if not (short or words):
        written("peers", told)


if __name__ == "__main__":
    main()
