"""One case, from the drive to the verdict on the verdict."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from blind.cases import Case
from xy_sim.machine import Machine
from xy_sysid.axis_model import STANDARD
from xy_sysid.diagnosis import Diagnosis, diagnose
from xy_sysid.errors import BadInput
from xy_sysid.greybox import EPSILON, fit, prepare
from xy_sysid.traces import bounded

CONFIDENT = 0.5


@dataclass(frozen=True, slots=True)
class Judged:
    """What came of one case.

    right:   the truth was said: every effect (and, of one effect, only that), nothing, or not in the library
    first:   the first name is one of the truth's
    wrong:   a name that is not in the truth came first, with confidence
    ratio:   held-out error over that of a fit that began at the truth; for backlash innovation over noise; None if not named
    errors:  parameter -> relative error; inside: parameter -> is the truth in its 95 % interval
    """

    case: Case
    verdict: str
    effects: tuple[str, ...]
    confidence: float
    seconds: float
    right: bool
    first: bool
    wrong: bool
    ratio: float | None = None
    errors: dict[str, float] = field(default_factory=dict)
    inside: dict[str, bool] = field(default_factory=dict)


def run(case: Case) -> Judged:
    """Drive, diagnose, judge."""
    machine, recording = case.record()
    u, y = recording.axis("x")
    begun = time.process_time()
    found = diagnose(recording.sampling_rate, u, y)
    seconds = time.process_time() - begun
    named = found.effects if found.verdict == "missing_effect" else ()
    one = len(case.truth) == 1 and not case.nuisance
    if not case.known:
        right = found.verdict in ("not_in_library", "nothing_missing")
    elif not case.truth:
        right = found.verdict == "nothing_missing"
    else:
        right = set(named) == set(case.truth) if one else set(case.truth) <= set(named) or _laws(case.truth) <= _laws(named)
    first = bool(named) and (named[0] in case.truth or (not one and _laws(named[:1]) <= _laws(case.truth)))
    stray = bool(named) and not first and not (case.nuisance and named[0] in _parts(machine))
    wrong = stray and found.confidence >= CONFIDENT
    ratio, errors, inside = _measured(case, machine, recording.sampling_rate, u, y, found) if right and one and case.known else (None, {}, {})
    return Judged(case, found.verdict, found.effects, found.confidence, seconds, right, first, wrong, ratio, errors, inside)


def _laws(names: tuple[str, ...]) -> set[str]:
    """Names, with those that are the sum of others taken apart: no data can tell these from the others together."""
    sums = {name: whole.parts for name in names if name in STANDARD.effects and (whole := STANDARD[name].sum_of)}
    return {part for name in names for part in sums.get(name, (name,))}


def _parts(machine: Machine) -> set[str]:
    return set(machine.spec.axes[0].parts)


def true_values(case: Case, machine: Machine) -> dict[str, float]:
    """What the hypothesis should find, by ``effect.parameter``."""
    axis, truth = machine.spec.axes[0], machine.truth("x")
    values: dict[str, float] = {}
    for name in case.truth:
        if name not in STANDARD.effects:
            continue
        own = dict(axis.parts[name])
        if "per_revolution" in own:
            own["period"] = axis.drive.lead / own.pop("per_revolution")
        if name in ("base_resonance", "screw_compliance"):
            own = {"frequency": truth["antiresonance_hz"], "split": truth["resonance_hz"] / truth["antiresonance_hz"] - 1.0}
        if name == "backlash":
            own = {"gap": own["gap"]}
        values |= {f"{name}.{key}": float(value) for key, value in own.items() if key in STANDARD[name].names}
    return values


def _measured(case: Case, machine: Machine, fs: float, u: Any, y: Any, found: Diagnosis) -> tuple[float | None, dict[str, float], dict[str, bool]]:
    assert found.ladder is not None
    final, values = found.ladder.final, true_values(case, machine)
    errors, inside = {}, {}
    for key, value in values.items():
        try:
            estimate = final.parameter(key)
        except BadInput:
            continue
        angle = key.endswith("phase")
        if value == 0.0 or angle:
            continue
        errors[key] = abs(estimate.value / value - 1.0)
        inside[key] = estimate.low <= value <= estimate.high
    if case.truth == ("backlash",):
        return final.held_out_error / final.noise_floor, errors, inside
    if not case.truth:
        return None, errors, inside
    model = final.model
    for name in case.truth:
        known = [values.get(f"{name}.{key}", old) for key, old in zip(STANDARD[name].names, dict(model.effects)[name], strict=True)]
        model = model.with_effect(name, bounded(STANDARD[name], known))
    best = fit(prepare(fs, np.asarray(u), np.asarray(y), EPSILON), model)
    return final.held_out_error / best.held_out_error, errors, inside
