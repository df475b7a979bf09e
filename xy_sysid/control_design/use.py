"""All results for a controller from a refined model, in one call."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from xy_sysid.axis.model import AxisModel
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.bandwidth import Bandwidth, bandwidth_of, with_filter
from xy_sysid.control_design.closed_loop import NO_LIMIT, Encoder
from xy_sysid.control_design.compensation import Compensation
from xy_sysid.control_design.feedback import GAIN_MARGIN, PHASE_MARGIN, Asked, Feedback, feedback
from xy_sysid.control_design.filters import LoopFilter, Shaper, Swing, best_shaper, modes, notch, rings_after, shapers
from xy_sysid.control_design.gains import Gains, gains
from xy_sysid.control_design.inverse import not_undone
from xy_sysid.control_design.laws import largest_voltage
from xy_sysid.control_design.limits import Fastest, fastest
from xy_sysid.control_design.measured_table import measured_table
from xy_sysid.control_design.path import Bounds, SampledPath, recorded, s_curve
from xy_sysid.control_design.state_feedback import StateFeedback, state_feedback
from xy_sysid.control_design.tables import Correction, friction_table, position_tables
from xy_sysid.control_design.uncertain import Derived, derive, later, samples
from xy_sysid.control_design.worth import EDGE, WIDER, Predicted, Tracking, clear_below, encoder_of, predicted, tracked
from xy_sysid.errors import BadInput
from xy_sysid.linear.any_model import AnyModel
from xy_sysid.samples.recording import Recording, Run, one_run
from xy_sysid.tables import Table, with_sentence
from xy_sysid.units import Sensed

CALCULATION, LONGEST_CALCULATION = 1.0, 10.0  # controller periods from reading to writing: of most drives, and the most accepted
WORST_OF = 6  # samples of the parameters along a path
CALM = 0.6  # of the fastest path's speed, for the path on which tracking is compared
FOLLOWED = 0.2  # of the bandwidth: cut-off of the recorded motion that the loop has to follow
LONGEST = 10.0  # s of a recorded motion that is followed
Found = TypeVar("Found")


@dataclass(frozen=True, slots=True)
class Used:
    """The results for one axis (``axis``), in the units of the model (``model.units``).

    sampling_rate: Hz, of the controller; rate_from: its origin; calculation: controller periods from reading the encoder to writing the voltage
    limit: V, of the drive, infinite if unknown; limit_from: its origin
    travel: m, range of tables and paths; None if unknown
    gains, friction, tables, gap: feedforward and corrections (None: the axis has none)
    feedback, states (state feedback with an observer), modes, notch, shapers (of the lowest mode; shaper: the best), fastest: None or empty if
    there is nothing to design, or if it was refused
    allowed: the highest crossover, and the cost of each part of the axis; filter, filtered: the notch or low-pass with which the loop reaches the
    highest crossover, and that loop; None if none reaches more
    rings: m, amplitude with which the load swings after the fastest path, without and with the best shaper; None without a mode or a path
    predicted: input of the recording that is not predicted, if there is a recording; tracking: simulated tracking errors
    compensation: along the first path of ``tracking``; exported source inverts its laws
    refused: (design, why) of designs that are missing; not_undone: (effect, why) that the feedforward does not invert; notes: to be read first
    """

    axis: str
    model: PhysicalModel
    sampling_rate: float
    rate_from: str
    calculation: float
    limit: float
    limit_from: str
    travel: tuple[float, float] | None
    gains: Gains
    friction: Correction | None
    tables: tuple[Correction, ...]
    gap: Derived | None
    feedback: Feedback | None
    states: StateFeedback | None
    modes: tuple[Swing, ...]
    notch: LoopFilter | None
    allowed: Bandwidth | None
    filter: LoopFilter | None
    filtered: Feedback | None
    shapers: tuple[Shaper, ...]
    shaper: Shaper | None
    rings: tuple[float, float] | None
    fastest: Fastest | None
    predicted: Predicted | None
    tracking: tuple[Tracking, ...]
    compensation: Compensation | None
    refused: tuple[tuple[str, str], ...]
    not_undone: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]

    @property
    def in_loop(self) -> PhysicalModel:
        """The model with the delay of the controller's calculation."""
        return later(self.model, self.calculation / self.sampling_rate)

    def __repr__(self) -> str:
        named = ", ".join(f"{item.name} {item.value:.4g}" for item in self.gains.items[:3])
        loop = f", bandwidth {self.feedback.bandwidth:.3g} Hz" if self.feedback is not None else ""
        return f"<Used: axis {self.axis}, {named}{loop}>"

    @property
    def table(self) -> Table:
        """Each feedforward gain with its 95 % interval."""
        rows = ((item.name, item.value, item.low, item.high, item.unit) for item in self.gains.items)
        return Table(("gain", "value", "from", "to", "unit"), tuple(rows))

    def __str__(self) -> str:
        """The result in one line, and the table."""
        return with_sentence(repr(self)[1:-1], self.table)


