"""The benefit of a feedforward: recorded voltage predicted from recorded motion, and simulated tracking errors with the refined model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from xy_sysid.axis.model import AxisModel
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.closed_loop import Controller, Encoder, follow_path, rms, shake
from xy_sysid.control_design.compensation import Compensation, compensate
from xy_sysid.control_design.gains import Gains, simple_feedforward
from xy_sysid.control_design.inverse import feedforward
from xy_sysid.control_design.measured_table import MeasuredTable
from xy_sysid.control_design.path import ORDER, SampledPath, recorded
from xy_sysid.greybox.floor import TOP, TOP_SHARE, count_size, encoder_noise
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Run

HEARD = 0.05  # of the voltage's rms: largest contribution of encoder noise to a predicted voltage
HIGHEST, LOWEST = 0.05, 0.005  # of the sampling rate: bounds of the frequency below which voltages are compared
WIDER = 4.0  # cut-off of the motion over that of the voltages, so that its reversals keep their times
EDGE = 0.02  # of the recording at each end, which a zero-phase filter distorts


@dataclass(frozen=True, slots=True)
class Predicted:
    """The recorded voltage compared with the feedforward of the recorded motion.

    below: Hz, highest frequency that is compared; voltage: rms of the recorded voltage, V
    The others are rms, V, of the input that a feedforward does not predict. inertia: without kS; simple: with kS too; whole: with every law
    tabled: with the measured table too, each half with the table of the other half; None without one
    """

    below: float
    voltage: float
    inertia: float
    simple: float
    whole: float
    tabled: float | None = None


@dataclass(frozen=True, slots=True)
class Loop:
    """Another feedback along the same path: tracking errors, m rms, alone and with the compensation, and of the worst sample with it; largest: V."""

    name: str
    alone: float
    compensated: float
    worst: float
    largest: float


@dataclass(frozen=True, slots=True)
class Tracking:
    """Simulated tracking errors of the load, m rms, behind gap and scale error, under the same feedback.

    path: in words; feedback, simple, whole, compensated: alone, with kS, kV and kA, with every law inverted, with the laws whose inversion helps
    worst: of the compensated axis over samples of its parameters; largest: V, the largest voltage of any of them; limit: V
    undone, left: laws that the compensation inverts, and (law, why) of the others
    loops: the other feedbacks that were designed, with the same compensation; state feedback only where the calculation takes a period at least,
        because its design contains that period
    """

    path: str
    feedback: float
    simple: float
    whole: float
    compensated: float
    worst: float
    largest: float
    limit: float
    undone: tuple[str, ...]
    left: tuple[tuple[str, str], ...]
    loops: tuple[Loop, ...] = ()


def encoder_of(run: Run) -> Encoder:
    """Noise and counts of the encoder of a recording whose position was measured."""
    count = count_size(run.position)
    noise = encoder_noise(run.sampling_rate, run.position)
    return Encoder(noise=math.sqrt(max(noise**2 - count**2 / 12.0, 0.0)), count=count)


def encoder_of_floor(noise_floor: float, sampling_rate: float) -> Encoder:
    """White noise of an encoder that causes this noise floor, m/s rms, of the velocity below the highest frequency that is compared.

    The difference of white noise has the power density 2 (1 - cos w), w = 0 .. pi.
    """
    top = min(TOP, TOP_SHARE * sampling_rate) / (0.5 * sampling_rate)
    return Encoder(noise=noise_floor / sampling_rate / math.sqrt(2.0 * (top - math.sin(math.pi * top) / math.pi)))


def predicted(model: PhysicalModel, found: Gains, run: Run, table: MeasuredTable | None = None) -> Predicted:
    """The voltage of a run from its motion; table: of the residual input of this run. Raises BadInput if the run is too short."""
    below = clear_below(model, run)
    path = recorded(run.position, run.sampling_rate, WIDER * below)
    sos = scipy.signal.butter(ORDER, below, fs=run.sampling_rate, output="sos")
    edge = max(int(EDGE * len(run)), 1)

    def heard(voltage: FloatArray) -> FloatArray:
        return np.asarray(scipy.signal.sosfiltfilt(sos, voltage)[edge:-edge])

    wanted = heard(run.voltage)
    early = path.ahead(model.model.delay + 0.5 / run.sampling_rate)  # all get the same delay: only their laws are compared
    whole = feedforward(model.model, path).voltage
    tries = [simple_feedforward(found, early, False), simple_feedforward(found, early), whole]
    tries += [] if table is None else [whole + table.of_other_half(path)]
    left = [float(np.sqrt(np.mean((wanted - heard(voltage)) ** 2))) for voltage in tries]
    return Predicted(
        below=below,
        voltage=float(np.sqrt(np.mean(wanted**2))),
        inertia=left[0],
        simple=left[1],
        whole=left[2],
        tabled=left[3] if table is not None else None,
    )


def clear_below(model: PhysicalModel, run: Run) -> float:
    """Hz: below it the sensor's noise adds at most ``HEARD`` to a voltage that is calculated from the measured motion."""
    noise, size = encoder_noise(run.sampling_rate, run.position, run.measured, run.voltage), float(np.std(run.voltage))
    own = abs(model.model.gain * model.model.pole)
    allowed = HEARD * size * own / max(noise, 1e-300)  # (rad/s)^times
    times = {"position": 2, "velocity": 1, "acceleration": 0}[run.measured]
    top = allowed ** (1.0 / times) / (2.0 * np.pi) if times else math.inf
    return float(np.clip(top, LOWEST * run.sampling_rate, HIGHEST * run.sampling_rate))


def tracked(
    models: Sequence[AxisModel],
    found: Gains,
    controller: Controller,
    path: tuple[str, SampledPath],
    encoder: Encoder,
    others: Sequence[tuple[str, Controller]] = (),
) -> tuple[Tracking, Compensation]:
    """The path followed by the first model with each feedforward, and the compensation; the other models are samples of its parameters.

    others: names and controllers of ``Tracking.loops``
    """
    name, wanted = path
    made = compensate(models, found, wanted, controller, encoder)
    noise = shake(models[0], float(wanted.position[0]), wanted.sampling_rate, controller, encoder)
    whole = follow_path(models[0], wanted, controller, feedforward(models[0], wanted, noise).voltage, encoder)
    told = Tracking(
        path=name,
        feedback=made.centre[0],
        simple=made.centre[1],
        whole=rms(wanted.position - whole.carried),
        compensated=made.centre[2],
        worst=made.chosen,
        largest=made.largest,
        limit=controller.limit,
        undone=made.terms,
        left=made.left,
        loops=tuple(_loop(which, made, wanted, other, models, encoder) for which, other in others),
    )
    return told, made


def _loop(name: str, made: Compensation, wanted: SampledPath, controller: Controller, models: Sequence[AxisModel], encoder: Encoder) -> Loop:
    alone = follow_path(models[0], wanted, controller, None, encoder)
    runs = [follow_path(model, made.path, controller, made.voltage, encoder) for model in models]
    errors = [rms(wanted.position - run.carried) for run in runs]
    largest = max(float(np.max(np.abs(run.voltage))) for run in runs)
    return Loop(name=name, alone=rms(wanted.position - alone.carried), compensated=errors[0], worst=max(errors), largest=largest)
