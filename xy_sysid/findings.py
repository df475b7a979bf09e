"""A diagnosis in plain numbers and words, with why the runner-up lost and which look-alikes these data cannot tell apart.

Nothing in it holds code or whole signals, so that it can go to another process or into a document.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from xy_sysid.axis_model import Library
from xy_sysid.comparison import Place
from xy_sysid.diagnosis import Diagnosis, Kind
from xy_sysid.greybox import Estimate, GreyboxFit
from xy_sysid.own_units import in_units
from xy_sysid.race import AT_FLOOR, SIMPLER, Candidate


@dataclass(frozen=True, slots=True)
class Rung:
    """One fit in a row of fits: what changed, and how good it is.

    added, removed: the effect that came or went, None for none; model: gain, delay, pole and each effect's values, SI
    train_error, held_out_error, noise_floor: rms, m/s; excess: 0 is at the floor; explained: at the floor
    """

    label: str
    added: str | None
    removed: str | None
    gain: float
    delay: float
    pole: float
    values: tuple[tuple[str, tuple[float, ...]], ...]
    parameters: tuple[Estimate, ...]
    train_error: float
    held_out_error: float
    noise_floor: float
    excess: float
    explained: bool

    @property
    def effects(self) -> tuple[str, ...]:
        """Names, in the order in which they were added."""
        return tuple(name for name, _ in self.values)


def rung(fit: GreyboxFit, added: str | None = None, removed: str | None = None) -> Rung:
    """The plain numbers of a fit."""
    if added is not None:
        label = f"with {added}" if removed is None else f"{added} instead of {removed}"
    else:
        label = "rigid, with delay" if removed is None else f"without {removed}"
    model = fit.model
    if model.ahead:
        label += " (error one sample ahead)"  # free simulation cannot judge these; see ``one_step``
    errors = fit.training_error, fit.held_out_error, fit.noise_floor, fit.excess
    return Rung(label, added, removed, model.gain, model.delay, model.pole, model.effects, fit.parameters, *errors, fit.excess < AT_FLOOR)


@dataclass(frozen=True, slots=True)
class Tried:
    """One candidate: share of the error that its trace explains; error, m/s, and excess after a full fit; evidence in words."""

    effect: str
    share: float
    held_out_error: float
    error_ratio: float | None
    excess: float
    parameters: tuple[Estimate, ...]
    evidence: str


@dataclass(frozen=True, slots=True)
class LookAlike:
    """An effect that the named one can be taken for: whether these data tell them apart, and what would."""

    effect: str
    told_apart: bool
    sentence: str
    experiment: str


@dataclass(frozen=True, slots=True)
class Findings:
    """What a diagnosis found; see ``diagnosis.Diagnosis``. ladder: from the base down, after pruning the last is the answer."""

    verdict: Kind
    effects: tuple[str, ...]
    confidence: float
    tolerance: float
    sentence: str
    where: tuple[Place, ...]
    candidates: tuple[Tried, ...]
    runner_up: tuple[str, str] | None
    look_alikes: tuple[LookAlike, ...]
    ladder: tuple[Rung, ...]
    next_experiment: str

    @property
    def effect(self) -> str | None:
        """The first of the effects."""
        return self.effects[0] if self.effects else None


def findings(item: Diagnosis, library: Library) -> Findings:
    """The plain form of a diagnosis."""
    ladder = item.ladder
    rungs = tuple(rung(step.fit, step.added) for step in ladder.steps) if ladder is not None else ()
    if ladder is not None and set(rungs[-1].effects) != set(ladder.effects):
        gone = [name for name in rungs[-1].effects if name not in ladder.effects]
        rungs = (*rungs, rung(ladder.final, None, " and ".join(gone)))
    before = rungs[0].held_out_error if rungs else 0.0
    fitted = [(candidate, candidate.fit) for candidate in item.candidates if candidate.fit is not None]
    named = item.verdict == "missing_effect"
    if named:  # a richer relative may fit a hair better than the one that was taken
        fitted.sort(key=lambda pair: pair[0].effect != item.effect)
    return Findings(
        item.verdict,
        item.effects,
        item.confidence,
        item.tolerance,
        item.sentence,
        item.where.places if item.where is not None else (),
        tuple(_tried(candidate, fit, before) for candidate, fit in fitted),
        _runner_up(fitted, item.effects, library) if named else None,
        _look_alikes(fitted, {one.effect: one.share for one in item.candidates}, item.effects[0], library) if named else (),
        rungs,
        item.next_experiment,
    )


def _tried(item: Candidate, fit: GreyboxFit, before: float) -> Tried:
    evidence = (
        f"judged one sample ahead, as no free simulation can tell: with it {1e3 * fit.held_out_error:.3g} mm/s are left, "
        f"the encoder's noise alone is {1e3 * fit.noise_floor:.3g}"
        if fit.model.ahead
        else f"its trace explains {100 * item.share:.3g} % of the error; with it the held-out error is "
        f"{1e3 * fit.held_out_error:.3g} mm/s instead of {1e3 * before:.3g}"
    )
    ratio = fit.held_out_error / before if before > 0 else None
    return Tried(item.effect, item.share, fit.held_out_error, ratio, fit.excess, fit.parameters, evidence)


def _runner_up(fitted: list[tuple[Candidate, GreyboxFit]], names: tuple[str, ...], library: Library) -> tuple[str, str] | None:
    """The best candidate that was not taken, and why it was not."""
    families = {library[name].family for name in names} - {""}  # a richer relative contains the one that was taken
    others = [
        (candidate.effect, fit) for candidate, fit in fitted if candidate.effect not in names and library[candidate.effect].family not in families
    ]
    taken = next((fit for candidate, fit in fitted if candidate.effect == names[0]), None)
    if not others or taken is None:
        return None
    name, fit = others[0]
    if fit.excess > taken.excess + SIMPLER:
        left, right = f"{1e3 * fit.held_out_error:.3g} mm/s", f"{1e3 * taken.held_out_error:.3g} mm/s"
        return name, f"with {name} instead of {names[0]} the held-out error is {left}, not {right}."
    mine, its = len(library[names[0]].parameters), len(library[name].parameters)
    if its > mine:
        return name, f"{name} does as well as {names[0]}, but with {its} parameters instead of {mine}: the simpler one is taken."
    return name, f"{name} does nearly as well as {names[0]}: these data hardly tell them apart."


def _look_alikes(fitted: list[tuple[Candidate, GreyboxFit]], shares: Mapping[str, float], name: str, library: Library) -> tuple[LookAlike, ...]:
    fits = {candidate.effect: fit for candidate, fit in fitted}
    if name not in fits:
        return ()
    found = []
    for other in library[name].look_alikes:
        if other not in library.effects or library[other].category == "base":
            continue
        richer = len(library[other].parameters) > len(library[name].parameters)
        if other not in fits and shares.get(other, 0.0) > 0.0 and richer:
            apart, text = False, f"{other}, with more parameters, was not fitted: nothing in these data asks for more than {name}"
        elif other not in fits:
            apart, text = True, f"the error has no trace of {other}, or a weak one"
        elif fits[other].excess > fits[name].excess + SIMPLER:
            apart = True
            text = f"{other} leaves {1e3 * fits[other].held_out_error:.3g} mm/s, {name} {1e3 * fits[name].held_out_error:.3g}"
        elif library[other].family and library[other].family == library[name].family and richer:
            apart, text = False, f"{other} contains {name} and does as well; nothing in these data asks for more than {name}"
        else:
            apart, text = False, f"these data cannot tell {name} from {other}"
        found.append(LookAlike(other, apart, text, library[name].experiment))
    return tuple(found)


def answer(item: Findings, units: tuple[str, str] = ("V", "m")) -> dict[str, Any]:
    """One axis of the document that ``diagnose --json`` gives."""
    first, last = (item.ladder[0], item.ladder[-1]) if item.ladder else (None, None)
    made = {
        "verdict": item.verdict,
        "effect": item.effect if item.verdict == "missing_effect" else None,
        "effects": list(item.effects),
        "confidence": item.confidence,
        "tolerance": item.tolerance,
        "sentence": item.sentence,
        "error": {
            "unit": f"{units[1]}/s",
            "now": first.held_out_error if first else None,
            "noise_floor": first.noise_floor if first else None,
            "held_out": last.held_out_error if last else None,
        },
        "where": [place(one) for one in item.where],
        "candidates": [
            {
                "effect": one.effect,
                "held_out_error": one.held_out_error,
                "error_ratio": one.error_ratio,
                "excess": one.excess,
                "share": one.share,
                "parameters": parameters(one.parameters),
                "evidence": one.evidence,
            }
            for one in item.candidates
        ],
        "runner_up": {"effect": item.runner_up[0], "sentence": item.runner_up[1]} if item.runner_up else None,
        "look_alikes": [
            {"effect": one.effect, "told_apart": one.told_apart, "sentence": one.sentence, "experiment": one.experiment} for one in item.look_alikes
        ],
        "next_experiment": item.next_experiment,
    }
    return in_units(made, units)


def place(item: Place) -> dict[str, Any]:
    """One place where a model fails."""
    return {
        "kind": item.kind,
        "from": item.low,
        "to": item.high,
        "unit": item.unit,
        "error_over_floor": item.error_over_floor,
        "sentence": item.sentence,
    }


def parameters(items: tuple[Estimate, ...]) -> Mapping[str, Any]:
    """Every parameter with unit and 95 % interval."""
    return {item.name: {"value": item.value, "unit": item.unit, "ci95": [item.low, item.high]} for item in items}
