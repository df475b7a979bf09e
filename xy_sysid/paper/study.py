"""The paper's study in numbers: the fits of each axis, and the pair of antiresonance and resonance before and after."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from xy_sysid.errors import BadInput
from xy_sysid.fitting import Fit, identify
from xy_sysid.fitting.of_recording import estimate, split
from xy_sysid.report.axis_fits import AxisFits, Pair, fit_axis, pair_of
from xy_sysid.response.frf import Z95
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings


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
class AxisStudy(AxisFits):
    """The fits of one axis, and the change of its pair; change: None if there are no fits."""

    change: BeforeAfter | None = None


def study_axis(recording: Recording, axis: str, settings: IdentifierSettings, period: int | None = 0, loose: Recording | None = None) -> AxisStudy:
    """The study of one axis; ``problem`` says which part was not possible.

    period: as in ``fitting.of_recording.estimate``; loose: a second recording of the same machine, which is compared with the first.
    Without it, the two halves of the first are compared.
    """
    made = fit_axis(recording, axis, settings, period)
    change = None
    if made.fits:
        change = before_after(recording, axis, settings, period, loose, made.fits["ML"])
    return AxisStudy(**{each.name: getattr(made, each.name) for each in fields(made)}, change=change)


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
            fit = identify(frf, whole.structure, whole.tf)
        except BadInput as problem:
            pairs.append(None)
            problems.append(f"{name}: {problem}")
            continue
        near = pairs[0].resonance.value if pairs and pairs[0] else None
        pairs.append(pair_of(fit, near))
        if pairs[-1] is None:
            problems.append(f"{name}: no lightly damped resonance in the band.")
    return BeforeAfter(before_name=names[0], after_name=names[1], before=pairs[0], after=pairs[1], problem=" ".join(problems))
