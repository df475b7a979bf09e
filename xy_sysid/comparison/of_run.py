"""Models compared with a run: where a model fails, whether it holds, and which of two is better."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xy_sysid.comparison.where_it_fails import TWICE, Comparison, Unseen, compare_motion
from xy_sysid.comparison.which_is_better import Paired, paired
from xy_sysid.errors import BadInput
from xy_sysid.fitting.check_on_data import AT_THE_FLOOR, ModelCheck, check, check_motion
from xy_sysid.fitting.of_recording import estimate, fitted, judged, split
from xy_sysid.fitting.of_run import LinearModel
from xy_sysid.greybox.floor import encoder_noise
from xy_sysid.linear.any_model import AnyModel
from xy_sysid.response.distortion import Distortion, distortion
from xy_sysid.response.period import find_period
from xy_sysid.samples.recording import Recording, Run, one_run
from xy_sysid.settings import IdentifierSettings, build
from xy_sysid.units import told

HELD_OUT = 1.0 / 3.0  # of the recording, if the model was fitted to it
SEEN = "the model was fitted to this recording; only its last third is used"
OWN = "no model is given, so a linear one is fitted to the first two thirds and judged on the last third; to judge another, give its file"

MOST_LEFT = 0.7  # of the motion: half of its power
HARDLY = "The model explains little of the motion: it does not describe this axis, or input and output do not belong together."


@dataclass(frozen=True, slots=True)
class Judgement:
    """A model compared with the data of one axis.

    where:      in time, by speed, position and so on; check: in frequency, None if the data are too short or nothing is coherent
    notes:      caveats for the user
    """

    where: Comparison
    check: ModelCheck | None
    notes: tuple[str, ...] = ()


def compare(data: Run | Recording, model: AnyModel | None = None, **settings: Any) -> Comparison:
    """Where a model fails: by frequency, speed, direction, position, amplitude and time, in multiples of the noise floor.

    model: if None, a linear model is fitted to the first two thirds and judged by the last third
    A model that was fitted to the same data is also judged by their last third. settings: as for ``frf``
    Raises BadInput for a run that is too short, or a model of another unit.
    """
    run = one_run(data)
    recording = data if isinstance(data, Recording) else run.recording()
    return judge(recording, run.axis, model, build(IdentifierSettings, settings, "compare")).where


def validate(data: Run | Recording, model: AnyModel, period: int | None = 0, **settings: Any) -> ModelCheck:
    """Validates a model on new data: in frequency line by line in sigma, and in time. The result is in ``sentence`` and ``holds``.

    period, settings: as for ``frf``. Raises BadInput for other units, or no line to be trusted.
    """
    run = one_run(data)
    recording = data if isinstance(data, Recording) else run.recording()
    return in_frequency(recording, run.axis, model, build(IdentifierSettings, settings, "validate"), period)[0]


def better(data: Run | Recording, before: AnyModel, after: AnyModel) -> Paired:
    """Is ``after`` better than ``before``? A paired test on the same windows; ``better`` is None if it does not decide.

    If one model was fitted to these data, only their last third is used.
    Source: Student, Biometrika 6 (1908); Holm, Scand. J. Statist. 6 (1979). Raises BadInput for too little data.
    """
    run = one_run(data)
    first = held(run) if run.digest in (*before.data, *after.data) else 0
    old, new = (model.velocity(run.sampling_rate, run.voltage, run.position)[first:] for model in (before, after))
    return paired(old, new, run.position[first:], run.sampling_rate, run.units)


def judge(recording: Recording, axis: str, model: AnyModel | None, settings: IdentifierSettings) -> Judgement:
    """Compare on the full recording if the model is from another one, else on its last third; without a model, fit one to the rest."""
    seen = model is not None and recording.run(axis).digest in model.data
    said = SEEN if seen else OWN if model is None else ""
    data = recording
    if model is None:
        training, data = split(recording, HELD_OUT)
        model = LinearModel(fitted(estimate(training, axis, settings).frf, settings).tf)
    run = data.run(axis)
    first = held(run) if seen else 0
    velocity = model.velocity(run.sampling_rate, run.voltage, run.position)[first:]
    with np.errstate(over="ignore"):  # positions of any size
        encoder = encoder_noise(run.sampling_rate, recording.run(axis).position, run.measured, recording.run(axis).voltage)
    unseen = Unseen(run.voltage[first:], run.position[first:], run.sampling_rate, run.units, encoder=encoder)
    with np.errstate(over="ignore", invalid="ignore"):  # a model that diverges
        where = compare_motion(velocity, unseen)
    hardly = HARDLY if np.isfinite(where.error) and where.error > MOST_LEFT * where.motion else ""
    notes = tuple(text for text in (model.doubt, said, hardly) if text)
    try:
        return Judgement(where, in_frequency(data, axis, model, settings)[0], notes)
    except BadInput:  # too short for a window, or nothing coherent: use the time domain only
        return Judgement(where, None, notes)


def in_frequency(
    recording: Recording, axis: str, model: AnyModel, settings: IdentifierSettings, period: int | None = 0
) -> tuple[ModelCheck, tuple[str, ...]]:
    """The check line by line, and the notes of the estimate; period: of the input, see ``estimate``. Raises BadInput."""
    found = estimate(recording, axis, settings, period)
    judged(found.frf)
    run = recording.run(axis)
    if isinstance(model, LinearModel):
        inputs, output, _ = run.sensed
        return check(model.tf, found.frf, inputs, output, model.hold), found.notes
    moved = estimate(simulated(recording, axis, model), axis, settings, period)
    velocity = model.velocity(run.sampling_rate, run.voltage, run.position)
    return check_motion(velocity, moved.frf, found.frf, run.position), (*found.notes, *([model.doubt] if model.doubt else []))


def simulated(recording: Recording, axis: str, model: AnyModel) -> Recording:
    """The recording with the simulated motion of the model on this axis, run by run."""
    u, y = recording.axis(axis)
    position = recording.position.copy()
    column = recording.axes.index(axis)
    for rows in recording.runs():
        if rows.stop - rows.start > 1:
            moved = np.cumsum(model.velocity(recording.sampling_rate, u[rows], y[rows])) / recording.sampling_rate
            position[rows.start + 1 : rows.stop, column] = y[rows.start] + moved
    return replace(recording, position=position)


def frequency_sentence(line: ModelCheck, where: Comparison) -> str:
    """The comparison in words, and its limits."""
    text = f"in frequency: residual {told(line.rms_sigma)} sigma rms, at worst {told(line.worst_sigma)} at {line.worst_hz:.4g} Hz"
    hidden = line.rms_sigma <= AT_THE_FLOOR and where.error_below_end > TWICE * where.floor_below_end
    return text + (
        ": the error does not repeat with the input, so the frequency response treats it as noise (friction does this)." if hidden else "."
    )


def held(run: Run) -> int:
    """Index of the first sample of the last third, which is held out if the model was fitted to the run."""
    return int((1.0 - HELD_OUT) * len(run))


def distorted(run: Run) -> Distortion | None:
    """Even and odd distortion of a run with an odd multisine; None for any other input."""
    period = find_period(run.voltage)
    return distortion(run.sampling_rate, run.voltage, run.position, period) if period else None
