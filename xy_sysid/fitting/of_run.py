"""Two calls: from a run to its frequency response, and from a response to a transfer function with verdicts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fitting import ESTIMATORS, Fit, identify
from xy_sysid.fitting.of_given_response import settings_for
from xy_sysid.fitting.of_recording import FIXED, estimate, judged, with_orders
from xy_sysid.fitting.structure import Structure, Weighting, structure_from
from xy_sysid.fitting.verdicts import HeldOut, Validation, Verdict, validate
from xy_sysid.linear.simulate import simulate_sampled
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.integral import detrended
from xy_sysid.samples.recording import Origin, Recording, Run, one_run
from xy_sysid.settings import IdentifierSettings, build, changed
from xy_sysid.tables import Table
from xy_sysid.units import derivative_of


@dataclass(frozen=True, slots=True)
class LinearModel:
    """A transfer function of one axis, with its origin, fit and verdicts.

    hold:     how its input behaves between samples
    axis:     its name; data: SHA-256 of the samples of each recording that it was fitted to
    fit:      the fit with its intervals; None for a model from a file
    verdicts: the checks of the fit
    """

    tf: TransferFunction
    hold: Literal["zoh", "none"] = "zoh"
    axis: str = ""
    data: tuple[str, ...] = ()
    fit: Fit | None = None
    verdicts: tuple[Verdict, ...] = ()

    @property
    def doubt(self) -> str:
        """Empty: a linear model can always be simulated."""
        return ""

    @property
    def label(self) -> str:
        """A short text for a legend."""
        return f"transfer function {self.tf.numerator.size - 1}/{self.tf.denominator.size - 1}"

    @property
    def intervals(self) -> tuple[Estimate, ...]:
        """95 % intervals of coefficients, delay, gain, poles, zeros and resonances, for noise alone; empty for a model from a file."""
        return self.fit.intervals if self.fit is not None else ()

    @property
    def intervals_with_misfit(self) -> tuple[Estimate, ...]:
        """The intervals, widened for the residual error above the noise."""
        return self.fit.intervals_with_misfit if self.fit is not None else ()

    @property
    def ok(self) -> bool:
        """True if every verdict is good."""
        return all(verdict.ok for verdict in self.verdicts)

    @property
    def table(self) -> Table:
        """Each parameter with its 95 % interval, widened for the residual error above the noise."""
        rows = ((item.name, item.value, item.low, item.high, item.unit) for item in self.intervals_with_misfit)
        return Table(("parameter", "value", "from", "to", "unit"), tuple(rows))

    def __str__(self) -> str:
        """Formula, and the table of the parameters."""
        return "\n\n".join((repr(self)[1:-1], str(self.tf), *([str(self.table)] if self.intervals else [])))

    def velocity(self, sampling_rate: float, voltage: FloatArray, position: FloatArray) -> FloatArray:
        """(n - 1,) simulated mean velocity of each sample, m/s, from rest; of an acceleration its integral without mean and slow drift."""
        with np.errstate(over="ignore", invalid="ignore"):  # an unstable model is reported as such
            moved, derivative = simulate_sampled(self.tf, sampling_rate, voltage, self.hold), derivative_of(self.tf.output_unit)
            if derivative == 2:
                steps = (moved - np.mean(moved))[:-2] / sampling_rate
                return detrended(np.concatenate(([0.0], np.cumsum(steps))))
            return np.asarray(moved[:-1] if derivative else np.diff(moved) * sampling_rate)

    def __repr__(self) -> str:
        told = f" of axis {self.axis}" if self.axis else ""
        modes = [f"{mode.frequency:.4g} Hz" for mode in self.tf.pole_modes() if abs(mode.damping) < 1.0]
        shown = f", resonance {', '.join(modes)}" if modes else ""
        passed = f", {sum(item.ok for item in self.verdicts)} of {len(self.verdicts)} checks passed" if self.verdicts else ""
        factor = self.fit.misfit if self.fit is not None else 1.0
        doubt = f", misfit: intervals {factor:.3g} times too narrow" if factor > 1.0 else ""
        return f"<LinearModel{told}: {self.label}, delay {1e3 * self.tf.delay:.4g} ms{shown}{passed}{doubt}>"


def frf(data: Run | Recording, period: int | None = 0, **settings: Any) -> FrequencyResponse:
    """H1 with coherence and sigma of every line.

    data:     a run, or a recording of one axis; period: of the input in samples; 0: search for one, None: not periodic
    settings: any of the identifier's (docs/settings.md), for example length=8192, window="hann", band_low=1.0
    Source: Bendat & Piersol, Random Data, 4th ed., sec. 6.1.4. Notes for the user are in ``origin.notes``.
    Raises BadInput if the axis does not move, the data are too short for one window, or a setting is unknown.
    """
    run = one_run(data)
    recording = data if isinstance(data, Recording) else run.recording()
    found = estimate(recording, run.axis, build(IdentifierSettings, settings, "frf"), period)
    return replace(found.frf, origin=Origin(run.axis, run.digest, found.notes))


def fit(response: FrequencyResponse, method: str = "best", **settings: Any) -> LinearModel:
    """A fitted transfer function with delay, 95 % intervals and verdicts.

    method:   best (maximum likelihood), lls, iwls, nlls, ml, nllsfdi
    settings: any of the identifier's, for example numerator_order=2, denominator_order=3, delay=False
    Orders that are not given are chosen from the response, from a rigid body with delay upwards; the verdict "order" says why.
    Source: Pintelon & Schoukens, System Identification, 2nd ed., ch. 9 and 10.
    Raises BadInput for a response without uncertainty, or orders beyond what numbers can hold.
    """
    found, validation = fit_response(response, changed(IdentifierSettings(), settings), Method(method))
    known = (response.origin.data,) if response.origin.data else ()
    return LinearModel(tf=found.tf, hold=found.structure.hold, axis=response.origin.axis, data=known, fit=found, verdicts=validation.verdicts)


@dataclass(frozen=True, slots=True)
class Method:
    """How a transfer function is fitted.

    estimator: best (maximum likelihood), lls, iwls, nlls, ml, or nllsfdi
    weighting: of a line's error: sigma, relative (1/|FRF|) or uniform; domain: s (continuous) or z (discrete)
    Raises BadInput for anything else.
    """

    estimator: str = "best"
    weighting: str = "sigma"
    domain: str = "s"

    def __post_init__(self) -> None:
        known = {"method": ("best", *ESTIMATORS), "weighting": get_args(Weighting), "domain": ("s", "z")}
        for (name, allowed), value in zip(known.items(), (self.estimator, self.weighting, self.domain), strict=True):
            if value not in allowed:
                raise BadInput(name, repr(value), ", ".join(allowed), "Choose one of these.")

    def structure(self, settings: IdentifierSettings) -> Structure:
        """The model family. Raises BadInput for settings that contradict each other."""
        values: dict[str, Any] = {"weighting": self.weighting, "domain": self.domain}
        return replace(structure_from(settings), **values)


def fit_response(
    response: FrequencyResponse, settings: IdentifierSettings, method: Method | None = None, unseen: HeldOut | None = None
) -> tuple[Fit, Validation]:
    """The fit with its verdicts; unseen: held-out samples, for the check in time. Raises BadInput as ``fit``."""
    judged(response)
    settings = settings_for(response, settings)
    method, choice = method or Method(), None
    try:
        with np.errstate(all="ignore"):  # an overflow gives a number that the verdicts judge
            if method.domain == "s" and method.estimator not in FIXED:
                settings, choice = with_orders(response, settings)
            if choice is not None and (method.estimator, method.weighting) == ("best", "sigma"):
                found = choice.fit
            else:
                found = {"best": identify, **ESTIMATORS}[method.estimator](response, method.structure(settings))
            return found, validate(found, response, unseen, choice=choice)
    except (np.linalg.LinAlgError, ZeroDivisionError):
        raise BadInput("fit", "beyond what numbers can hold", "orders that the data determine", "Lower them or widen the band.") from None
