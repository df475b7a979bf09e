"""The paper's study in numbers: for each axis the response, three fits, and the pair of antiresonance and resonance.

Frozen results only; figures, tables and the page are made from them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fitting import Fit, Interval, Structure, identify, lls, nllsfdi
from xy_sysid.fitting.choose_orders import Choice
from xy_sysid.fitting.of_recording import AxisEstimate, estimate, split, with_orders
from xy_sysid.fitting.structure import structure_from
from xy_sysid.live.fitter import LIGHT_DAMPING, watched
from xy_sysid.report.signals import Excitation, Motion, excitation, motion
from xy_sysid.response.frf import Z95, FrequencyResponse
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings

NEAR = 2.0  # an antiresonance belongs to a resonance when their frequencies differ by less than this factor


@dataclass(frozen=True, slots=True)
class Pair:
    """A resonance and its antiresonance (None without one), with intervals, in the fit that is named."""

    resonance: Interval
    antiresonance: Interval | None
    fit: Fit


@dataclass(frozen=True, slots=True)
class Shift:
    """After minus before: value and 95 % interval, Hz."""

    name: str
    value: float
    low: float
    high: float

    @property
    def certain(self) -> bool:
        """True if the interval excludes 0."""
        return self.low > 0.0 or self.high < 0.0


@dataclass(frozen=True, slots=True)
class BeforeAfter:
    """The pair in two parts of the data; None if no lightly damped resonance was found; ``problem`` gives the reason."""

    before_name: str
    after_name: str
    before: Pair | None
    after: Pair | None
    problem: str = ""

    @property
    def shifts(self) -> tuple[Shift, ...]:
        """Shift of the antiresonance (if both parts have one) and of the resonance; empty if one part has no pair."""
        if self.before is None or self.after is None:
            return ()
        made = []
        for name in ("antiresonance", "resonance"):
            was, now = getattr(self.before, name), getattr(self.after, name)
            if was is not None and now is not None:
                half = Z95 * math.hypot(was.sigma, now.sigma)
                value = now.value - was.value
                made.append(Shift(name, value, value - half, value + half))
        return tuple(made)


@dataclass(frozen=True, slots=True)
class AxisStudy:
    """Everything about one axis; ``fits`` holds LLS, NLLS (the paper's method) and ML, empty if ``problem`` gives a reason; choice: of orders."""

    axis: str
    excitation: Excitation
    motion: Motion
    estimate: AxisEstimate | None = None
    fits: dict[str, Fit] = field(default_factory=dict)
    pair: Pair | None = None
    change: BeforeAfter | None = None
    problem: str = ""
    choice: Choice | None = None

    @property
    def frf(self) -> FrequencyResponse | None:
        """The measured response, None without one."""
        return self.estimate.frf if self.estimate else None


def study_axis(
    recording: Recording, axis: str, settings: IdentifierSettings, period: int | None = 0, loose: Recording | None = None, refit: bool = True
) -> AxisStudy:
    """The study of one axis; ``problem`` says which part was not possible.

    period: as in ``offline.estimate``; loose: a second recording of the same machine, which is compared with the first.
    Without it, the two halves of the first are compared (not if ``refit`` is False).
    """
    made = AxisStudy(axis=axis, excitation=excitation(recording, axis), motion=motion(recording, axis))
    try:
        found = estimate(recording, axis, settings, period)
        made = replace(made, estimate=found)
        settings, choice = with_orders(found.frf, settings)
        fits = three_fits(found.frf, structure_from(settings))
    except BadInput as problem:
        return replace(made, problem=str(problem))
    change = before_after(recording, axis, settings, period, loose, fits["ML"]) if refit else None
    return replace(made, fits=fits, pair=pair_of(fits["ML"]), change=change, choice=choice)


def three_fits(frf: FrequencyResponse, structure: Structure) -> dict[str, Fit]:
    """LLS and NLLS as nllsfdi makes them (delay absorbed, weight 1/|FRF|), and ML with delay and hold in the model."""
    literal = replace(structure, integrators=0, delay=0.0, hold="none", weighting="relative", domain="s")
    bare = replace(frf, kernel_offset=np.zeros(1), kernel_weight=np.ones(1), differenced=False)
    return {"LLS": lls.fit(bare, literal), "NLLS": nllsfdi.fit(frf, literal), "ML": identify(frf, structure)}


def before_after(
    recording: Recording, axis: str, settings: IdentifierSettings, period: int | None, loose: Recording | None, whole: Fit
) -> BeforeAfter:
    """The pair before and after; each fit starts from the model of the full data."""
    if loose is None:
        names = ("first half", "second half")
        first, second = split(recording, 0.5)
    else:
        names = ("before", "after")
        first, second = recording, loose
    pairs: list[Pair | None] = []
    problems: list[str] = []
    for name, data in zip(names, (first, second), strict=True):
        try:
            frf = estimate(data, axis, settings, period).frf
            fit = identify(frf, structure_from(settings), whole.tf)
        except BadInput as problem:
            pairs.append(None)
            problems.append(f"{name}: {problem}")
            continue
        near = pairs[0].resonance.value if pairs and pairs[0] else None
        pairs.append(pair_of(fit, near))
        if pairs[-1] is None:
            problems.append(f"{name}: no lightly damped resonance in the band.")
    return BeforeAfter(before_name=names[0], after_name=names[1], before=pairs[0], after=pairs[1], problem=" ".join(problems))


def pair_of(fit: Fit, near: float | None = None) -> Pair | None:
    """The watched resonance of a fit (the one nearest to ``near`` Hz if given) and its antiresonance; None without one."""
    resonance = watched(fit, near) if fit.converged else None
    if resonance is None:
        return None
    named = next(e for e in fit.intervals if e.name.startswith("resonance_") and e.name.endswith(".frequency") and e.value == resonance.frequency)
    zeros = []
    for item in fit.intervals:
        if item.name.startswith("antiresonance_") and item.name.endswith(".frequency"):
            damping = abs(fit.interval(item.name.replace(".frequency", ".damping")).value)
            ratio = max(item.value, named.value) / max(min(item.value, named.value), 1e-12)
            if damping < LIGHT_DAMPING and ratio < NEAR:
                zeros.append((ratio, item))
    return Pair(named, min(zeros, key=lambda each: each[0])[1] if zeros else None, fit)
