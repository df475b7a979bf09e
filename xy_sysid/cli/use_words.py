"""The output of ``xy-sysid use`` for one axis: tables, sentences, and its part of the JSON document."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from xy_sysid.cli.output import aside, estimate, plain, quantity, say, table
from xy_sysid.control_design.bandwidth import Cost
from xy_sysid.control_design.compensation import SIMPLE, left_words
from xy_sysid.control_design.feedback import Feedback
from xy_sysid.control_design.filters import Swing
from xy_sysid.control_design.limits import RESERVE
from xy_sysid.control_design.sampled import coefficients
from xy_sysid.control_design.use import Used
from xy_sysid.control_design.worth import Tracking
from xy_sysid.units import bare, motion, moved

TURN = 2.0 * math.pi  # rad


def show(name: str, used: Used) -> None:
    """Print every result of an axis."""
    for note in used.notes:
        say(f"axis {name}: {note}", aside)
    for part in (_show_gains, _show_feedback, _show_states, _show_modes, _show_corrections, _show_limits, _show_tracking):
        part(name, used)
    for effect, why in used.not_undone:
        say(f"  The feedforward does not compensate {effect}: {why}.")
    for what, why in used.refused:
        say(f"  No {what}: {why}")
    say()


def _show_gains(name: str, used: Used) -> None:
    doubtful = {item.name: item.doubt for item in used.gains.items if used.model.parameters and item.doubt}
    shown = [
        (
            *estimate(item.name, (item.value, item.low, item.high), item.unit),
            f"NOT DETERMINED: {doubtful[item.name]}" if item.name in doubtful else item.meaning,
        )
        for item in used.gains.items
    ]
    table(f"axis {name}: feedforward", ("gain", "value", "95 % interval", "unit", "in words"), shown)
    most = ", ".join(f"{item.name} {item.because[0][0]}" for item in used.gains.items if item.because)
    if most:
        say(f"  The parameter that contributes most to each interval: {most}.")


def _show_states(_: str, used: Used) -> None:
    s, units = used.states, used.model.units
    if s is not None:
        say(
            f"  State feedback with an observer (--to state_feedback): bandwidth {s.bandwidth / TURN:.3g} Hz, {s.b.size} states. Worst of {s.count} "
            f"samples: phase margin {s.worst.phase:.3g} degrees, gain margin {s.worst.gain:.3g}. A load of 1 {units.input} moves it by "
            f"{moved(s.rejects, units.output)} at most, and a tenth of that is left after {1e3 * s.settles:.3g} ms."
        )


def _show_modes(name: str, used: Used) -> None:
    for mode in used.modes:
        say(f"  {_mode(mode)}")
    if used.shaper is None:
        return
    rows = []
    for one in used.shapers:
        vibration = (f"{100 * share:.2g}" for share in (one.vibration, one.worst))
        rows.append((f"{one.name}{' (best)' if one is used.shaper else ''}", f"{1e3 * one.duration:.3g}", *vibration))
    title = f"axis {name}: input shapers at {used.shaper.frequency:.2f} Hz, damping {used.shaper.damping:.3g}"
    table(title, ("shaper", "ms longer", "vibration left, %", "at worst over the interval, %"), rows)
    if used.rings is not None:
        before, after = (moved(value, used.model.units.output) for value in used.rings)
        say(f"  After the fastest S-curve below the load swings by {before}; with the {used.shaper.name} shaper by {after}.")


def _show_corrections(_: str, used: Used) -> None:
    output = used.model.units.output
    for item in (*used.tables, *([used.friction] if used.friction is not None else [])):
        say(f"  Table {item.name}: {item.before:.3g} {item.unit} rms, known to {item.after:.2g}; {item.meaning}.")
    if used.gap is not None:
        low, high = bare(used.gap.low, output, 4), moved(used.gap.high, output, 4)
        closed = {effect for effect, _ in used.not_undone}
        left = any(effect in closed for one in used.tracking for effect, _ in one.left)
        useless = "; with the feedback above this is predicted not to help along the paths below" if left else ""
        say(f"  Backlash {moved(used.gap.value, output, 4)} ({low} .. {high}): {used.gap.meaning}{useless}.")


def _show_limits(_: str, used: Used) -> None:
    """Print the fastest path, and how much of the recorded input is predicted."""
    units = used.model.units
    if used.fastest is not None:
        f = used.fastest
        scale, unit = motion(units.output)
        speeds = f"{scale * f.bounds.speed:.3g} {unit}/s, {scale * f.bounds.acceleration:.4g} {unit}/s2"
        kept = f"{100 * RESERVE:.0f} % of {used.limit:.4g} {units.input} kept ({used.limit_from})"
        say(f"  Fastest S-curve over the travel with {kept}: {speeds}, {f.path.seconds:.3g} s.")
    if used.predicted is not None:
        p = used.predicted
        off = [f"{100 * value / p.voltage:.3g} %" for value in (p.inertia, p.simple, p.whole)]
        tabled = "" if p.tabled is None else f", {100 * p.tabled / p.voltage:.3g} % with the table residual (that of the other half of the recording)"
        say(
            f"  The recorded input below {p.below:.3g} Hz, predicted from the recorded motion, is off by {off[0]} with kV and kA alone, "
            f"{off[1]} with kS, {off[2]} with the whole feedforward{tabled}."
        )


def _show_tracking(name: str, used: Used) -> None:
    units = used.model.units
    for way in used.tracking:
        errors = [("PID", *(bare(value, units.output) for value in (way.feedback, way.simple, way.compensated, way.worst)), f"{way.largest:.3g}")]
        for other in way.loops:
            alone, *both = (bare(value, units.output) for value in (other.alone, other.compensated, other.worst))
            errors.append((other.name, alone, "", *both, f"{other.largest:.3g}"))
        title = f"axis {name}, {way.path}: simulated tracking error, rms, {motion(units.output)[1]}"
        table(title, ("feedback", "alone", "+ kS kV kA", "compensated", "worst", f"largest {units.input}"), errors)
    if used.tracking:
        say(f"  {_compensation(used.tracking[0])}")


def _show_feedback(name: str, used: Used) -> None:
    """Print gains, with a filter in the loop if it allows a higher bandwidth; margins, encoder noise, and further limits."""
    loop, units = used.feedback, used.model.units
    if loop is None:
        return
    loops = [loop, *([used.filtered] if used.filtered is not None else [])]
    rows: list[tuple[str, Callable[[Feedback], str], str]] = [
        ("crossover", lambda item: f"{item.nominal.crossover:.3g}", "Hz"),
        ("P-PI: position loop", lambda item: f"{item.position_gain:.4g}", "1/s"),
        ("P-PI: velocity loop", lambda item: f"{item.velocity_gain:.4g}", units.of("V/(m/s)")),
        ("P-PI: integral time", lambda item: f"{1e3 * item.integral_time:.4g}", "ms"),
        ("PID: kp", lambda item: f"{item.controller.kp:.4g}", units.of("V/m")),
        ("PID: ki", lambda item: f"{item.controller.ki:.4g}", units.of("V/m") + "/s"),
        ("PID: kd", lambda item: f"{item.controller.kd:.4g}", units.of("V/(m/s)")),
        ("derivative filter", lambda item: f"{1e3 * item.controller.derivative_time:.3g}", "ms"),
    ]
    columns = ("number", "value", *([f"with the {used.filter.kind}"] if used.filter is not None else []), "unit")
    periods = f"{used.calculation:g} period{'s' * (used.calculation != 1.0)}"
    title = f"axis {name}: feedback at {loop.sampling_rate:g} Hz ({used.rate_from}), written {periods} after reading"
    table(title, columns, [(what, *map(of, loops), unit) for what, of, unit in rows])
    found = coefficients(loops[-1].controller, loop.sampling_rate)
    which = ("PID", *([used.filter.kind] if used.filter is not None else []))
    kind = f", with the {used.filter.kind}" if used.filter is not None else ""
    shown = [(what, *(f"{value:.9g}" for value in row)) for what, row in zip(which, found.tolist(), strict=True)]
    table(f"axis {name}: the same{kind} as sections b0 + b1/z + b2/z2 over 1 + a1/z + a2/z2", ("section", "b0", "b1", "b2", "a1", "a2"), shown)
    worst = loop.worst
    heard = f" Encoder noise makes {quantity(loop.noise, units.input, 2)} rms." if loop.noise > 0.0 else ""
    say(
        f"  Worst of {loop.count} samples of the intervals: phase margin {worst.phase:.3g} degrees, gain margin {worst.gain:.3g}, "
        f"sensitivity {worst.sensitivity:.3g}; the {loop.short} margin is the limit.{heard}"
    )
    if used.allowed is not None:
        costs = ", ".join(_cost(item) for item in used.allowed.costs)
        say(f"  The margins allow a crossover of {used.allowed.crossover:.3g} Hz. Costs: {costs}.")
    if used.filter is not None and used.filtered is not None:
        f, at = used.filter, used.filtered.nominal.crossover
        width = f" (damping {f.width:.2g}, depth {f.depth:.2g})" if f.kind == "notch" else ""
        say(f"  A {f.kind} at {f.frequency:.4g} Hz{width} in the loop takes {f.phase_cost(at):.2g} degrees and raises the crossover to {at:.3g} Hz.")
    elif used.modes:
        say("  Neither a notch nor a low-pass in the loop allows a higher crossover.")


def _cost(item: Cost) -> str:
    takes = [f"{item.phase:.2g} degrees at the crossover"] if abs(item.phase) >= 0.05 else []
    alone = [f"{item.without:.3g} Hz without it"] if math.isfinite(item.without) else []
    return f"{item.part} {' and '.join(takes + alone)}"


def _compensation(item: Tracking) -> str:
    """The effects that are compensated along a path, and those that are not."""
    if item.undone == (SIMPLE,):
        why = item.left[0][1] if item.left else "there is nothing else to undo"
        return f"The compensation is kS, kV and kA alone: {why}."
    return f"The compensation undoes {', '.join(item.undone)}{left_words(item.left)}."


def _mode(mode: Swing) -> str:
    held, free = (f"{item.value:.4g} Hz ({item.low:.4g} .. {item.high:.4g})" for item in (mode.held, mode.free))
    least = mode.held.because[0][0] if mode.held.because else "nothing that is known"
    swings = f"{held} with the encoder's side held, damping {mode.held_damping:.3g}; {free} free, damping {mode.free_damping:.3g}"
    return f"Mode: {swings}; the intervals come mostly from {least}."


def answer(used: Used) -> dict[str, Any]:
    """The JSON document of an axis, without the model, which has its own file, and without the paths."""
    designs = ("friction", "tables", "gap", "modes", "shaper", "shapers", "rings", "allowed")
    names = ("sampling_rate", "rate_from", "calculation", "limit", "limit_from", "travel", *designs, "predicted", "tracking")
    found: dict[str, Any] = {name: getattr(used, name) for name in names}
    found["gains"] = {
        item.name: {"value": item.value, "unit": item.unit, "ci95": [item.low, item.high], "determined": item.determined, "because": item.because}
        for item in used.gains.items
    }
    loop = used.feedback
    found["feedback"] = None if loop is None else _loop(loop)
    for key, item, inside in (("notch", used.notch, loop), ("filter", used.filter, used.filtered)):
        found[key] = None if item is None or inside is None else {**plain(item), "phase_cost": item.phase_cost(inside.nominal.crossover)}
    found["filtered"] = None if used.filtered is None else _loop(used.filtered)
    found["state_feedback"] = plain(used.states) if used.states is not None else None
    quick = used.fastest
    found["fastest"] = None if quick is None else {"bounds": quick.bounds, "voltage": quick.voltage, "seconds": quick.path.seconds}
    found["refused"] = [{"what": what, "reason": why} for what, why in used.refused]
    found["not_undone"] = [{"effect": name, "reason": why} for name, why in used.not_undone]
    found["notes"] = used.notes
    return found


def _loop(loop: Feedback) -> dict[str, Any]:
    servo = ("position_gain", "velocity_gain", "integral_time")
    sections = coefficients(loop.controller, loop.sampling_rate)
    return {**plain(loop), **{name: getattr(loop, name) for name in servo}, "coefficients": sections.tolist()}
