"""A sequence of fits: warm starts, the watch on a resonance, and the messages to publish.

``LiveFitter.fit(request)`` depends only on the requests so far and their order, so that a replay repeats it bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fitting import identify
from xy_sysid.fitting.choose_orders import Choice, choose, stands
from xy_sysid.fitting.modes import pole_estimates
from xy_sysid.fitting.result import POOR_ERROR, Fit
from xy_sysid.fitting.structure import FitOptions, structure_from
from xy_sysid.linear.transfer_function import LIGHT_DAMPING, TransferFunction
from xy_sysid.live import status_values
from xy_sysid.live.coupling_messages import coupling_messages, coupling_status
from xy_sysid.live.identifier import AxisRequest, FitRequest
from xy_sysid.live.messages import comparison_message, frf_message, transfer_function_message
from xy_sysid.live.plain_messages import ERROR, OK, WARN, ArrayMessage, StatusMessage
from xy_sysid.live.resonance_watch import Resonance, Track, alarm_sentence, follow
from xy_sysid.live.stretch_fits import FittedStretch, StretchFits
from xy_sysid.response.estimate import Estimate
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.response.h1 import H1Options, frequency_response
from xy_sysid.response.spectra import RunningSpectra, State, Transformer
from xy_sysid.response.windows import Window, WindowShape
from xy_sysid.samples.block import FloatArray, columns, unpack
from xy_sysid.samples.pairing import QUANTITIES, Pairer
from xy_sysid.samples.ring import RATE_SAMPLES
from xy_sysid.settings import IdentifierSettings

FIRST_FITS = 3  # fits in which a warm start that noise does not explain is checked against a cold start
LATER_DOUBT = 15  # later, one of this many fits: noise never explains an axis with friction, and a cold start is slow
OPTIONS = FitOptions(relative_change=1e-6)  # of the cost: leaves at most a hundredth of a standard error


@dataclass(frozen=True, slots=True)
class AxisUpdate:
    """One axis after a fit; ``fit`` is None if it was not possible, and ``problem`` gives the reason.

    stretch: fit of the newest windows with the structure of the baseline, if they share no sample with the previous stretch
    """

    frf: FrequencyResponse
    fit: Fit | None
    track: Track
    windows: int
    dropped: dict[str, int]
    problem: str = ""
    stretch: FittedStretch | None = None


@dataclass(frozen=True, slots=True)
class Update:
    """All axes after one request."""

    request: FitRequest
    axes: dict[str, AxisUpdate]

    def arrays(self) -> list[ArrayMessage]:
        """The array topics, in a fixed order."""
        found: list[ArrayMessage] = []
        for axis, update in self.axes.items():
            found.append(frf_message(axis, update.frf))
            if update.fit is not None and update.fit.converged:
                found.append(transfer_function_message(axis, update.fit.tf))
                found.append(comparison_message(axis, update.fit))
        return found + ([] if self.request.coupling is None else coupling_messages(self.request.coupling))

    def statuses(self) -> list[StatusMessage]:
        """``metrics``: one status per axis, and one for the coupling of two axes."""
        found = [_status(axis, update, self.request) for axis, update in self.axes.items()]
        return found + ([] if self.request.coupling is None else [coupling_status(self.request.coupling)])


class LiveFitter:
    """Keeps the last model of each axis as the next start value, and the history of its resonance.

    baseline: by axis, the model of commissioning; stretches of new data are fitted with its structure, too
    """

    def __init__(self, settings: IdentifierSettings, baseline: Mapping[str, TransferFunction] | None = None) -> None:
        self._settings = settings
        self._stretches = StretchFits(settings, baseline or {}, OPTIONS)
        self._choices: dict[str, Choice] = {}
        self._last: dict[str, Fit] = {}
        self._tracks: dict[str, Track] = {}

    def fit(self, request: FitRequest) -> Update:
        """Fit every axis of the request."""
        return Update(request, {axis: self._axis(axis, asked, request.number) for axis, asked in request.axes.items()})

    def reset(self) -> None:
        """Forget models and references."""
        self._choices.clear()
        self._last.clear()
        self._tracks.clear()

    def references(self) -> dict[str, Resonance]:
        """The reference resonance of each axis."""
        return {axis: track.reference for axis, track in self._tracks.items() if track.reference}

    def restore(self, references: dict[str, Resonance]) -> None:
        """Use these references, as before a restart."""
        self._tracks = {axis: Track(reference=reference) for axis, reference in references.items()}

    def state(self) -> State:
        """The references as named arrays, to keep them over a restart."""
        return {f"reference/{axis}": np.array([found.frequency, found.error]) for axis, found in self.references().items()}

    def recall(self, state: State) -> None:
        """Use the references of ``state``."""
        prefix = "reference/"
        self.restore({name.removeprefix(prefix): Resonance(*map(float, value)) for name, value in state.items() if name.startswith(prefix)})

    def _axis(self, axis: str, asked: AxisRequest, number: int) -> AxisUpdate:
        track = self._tracks.get(axis, Track())
        try:
            fit = self._fit(axis, asked.frf, number)
        except BadInput as problem:
            return AxisUpdate(frf=asked.frf, fit=None, track=track, windows=asked.windows, dropped=asked.dropped, problem=str(problem))
        if fit.converged:
            self._last[axis] = fit
        overall = watched(fit)
        track = follow(track, overall, self._recent(asked, fit, track), asked.windows, self._settings.alarm_sigma)
        self._tracks[axis] = track
        stretch = self._stretches.fit(axis, asked)
        return AxisUpdate(frf=asked.frf, fit=fit, track=track, windows=asked.windows, dropped=asked.dropped, stretch=stretch)

    def _fit(self, axis: str, frf: FrequencyResponse, number: int) -> Fit:
        """The fit from the last model; at the fits 1, 2, 4, 8, ... its orders are judged again, as twice the data may support others."""
        start, choice = self._last.get(axis), self._choices.get(axis)
        structure = choice.fit.structure if choice is not None else structure_from(self._settings)
        if self._settings.orders_from_data and number & (number - 1) == 0:
            if choice is not None and start is not None:
                with suppress(BadInput):  # too few trusted lines for these orders: others are chosen
                    fit = identify(frf, structure, start.tf, OPTIONS, doubt=False)
                    if stands(frf, choice, fit, OPTIONS):
                        return fit
            choice = self._choices[axis] = choose(frf, structure_from(self._settings), thorough=False)
            structure, start = choice.fit.structure, choice.fit
        doubt = number <= FIRST_FITS or number % LATER_DOUBT == 0
        return identify(frf, structure, start.tf if start else None, OPTIONS, doubt)

    def _recent(self, asked: AxisRequest, fit: Fit, track: Track) -> Resonance | None:
        if asked.recent is None or not fit.converged:
            return None
        try:
            poles = pole_estimates(asked.recent, fit.structure, fit.tf, OPTIONS)
        except BadInput:
            return None
        return _light(poles, fit.frequency, track.reference.frequency if track.reference else None)


def watched(fit: Fit, near: float | None = None) -> Resonance | None:
    """The resonance to watch: the least damped of the lightly damped ones in the band, or the one nearest to ``near`` Hz."""
    return _light(fit.intervals, fit.frequency, near)


def _light(intervals: tuple[Estimate, ...], band: FloatArray, near: float | None) -> Resonance | None:
    found: list[tuple[float, Resonance]] = []
    low, high = float(band[0]), float(band[-1])
    values = {item.name: item.value for item in intervals}
    for item in intervals:
        if item.name.startswith("resonance_") and item.name.endswith(".frequency"):
            damping = values[item.name.replace(".frequency", ".damping")]
            if low <= item.value <= high and 0.0 < damping < LIGHT_DAMPING and math.isfinite(item.sigma):
                distance = damping if near is None else abs(item.value - near)
                found.append((distance, Resonance(item.value, item.sigma)))
    return min(found, key=lambda pair: pair[0])[1] if found else None


def _status(axis: str, update: AxisUpdate, request: FitRequest) -> StatusMessage:
    fit, track = update.fit, update.track
    values: dict[str, str] = {
        "fit": str(request.number),
        status_values.WINDOWS: str(update.windows),
        "averages": f"{update.frf.averages:.6g}",
        status_values.SECONDS: f"{request.seconds:.6g}",
        status_values.RATE: f"{request.sampling_rate:.9g}",
        status_values.INPUT_UNIT: update.frf.input_unit,
        status_values.OUTPUT_UNIT: update.frf.output_unit,
        status_values.DROPPED: str(sum(update.dropped.values())),
    }
    values |= {f"{status_values.DROPPED_FOR}{reason}": str(number) for reason, number in sorted(update.dropped.items())}
    values |= {f"stream: {reason}": str(number) for reason, number in sorted(request.faults.items())}
    if fit is None:
        return StatusMessage(f"axis {axis}", WARN, f"axis {axis}: no fit yet: {update.problem}", tuple(values.items()))
    values[status_values.RELATIVE_ERROR], values["misfit (1)"] = f"{fit.relative_error:.6g}", f"{fit.misfit:.6g}"
    for item in fit.intervals:
        if item.name in ("delay", "gain") or "resonance" in item.name:
            values |= status_values.written(item)
    values["cost"], values["expected cost"] = f"{fit.cost:.6g}", f"{fit.expected_cost:.6g}"
    if track.reference and track.now:
        values[status_values.WATCHED], values[status_values.REFERENCE] = f"{track.now.frequency:.6g}", f"{track.reference.frequency:.6g}"
        values["resonance shift (Hz)"] = f"{track.shift:.6g}"
    level, sentence = _verdict(axis, update, request)
    return StatusMessage(f"axis {axis}", level, sentence, tuple(values.items()))


def _verdict(axis: str, update: AxisUpdate, request: FitRequest) -> tuple[int, str]:
    fit = update.fit
    if update.track.alarm:
        return ERROR, alarm_sentence(axis, update.track)
    if fit is None or not fit.converged:
        return WARN, f"axis {axis}: the fit did not converge: {fit.reason if fit else update.problem}"
    if fit.relative_error > POOR_ERROR:
        return WARN, f"axis {axis}: relative error {100 * fit.relative_error:.2g} %; the model does not fit (yet)"
    if request.going_on[axis]:
        reasons = ", ".join(request.going_on[axis])
        return WARN, f"axis {axis}: relative error {100 * fit.relative_error:.2g} %; some data could not be used ({reasons})"
    return OK, f"axis {axis}: relative error {100 * fit.relative_error:.2g} %"


def warm_up(settings: IdentifierSettings) -> None:
    """Pair artificial samples and fit an artificial response once, so that everything is compiled before data arrive."""
    rate, lines = 2000.0, 200
    pairer = Pairer(("x",), settings.reorder)
    for first in range(0, 3 * RATE_SAMPLES, RATE_SAMPLES):
        seq = np.arange(first, first + RATE_SAMPLES, dtype=np.float64)
        table = np.stack((seq, seq / rate, np.zeros(RATE_SAMPLES)), axis=1)
        for kind in QUANTITIES:
            pairer.feed(kind, unpack(columns(pairer.axes), RATE_SAMPLES, 3, table.ravel()))
    shape = WindowShape.of(settings.window, settings.length, settings.overlap)
    random = np.random.default_rng(0)
    running = RunningSpectra(shape)
    u = random.standard_normal((shape.length, 1))
    y = np.concatenate((np.zeros((3, 1)), np.cumsum(u, axis=0)))[: shape.length + int(settings.differenced)]
    transform = Transformer(shape, settings.differenced)
    for index in range(4):
        running.update(transform(Window(index, np.roll(u, index * 7, axis=0), y + 0.01 * random.standard_normal(y.shape)))[0])
    frf = frequency_response(running.get(), shape, rate, H1Options(differenced=settings.differenced, band=(1.0, lines * rate / shape.length)))
    structure = structure_from(settings)
    try:
        identify(frf, structure, identify(frf, structure).tf)
    except BadInput:
        return