def use(
    model: AnyModel,
    data: Run | Recording | None = None,
    rate: float | None = None,
    limit: float | None = None,
    bandwidth: float | None = None,
    travel: tuple[float, float] | None = None,
    *,
    margins: tuple[float, float] | None = None,
    calculation: float = CALCULATION,
) -> Used:
    """Feedforward with intervals, correction tables, feedback with margins, filters, limits, and the benefit of each.

    Defaults are in brackets. model: of ``refine`` or a file; data: a recording of the same machine, for its motion, noise and limit
    rate: Hz, of the controller (that of the recording, or of the one that the model was fitted to)
    limit: V, of the drive (the model's saturation, or the recording's largest voltage)
    bandwidth: Hz, crossover of the loop (the largest with the margins); travel: m, range of tables and paths (the recording's)
    margins: phase margin, degrees, and gain margin, factor, that the worst sample of the parameters has to keep (45 and 2)
    calculation: periods of the controller from reading the encoder to writing the voltage, in margins and simulations (1: written in the next cycle)
    Raises BadInput for a transfer function, or values out of range. Designs that miss the margins are in ``refused``.
    """
    task = _task(model, data, rate, limit, travel, calculation)
    model, run, placed, refused = task.model, task.run, task.placed, list[tuple[str, str]]()
    asked = Asked(*(margins or (PHASE_MARGIN, GAIN_MARGIN)), bandwidth)
    found = gains(model)
    loop = _tried("feedback", lambda: feedback(_placed(task.late, task.sensed), task.rate, asked, encoder=task.encoder, limit=task.limit), refused)
    swings = _tried("filters", lambda: modes(model), refused) or ()
    table = None if placed is None else _tried("measured table", lambda: measured_table(model, placed, WIDER * clear_below(model, placed)), refused)
    every = shapers(swings[0]) if swings else ()
    shaper = best_shaper(every) if every else None
    better = None if loop is None or bandwidth is not None else with_filter(task.late, task.rate, swings, loop, task.encoder, task.limit)
    quick = _fastest(task, refused)
    states = _tried("state feedback", lambda: state_feedback(_placed(task.soon, task.sensed), task.rate, asked), refused)
    followed: list[tuple[Tracking, Compensation]] = []
    if loop is not None:
        others = [] if better is None else [(f"with the {better[0].kind}", better[1].controller)]
        others += [("state feedback", states.controller(task.limit))] if states is not None and calculation >= 1.0 else []
        slow = samples(task.late, WORST_OF)
        followed = [tracked(slow, found, loop.controller, path, task.encoder, others) for path in _paths(task, loop, quick)]
    return Used(
        axis=model.axis or (run.axis if run is not None else "x"),
        model=model,
        sampling_rate=task.rate,
        rate_from=task.rate_from,
        calculation=calculation,
        limit=task.limit if task.limit < NO_LIMIT else math.inf,
        limit_from=task.limit_from,
        travel=task.travel,
        gains=found,
        friction=friction_table(model, max(0.5 * min(task.limit, 4.0) * abs(model.model.gain), 1e-12)),
        tables=(*(() if task.travel is None else position_tables(model, task.travel)), *([] if table is None else [table.correction(model)])),
        gap=_gap(model),
        feedback=loop,
        states=states,
        modes=swings,
        notch=_tried("notch", lambda: notch(swings[0], task.rate), refused) if swings and loop is not None else None,
        allowed=None
        if loop is None
        else _tried("bandwidth", lambda: bandwidth_of(model, task.rate, loop.nominal.crossover, asked, task.wait), refused),
        filter=None if better is None else better[0],
        filtered=None if better is None else better[1],
        shapers=every,
        shaper=shaper,
        rings=None if quick is None or shaper is None else (rings_after(quick.path, swings[0]), rings_after(shaper.shape(quick.path), swings[0])),
        fastest=quick,
        predicted=None if run is None else _tried("prediction", lambda: predicted(model, found, run, table), refused),
        tracking=tuple(item for item, _ in followed),
        compensation=followed[0][1] if followed else None,
        refused=tuple(refused),
        not_undone=not_undone(model.model),
        notes=_notes(model, run, found),
    )


