"""One case: drive, diagnosis, and comparison with the truth."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.blind.cases import FRICTION, Case
from campaigns.blind.recordings import recorded
from xy_sim.machine import Machine
from xy_sysid.axis.model import STANDARD
from xy_sysid.diagnosis.answer import Answer
from xy_sysid.diagnosis.diagnose import diagnose
from xy_sysid.errors import BadInput
from xy_sysid.greybox.free_run import EPSILON, fit, prepare
from xy_sysid.greybox.score_test import bounded

CONFIDENT = 0.9
FAINT = 0.1  # fraction of noise and dirt together: a smaller change of the motion can hardly be detected in 60 s


@dataclass(frozen=True, slots=True)
class Judged:
    """The result of one case.

    right:    the answer is correct: every effect (if there is one, only that), nothing missing, or not in the library
    first:    the first name is one of the truth's
    wrong:    a name that is not in the truth came first, with confidence
    phantoms: named effects that are not on the axis, at any place and with any confidence
    unseen:   effects of the truth that change the motion by less than ``FAINT`` of noise and dirt, and by less than the answer says could be hidden
    ratio:    held-out error over that of a fit started at the truth; for backlash innovation over noise; None if not named
    errors:   parameter -> relative error; inside: parameter -> True if the truth is in its 95 % interval
    change, noise, dirt, kinds: see ``recordings.Seen``
    """

    case: Any  # a Case, or a Foreign of MuJoCo
    verdict: str
    effects: tuple[str, ...]
    confidence: float
    seconds: float
    right: bool
    first: bool
    wrong: bool
    phantoms: tuple[str, ...] = ()
    unseen: tuple[str, ...] = ()
    ratio: float | None = None
    errors: dict[str, float] = field(default_factory=dict)
    inside: dict[str, bool] = field(default_factory=dict)
    change: dict[str, float] = field(default_factory=dict)
    noise: float = 0.0
    dirt: float = 0.0
    kinds: tuple[str, ...] = ()

    @property
    def phantom(self) -> bool:
        """True if an effect that is not on the axis is named with confidence."""
        return bool(self.phantoms) and self.confidence >= CONFIDENT

    @property
    def hidden(self) -> bool:
        """True if an effect of the truth changes the motion too little to be detected in noise and dirt."""
        return any(part < faint(self.noise, self.dirt) for part in self.change.values())


def run(case: Case, folder: Path | None = None) -> Judged:
    """Drive (or read the recording from the folder), diagnose and judge."""
    recording = recorded(case, folder)
    machine, seen = case.exact(), recording.seen
    u, y = recording.voltage, recording.position
    begun = time.process_time()
    found = diagnose(recording.rate, u, y, clock=time.process_time)
    seconds = time.process_time() - begun
    named = names(found)
    one = len(case.truth) == 1 and not case.nuisance
    there = _there(case, machine, seen.kinds)
    phantoms = tuple(name for name in named if not laws((name,)) <= there)
    unseen = tuple(name for name, part in seen.change.items() if name not in named and part < min(found.could_hide, faint(seen.noise, seen.dirt)))
    visible = tuple(name for name in case.truth if name not in unseen)
    if not case.known:
        right = found.verdict in ("not_in_library", "nothing_missing")
    elif not visible and not case.nuisance:
        right = found.verdict == "nothing_missing" or (case.dirt > 0.0 and found.verdict == "not_in_library")
    elif one:
        right = laws(named) == laws(visible)
    else:
        right = laws(visible) <= laws(named) and not (phantoms and unseen)
    first = bool(named) and (named[0] in case.truth or (right and laws(named[:1]) <= laws(case.truth)))
    stray = bool(named) and not first and not ((case.nuisance or seen.kinds) and laws(named[:1]) <= there)
    ratio, errors, inside = _measured(case, machine, recording.rate, u, y, found) if right and visible and one and case.known else (None, {}, {})
    made = outcome(case, found, seconds, right=right, first=first, stray=stray, phantoms=phantoms)
    made = replace(made, ratio=ratio, errors=errors, inside=inside, unseen=unseen)
    return replace(made, change=seen.change, noise=seen.noise, dirt=seen.dirt, kinds=seen.kinds)


def faint(noise: float, dirt: float) -> float:
    """The part of the motion below which a change is not expected to be seen."""
    return FAINT * math.hypot(noise, dirt)


def names(found: Answer) -> tuple[str, ...]:
    """The effects that a diagnosis names as missing."""
    return found.effects if found.verdict == "missing_effect" else ()


def outcome(case: Any, found: Answer, seconds: float, *, right: bool, first: bool, stray: bool, phantoms: tuple[str, ...]) -> Judged:
    """The result of a diagnosis. stray: True if the first name is not in the truth."""
    return Judged(
        case=case,
        verdict=found.verdict,
        effects=tuple(found.effects),
        confidence=float(found.confidence),
        seconds=seconds,
        right=right,
        first=first,
        wrong=stray and found.confidence >= CONFIDENT,
        phantoms=phantoms,
    )


def laws(names: tuple[str, ...]) -> set[str]:
    """Names, with those that equal a sum of others replaced by these: no data distinguish the two."""
    sums = {name: whole.parts for name in names if name in STANDARD.effects and (whole := STANDARD[name].sum_of)}
    return {part for name in names for part in sums.get(name, (name,))}


def _there(case: Case, machine: Machine, dirt: tuple[str, ...]) -> set[str]:
    """Laws of every part of the machine and of its dirt; any dry friction includes Coulomb friction."""
    parts = (set(machine.spec.axes[0].parts) - set(case.parts)) | {*case.truth, *dirt}
    return laws(tuple(parts)) | parts | ({FRICTION[0]} if parts & set(FRICTION) else set())


def true_values(case: Case, machine: Machine) -> dict[str, float]:
    """The true parameters of the hypothesis, by ``effect.parameter``."""
    axis, truth = machine.spec.axes[0], machine.truth("x")
    values: dict[str, float] = {}
    for name, part in zip(case.truth, case.parts, strict=True):
        if name not in STANDARD.effects:
            continue
        own = dict(axis.parts[part])
        if "per_revolution" in own:
            own["period"] = axis.drive.lead / own.pop("per_revolution")
        if name in ("base_resonance", "screw_compliance"):
            own = {"frequency": truth["antiresonance_hz"], "split": truth["resonance_hz"] / truth["antiresonance_hz"] - 1.0}
        if name == "load_side_resonance":
            own = {"frequency": truth["resonance_hz"]}
        if name == "backlash":
            own = {"gap": own["gap"]}
        values |= {f"{name}.{key}": float(value) for key, value in own.items() if key in STANDARD[name].names}
    return values


def _measured(case: Case, machine: Machine, fs: float, u: Any, y: Any, found: Answer) -> tuple[float | None, dict[str, float], dict[str, bool]]:
    values = true_values(case, machine)
    errors: dict[str, float] = {}
    inside: dict[str, bool] = {}
    if not found.rungs:
        return None, errors, inside
    final = found.final
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
    if not case.truth or case.dirt > 0.0:  # with dirt, the truth is not the best start
        return None, errors, inside
    model, data = final.model, prepare(fs, np.asarray(u), np.asarray(y), EPSILON)
    for name in case.truth:
        known = [values.get(f"{name}.{key}", old) for key, old in zip(STANDARD[name].names, dict(model.effects)[name], strict=True)]
        model = model.with_effect(name, bounded(STANDARD[name], known, data.similar))
    best = fit(data, model)
    return final.held_out_error / best.held_out_error, errors, inside
