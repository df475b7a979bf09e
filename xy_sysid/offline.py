"""Frequency response of a whole recording, axis by axis."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.batch import batch_spectra
from xy_sysid.errors import BadInput
from xy_sysid.estimate import frequency_response
from xy_sysid.fitting import Fit, identify
from xy_sysid.frf import FrequencyResponse
from xy_sysid.friction_hint import friction_hint, friction_note
from xy_sysid.live_fit import structure_from
from xy_sysid.period import find_period, period_note
from xy_sysid.recording import Recording
from xy_sysid.settings import IdentifierSettings
from xy_sysid.stream import FloatArray
from xy_sysid.window_check import sound
from xy_sysid.windows import WindowShape

HARDLY = 4.0  # standard deviations of the number of lines that chance makes coherent (neighbours are alike, hence the 2)
TRANSIENT = 1  # periods left out at the start of a periodic recording
ROUNDING = 1e-12  # of the response: no line of a made-up signal without noise is more exact than its numbers
SMALLEST, LARGEST = 1e-100, 1e100  # of what is measured: squares of more or less leave the range of numbers


@dataclass(frozen=True, slots=True)
class AxisEstimate:
    """The response of one axis and how it came about.

    period: samples of one period of the input, None if it does not repeat; notes: sentences a user should read
    """

    axis: str
    frf: FrequencyResponse
    period: int | None
    windows: int
    notes: tuple[str, ...]


def estimate(recording: Recording, axis: str, settings: IdentifierSettings, period: int | None = 0) -> AxisEstimate:
    """H1 of one axis.

    period: samples of a period (the window becomes one period, without a taper), 0 to look for one, None for none
    Windows in which the encoder stands still or leaps are left out, as online, and a note says so.
    Raises BadInput if the axis is not there, was not excited, or the data are too short for one window.
    """
    u, y = recording.axis(axis)
    _moving(axis, u, y, (recording.input_unit, recording.output_unit))
    runs = recording.runs()
    longest = max(runs, key=_samples)
    notes: list[str] = []
    if period == 0:
        period = find_period(u[longest])
    elif period:
        notes += period_note(u[longest], period)
    if period:
        settings, runs = _periodic(settings, runs, period, notes, recording.sampling_rate)
    _possible(settings, recording.sampling_rate, _samples(longest))
    shape = WindowShape.of(settings.window, settings.length, settings.overlap)
    grid = 0 if period or not _fits(recording, runs, shape, settings.differenced) else 1
    pieces = [(grid * int(recording.seq[run][0]), u[run], y[run]) for run in runs]
    frozen = max(round(settings.frozen * recording.sampling_rate), 2)
    pieces, left_out = sound(pieces, shape, settings.differenced, frozen)
    notes += left_out
    spectra = batch_spectra(pieces, shape, settings.differenced)
    frf = frequency_response(
        spectra,
        shape,
        recording.sampling_rate,
        differenced=settings.differenced,
        periodic=bool(period),
        band=(settings.band_low, settings.band_high),
        min_coherence=settings.min_coherence,
        units=(recording.input_unit, recording.output_unit),
    )
    frf = replace(frf, sigma=np.maximum(frf.sigma, ROUNDING * np.abs(frf.response)))
    notes += _coherence(frf, settings, bool(period))
    longest = max(runs, key=_samples)
    friction = friction_note(friction_hint(u[longest], y[longest], recording.sampling_rate), recording.input_unit)
    notes += [*_closed_loop(recording, axis), *([friction] if friction else [])]
    return AxisEstimate(axis, frf, period or None, int(spectra.weight), tuple(notes))


def _samples(run: slice) -> int:
    return int(run.stop - run.start)


def _moving(axis: str, u: FloatArray, y: FloatArray, units: tuple[str, str]) -> None:
    """Raises BadInput for an input or output that does not move, or that moves by more than numbers can be squared."""
    acts = "Excite this axis.", "Check the encoder, and that the axis is enabled."
    for name, values, unit, act in zip(("input", "output"), (u, y), units, acts, strict=True):
        if values.size == 0 or float(np.ptp(values)) == 0.0:
            raise BadInput(f"{name} of axis {axis}", f"constant at {float(values[0]) if values.size else 0.0:g} {unit}", "a moving one", act)
        size = float(np.max(np.abs(values)))
        if not (float(np.ptp(values)) >= SMALLEST and size <= LARGEST):
            allowed = f"{SMALLEST:g} to {LARGEST:g} {unit}"
            raise BadInput(f"{name} of axis {axis}", f"up to {size:.3g} {unit} in size", allowed, "Check its unit and how it was written.")


def _possible(settings: IdentifierSettings, rate: float, samples: int) -> None:
    """Raises BadInput, before any work is done, for windows longer than the data and for a band that they cannot show."""
    needed = settings.length + int(settings.differenced)
    if samples < needed:
        act = f"Record for longer, or shorten the window with --set length={max(samples // 4, 16)}."
        raise BadInput("longest gap-free run", f"{samples} samples", f"{needed} or more", act)
    lowest, highest = rate / settings.length, 0.5 * rate
    if max(settings.band_low, lowest) > min(settings.band_high, highest):
        shown = f"some of {lowest:.4g} to {highest:.4g} Hz, which {rate:.6g} Hz and windows of {settings.length} samples show"
        raise BadInput(
            "band", f"{settings.band_low:g} to {settings.band_high:g} Hz", shown, "Change it with --set band_low= and band_high=, or the length."
        )


def _fits(recording: Recording, runs: list[slice], shape: WindowShape, differenced: bool) -> bool:
    """Whether a window of the grid (see ``windows``) lies in any run; a short recording may lie between two."""
    return any(-int(recording.seq[run.start]) % shape.hop + shape.length + int(differenced) <= _samples(run) for run in runs)


def _coherence(frf: FrequencyResponse, settings: IdentifierSettings, periodic: bool) -> list[str]:
    """Too little to judge, or hardly more trusted lines than noise alone would give."""
    if frf.averages < 2.0:
        return [f"Only {frf.averages:.1f} independent windows: no uncertainty, so no line is trusted. Record longer, or shorten the window."]
    if periodic:
        return []
    none = 1.0 - settings.min_coherence  # chance that a line of no coherence stays below
    chance = none ** (frf.averages - 1.0) * len(frf)
    usual = 1.0 - none * 0.1 ** (1.0 / (frf.averages - 1.0))  # nine of ten such lines by chance have no more coherence
    trusted = int(frf.trusted.sum())
    many = trusted > chance + HARDLY * math.sqrt(2.0 * chance)
    if many or (trusted and float(np.median(frf.coherence[frf.trusted])) > usual):
        return []
    return [
        f"Only {trusted} of {len(frf)} lines in the band are coherent with the input, and chance alone gives {chance:.0f}: "
        "the output hardly follows the input. Excite more, narrow the band, or check the wiring."
    ]


def _periodic(settings: IdentifierSettings, runs: list[slice], period: int, notes: list[str], rate: float) -> tuple[IdentifierSettings, list[slice]]:
    first = runs[0]
    if (first.stop - first.start) // period > TRANSIENT + 1:
        runs = [slice(first.start + TRANSIENT * period, first.stop), *runs[1:]]
        notes.append(f"The input repeats every {period} samples ({period / rate:.6g} s): windows of one period, the first one left out.")
    else:
        notes.append(f"The input repeats every {period} samples ({period / rate:.6g} s): windows of one period.")
    return replace_settings(settings, window="boxcar", length=period, overlap=0.0), runs


def replace_settings(settings: IdentifierSettings, **values: object) -> IdentifierSettings:
    """The settings with some values changed, unchecked by limits that only concern users."""
    return settings.model_copy(update=values)


def _closed_loop(recording: Recording, axis: str) -> list[str]:
    """A reference in the recording means feedback: H1 is then biased towards minus the inverse controller."""
    if recording.reference is None:
        return []
    column = recording.axes.index(axis)
    error = recording.reference[:, column] - recording.position[:, column]
    u = recording.voltage[:, column]
    if float(np.std(error)) == 0.0 or float(np.std(u)) == 0.0:
        return []
    likeness = abs(float(np.corrcoef(error, u)[0, 1]))
    if likeness < 0.3:
        return []
    return [
        f"Closed loop: the input follows the tracking error (correlation {likeness:.2f}). H1 is biased where noise and friction are "
        "large against the excitation; trust lines of high coherence only, or measure with open loop."
    ]


def judged(frf: FrequencyResponse) -> None:
    """Raises BadInput for a response without an uncertainty of its own, to which nothing can be fitted or compared."""
    if frf.averages < 2.0:
        act = "Record longer, or shorten the window with --set length=."
        raise BadInput("number of independent windows", f"{frf.averages:.1f}", "2 or more, so that there is an uncertainty", act)


def fitted(frf: FrequencyResponse, settings: IdentifierSettings) -> Fit:
    """A transfer function that can be simulated: of rigid orders where the default orders give none that is stable."""
    fit = identify(frf, structure_from(settings))
    defaults = IdentifierSettings()
    asked = settings.numerator_order, settings.denominator_order
    if asked != (defaults.numerator_order, defaults.denominator_order) or (fit.converged and fit.tf.is_stable):
        return fit
    rigid = settings.model_copy(update={"numerator_order": 0, "denominator_order": settings.integrators + 1})
    other = identify(frf, structure_from(rigid))
    return other if other.converged and other.tf.is_stable else fit


def split(recording: Recording, held_out: float) -> tuple[Recording, Recording]:
    """The first part to fit, and the last ``held_out`` (0..0.9) of the samples that no fit sees."""
    if not 0.0 <= held_out <= 0.9:
        raise BadInput("held-out part", held_out, "0 to 0.9", "Choose for example 0.2.")
    cut = len(recording) - round(held_out * len(recording))
    return part(recording, slice(0, cut)), part(recording, slice(cut, len(recording)))


def part(recording: Recording, rows: slice) -> Recording:
    """Some consecutive rows of a recording."""
    reference = None if recording.reference is None else recording.reference[rows]
    return replace(
        recording,
        seq=recording.seq[rows],
        time=recording.time[rows],
        voltage=recording.voltage[rows],
        position=recording.position[rows],
        reference=reference,
    )
