"""A diagnosis in plain numbers and words, with why the runner-up lost and which look-alikes these data cannot tell apart.

Nothing in it holds code or whole signals, so that it can go to another process or into a document.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from xy_sysid.axis.model import Library
from xy_sysid.comparison.where_it_fails import Place
from xy_sysid.diagnosis.diagnose import Diagnosis, Kind
from xy_sysid.diagnosis.ladder import Candidate, Ladder
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.greybox.parameters import Estimate
from xy_sysid.hypotheses.criteria import AT_FLOOR, DOUBTFUL
from xy_sysid.units import USUAL, Units, bare, moved


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
    if fit.one_step:
        label += " (error one sample ahead)"  # free simulation cannot judge these; see ``one_step``
    return Rung(
        label=label,
        added=added,
        removed=removed,
        gain=model.gain,
        delay=model.delay,
        pole=model.pole,
        values=model.effects,
        parameters=fit.parameters,
        train_error=fit.training_error,
        held_out_error=fit.held_out_error,
        noise_floor=fit.noise_floor,
        excess=fit.excess,
        explained=fit.excess < AT_FLOOR,
    )


@dataclass(frozen=True, slots=True)
class Tried:
    """One candidate: share (0..1) of the error's power beyond the noise that it takes away alone; error, m/s; excess; evidence in words."""

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
    explained: float = 0.0
    noise: float = 0.0
    discrepancy: float = 0.0
    stopped: bool = False
    refused: tuple[tuple[str, str], ...] = ()
    units: Units = USUAL

    @property
    def effect(self) -> str | None:
        """The first of the effects."""
        return self.effects[0] if self.effects else None


def findings(item: Diagnosis, library: Library) -> Findings:
    """The plain form of a diagnosis."""
    ladder = item.ladder
    rungs = tuple(rung(step.fit, step.added) for step in ladder.steps) if ladder is not None else ()
    if ladder is not None and set(rungs[-1].effects) != {name for name, _ in ladder.final.model.effects}:
        rungs = (*rungs, rung(ladder.final))
    fitted = [(candidate, candidate.fit) for candidate in item.candidates if candidate.fit is not None]
    named = item.verdict == "missing_effect"
    return Findings(
        verdict=item.verdict,
        effects=item.effects,
        confidence=item.confidence,
        tolerance=item.tolerance,
        sentence=item.sentence,
        where=item.where.places if item.where is not None else (),
        candidates=tuple(_tried(candidate, fit, ladder.base, item.why_refused(candidate.effect)) for candidate, fit in fitted) if ladder else (),
        runner_up=_runner_up(ladder) if named and ladder is not None else None,
        look_alikes=_look_alikes(fitted, item.effects[0], library) if named else (),
        ladder=rungs,
        next_experiment=item.next_experiment,
        explained=item.explained,
        noise=item.noise,
        discrepancy=item.discrepancy,
        stopped=item.stopped,
        refused=tuple((" and ".join(names), reason) for names, reason in item.refused),
        units=item.units,
    )


def _tried(item: Candidate, fit: GreyboxFit, base: GreyboxFit, refused: str) -> Tried:
    before, unit = base.held_out_error, base.units.judged
    if fit.one_step:
        evidence = (
            f"judged one sample ahead, as no free simulation can tell: with it {moved(fit.held_out_error, unit)} are left, "
            f"the encoder's noise alone is {bare(fit.noise_floor, unit)}"
        )
    else:
        evidence = f"alone it explains {100 * item.explained:.3g} % of the error's power: {bare(before, unit)} -> {moved(fit.held_out_error, unit)}"
    if refused:
        evidence += f"; it is refused ({refused})"
    ratio = fit.held_out_error / before if before > 0 else None
    return Tried(
        effect=item.effect,
        share=item.explained,
        held_out_error=fit.held_out_error,
        error_ratio=ratio,
        excess=fit.excess,
        parameters=fit.parameters,
        evidence=evidence,
    )


def _runner_up(ladder: Ladder) -> tuple[str, str] | None:
    """The best other set of effects, and why it was not taken."""
    if not ladder.rivals:
        return None
    rival = ladder.rivals[0]
    name, taken = " and ".join(rival.effects), " and ".join(ladder.effects)
    if rival.doubt < DOUBTFUL:
        left, right = (moved(fit.held_out_error, fit.units.judged) for fit in (rival.fit, ladder.final))
        return name, f"with {name} instead of {taken} the held-out error is {left}, not {right}."
    if rival.refused:
        return name, f"{name} predicts nearly as well as {taken}, but {rival.refused}."
    return name, f"{name} predicts nearly as well as {taken}: these data hardly distinguish them; the simpler one is taken."


def _look_alikes(fitted: list[tuple[Candidate, GreyboxFit]], name: str, library: Library) -> tuple[LookAlike, ...]:
    fits = {candidate.effect: fit for candidate, fit in fitted}
    if name not in fits:
        return ()
    found = []
    for other in library[name].look_alikes:
        if other not in library.effects or library[other].category == "base":
            continue
        richer = library[name].is_special_case(library[other])
        if other not in fits and richer:
            apart, text = False, f"{other}, with more parameters, was not fitted: nothing in these data asks for more than {name}"
        elif other not in fits:
            apart, text = True, f"the error has no trace of {other}, or a weak one"
        elif fits[other].excess > fits[name].excess + AT_FLOOR:
            apart = True
            left, least = fits[other], fits[name].held_out_error
            text = f"{other} leaves {moved(left.held_out_error, left.units.judged)}, {name} {bare(least, left.units.judged)}"
        elif richer:
            apart, text = False, f"{other} contains {name} and does as well; nothing in these data asks for more than {name}"
        else:
            apart, text = False, f"these data cannot tell {name} from {other}"
        found.append(LookAlike(other, apart, text, library[name].experiment))
    return tuple(found)


def answer(item: Findings) -> dict[str, Any]:
    """One axis of the document that ``diagnose --json`` gives."""
    first, last = (item.ladder[0], item.ladder[-1]) if item.ladder else (None, None)
    return {
        "verdict": item.verdict,
        "effect": item.effect if item.verdict == "missing_effect" else None,
        "effects": list(item.effects),
        "confidence": item.confidence,
        "tolerance": item.tolerance,
        "sentence": item.sentence,
        "error": {
            "unit": item.units.judged,
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
        "explained": item.explained,
        "noise": item.noise,
        "discrepancy": item.discrepancy,
        "stopped": "budget" if item.stopped else None,
        "refused": [{"effect": name, "reason": reason} for name, reason in item.refused],
    }


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
    """Every parameter with unit and 95 % interval; of what each recording has for itself the mean, and ``recordings``, one by one."""
    return {item.name: _parameter(item) for item in items}


def _parameter(item: Estimate) -> dict[str, Any]:
    own = {"recordings": [_parameter(one) for one in item.recordings]} if item.recordings else {}
    return {"value": float(item.value), "unit": item.unit, "ci95": [float(item.low), float(item.high)], **own}
