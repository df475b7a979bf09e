"""Reduction of the tracking error: hidden machines, a minute of identification, then a path with three kinds of feedforward.

    python -m campaigns.bench use            60 axes; writes the table into docs/use.md
    python -m campaigns.bench use --short    two of them, as in the tests

Each axis has one to three hidden effects, of a simulated table, or of a joint or slide of MuJoCo. It is driven with noise for a minute, its
model is identified, and it follows a path within the recorded travel, with (a) a PID tuned by a relay experiment on the machine and the
rules of Ziegler and Nichols; (b) the same PID with kS, kV and kA; (c) the same PID with the compensation that is predicted to help; (d) our PID
with its compensation. The error is that of the true position on the encoder's side (the table, behind a gap), from the start of the motion of the
path. The seeds of the report were never used for tuning. With XY_SYSID_KEPT=DIR the models are kept there, so a stopped campaign can continue.
"""

from __future__ import annotations

import os
import statistics
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from campaigns.bench.recordings import between
from campaigns.bench.tables import Check, Table, at_most
from campaigns.bench.use_machines import LIMIT, Case, followed, identify, joint_case, table_case, ziegler_nichols
from xy_sysid.axis.model import AxisModel
from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.closed_loop import Controller, Encoder
from xy_sysid.control_design.compensation import SIMPLE, Compensation, compensate, compensate_within
from xy_sysid.control_design.feedback import feedback
from xy_sysid.control_design.gains import Gains, gains, simple_feedforward
from xy_sysid.control_design.path import Bounds, Moves, SampledPath, of_position
from xy_sysid.control_design.uncertain import later, samples
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

SECONDS, SHORT_SECONDS = 60.0, 8.0  # of identification
REPORT, FOREIGN, SHORT = range(9100, 9122), range(9200, 9216), range(12, 13)  # seeds of tables (two axes each), of MuJoCo, of the short form
PLACES, BOUNDS = (0.0, 0.03, -0.02, 0.0), Bounds(0.06, 1.0, 50.0)
FAR = 0.05  # m from the start to the end of a table
WITHIN = 0.95  # fraction of the recorded travel
DRAWS = 6  # samples of the parameters for judging a compensation
PAGE = Path(__file__).parents[2] / "docs" / "use.md"
KINDS = ("PID", "kS kV kA", "compensated", "compensated, own PID")


@dataclass(frozen=True, slots=True)
class Outcome:
    """One axis: its hidden, found and compensated effects; rms tracking errors in the order of ``KINDS``; left: True if it exceeded a limit."""

    name: str
    hidden: tuple[str, ...]
    found: tuple[str, ...]
    undone: tuple[str, ...]
    errors: tuple[float, ...]
    left: bool


def outcomes(case: Case, seed: int, seconds: float = SECONDS, kept: Path | None = None) -> list[Outcome]:
    """The outcome for every axis of a machine."""
    known = identify(case, seed, seconds, kept)
    rate, size, axes = case.machine.rate, case.size, case.machine.axes
    bounds = Bounds(size * BOUNDS.speed, size * BOUNDS.acceleration, size * BOUNDS.jerk)
    moves = [Moves(_within(known.travel[axis], size), bounds, rate) for axis in axes]
    relay = ziegler_nichols(case, _as_long([item.sampled() for item in moves]))
    own = [_own(known.models[axis], rate, relay[number]) for number, axis in enumerate(axes)]
    paths, simple, chosen, with_own = [], [], [], []
    for number, axis in enumerate(axes):
        model = known.models[axis]
        found, of = gains(model), samples(model, DRAWS)
        path, best = _chosen(of, found, moves[number], relay[number], known.encoders[axis])
        paths.append(path)
        simple.append(simple_feedforward(found, path))
        chosen.append(best)
        with_own.append(compensate(of, found, path, own[number], known.encoders[axis]))

    def run(wanted: Sequence[SampledPath], extras: Sequence[FloatArray], controllers: Sequence[Controller]) -> tuple[FloatArray, NDArray[np.bool_]]:
        longer = _as_long(wanted)
        return followed(case, longer, [_padded(extra, longer[0].position.size) for extra in extras], controllers)

    runs = (
        run(paths, [np.zeros(1)] * len(axes), relay),
        run(paths, simple, relay),
        run([item.path for item in chosen], [item.voltage for item in chosen], relay),
        run([item.path for item in with_own], [item.voltage for item in with_own], own),
    )
    return [
        _outcome(f"{case.name} {axis}", (case.hidden[number], known.models[axis].effects), chosen[number], paths[number], [
            (place[:, number], full[:, number]) for place, full in runs
        ], FAR * size)
        for number, axis in enumerate(axes)
    ]  # fmt: skip


