"""All results for a controller from a refined model, in one call."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
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
from xy_sysid.control_design.path import Bounds, recorded, s_curve
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
    wait = calculation / rate
    late = later(model, wait)
    drive, drive_from = _limit(model, run, limit)
    sensed = model.units.sensed if run is None else run.measured
    placed = run if sensed == "position" else None  # the integral of a speed drifts, so it is no position
    between = travel or (None if placed is None else (float(np.min(placed.position)), float(np.max(placed.position))))
    if between is not None and not between[0] < between[1]:
        raise BadInput("travel", f"{between[0]:g} to {between[1]:g}", "two places, the lower first", "Give --travel LOW HIGH.")
    encoder = Encoder() if placed is None else encoder_of(placed)
    refused: list[tuple[str, str]] = []
    found = gains(model)
    asked = Asked(*(margins or (PHASE_MARGIN, GAIN_MARGIN)), bandwidth)
    loop = _tried("feedback", lambda: feedback(_placed(late, sensed), rate, asked, encoder=encoder, limit=drive), refused)
    swings = _tried("filters", lambda: modes(model), refused) or ()
    table = None if placed is None else _tried("measured table", lambda: measured_table(model, placed, WIDER * clear_below(model, placed)), refused)
    every = shapers(swings[0]) if swings else ()
    better = None if loop is None or bandwidth is not None else with_filter(late, rate, swings, loop, encoder, drive)
    models = _tried("worst cases", lambda: samples(model, WORST_OF), refused) or (model.model,)
    quick, ends = None, []
    if between is None:
        refused.append(("path and tables by position", "the travel is not known: give a recording of the position with --on, or --travel LOW HIGH."))
    else:
        centre = 0.5 * (between[0] + between[1])
        ends = [centre, between[1], between[0], centre]
    if ends and drive < NO_LIMIT:
        quick = _tried("fastest path", lambda: fastest(models, ends, drive, rate), refused)
    soon = later(model, max(wait - 1.0 / rate, 0.0))  # a period of calculation is part of the design of the state feedback
    states = _tried("state feedback", lambda: state_feedback(_placed(soon, sensed), rate, asked), refused)
    shaper = best_shaper(every) if every else None
    rings = None
    if quick is not None and shaper is not None:
        rings = rings_after(quick.path, swings[0]), rings_after(shaper.shape(quick.path), swings[0])
    followed: list[tuple[Tracking, Compensation]] = []
    if loop is not None:
        paths = []
        if quick is not None:
            calm = Bounds(CALM * quick.bounds.speed, CALM**2 * quick.bounds.acceleration, CALM**3 * quick.bounds.jerk)
            paths.append(("S-curve over the travel", s_curve(ends, calm, rate)))
        if run is not None and run.sampling_rate == rate:
            edge = max(int(EDGE * len(run)), 1)  # the low-pass distorts both ends
            whole = recorded(run.position, rate, FOLLOWED * loop.bandwidth)
            paths.append(("the recorded motion", whole.part(edge, min(len(run) - edge, edge + round(LONGEST * rate)))))
        slow = samples(late, WORST_OF)
        others = [] if better is None else [(f"with the {better[0].kind}", better[1].controller)]
        others += [("state feedback", states.controller(drive))] if states is not None and calculation >= 1.0 else []
        followed = [tracked(slow, found, loop.controller, path, encoder, others) for path in paths]
    return Used(
        axis=model.axis or (run.axis if run is not None else "x"),
        model=model,
        sampling_rate=rate,
        rate_from=rate_from,
        calculation=calculation,
        limit=drive if drive < NO_LIMIT else math.inf,
        limit_from=drive_from,
        travel=between,
        gains=found,
        friction=friction_table(model, max(0.5 * min(drive, 4.0) * abs(model.model.gain), 1e-12)),
        tables=(*(() if between is None else position_tables(model, between)), *([] if table is None else [table.correction(model)])),
        gap=_gap(model),
        feedback=loop,
        states=states,
        modes=swings,
        notch=_tried("notch", lambda: notch(swings[0], rate), refused) if swings and loop is not None else None,
        allowed=None if loop is None else _tried("bandwidth", lambda: bandwidth_of(model, rate, loop.nominal.crossover, asked, wait), refused),
        filter=None if better is None else better[0],
        filtered=None if better is None else better[1],
        shapers=every,
        shaper=shaper,
        rings=rings,
        fastest=quick,
        predicted=None if run is None else _tried("prediction", lambda: predicted(model, found, run, table), refused),
        tracking=tuple(item for item, _ in followed),
        compensation=followed[0][1] if followed else None,
        refused=tuple(refused),
        not_undone=not_undone(model.model),
        notes=_notes(model, run, found),
    )


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
