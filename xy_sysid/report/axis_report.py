"""Everything about one axis that a report shows: response and fits, verdicts on them, and the story of what is missing.

All fits see the first two thirds of the recording; the last third is kept to test them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xy_sysid.axis_model import STANDARD, Library
from xy_sysid.errors import BadInput
from xy_sysid.offline import judged, split
from xy_sysid.recording import Recording
from xy_sysid.report.signals import excitation, motion
from xy_sysid.report.study import AxisStudy, study_axis
from xy_sysid.settings import IdentifierSettings
from xy_sysid.story import auto, begin, diagnosed
from xy_sysid.story_document import document
from xy_sysid.validation import HeldOut, Validation, validate

HELD_OUT = 1.0 / 3.0  # of the recording, as in every story
LONGEST = 600.0  # s of which the story is told: more would teach it nothing and take memory (2 MB a second at 2 kHz)
STAGES = ("response and fits", "rigid model", "diagnosis", "refinement")

Tell = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class AxisReport:
    """One axis.

    study: excitation and motion of the whole recording, response and fits of its first two thirds
    verdicts: on the ML fit, None without one; story: the document of ``story_document``, None if ``problem`` says why
    speed: rms of the measured speed, output unit / s; note: what a reader should know about orders and length
    """

    study: AxisStudy
    verdicts: Validation | None
    story: Mapping[str, Any] | None
    speed: float
    problem: str = ""
    note: str = ""

    @property
    def axis(self) -> str:
        """Its name."""
        return self.study.axis


def axis_report(
    recording: Recording,
    axis: str,
    settings: IdentifierSettings,
    period: int | None = 0,
    library: Library = STANDARD,
    tell: Tell = lambda stage: None,
) -> AxisReport:
    """All that can be said about one axis; what cannot is said in words. tell: called with each of STAGES as it begins."""
    tell(STAGES[0])
    studied, verdicts, note = _linear(recording, axis, settings, period)
    data = longest_run(recording, axis)
    if data is not None and data[0].size > round(LONGEST * data[2]):
        note = f"{note} What is missing is judged on the first {LONGEST:g} s of the longest stretch, of {data[0].size / data[2]:.4g} s.".strip()
    try:
        story = _story(recording, axis, library, tell)
    except BadInput as problem:
        return AxisReport(studied, verdicts, None, float("nan"), str(problem), note)
    return AxisReport(studied, verdicts, story, _speed(recording, axis), note=note)


def longest_run(recording: Recording, axis: str) -> HeldOut | None:
    """Input, output and rate of the longest gap-free stretch; None if there is none."""
    runs = recording.runs()
    if not runs:
        return None
    run = max(runs, key=lambda one: one.stop - one.start)
    u, y = recording.axis(axis)
    return u[run], y[run], recording.sampling_rate


def _linear(recording: Recording, axis: str, settings: IdentifierSettings, period: int | None) -> tuple[AxisStudy, Validation | None, str]:
    """Response, fits and verdicts; rigid orders, with a note, where the default ones give what cannot be an axis."""
    asked = _orders(settings)
    studied, verdicts = _studied(recording, axis, settings, period)
    if asked != _orders(IdentifierSettings()) or verdicts is None or _possible(studied, verdicts):
        return studied, verdicts, ""
    rigid = settings.model_copy(update={"numerator_order": 0, "denominator_order": settings.integrators + 1})
    again, checked = _studied(recording, axis, rigid, period)
    if checked is None or not _possible(again, checked):
        return studied, verdicts, ""
    orders = "/".join(str(order) for order in _orders(rigid))
    return again, checked, f"Orders {asked[0]}/{asked[1]} gave no stable and physical model; the transfer functions shown are of orders {orders}."


def _orders(settings: IdentifierSettings) -> tuple[int, int]:
    return settings.numerator_order, settings.denominator_order


def _possible(studied: AxisStudy, verdicts: Validation) -> bool:
    return studied.fits["ML"].converged and all(check.ok for check in verdicts.verdicts if check.name in ("stable", "feasible"))


def _studied(recording: Recording, axis: str, settings: IdentifierSettings, period: int | None) -> tuple[AxisStudy, Validation | None]:
    training, unseen = split(recording, HELD_OUT)
    drive, moved = excitation(recording, axis), motion(recording, axis)
    try:
        with np.errstate(all="ignore"):  # what overflows ends in a figure that the verdicts judge
            studied = replace(study_axis(training, axis, settings, period, refit=False), excitation=drive, motion=moved)
            if not studied.fits or studied.frf is None:
                return studied, None
            judged(studied.frf)
            return studied, validate(studied.fits["ML"], studied.frf, longest_run(unseen, axis))
    except BadInput as refusal:
        return replace(studied, fits={}, pair=None, problem=str(refusal)), None
    except (np.linalg.LinAlgError, ZeroDivisionError):
        problem = "The transfer function is beyond what numbers can hold: lower the orders or widen the band."
        return AxisStudy(axis, drive, moved, None, {}, None, None, problem), None


def _story(recording: Recording, axis: str, library: Library, tell: Tell) -> Mapping[str, Any]:
    data = longest_run(recording, axis)
    if data is None:
        raise BadInput("recording", "without a stretch that is free of gaps", "one", "Record again.")
    u, y, rate = data
    u, y = u[: round(LONGEST * rate)], y[: round(LONGEST * rate)]
    tell(STAGES[1])
    story = begin(axis, rate, u, y, library, units=(recording.input_unit, recording.output_unit))
    if story.steps:
        tell(STAGES[2])
        story = diagnosed(story, u, y, library)
        tell(STAGES[3])
        story = auto(story, u, y, library)
    return document(story)


def _speed(recording: Recording, axis: str) -> float:
    data = longest_run(recording, axis)
    return float("nan") if data is None else float(np.sqrt(np.mean((np.diff(data[1]) * data[2]) ** 2)))