def _chosen(of: Sequence[AxisModel], found: Gains, moves: Moves, controller: Controller, encoder: Encoder) -> tuple[SampledPath, Compensation]:
    """The path and its compensation; if the compensation is refused, the requested path with kS, kV and kA."""
    try:
        return compensate_within(of, found, moves, controller, encoder)
    except BadInput as refused:
        path = moves.sampled()
        simple, unknown = simple_feedforward(found, path), float("nan")
        left = tuple((name, str(refused)) for name, _ in of[0].effects)
        errors = (unknown, unknown, unknown)
        return path, Compensation(path, simple, (f"{SIMPLE}, refused",), left, *errors, largest=unknown, centre=errors, inverse=None)


def _within(travel: tuple[float, float], size: float) -> list[float]:
    """The positions of the path, clipped to the recorded travel."""
    low, high = (WITHIN * end for end in travel)
    return [min(max(size * place, low), high) for place in PLACES]


def _as_long(paths: Sequence[SampledPath]) -> list[SampledPath]:
    """The paths, all extended to the longest; the others wait at their ends."""
    count = max(path.position.size for path in paths)
    return [of_position(_padded(path.position, count), path.sampling_rate) for path in paths]


def _padded(values: FloatArray, count: int) -> FloatArray:
    """The values, with the last one repeated up to ``count``."""
    return np.concatenate((values, np.full(count - values.size, values[-1])))


def _own(model: PhysicalModel, rate: float, otherwise: Controller) -> Controller:
    """Our PID, for a reading that is one sample old; the other controller if no PID has the margins."""
    try:
        return feedback(later(model, 1.0 / rate), rate, limit=LIMIT).controller
    except BadInput:
        return otherwise


def _outcome(
    name: str,
    effects: tuple[tuple[str, ...], tuple[str, ...]],
    chosen: Compensation,
    path: SampledPath,
    runs: Sequence[tuple[FloatArray, NDArray[np.bool_]]],
    far: float,
) -> Outcome:
    """The outcome of one axis. runs: for each kind the positions, and True where its drive was at the limit; far: m, the end of the table."""
    begun = int(np.flatnonzero(path.speed)[0])  # before that a load moves the axis, because it is not controlled yet
    size = path.position.size
    errors = tuple(float(np.sqrt(np.mean((path.position - place[:size])[begun:] ** 2))) for place, _ in runs)
    place, full = runs[KINDS.index("compensated")]
    left = bool(full[:size].any() or np.max(np.abs(place[:size])) > far)
    return Outcome(name=name, hidden=effects[0], found=effects[1], undone=chosen.terms, errors=errors, left=left)


def table(found: Sequence[Outcome], seconds: float = SECONDS) -> Table:
    """The result of the campaign."""
    by_pid, by_simple = ([item.errors[2] / item.errors[k] for item in found] for k in (0, 1))
    rows = [
        (
            item.name,
            *(", ".join(names) or "none" for names in (item.hidden, item.found)),
            ", ".join(item.undone),
            *(f"{1e6 * value:.3g}" for value in item.errors),
        )
        for item in found
    ]
    middle = tuple(f"{1e6 * statistics.median(item.errors[k] for item in found):.3g}" for k in range(len(KINDS)))
    rows.insert(0, ("median", "", "", "", *middle))
    checks = (
        at_most("error with the compensation / error with the PID, median", statistics.median(by_pid), 0.1),
        at_most("error with the compensation / error with kS, kV and kA, median", statistics.median(by_simple), 1.0 / 3.0),
        at_most("the same, largest", max(by_simple), 1.0),
        Check("axes worse than with kS, kV and kA", str(sum(value > 1.0 for value in by_simple)), "0", max(by_simple) <= 1.0),
        Check("axes that left a limit", str(sum(item.left for item in found)), "0", not any(item.left for item in found)),
    )
    told = f"{len(found)} axes with hidden effects, {seconds:g} s of identification each; tracking errors, um rms (urad of a hinge)."
    columns = ("axis", "hidden", "found", "undone", *KINDS)
    return Table(title="Each axis, and the errors on its path", text=told, columns=columns, rows=tuple(rows), checks=checks)


def main(short: bool = False) -> None:
    """Run the campaign and print its table; if not short, write it to docs/use.md."""
    from campaigns.bench.__main__ import text

    kept = Path(folder) if (folder := os.environ.get("XY_SYSID_KEPT")) and not short else None
    seconds = SHORT_SECONDS if short else SECONDS
    found: list[Outcome] = []
    for case, seed in [(table_case, seed) for seed in (SHORT if short else REPORT)] + [(joint_case, seed) for seed in (() if short else FOREIGN)]:
        fresh = outcomes(case(seed), seed, seconds, kept)
        for item in fresh:
            sys.stderr.write(f"{item.name}: {', '.join(item.found)}: {', '.join(f'{1e6 * value:.4g}' for value in item.errors)} um\n")
        found += fresh
    made = text("use", table(found, seconds))
    sys.stdout.write(made)
    if not short:
        PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), "use", made), encoding="utf-8")
