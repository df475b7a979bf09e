"""Frequency response of a whole recording, axis by axis."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.batch import batch_spectra
from xy_sysid.errors import BadInput
from xy_sysid.estimate import frequency_response
from xy_sysid.frf import FrequencyResponse
from xy_sysid.friction_hint import friction_hint, friction_note
from xy_sysid.period import find_period
from xy_sysid.recording import Recording
from xy_sysid.settings import IdentifierSettings
from xy_sysid.windows import WindowShape

TRANSIENT = 1  # periods left out at the start of a periodic recording


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
    Raises BadInput if the axis is not there, was not excited, or the data are too short for one window.
    """
    u, y = recording.axis(axis)
    if float(np.ptp(u)) == 0.0:
        raise BadInput(
            f"input of axis {axis}", f"constant at {float(u[0]) if u.size else 0.0:g} {recording.input_unit}", "a moving one", "Excite this axis."
        )
    if float(np.ptp(y)) == 0.0:
        raise BadInput(f"output of axis {axis}", "constant", "a moving one", "Check the encoder, and that the axis is enabled.")
    runs = recording.runs()
    if period == 0:
        longest = max(runs, key=lambda run: run.stop - run.start)
        period = find_period(u[longest])
    notes: list[str] = []
    if period:
        settings, runs = _periodic(settings, runs, period, notes, recording.sampling_rate)
    shape = WindowShape.of(settings.window, settings.length, settings.overlap)
    pieces = [(0 if period else int(recording.seq[run][0]), u[run], y[run]) for run in runs]
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
    longest = max(runs, key=lambda run: run.stop - run.start)
    friction = friction_note(friction_hint(u[longest], y[longest], recording.sampling_rate), recording.input_unit)
    notes += [*_closed_loop(recording, axis), *([friction] if friction else [])]
    return AxisEstimate(axis, frf, period or None, int(spectra.weight), tuple(notes))


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
