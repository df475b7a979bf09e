"""The expected recording of an experiment if a model is true, and how a rival would predict it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from xy_sysid.axis.forward import Motion, move
from xy_sysid.axis.model import AxisModel, simulator
from xy_sysid.experiment_design.beliefs import Belief, derivatives
from xy_sysid.experiment_design.criteria import BLOCK, COARSE, CYCLES, LOOKED
from xy_sysid.experiment_design.experiment import RAMP, Experiment
from xy_sysid.greybox.axis_data import FITTED_BLOCK, HELD_OUT_BLOCK, ROOM, WINDOWS, AxisData
from xy_sysid.greybox.floor import Bands, Windows, bands, floor
from xy_sysid.greybox.objective import Objective
from xy_sysid.samples.block import FloatArray


@dataclass(frozen=True)
class Setting:
    """The measurement of an experiment: windows, noise floor and response.

    layout: windows and bands; encoder: noise, m; epsilon: accuracy of laws, fraction of the motion; recorded: s of each present recording
    response: (bands,) |G|^2 of the machine to a force, as recorded (``greybox.floor``); None before any recording
    ramp: s, fade-in of an experiment
    """

    layout: Bands
    encoder: float
    epsilon: float
    recorded: tuple[float, ...] = ()
    response: FloatArray | None = None
    ramp: float = RAMP

    @property
    def looked(self) -> float:
        """s of an experiment that are simulated: a fixed steady duration plus the fade-in."""
        return LOOKED - RAMP + self.ramp

    @staticmethod
    def of(data: AxisData, ramp: float = RAMP) -> Setting:
        """The setting of some data, with windows for recordings as long as the simulated ones."""
        recorded = tuple(size / data.sampling_rate for size in data.counts(early=False))
        longest = max(LOOKED, *recorded)
        layout = bands(data.sampling_rate, int(longest * data.sampling_rate / WINDOWS))
        known, asked = (np.log(0.5 * (each.edges()[1:] + each.edges()[:-1])) for each in (data.layout, layout))
        response = np.exp(np.interp(asked, known, np.log(np.maximum(data.floor.response, 1e-300))))
        return Setting(
            layout=layout, encoder=data.floor.encoder, epsilon=data.floor.epsilon, recorded=recorded, response=np.asarray(response), ramp=ramp
        )

    def shortest(self) -> float:
        """Least duration of an experiment, s, with held-out windows when it is compared together with the present recordings.

        The windows grow with the data (``greybox.axis_data``), so the duration is searched in steps.
        """
        rate, seconds = self.layout.sampling_rate, BLOCK
        while True:
            every = (*self.recorded, seconds)
            window = bands(rate, int(min(sum(every) / WINDOWS, max(every) / ROOM) * rate)).length / rate
            if seconds - self.ramp >= CYCLES * (FITTED_BLOCK + HELD_OUT_BLOCK) * window:
                return seconds
            seconds += BLOCK


@dataclass(frozen=True)
class Recorded:
    """A recording without noise.

    windows: of the steady part; seconds: of this part; velocity: (windows, lines) spectrum; objective: scores errors of the velocity
    trusted: accuracy of laws, fraction of the motion; moves: True if the motion exceeds the encoder's noise
    """

    motion: Motion
    windows: Windows
    seconds: float
    velocity: NDArray[np.complex128]
    objective: Objective
    trusted: float
    moves: bool


def recorded(setting: Setting, experiment: Experiment, model: AxisModel, start: float, seconds: float | None = None) -> Recorded:
    """The recording of an experiment of ``seconds`` (``looked`` by default) if a model is true; start: m."""
    rate = setting.layout.sampling_rate
    return seen(setting, move(model, rate, experiment.drive(rate, setting.looked if seconds is None else seconds, start), COARSE))


def seen(setting: Setting, motion: Motion, since: float = 0.0) -> Recorded:
    """The recording of a motion, from the end of the fade-in on, or from a later instant, s."""
    rate, length = motion.sampling_rate, setting.layout.length
    velocity = np.diff(motion.position) * rate
    first = min(round(max(setting.ramp, since) * rate), max(velocity.size - length, 0))
    windows = Windows(setting.layout, np.arange(first, max(velocity.size - length, first) + 1, max(length // 2, 1), dtype=np.int64))
    least = floor(windows, velocity, setting.encoder, setting.epsilon, motion.voltage[:-1])
    least = least if setting.response is None else replace(least, response=setting.response)
    steady = (windows.end - first) / rate
    return Recorded(
        motion=motion,
        windows=windows,
        seconds=steady,
        velocity=windows.spectrum(velocity),
        objective=Objective.of(least),
        trusted=setting.epsilon,
        moves=bool(np.any(least.excited)),
    )


def predicted(item: Recorded, model: AxisModel) -> NDArray[np.complex128]:
    """(windows, lines) spectrum of the velocity that a model predicts from the voltage and position of a recording."""
    motion = item.motion
    names = [name for name, _ in model.effects]
    run = simulator(model.library, names, motion.sampling_rate, motion.voltage, motion.position, COARSE)
    return item.windows.spectrum(run(model.row))


def slopes(item: Recorded, belief: Belief, model: AxisModel, now: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """(k, windows, lines) derivatives of a model's prediction by the coordinates of its belief."""
    return np.nan_to_num(derivatives(lambda moved: predicted(item, moved), model, belief.scale, now))


def expected_error(item: Recorded, belief: Belief) -> FloatArray:
    """(bands,) power of a model's error where the model is true, m^2/s^2: noise, unmodelled force and motion."""
    return np.asarray(item.objective.floor + belief.force * item.objective.response + belief.motion)
