"""Response of a machine in closed loop: the joint input-output method, with the reference as instrument.

Feedback carries the output's noise into the input. Therefore output over input (H1) lies between the machine and minus the inverse
controller. The parts of both signals that are correlated with the reference are free of that noise:

    G = Syr / Sur,   sigma^2 = See / (|Sur|^2 / Srr) / (averages - 1)

where e = y - G u is the part that reference and machine do not explain: See = Cyy - 2 Re(G* Cyu) + |G|^2 Cuu. C are the spectra of y and u
without the part that is correlated with the reference. (Pintelon & Schoukens, System Identification, 2nd ed., sec. 2.7 and 9.18; Ljung, System
Identification, 2nd ed., sec. 13.5; Söderström & Stoica, Instrumental variable methods, 1983)

A window smooths Syr and Sur, not the machine's response itself, so the response has no smoothing kernel. If either varies strongly within a
few lines, use a periodic reference (a multisine), which has no leakage and no smoothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from xy_sysid.response.batch_spectra import batch_spectra
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.response.h1 import NOISE_SMOOTHING, H1Options, divisor, frequency_response, smoothed
from xy_sysid.response.spectra import RunningSpectra, Spectra, State, Transformer, WindowSpectrum, of_pair
from xy_sysid.response.windows import Window, WindowShape
from xy_sysid.samples.block import FloatArray

SURE = 0.2  # relative error of reference -> input up to which the quotient has the stated scatter and negligible bias
DRIVEN = 1e-6  # of the strongest line's power; between its lines a periodic reference has less
LINES = 2 * NOISE_SMOOTHING + 1


@dataclass(frozen=True, slots=True)
class LoopSpectra:
    """Spectra of three pairs of signals over the same windows: reference and output, reference and input, input and output."""

    output: Spectra
    input: Spectra
    between: Spectra


def loop_spectra(runs: list[tuple[int, FloatArray, FloatArray, FloatArray]], shape: WindowShape, differenced: bool) -> LoopSpectra:
    """Spectra of full runs: (counter of the first sample, reference (n,), input (n,), output (n,)) each; see ``batch_spectra``."""
    cut = slice(None, -1) if differenced else slice(None)  # shorten the input, so that all pairs have the same windows
    return LoopSpectra(
        output=batch_spectra([(seq, r, y) for seq, r, _, y in runs], shape, differenced),
        input=batch_spectra([(seq, r[cut], u[cut]) for seq, r, u, _ in runs], shape, False),
        between=batch_spectra([(seq, u, y) for seq, _, u, y in runs], shape, differenced),
    )


@dataclass(frozen=True, slots=True)
class LoopWindow:
    """Spectra of one axis in one window, of the same three pairs."""

    output: WindowSpectrum
    input: WindowSpectrum
    between: WindowSpectrum


class LoopTransformer:
    """Turns windows with a reference into the spectra of the three pairs."""

    def __init__(self, shape: WindowShape, differenced: bool) -> None:
        self._differenced = differenced
        self._lines = Transformer(shape, differenced).lines

    def __call__(self, window: Window) -> list[LoopWindow]:
        """One LoopWindow for each axis of the window."""
        output = np.diff(window.position, axis=0) if self._differenced else window.position
        signals = zip(*(self._lines(values) for values in (window.reference, window.voltage, output)), strict=True)
        return [LoopWindow(of_pair(window.index, r, y), of_pair(window.index, r, u), of_pair(window.index, u, y)) for r, u, y in signals]


class RunningLoop:
    """update(window) and get(), as ``RunningSpectra``, of the three pairs."""

    def __init__(self, shape: WindowShape, forget: float = 1.0, sliding: int = 0) -> None:
        """See ``RunningSpectra``."""
        self._output, self._input, self._between = (RunningSpectra(shape, forget, sliding) for _ in range(3))

    def update(self, window: LoopWindow) -> None:
        """Add one window."""
        self._output.update(window.output)
        self._input.update(window.input)
        self._between.update(window.between)

    def get(self) -> LoopSpectra:
        """The spectra so far."""
        return LoopSpectra(output=self._output.get(), input=self._input.get(), between=self._between.get())

    def state(self) -> State:
        """The state as arrays, to continue later."""
        return {f"{name}/{key}": value for name, one in self._parts() for key, value in one.state().items()}

    def restore(self, state: State) -> None:
        """Continue from a state of the same shape."""
        for name, one in self._parts():
            one.restore({key.removeprefix(f"{name}/"): value for key, value in state.items() if key.startswith(f"{name}/")})

    def _parts(self) -> tuple[tuple[str, RunningSpectra], ...]:
        return (("output", self._output), ("input", self._input), ("between", self._between))


def joint_input_output(spectra: LoopSpectra, shape: WindowShape, sampling_rate: float, options: H1Options) -> FrequencyResponse:
    """The machine's response; coherence is the smaller of reference with output and reference with input.

    options: units are those of input and output. A line is trusted if both coherences suffice and reference -> input is accurate.
    """
    options = replace(options, repeated=0.0)
    output = frequency_response(spectra.output, shape, sampling_rate, options)
    through = frequency_response(spectra.input, shape, sampling_rate, replace(options, differenced=False))
    lines = np.rint(output.frequency / output.resolution).astype(np.int64)
    with np.errstate(divide="ignore", invalid="ignore"):
        response = output.response / through.response
        sigma = np.sqrt(_unexplained(spectra)[lines] / _reached(spectra)[lines] / max(spectra.output.averages - 1.0, 0.0))
        if options.differenced:
            sigma = sigma / np.abs(divisor(output.frequency, sampling_rate))
        sure = through.sigma <= SURE * np.abs(through.response)
    sigma = np.where(np.isfinite(sigma) & (spectra.output.averages >= 2.0), sigma, np.inf)
    return replace(
        output,
        response=np.where(np.isfinite(response), response, 0.0),
        coherence=np.minimum(output.coherence, through.coherence),
        sigma=sigma,
        trusted=output.trusted & through.trusted & sure & np.isfinite(sigma),
        kernel_offset=np.zeros(1),
        kernel_weight=np.ones(1),
        kernel_amplitude=np.zeros(0),
    )


def _reached(spectra: LoopSpectra) -> FloatArray:
    """(lines,) power of the input that is correlated with the reference, |Sur|^2 / Srr, with the gain averaged over the lines around each."""
    power = np.maximum(spectra.input.gxx, np.finfo(float).tiny)
    gain = smoothed(np.abs(spectra.input.gyx) ** 2 / power, LINES) / np.maximum(smoothed(power, LINES), np.finfo(float).tiny)
    return np.asarray(gain * power)


def _unexplained(spectra: LoopSpectra) -> FloatArray:
    """(lines,) power of e = y - G u that is not correlated with the reference, averaged over the driven lines around each."""
    power = np.maximum(spectra.output.gxx, np.finfo(float).tiny)
    to_output, to_input = spectra.output.gyx, spectra.input.gyx
    driven = power > DRIVEN * float(np.max(power))
    with np.errstate(divide="ignore", invalid="ignore"):
        response = np.where(driven & (np.abs(to_input) > 0), to_output / to_input, 0.0)
    rest_output = spectra.output.gyy - np.abs(to_output) ** 2 / power
    rest_input = spectra.input.gyy - np.abs(to_input) ** 2 / power
    rest_both = spectra.between.gyx - to_output * to_input.conj() / power
    left = np.maximum(rest_output - 2.0 * np.real(response.conj() * rest_both) + np.abs(response) ** 2 * rest_input, 0.0)
    share = np.maximum(smoothed(driven.astype(np.float64), LINES), np.finfo(float).tiny)
    return np.asarray(smoothed(np.where(driven, left, 0.0), LINES) / share)
