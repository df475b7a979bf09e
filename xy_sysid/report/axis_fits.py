"""The fits of one axis side by side: the response, three estimators, and the pair of antiresonance and resonance.

Frozen results only; figures, tables and pages are made from them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fitting import Fit, Structure, identify, lls, nllsfdi
from xy_sysid.fitting.choose_orders import Choice
from xy_sysid.fitting.of_recording import AxisEstimate, estimate, with_orders
from xy_sysid.fitting.structure import structure_from
from xy_sysid.linear.transfer_function import LIGHT_DAMPING
from xy_sysid.live.fitter import watched
from xy_sysid.report.signals import Excitation, Motion, excitation, motion
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings

NEAR = 2.0  # an antiresonance belongs to a resonance when their frequencies differ by less than this factor


@dataclass(frozen=True, slots=True)
class Pair:
    """A resonance and its antiresonance (None without one), with intervals, in the fit that is named."""

    resonance: Estimate
    antiresonance: Estimate | None
    fit: Fit


@dataclass(frozen=True, slots=True)
class AxisFits:
    """Signals, response and fits of one axis; ``fits`` holds LLS, NLLS (the paper's method) and ML, empty if ``problem`` gives a reason.

    choice: of orders
    """

    axis: str
    excitation: Excitation
    motion: Motion
    estimate: AxisEstimate | None = None
    fits: dict[str, Fit] = field(default_factory=dict)
    pair: Pair | None = None
    problem: str = ""
    choice: Choice | None = None

    @property
    def frf(self) -> FrequencyResponse | None:
        """The measured response, None without one."""
        return self.estimate.frf if self.estimate else None


def fit_axis(recording: Recording, axis: str, settings: IdentifierSettings, period: int | None = 0) -> AxisFits:
    """The three fits of one axis; ``problem`` says which part was not possible. period: as in ``fitting.of_recording.estimate``."""
    made = AxisFits(axis=axis, excitation=excitation(recording, axis), motion=motion(recording, axis))
    try:
        found = estimate(recording, axis, settings, period)
        made = replace(made, estimate=found)
        settings, choice = with_orders(found.frf, settings)
        fits = three_fits(found.frf, structure_from(settings))
    except BadInput as problem:
        return replace(made, problem=str(problem))
    return replace(made, fits=fits, pair=pair_of(fits["ML"]), choice=choice)


def three_fits(frf: FrequencyResponse, structure: Structure) -> dict[str, Fit]:
    """LLS and NLLS as nllsfdi makes them (delay absorbed, weight 1/|FRF|), and ML with delay and hold in the model."""
    literal = replace(structure, integrators=0, delay=0.0, hold="none", weighting="relative", domain="s")
    bare = replace(frf, kernel_offset=np.zeros(1), kernel_weight=np.ones(1), differenced=False)
    return {"LLS": lls.fit(bare, literal), "NLLS": nllsfdi.fit(frf, literal), "ML": identify(frf, structure)}


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