@dataclass(frozen=True)
class _Task:
    """What is designed for: the model, a recording of its machine, the controller and the drive; see ``use`` and ``Used``."""

    model: PhysicalModel
    run: Run | None
    rate: float
    rate_from: str
    limit: float
    limit_from: str
    travel: tuple[float, float] | None
    wait: float

    @property
    def late(self) -> PhysicalModel:
        """The model with the delay of the calculation."""
        return later(self.model, self.wait)

    @property
    def soon(self) -> PhysicalModel:
        """The model for the design of the state feedback, of which a period of calculation is part."""
        return later(self.model, max(self.wait - 1.0 / self.rate, 0.0))

    @property
    def sensed(self) -> Sensed:
        """The measured quantity."""
        return self.model.units.sensed if self.run is None else self.run.measured

    @property
    def placed(self) -> Run | None:
        """The recording, if it has a position; the integral of a speed drifts, so it is no position."""
        return self.run if self.sensed == "position" else None

    @cached_property
    def encoder(self) -> Encoder:
        """The encoder of the recording."""
        return Encoder() if self.placed is None else encoder_of(self.placed)

    @property
    def ends(self) -> list[float]:
        """m, where the paths over the travel stop; empty if the travel is unknown."""
        if self.travel is None:
            return []
        low, high = self.travel
        return [0.5 * (low + high), high, low, 0.5 * (low + high)]


def _task(
    model: AnyModel, data: Run | Recording | None, rate: float | None, limit: float | None, travel: tuple[float, float] | None, calculation: float
) -> _Task:
    """The task, with what was not given taken from the recording or the model. Raises BadInput for values out of range."""
    if not isinstance(model, PhysicalModel):
        raise BadInput("model", type(model).__name__, "a model with physical effects", "Make one with refine, or xy-sysid refine --model.")
    run = None if data is None else one_run(data)
    if run is not None and run.units != model.units:
        raise BadInput("units of the recording", "/".join(run.units), "/".join(model.units), "Give a recording in the model's units.")
    rate, rate_from = _rate(model, run, rate)
    if not 1.0 <= rate <= 1e6:
        raise BadInput("rate", f"{rate:g} Hz", "1 to 1e6 Hz", "Give the controller's rate.")
    if not 0.0 <= calculation <= LONGEST_CALCULATION:
        raise BadInput("calculation", f"{calculation:g} periods", f"0 to {LONGEST_CALCULATION:g}", "Give the periods from reading to writing.")
    drive, drive_from = _limit(model, run, limit)
    task = _Task(model=model, run=run, rate=rate, rate_from=rate_from, limit=drive, limit_from=drive_from, travel=travel, wait=calculation / rate)
    if not travel and task.placed is not None:
        task = replace(task, travel=(float(np.min(task.placed.position)), float(np.max(task.placed.position))))
    if task.travel is not None and not task.travel[0] < task.travel[1]:
        raise BadInput("travel", f"{task.travel[0]:g} to {task.travel[1]:g}", "two places, the lower first", "Give --travel LOW HIGH.")
    return task


