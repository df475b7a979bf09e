"""Frequency response of a full recording, axis by axis."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.fitting import Fit, identify
from xy_sysid.fitting.choose_level import choose_level, is_level
from xy_sysid.fitting.choose_orders import Choice, choose, choose_among
from xy_sysid.fitting.of_given_response import is_given
from xy_sysid.fitting.structure import structure_from
from xy_sysid.response.best_linear import Realisation, best_linear
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.response.friction_hint import friction_hint, friction_note
from xy_sysid.response.h1 import H1Options
from xy_sysid.response.methods import METHODS, ResponseMethod
from xy_sysid.response.period import FEWEST, find_half_period, find_period, half_periods, one_more, period_note
from xy_sysid.response.window_check import stretches
from xy_sysid.response.windows import WindowShape
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.rate import error_of_rate
from xy_sysid.samples.recording import Recording, as_sensed
from xy_sysid.settings import IdentifierSettings
from xy_sysid.units import derivative_of

HARDLY = 4.0  # standard deviations of the number of lines that are coherent by chance (neighbours are correlated, hence the 2)
HALVES = (
    "The input repeats with the other sign every {half} samples ({seconds:.6g} s), half its period: "
    "windows of one period, made of each half and its negative."
)
FIXED = ("nllsfdi",)  # estimators with the paper's own structure: the default orders are 2/4
WINDOWS, SHORTEST = 3, 16  # least number of adjacent windows in a record, and samples of the shortest window
LONGEST = 16_384  # samples of a window, if a single one suffices
MOST_ON_GRID = 0.5  # of the possible windows; if the grid holds fewer, each stretch has windows from its own start
COVERED = 0.5  # of the samples: least fraction in such windows
MANY = 6  # periods needed if feedback or friction affects the input
MOST_TRANSIENT = 2  # largest number of periods of a stretch from which none is left out
BEST = "Several realisations of a periodic input: noise and nonlinear distortion are separated, and sigma is the larger of the two."
TRANSIENT = 1  # periods left out at the start of a periodic recording
USUAL = IdentifierSettings()
ROUNDING = 1e-12  # of the response: a simulated signal without noise is not more accurate than its numbers
SMALLEST, LARGEST = 1e-100, 1e100  # of the measurement: squares of other values are out of range


@dataclass(frozen=True, slots=True)
class AxisEstimate:
    """The response of one axis and details of its estimation.

    period: samples of one period of the input, None if it is not periodic; notes: sentences for the user
    """

    axis: str
    frf: FrequencyResponse
    period: int | None
    windows: int
    notes: tuple[str, ...]


def estimate(recording: Recording, axis: str, settings: IdentifierSettings, period: int | None = 0) -> AxisEstimate:
    """The response of one axis in the quantity that its sensor reads, by the method that ``settings.response`` names.

    period: samples of a period (the window becomes one period, without a taper), 0 to look for one, None for none
    Windows in which the encoder stands still or jumps are left out, as online, and a note says so.
    Raises BadInput if the axis is missing, was not excited, or the data are too short for one window.
    """
    method, notes = METHODS[settings.response], list[str]()
    heard = _heard(recording, axis, method)
    if recording.measured != "position":
        settings = replace_settings(settings, differenced=False)  # a directly measured quantity has no drift and therefore no leakage from it
    windows = _windows(heard, settings, _repeats(heard, settings, period, notes), notes)
    settings, period = windows.settings, windows.period
    y = _sensed(recording, heard.y, windows.half or period or 0, -1.0 if windows.half else 1.0)
    r = None if heard.r is None else _sensed(recording, heard.r, period or 0)
    checked, pieces = (_pieces(heard, output, windows) for output in (y if windows.half else heard.y, y))
    frozen = max(round(settings.frozen * recording.sampling_rate), 2)
    kept, left_out = stretches(checked, windows.shape, settings.differenced, frozen)
    notes += left_out
    cut = [
        (pieces[k][0] + start, np.zeros(0) if r is None else r[windows.runs[k]][start:stop], pieces[k][1][start:stop], pieces[k][2][start:stop])
        for k, start, stop in kept
    ]
    options = H1Options(
        differenced=settings.differenced,
        periodic=bool(period),
        band=(settings.band_low, settings.band_high),
        min_coherence=settings.min_coherence,
        units=(recording.units.input, recording.units.measured),
        rate_error=error_of_rate(recording.time, recording.seq),
    )
    sums = method.whole(cut, windows.shape, settings.differenced)
    frf = method.estimate(sums, windows.shape, recording.sampling_rate, options)
    notes += [method.note] if method.note else []
    if period and not windows.half and method.plain:
        frf = best_linear(frf, _realisations([(inputs, outputs) for _, inputs, outputs in pieces], period, settings.differenced))
        notes += [BEST] if frf.noise.size else []
    frf = replace(frf, sigma=np.maximum(frf.sigma, ROUNDING * np.abs(frf.response)))
    notes += _coherence(frf, settings, bool(period))
    notes += [] if method.reference else _closed_loop(recording, axis)
    longest = max(windows.runs, key=_samples)
    friction = friction_note(friction_hint(heard.u[longest], y[longest], recording.sampling_rate))
    notes += [friction] if friction else []
    return AxisEstimate(axis=axis, frf=frf, period=period, windows=int(method.windows(sums)), notes=tuple(notes))


@dataclass(frozen=True, slots=True)
class _Signals:
    """One axis. longest: its longest run; u, y, r: (n,) input, output, and the reference if the method needs one."""

    recording: Recording
    axis: str
    longest: slice
    u: FloatArray
    y: FloatArray
    r: FloatArray | None


@dataclass(frozen=True, slots=True)
class _Windows:
    """Where windows are cut. runs: of samples; period: samples of one, or None; half: samples of half a period, if only halves repeat."""

    settings: IdentifierSettings
    shape: WindowShape
    runs: list[slice]
    period: int | None
    half: int | None


def _heard(recording: Recording, axis: str, method: ResponseMethod) -> _Signals:
    """The signals of an axis, all of which move."""
    u, y = recording.axis(axis)
    r = _reference(recording, axis) if method.reference else None
    _moving(axis, u, y, (recording.units.input, recording.units.measured))
    return _Signals(recording=recording, axis=axis, longest=recording.run(axis).rows, u=u, y=y, r=r)


def _repeats(heard: _Signals, settings: IdentifierSettings, period: int | None, notes: list[str]) -> tuple[int | None, int | None]:
    """Samples after which the input or reference repeats, and samples after which the input repeats with the other sign; None if it does not."""
    recording, axis, longest = heard.recording, heard.axis, heard.longest
    repeats = (heard.u if heard.r is None else heard.r)[longest]
    if period:
        notes += period_note(repeats, period)
    if period != 0:
        return period, None
    period = find_period(repeats)
    if period and heard.r is None and _samples(longest) < MANY * period and _distorted(recording, axis, longest):
        period = None
    drifts = recording.measured == "position" and not settings.differenced
    alone = period is None and METHODS[settings.response].plain and not drifts and not _closed_loop(recording, axis)
    return period, find_half_period(heard.u[longest]) if alone else None


def _windows(heard: _Signals, settings: IdentifierSettings, repeats: tuple[int | None, int | None], notes: list[str]) -> _Windows:
    """Windows of one period, or windows that fit into the record. Raises BadInput if there is none."""
    (period, half), recording, method, runs = repeats, heard.recording, METHODS[settings.response], heard.recording.runs()
    if half:
        settings, period = replace_settings(settings, window="boxcar", length=2 * half, overlap=0.0), 2 * half
        notes.append(HALVES.format(half=half, seconds=half / recording.sampling_rate))
    elif period:
        what = "input" if heard.r is None else "reference"
        settings, runs = _periodic(settings, runs, period, notes, recording.sampling_rate, what)
    else:
        settings = _fitting(settings, runs, notes, method.tapered)
    _possible(settings, recording.sampling_rate, _samples(heard.longest) + (half or 0) + bool(period))
    shape = method.shape(settings.window, settings.length, settings.overlap)
    return _Windows(settings=settings, shape=shape, runs=runs, period=period, half=half)


def _pieces(heard: _Signals, y: FloatArray, windows: _Windows) -> list[tuple[int, FloatArray, FloatArray]]:
    """(counter of the first sample, input, output) of each run, with samples added where a period or half of one is made of another."""
    recording, u, differenced = heard.recording, heard.u, windows.settings.differenced
    if windows.half:
        return half_periods(u[heard.longest], y[heard.longest], windows.half, differenced)
    grid = 0 if windows.period or not _fits(recording, windows.runs, windows.shape, differenced) else 1
    pieces = [(grid * int(recording.seq[run][0]), u[run], y[run]) for run in windows.runs]
    if windows.period and heard.r is None and differenced:
        return [(seq, *one_more(inputs, outputs, windows.period)) for seq, inputs, outputs in pieces]
    return pieces


def _realisations(pieces: list[tuple[FloatArray, FloatArray]], period: int, differenced: bool) -> list[Realisation]:
    """Input and output of each stretch, period by period, without the first one if at least two others remain."""
    found = []
    for u, y in pieces:
        output = np.diff(y) if differenced else y
        count = output.size // period
        first = int(count > MOST_TRANSIENT)
        rows = slice(first * period, count * period)
        if count > first:
            found.append((u[rows].reshape(-1, period), output[rows].reshape(-1, period)))
    return found


def _sensed(recording: Recording, y: FloatArray, period: int, sign: float = 1.0) -> FloatArray:
    """(n,) the output as the sensor reads it. Missing last samples of each run are copied from a period before, or from the sample before."""
    found = np.zeros_like(y)
    for run in recording.runs():
        own = as_sensed(y[run], recording.sampling_rate, recording.measured)
        ends = y[run].size - own.size
        if 0 < period <= own.size:
            own = np.append(own, sign * own[own.size - period : own.size - period + ends])
        found[run] = own if own.size == y[run].size else np.append(own, np.full(ends, own[-1] if own.size else 0.0))
    return found


def _distorted(recording: Recording, axis: str, rows: slice) -> bool:
    """True if feedback or friction affects the input: this contribution is periodic too, and few periods cannot separate it from the response."""
    u, y = recording.axis(axis)
    return bool(_closed_loop(recording, axis) or friction_note(friction_hint(u[rows], y[rows], recording.sampling_rate)))


def _reference(recording: Recording, axis: str) -> FloatArray:
    """(n,) reference of one axis; raises BadInput if there is none, or a constant one."""
    if recording.reference is None:
        act = "Record it (topic reference, column x_reference), or leave response at h1."
        raise BadInput("response", "joint_input_output, and the recording has no reference", "a recording with a reference", act)
    reference = recording.reference[:, recording.axes.index(axis)]
    _moving(axis, reference, reference, (recording.output_unit, recording.output_unit), ("reference", "reference"))
    return reference


def _samples(run: slice) -> int:
    return int(run.stop - run.start)


def _moving(axis: str, u: FloatArray, y: FloatArray, units: tuple[str, str], names: tuple[str, str] = ("input", "output")) -> None:
    """Raises BadInput for an input or output that is constant, or whose square would overflow or underflow."""
    acts = "Excite this axis.", "Check the encoder, and that the axis is enabled."
    for name, values, unit, act in zip(names, (u, y), units, acts, strict=True):
        if values.size == 0 or float(np.ptp(values)) == 0.0:
            raise BadInput(f"{name} of axis {axis}", f"constant at {float(values[0]) if values.size else 0.0:g} {unit}", "a moving one", act)
        size = float(np.max(np.abs(values)))
        if not (float(np.ptp(values)) >= SMALLEST and size <= LARGEST):
            allowed = f"{SMALLEST:g} to {LARGEST:g} {unit}"
            raise BadInput(f"{name} of axis {axis}", f"up to {size:.3g} {unit} in size", allowed, "Check its unit and how it was written.")


def _fitting(settings: IdentifierSettings, runs: list[slice], notes: list[str], tapered: bool) -> IdentifierSettings:
    """The settings with a window of which enough fit into the record; unchanged if the user chose a length.

    tapered: several windows are averaged; otherwise lines are averaged, so one long window suffices
    """
    if settings.length != USUAL.length:
        return settings
    sizes = np.array([max(_samples(run) - 1, 0) for run in runs])
    length = settings.length if tapered else min(LONGEST, int(np.max(sizes)) // 2 * 2)
    while length > SHORTEST and (np.sum(sizes // length) < (WINDOWS if tapered else 1) or length * np.sum(sizes // length) < COVERED * np.sum(sizes)):
        length //= 2
    if length == settings.length:
        return settings
    used = int(np.sum(sizes >= length))
    short = f"; {len(sizes) - used} of {len(sizes)} stretches are shorter than one and are not used" if used < len(sizes) else ""
    if tapered:
        notes.append(f"Windows of {length} samples ({settings.length} is usual), so that the record holds {WINDOWS} or more{short}.")
    return replace_settings(settings, length=length)


def _possible(settings: IdentifierSettings, rate: float, samples: int) -> None:
    """Raises BadInput, before any computation, for windows longer than the data and for a band outside their range."""
    needed = settings.length + int(settings.differenced)
    if samples < needed:
        shorter = f", or shorten the window with --set length={max(samples // 4, SHORTEST)}" if settings.length > SHORTEST else ""
        act = f"Record for longer{shorter}."
        raise BadInput("longest gap-free run", f"{samples} samples", f"{needed} or more", act)
    lowest, highest = rate / settings.length, 0.5 * rate
    if max(settings.band_low, lowest) > min(settings.band_high, highest):
        shown = f"some of {lowest:.4g} to {highest:.4g} Hz, which {rate:.6g} Hz and windows of {settings.length} samples show"
        raise BadInput(
            "band", f"{settings.band_low:g} to {settings.band_high:g} Hz", shown, "Change it with --set band_low= and band_high=, or the length."
        )


def _fits(recording: Recording, runs: list[slice], shape: WindowShape, differenced: bool) -> bool:
    """True if the grid of windows (see ``windows``) holds at least half of those that fit into the runs; a short run may fall between two."""
    needed = shape.length + int(differenced)
    rooms = [(_samples(run) - needed, -int(recording.seq[run.start]) % shape.hop) for run in runs if _samples(run) >= needed]
    on_grid = sum((room - first) // shape.hop + 1 for room, first in rooms if room >= first)
    return 0 < on_grid >= MOST_ON_GRID * sum(room // shape.hop + 1 for room, _ in rooms)


def _coherence(frf: FrequencyResponse, settings: IdentifierSettings, periodic: bool) -> list[str]:
    """Notes if there are too few data, or hardly more trusted lines than from noise alone."""
    if frf.averages < 2.0:
        return [f"Only {frf.averages:.1f} independent windows: no uncertainty, so no line is trusted. Record longer, or shorten the window."]
    if periodic:
        return []
    none = 1.0 - settings.min_coherence  # to the power averages - 1: probability that a line without coherence has more
    chance = none ** (frf.averages - 1.0) * len(frf)
    usual = 1.0 - none * 0.1 ** (1.0 / (frf.averages - 1.0))  # nine of ten such lines have less coherence than this by chance
    trusted = int(frf.trusted.sum())
    many = trusted > chance + HARDLY * math.sqrt(2.0 * chance)
    if many or (trusted and float(np.median(frf.coherence[frf.trusted])) > usual):
        return []
    return [
        f"Only {trusted} of {len(frf)} lines in the band are coherent with the input, and chance alone gives {chance:.0f}: "
        "the output hardly follows the input. Excite more, narrow the band, or check the wiring."
    ]


def _periodic(
    settings: IdentifierSettings, runs: list[slice], period: int, notes: list[str], rate: float, what: str
) -> tuple[IdentifierSettings, list[slice]]:
    """Settings and runs for a periodic signal. what: its name, the input or the reference."""
    first = runs[0]
    if (first.stop - first.start) // period > TRANSIENT + 1:
        runs = [slice(first.start + TRANSIENT * period, first.stop), *runs[1:]]
        notes.append(f"The {what} repeats every {period} samples ({period / rate:.6g} s): windows of one period, the first one left out.")
    else:
        notes.append(f"The {what} repeats every {period} samples ({period / rate:.6g} s): windows of one period.")
    return replace_settings(settings, window="boxcar", length=period, overlap=0.0), runs


def replace_settings(settings: IdentifierSettings, **values: object) -> IdentifierSettings:
    """The settings with some values changed, without the checks for users."""
    return settings.model_copy(update=values)


def _closed_loop(recording: Recording, axis: str) -> list[str]:
    """A note if the input follows the tracking error: with such feedback H1 is biased towards minus the inverse controller."""
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
        "large compared with the excitation; if the reference moves in the whole band, --set response=joint_input_output uses it as instrument; "
        "otherwise trust only lines with high coherence, or measure in open loop."
    ]


def judged(frf: FrequencyResponse) -> None:
    """Raises BadInput for a response without an uncertainty, which cannot be fitted or compared."""
    if frf.averages < 2.0:
        act = "Record longer, or shorten the window with --set length=."
        raise BadInput("number of independent windows", f"{frf.averages:.1f}", "2 or more, so that there is an uncertainty", act)


def with_orders(frf: FrequencyResponse, settings: IdentifierSettings) -> tuple[IdentifierSettings, Choice | None]:
    """The settings with orders chosen from the response, and the choice; unchanged, and None, if the user gave orders."""
    if not settings.orders_from_data:
        return settings, None
    family = structure_from(settings)
    if is_given(frf) and is_level(frf):
        choice = choose_level(frf, family)
        at = choice.fit.structure
        level = {"numerator_order": at.numerator_order, "denominator_order": at.denominator_order, "delay": at.free_delay}
        return settings.model_copy(update=level), choice
    open_question = derivative_of(frf.output_unit) == 2 and settings.integrators == USUAL.integrators
    choice = choose_among(frf, [replace(family, integrators=count) for count in (2, 1, 0)]) if open_question else choose(frf, family)
    structure = choice.fit.structure
    orders = {
        "numerator_order": structure.numerator_order,
        "denominator_order": structure.denominator_order,
        "integrators": structure.integrators,
    }
    return settings.model_copy(update=orders), choice


def fitted(frf: FrequencyResponse, settings: IdentifierSettings) -> Fit:
    """A transfer function with the given orders, or with those that the response supports."""
    settings, choice = with_orders(frf, settings)
    return choice.fit if choice is not None else identify(frf, structure_from(settings))


def split(recording: Recording, held_out: float) -> tuple[Recording, Recording]:
    """The first part, for the fit, and the last ``held_out`` (0..0.9) of the samples. Raises BadInput out of this range."""
    if not 0.0 <= held_out <= 0.9:
        raise BadInput("held-out part", held_out, "0 to 0.9", "Choose for example 0.2.")
    cut = len(recording) - round(held_out * len(recording))
    return part(recording, slice(0, cut)), part(recording, slice(cut, len(recording)))


def few_periods(recording: Recording, held_out: float) -> bool:
    """True if the input has so few periods that fewer than two remain without the held-out part."""
    if not 0.0 <= held_out <= 0.9:
        return False  # refused by ``split``
    rows = len(recording) - round(held_out * len(recording))
    inputs = [recording.run(axis).voltage for axis in recording.axes]
    periods = [find_period(values) or find_half_period(values) for values in inputs]
    return any(period is not None and FEWEST * period > rows for period in periods)


def part(recording: Recording, rows: slice) -> Recording:
    """Consecutive rows of a recording."""
    return recording.only(rows)
