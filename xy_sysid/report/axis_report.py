"""The content of a report for one axis: response, fits with verdicts, and missing effects.

Transfer functions are fitted to the first two thirds of the recording and tested on the last third;
the story's models are fitted to two thirds that are spread over the recording.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from xy_sysid.axis.model import STANDARD, Library
from xy_sysid.comparison.of_run import HELD_OUT
from xy_sysid.diagnosis.refine import never
from xy_sysid.errors import BadInput
from xy_sysid.fitting.of_recording import judged, split
from xy_sysid.fitting.verdicts import Validation, validate
from xy_sysid.greybox.axis_data import SHORTEST
from xy_sysid.report.axis_fits import AxisFits, fit_axis
from xy_sysid.report.signals import excitation, motion
from xy_sysid.samples.moves import several_moves
from xy_sysid.samples.recording import Recording, Run
from xy_sysid.settings import IdentifierSettings
from xy_sysid.story.document import document
from xy_sysid.story.story import tell as whole_story

LONGEST = 600.0  # s of data for the story: more would not improve it and needs memory (2 MB per second at 2 kHz)
MOST_SENT = 1 << 27  # bytes of positions; a longer recording is not copied to another process
STAGES = ("response and fits", "diagnosis")

Tell = Callable[[str, str], None]
Begin = Callable[..., Callable[[], Any]]  # starts a function of this module with its arguments; returns a function that waits for its result


@dataclass(frozen=True, slots=True)
class AxisReport:
    """The report content of one axis.

    study: excitation and motion of the whole recording, response and fits of its first two thirds
    verdicts: on the ML fit, None without an ML fit; story: the document of ``story.document``, None if ``problem`` gives the reason
    speed: rms of the measured speed, output unit / s; note: remarks for the reader on orders and length
    """

    study: AxisFits
    verdicts: Validation | None
    story: Mapping[str, Any] | None
    speed: float
    problem: str = ""
    note: str = ""

    @property
    def axis(self) -> str:
        """The name of the axis."""
        return self.study.axis


@dataclass(frozen=True, slots=True)
class Wanted:
    """Options of a report. period: of the input, samples (0: none, None: found); budget: s of processor time for the diagnosis of each axis."""

    settings: IdentifierSettings = field(default_factory=IdentifierSettings)
    period: int | None = 0
    library: Library = STANDARD
    budget: float = math.inf


def later(function: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
    """Do not start yet: the returned function computes the result when it is called."""
    return lambda: function(*arguments)


def axis_reports(
    recording: Recording, axes: Sequence[str], wanted: Wanted, tell: Tell = lambda axis, stage: None, begin: Begin = later
) -> dict[str, AxisReport]:
    """The reports of these axes, by name.

    tell: called with an axis and each of STAGES as the stage starts; begin: starts the fits of all axes, in parallel with the stories if possible
    """
    begin = begin if recording.position.nbytes < MOST_SENT else later
    fits = {}
    for axis in axes:
        tell(axis, STAGES[0])
        fits[axis] = begin(_studied, recording.of_axes((axis,)), axis, wanted.settings, wanted.period)
    return {axis: _report(recording, axis, wanted, tell, fits[axis]) for axis in axes}


def _report(recording: Recording, axis: str, wanted: Wanted, tell: Tell, fits: Callable[[], Any]) -> AxisReport:
    """The report of one axis; a part that cannot be computed has a sentence instead."""
    runs = recording.stretches(axis) if len(recording) else ()
    seconds, notes = sum(run.seconds for run in runs), [text.partition(": ")[2] for text in recording.left_out((axis,))]
    if seconds > LONGEST:
        stretches = "the longest stretch" if len(runs) == 1 else f"{len(runs)} stretches"
        notes.append(f"The diagnosis uses the first {LONGEST:g} s of {stretches}, of {seconds:.4g} s.")
    story, problem = None, ""
    tell(axis, STAGES[1])
    try:
        story = told(recording, axis, wanted)
    except BadInput as refusal:
        problem = str(refusal)
    studied, verdicts = fits()
    speed = float("nan") if story is None else _speed(recording, axis)
    return AxisReport(study=studied, verdicts=verdicts, story=story, speed=speed, problem=problem, note="; ".join(notes))


def _studied(recording: Recording, axis: str, settings: IdentifierSettings, period: int | None) -> tuple[AxisFits, Validation | None]:
    training, unseen = split(recording, HELD_OUT)
    drive, moved = excitation(recording, axis), motion(recording, axis)
    try:
        with np.errstate(all="ignore"):  # an overflow gives a number that the verdicts judge
            studied = replace(fit_axis(training, axis, settings, period), excitation=drive, motion=moved)
            if not studied.fits or studied.frf is None:
                return studied, None
            judged(studied.frf)
            return studied, validate(studied.fits["ML"], studied.frf, unseen.run(axis).sensed if len(unseen) else None, choice=studied.choice)
    except BadInput as refusal:
        return replace(studied, fits={}, pair=None, problem=str(refusal)), None
    except (np.linalg.LinAlgError, ZeroDivisionError):
        problem = "The coefficients of the transfer function are too large for the computer. Lower the orders or widen the band."
        return AxisFits(axis=axis, excitation=drive, motion=moved, problem=problem), None


def told(recording: Recording, axis: str, wanted: Wanted) -> Mapping[str, Any]:
    """The document of the full story of an axis, from at most LONGEST seconds. Raises BadInput for samples that cannot be analysed."""
    clock = never if wanted.budget == math.inf else time.process_time
    return document(whole_story(_stretches(recording, axis), wanted.library, clock, wanted.budget))


def _stretches(recording: Recording, axis: str) -> tuple[Run, ...]:
    """All runs of an axis, as ``diagnose`` uses them, at most LONGEST seconds in total. Raises BadInput if they hold one move only."""
    runs = recording.stretches(axis)
    several_moves(runs)
    found, left = [], LONGEST
    for run in runs:
        if left * run.sampling_rate >= SHORTEST:
            found.append(run.until(left))
            left -= run.seconds
    return tuple(found)


def _speed(recording: Recording, axis: str) -> float:
    if not len(recording):
        return float("nan")
    run = recording.run(axis)
    return float(np.sqrt(np.mean((np.diff(run.position) * run.sampling_rate) ** 2)))
