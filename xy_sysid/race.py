"""Which effect next? The candidates race: simple ones first, on little data, and only those that come near run the whole distance.

Also what a race of single effects cannot find: two that hide one another, one just below the floor's threshold, and one that
only one-step prediction can judge.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.axis_model import STANDARD, Library
from xy_sysid.effects import Effect
from xy_sysid.greybox import AxisData, GreyboxFit, finish, fit_instead, fit_with, look
from xy_sysid.one_step_race import Grown, grown
from xy_sysid.traces import Trace

# Tuned on development draws of the simulated machine only (blind/cases.py).
AT_FLOOR = 0.15  # excess below which nothing is left to explain; clean axes stay below 0.02
SURE = 0.03  # excess up to which nothing at all is left
SIMPLER = 0.08  # excess that a simpler model may be worse by and still be preferred
TRIED = 5  # effects that are fitted at each step, by their share of the error
LEAST_SHARE = 5e-4  # of the error that an effect's trace must explain to be tried
HOPELESS = 1.5  # excess behind the best so far at which a candidate is given up after its first round
HELPS = 0.05  # excess that a candidate must win on the first stage to run the whole distance
FAR = 1.0  # excess on the first stage above which only the candidate that would be chosen runs the whole distance
NEAR = 0.3  # excess on the first stage within which candidates run the whole distance
WIDE = 3  # candidates that run the whole distance, and first effects of the pairs that are tried
IDLE = 0.02  # excess that one more effect must win in its first round, far from the floor
PART_LEFT = 0.4  # of the excess that an effect found between SURE and AT_FLOOR may leave
FAINT_TRACE = 0.06  # share, times seconds of training, from which an effect is looked for in the noise: of clean axes the largest is 0.036,
LINEAR_TRACE = 0.4  # but 0.1 for lags and resonances, which a last thousandth of the base's response looks like
RELATIVE_TRACE = 0.2  # the same for a richer relative of what is in the model: where nothing asks for it, the largest is 0.05
AS_LARGE = 0.9  # part of a relative's trace that a simpler one must have to be tried in its place
WELL_KNOWN = 2.0  # width of the 95 % interval over the size: it is not zero
SUSPICIOUS = 0.1  # share of a look-alike from which an effect that free simulation cannot judge is tried
UNSEEN = ("constant_load",)  # effects with next to no trace in the error's spectrum: always tried as the second of a pair


@dataclass(frozen=True, slots=True)
class Candidate:
    """One effect tried: the share of the error that its trace explains, and its full fit (None if that failed)."""

    effect: str
    share: float
    fit: GreyboxFit | None


def candidates(data: AxisData, now: GreyboxFit, library: Library = STANDARD) -> tuple[Candidate, ...]:
    """The effects that may be added to a fit, the best few fitted, least excess first.

    A race: simpler effects first, each on the first stage's data only. Once one is at the floor, richer ones cannot be
    preferred to it and are left out; those that come near the best run the whole distance.
    """
    open_to = [*_open(now, library), *(library[name] for name in _richer(now, library))]
    traces = [trace for trace in look(data, now, open_to) if trace.share >= LEAST_SHARE]
    shares = {trace.effect: trace.share for trace in traces}
    names = _with_relatives([trace.effect for trace in traces[:TRIED]], open_to)
    found: list[Candidate] = []
    enough = np.inf
    for name in sorted(names, key=lambda name: (_more(now, library, name), -shares.get(name, 0.0))):
        if _more(now, library, name) > enough:
            found.append(Candidate(name, shares.get(name, 0.0), None))
            continue
        least = min((item.fit.excess for item in found if item.fit), default=np.inf)
        fitted = _tried(data, now, name, min(least + HOPELESS, now.excess - IDLE if now.model.effects and now.excess > FAR else np.inf))
        if fitted is not None and fitted.excess < AT_FLOOR:
            fitted = finish(data, fitted.model, fitted.runs)
            if fitted.excess < SIMPLER:
                enough = _more(now, library, name)
        found.append(Candidate(name, shares.get(name, 0.0), fitted))
    for item in _finalists(now, found, library):
        assert item.fit is not None
        found[found.index(item)] = replace(item, fit=finish(data, item.fit.model, item.fit.runs))
    rest = [Candidate(trace.effect, trace.share, None) for trace in traces[TRIED:] if trace.effect not in names]
    return tuple(sorted(found, key=lambda item: item.fit.excess if item.fit else np.inf)) + tuple(rest)


def _finalists(now: GreyboxFit, found: list[Candidate], library: Library) -> list[Candidate]:
    """Those that run the whole distance: all near the best, but far from the floor only the one that would be chosen."""
    least = min((item.fit.excess for item in found if item.fit), default=np.inf)
    bar = min(least + NEAR, now.excess - HELPS)
    near = [item for item in found if item.fit and AT_FLOOR <= item.fit.excess <= bar]
    best = choose(now, tuple(near), library)
    if best is not None and best.fit is not None and best.fit.excess > FAR:
        return [best]
    return sorted(near, key=lambda item: item.fit.excess if item.fit else np.inf)[:WIDE]


def choose(now: GreyboxFit, tried: tuple[Candidate, ...], library: Library = STANDARD) -> Candidate | None:
    """The simplest (fewest parameters more than now) of those within SIMPLER of the least excess; None if nothing could be fitted."""
    fitted = [item for item in tried if item.fit is not None]
    if not fitted:
        return None
    least = min(item.fit.excess for item in fitted if item.fit)
    good = [item for item in fitted if item.fit and item.fit.excess <= least + SIMPLER]
    return min(good, key=lambda item: (_more(now, library, item.effect), item.fit.excess if item.fit else np.inf))


def suspected(
    data: AxisData, base: GreyboxFit, tried: tuple[Candidate, ...], library: Library, patient: bool = False, begun: Mapping[str, Grown] | None = None
) -> dict[str, Grown]:
    """Effects that only one-step prediction can judge, where no other explains the error and a look-alike left its trace.

    The last of them explains the axis, or none does. patient, begun: see ``grown``
    """
    found: dict[str, Grown] = {}
    if any(item.fit is not None and item.fit.excess < AT_FLOOR for item in tried):
        return found
    shares = {item.effect: item.share for item in tried}
    for effect in library.acting:
        share = max((shares.get(name, 0.0) for name in effect.look_alikes), default=0.0)
        if effect.one_step is not None and share >= SUSPICIOUS:
            rubbing = [item.fit for item in tried if item.effect == "coulomb_friction" and item.fit is not None and item.share >= SUSPICIOUS]
            found[effect.name] = grown(data, rubbing[0] if rubbing else base, effect, library, patient, (begun or {}).get(effect.name))
            if explaining(found):
                return found
    return found


def explaining(found: Mapping[str, Grown]) -> tuple[tuple[str, GreyboxFit], ...]:
    """The rungs of the last of what was suspected, if they explain the axis, else none."""
    rungs = list(found.values())[-1].rungs if found else ()
    return rungs if rungs and rungs[-1][1].excess < AT_FLOOR else ()


def together(data: AxisData, now: GreyboxFit, tried: tuple[Candidate, ...], library: Library, bar: float) -> tuple[Candidate, Candidate] | None:
    """Two effects at once, where each alone helps little because the other's error hides it; None if that helps little, too.

    bar: excess above which a pair is not worth the whole distance
    """
    if now.model.ahead:
        return None
    fitted = _one_of_each_family([item for item in tried if item.fit is not None and library[item.effect].one_step is None], now, library)
    best: tuple[Candidate, Candidate] | None = None
    least = np.inf
    for first in fitted[:WIDE]:
        assert first.fit is not None
        seconds = [item.effect for item in look(data, first.fit, _open(first.fit, library)) if item.share >= LEAST_SHARE][:1]
        always = [effect.name for effect in _open(first.fit, library) if effect.name in UNSEEN]
        for name in dict.fromkeys([*seconds, *always]):
            try:
                found = fit_with(data, now, [first.effect, name], brief=True, hopeless=now.excess)
            except np.linalg.LinAlgError:
                continue
            if found.excess < least and plausible(found):  # false for a fit that is not a number
                best, least = (first, Candidate(name, 0.0, found)), found.excess
        if least < AT_FLOOR:
            break
    if best is None or best[1].fit is None or least > bar:
        return None
    return best[0], replace(best[1], fit=finish(data, best[1].fit.model, best[1].fit.runs))


def polished(data: AxisData, now: GreyboxFit, library: Library) -> Candidate | None:
    """One more effect below the threshold of the floor, if it takes away most of what is left there."""
    for trace in look(data, now, _open(now, library))[:2]:
        found = _tried(data, now, trace.effect)
        if found is not None and found.excess < now.excess:
            found = finish(data, found.model, found.runs)
            if found.excess < PART_LEFT * now.excess and (now.model.effects or _known(found, library[trace.effect])):
                return Candidate(trace.effect, trace.share, found)
    return None


def faint(data: AxisData, now: GreyboxFit, library: Library) -> Candidate | None:
    """One effect that hides in the noise of a model at the floor: its trace is larger than chance makes it, and its size well known.

    The mean over the bands does not see an effect that moves two or three of them. Beside another effect only richer
    relatives are looked for, which take its place.
    """
    seconds = data.training / data.sampling_rate
    richer = _richer(now, library) if now.model.effects else {}
    open_to = [library[name] for name in richer] if now.model.effects else _open(now, library)
    traces = look(data, now, open_to) if open_to else []
    for trace in dict.fromkeys(_simplest(trace, traces, library) for trace in traces[:2]):
        effect = library[trace.effect]
        least = RELATIVE_TRACE if richer else LINEAR_TRACE if effect.category in ("motion", "state") else FAINT_TRACE
        if trace.share * seconds < least:
            continue
        found = _tried(data, now, trace.effect)
        if found is None:
            continue
        found = finish(data, found.model, found.runs)
        if _known(found, effect) and plausible(found) and found.held_out_error < now.held_out_error and found.excess <= now.excess + SURE:
            return Candidate(trace.effect, trace.share, found)
    return None


def _known(found: GreyboxFit, effect: Effect) -> bool:
    """The size of an effect, its first parameter, is well known."""
    size = found.parameter(f"{effect.name}.{effect.names[0]}")
    return size.high - size.low < WELL_KNOWN * abs(size.value)


def _simplest(trace: Trace, traces: list[Trace], library: Library) -> Trace:
    """The relative with the fewest parameters of those whose traces are as large: in the noise nothing asks for more."""
    family = library[trace.effect].family
    alike = [other for other in traces if family and library[other.effect].family == family and other.share > AS_LARGE * trace.share]
    return min(alike, key=lambda other: len(library[other.effect].parameters), default=trace)


def plausible(found: GreyboxFit) -> bool:
    """No effect has values that no machine has."""
    checks = ((found.model.library[name].plausible, values) for name, values in found.model.effects)
    return all(check is None or check(values) for check, values in checks)


def _open(now: GreyboxFit, library: Library) -> list[Effect]:
    """What may still be added."""
    families = {library[name].family for name, _ in now.model.effects if library[name].family}
    return [e for e in library.acting if e.simulable and e.name not in now.model and not (e.family and e.family in families)]


def _richer(now: GreyboxFit, library: Library) -> dict[str, str]:
    """Effects that may take the place of a relative in the model which says less: name and relative.

    That is one with more parameters, or of an effect that is the sum of others, one with more than its own relative among them.
    """
    found = {}
    for own, _ in now.model.effects:
        relatives = [e for e in library.acting if e.family and e.family == library[own].family and e.simulable and e.name not in now.model]
        whole = library[own].sum_of
        parts = () if whole is None else tuple(library[part] for part in whole.parts)
        least = min((len(part.parameters) for part in parts if part.family == library[own].family), default=len(library[own].parameters))
        found.update({e.name: own for e in relatives if len(e.parameters) > least})
    return found


def _more(now: GreyboxFit, library: Library, name: str) -> float:
    """Parameters that a candidate adds; one effect in the place of another counts half a parameter less than one more."""
    own = _richer(now, library).get(name)
    if own is None:
        return len(library[name].parameters)
    kept = library[own].sum_of
    stays = 0 if kept is None else sum(len(library[part].parameters) for part in kept.parts if library[part].family != library[own].family)
    return stays + len(library[name].parameters) - len(library[own].parameters) - 0.5


def _one_of_each_family(fitted: list[Candidate], now: GreyboxFit, library: Library) -> list[Candidate]:
    """The simplest stands for its relatives: what it leaves to them they may take later. None in place of one in the model."""
    richer, found = _richer(now, library), list[Candidate]()
    for item in sorted(fitted, key=lambda item: len(library[item.effect].parameters)):
        family = library[item.effect].family
        if item.effect not in richer and not (family and any(library[other.effect].family == family for other in found)):
            found.append(item)
    return sorted(found, key=fitted.index)


def _with_relatives(names: list[str], open_to: list[Effect]) -> list[str]:
    """The names, and the rest of a family of which one is among the first two: relatives share their trace."""
    family = {effect.name: effect.family for effect in open_to}
    wanted = {family[name] for name in names[:2] if family[name]}
    return [*names, *(name for name in family if family[name] in wanted and name not in names)]


def _tried(data: AxisData, now: GreyboxFit, name: str, hopeless: float = np.inf) -> GreyboxFit | None:
    own = _richer(now, now.model.library).get(name)
    try:
        if own is None:
            found = fit_with(data, now, [name], brief=True, hopeless=hopeless)
        else:
            found = fit_instead(data, now, own, name, brief=True, hopeless=hopeless)
    except np.linalg.LinAlgError:
        return None
    return found if np.isfinite(found.excess) and plausible(found) else None