def _fastest(task: _Task, refused: list[tuple[str, str]]) -> Fastest | None:
    """The fastest path over the travel."""
    models = _tried("worst cases", lambda: samples(task.model, WORST_OF), refused) or (task.model.model,)
    if task.travel is None:
        refused.append(("path and tables by position", "the travel is not known: give a recording of the position with --on, or --travel LOW HIGH."))
    if task.travel is None or not task.limit < NO_LIMIT:
        return None
    return _tried("fastest path", lambda: fastest(models, task.ends, task.limit, task.rate), refused)


def _paths(task: _Task, loop: Feedback, quick: Fastest | None) -> list[tuple[str, SampledPath]]:
    """The paths on which tracking is compared, with their names."""
    paths: list[tuple[str, SampledPath]] = []
    if quick is not None:
        calm = Bounds(CALM * quick.bounds.speed, CALM**2 * quick.bounds.acceleration, CALM**3 * quick.bounds.jerk)
        paths.append(("S-curve over the travel", s_curve(task.ends, calm, task.rate)))
    if task.run is not None and task.run.sampling_rate == task.rate:
        edge = max(int(EDGE * len(task.run)), 1)  # the low-pass distorts both ends
        whole = recorded(task.run.position, task.rate, FOLLOWED * loop.bandwidth)
        paths.append(("the recorded motion", whole.part(edge, min(len(task.run) - edge, edge + round(LONGEST * task.rate)))))
    return paths


def _tried(what: str, make: Callable[[], Found], refused: list[tuple[str, str]]) -> Found | None:
    """The result; None if it raises BadInput, whose text is added to ``refused``."""
    try:
        return make()
    except BadInput as problem:
        refused.append((what, str(problem)))
        return None


def _limit(model: PhysicalModel, run: Run | None, given: float | None) -> tuple[float, str]:
    if given is not None:
        if not 0.0 < given < math.inf:
            raise BadInput("limit", f"{given:g} V", "above 0 and finite", "Give the drive's largest voltage.")
        return given, "given"
    own = largest_voltage(model.model)
    if own < math.inf:
        return own, "the model's"
    if run is not None:
        return float(np.max(np.abs(run.voltage))), "the largest that the recording has; the drive may have more"
    return NO_LIMIT, "not known"


def _placed(model: PhysicalModel, sensed: Sensed) -> PhysicalModel:
    """The model, for a position loop. Raises BadInput if no position is measured."""
    if sensed != "position":
        given = f"of an axis whose {sensed} is measured, and no position"
        raise BadInput("position loop", given, "a measured position", "Close a velocity loop in the drive, or measure the position too.")
    return model


def _rate(model: PhysicalModel, run: Run | None, given: float | None) -> tuple[float, str]:
    if given is not None:
        return given, "given"
    if run is not None:
        return run.sampling_rate, "the recording's"
    if model.sampling_rate is not None:
        return model.sampling_rate, "of the recording that the model was fitted to"
    raise BadInput("rate of the controller", "not known", "in Hz", "Give it with --controller-rate (rate= in Python), or a recording with --on.")


def _gap(model: PhysicalModel) -> Derived | None:
    """The gap of an effect that has one, as a correction by direction."""
    for name, _ in model.model.effects:
        places = [k for k, item in enumerate(model.model.library[name].parameters) if item.name == "gap"]
        if places:
            meaning = (
                "free play: add half of it to the position asked for while moving forth, and subtract half while moving back, "
                "unless a load presses the table to one side"
            )
            return derive(model, "gap", "m", meaning, _parameter(name, places[0]))
    return None


def _parameter(name: str, place: int) -> Callable[[AxisModel], float]:
    return lambda model: dict(model.effects)[name][place]


def _notes(model: PhysicalModel, run: Run | None, found: Gains) -> tuple[str, ...]:
    notes = []
    if not model.parameters:
        notes.append("the model has no intervals, so the accuracy of these numbers is unknown: write it with refine --model")
    notes += [item.doubt for item in found.items if model.parameters and item.doubt]
    if run is not None and run.digest in model.data:
        notes.append("the model was fitted to this recording: before and after show how well it explains it, not how well it predicts another")
    if model.doubt:
        notes.append(model.doubt)
    return tuple(notes)
