"""Two axes at the same time: the 2 x 2 response, its uncertainty, and whether two single-axis models suffice.

G = Syu Suu^-1 for two different inputs (two independent noises, orthogonal multisines). The covariance of the output that the inputs do
not explain gives sigma of each of the four entries. (Bendat & Piersol, Random Data, 4th ed., sec. 7.4; Pintelon & Schoukens, System Identification,
2nd ed., sec. 2.7)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from xy_sysid.errors import BadInput
from xy_sysid.jit import compiled
from xy_sysid.response.frf import ComplexArray
from xy_sysid.response.h1 import divisor
from xy_sysid.response.windows import WindowShape, error_correlation
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording, as_sensed
from xy_sysid.tables import Table

SUFFICES = 0.01  # of the axis's own motion; models of machines are not more accurate than this
BANDS = 24  # number of bands for averaging the coupling
ALIKE = 0.95  # coherence of the two inputs from which their effects cannot be separated
FEWEST = 4.0  # minimum number of independent windows
LONGER = 4  # window length relative to that of one axis: lines are averaged in bands, and leakage of the axis's own response is smaller
COMBINED = {"corexy": ("x", "y"), "gantry": ("travel", "yaw")}  # names of mean and difference: of a CoreXY's two motors, of a gantry's two sides


@dataclass(frozen=True, slots=True, repr=False)
class Coupling:
    """The coupling of two axes.

    axes: their names; response: (lines, 2, 2) complex, output i over input j; sigma: (lines, 2, 2); frequency: (lines,) Hz, of the used lines
    windows, seconds: averaged data; needed: s of such a recording after which the largest 95 % limit would fall to SUFFICES
    band_edges: (bands + 1,) Hz; coupling, at_most: (bands,) |G_ij| / sqrt(|G_ii G_jj|), rms in the band, larger direction: certain part, 95 % limit
    """

    axes: tuple[str, str]
    frequency: FloatArray
    response: ComplexArray
    sigma: FloatArray
    band_edges: FloatArray
    coupling: FloatArray
    at_most: FloatArray
    windows: int
    seconds: float
    needed: float

    @property
    def largest(self) -> float:
        """The largest 95 % limit over all bands."""
        return float(np.max(self.at_most))

    @property
    def suffice(self) -> bool:
        """True if two single-axis models suffice."""
        return self.largest < SUFFICES

    @property
    def coupled(self) -> bool:
        """True if two single-axis models certainly do not suffice."""
        return bool(np.any(self.coupling > SUFFICES))

    @property
    def table(self) -> Table:
        """Coupling by band: certain part and 95 % limit, fractions of the axis's own motion."""
        rows = zip(self.band_edges[:-1].tolist(), self.band_edges[1:].tolist(), self.coupling.tolist(), self.at_most.tolist(), strict=True)
        return Table(("from (Hz)", "to (Hz)", "at least (1)", "at most (1)"), tuple(rows))

    def __str__(self) -> str:
        """The sentence and the table."""
        return f"{self.sentence}\n\n{self.table}"

    def __repr__(self) -> str:
        return f"<Coupling: {self.sentence}>"

    @property
    def sentence(self) -> str:
        """The result in words."""
        one, other = self.axes
        span = f"{self.frequency[0]:.3g} to {self.frequency[-1]:.4g} Hz"
        if self.suffice:
            level = 20 * np.log10(self.largest)
            return f"{one} and {other} are coupled by at most {100 * self.largest:.2g} % ({level:.0f} dB) in {span}: two single-axis models suffice."
        if not self.coupled:
            place = int(np.argmax(self.at_most))
            where = f"{self.band_edges[place]:.3g} to {self.band_edges[place + 1]:.3g} Hz"
            size = f"up to {_figures(100 * self.largest)} %" if self.largest < 1.0 else "of any size"
            return (
                f"No coupling of {one} and {other} was found in {span}. In {where} the recording has too few windows ({self.windows}) to exclude "
                f"it: there it may be {size}. With this excitation, {_lasting(self.needed)} would exclude "
                f"more than {100 * SUFFICES:g} %; with more excitation of both axes there, a shorter recording suffices."
            )
        worst = int(np.argmax(self.coupling))
        low, high = self.band_edges[worst], self.band_edges[worst + 1]
        level = 20 * np.log10(self.coupling[worst])
        return (
            f"{one} and {other} are coupled by {100 * self.coupling[worst]:.2g} % ({level:.0f} dB) in {low:.3g} to {high:.3g} Hz: "
            "two single-axis models do not suffice there."
        )


@dataclass(frozen=True, slots=True)
class CrossSpectra:
    """Sums over windows of U U*, Y U*, Y Y*, each (lines, 2, 2), and the equivalent number of independent windows."""

    inputs: ComplexArray
    between: ComplexArray
    outputs: ComplexArray
    averages: float
    windows: int


class RunningCrossSpectra:
    """``update`` adds windows of both axes, ``get`` returns the sums."""

    def __init__(self, shape: WindowShape) -> None:
        """shape: of the windows."""
        self._taper = shape.taper()
        self._sums = np.zeros((3, shape.length // 2 + 1, 2, 2), dtype=np.complex128)
        self._count = 0
        self._shared = 1.0 + 2.0 * float(np.sum(error_correlation(shape)[1:, 0]))

    def update(self, inputs: FloatArray, outputs: FloatArray) -> None:
        """Add one window: (length, 2) of inputs and of outputs, positions differenced."""
        rows = np.concatenate((inputs.T, outputs.T))
        _add_products(self._sums, np.fft.rfft((rows - rows.mean(axis=1, keepdims=True)) * self._taper))
        self._count += 1

    def get(self) -> CrossSpectra:
        """The sums so far."""
        inputs, between, outputs = self._sums
        return CrossSpectra(inputs=inputs, between=between, outputs=outputs, averages=self._count / self._shared, windows=self._count)


@compiled
def _add_products(sums: NDArray[np.complex128], spectra: NDArray[np.complex128]) -> None:
    """Add U U*, Y U* and Y Y* of one window to the sums; spectra: (4, lines), both inputs, then both outputs."""
    for k in range(spectra.shape[1]):
        for i in range(2):
            for j in range(2):
                sums[0, k, i, j] += spectra[i, k] * spectra[j, k].conjugate()
                sums[1, k, i, j] += spectra[2 + i, k] * spectra[j, k].conjugate()
                sums[2, k, i, j] += spectra[2 + i, k] * spectra[2 + j, k].conjugate()


def coupling(recording: Recording, shape: WindowShape, band: tuple[float, float], combine: str = "") -> Coupling:
    """Coupling of the first two axes of a recording. combine: corexy or gantry, for a machine in which both drives move both axes.

    Raises BadInput for a recording with fewer than two axes, one that is too short, or two inputs that are too similar.
    """
    if len(recording.axes) < 2:
        raise BadInput("axes of the recording", ", ".join(recording.axes), "two", "Record both axes at once, each with a signal of its own.")
    if combine and combine not in COMBINED:
        raise BadInput("combine", repr(combine), ", ".join(COMBINED), "Choose one of these.")
    drives = np.array([[1.0, 1.0], [1.0, -1.0]]) if combine else np.eye(2)
    moves = 0.5 * drives if combine else drives
    names = COMBINED.get(combine, recording.axes[:2])
    u, y = recording.voltage[:, :2] @ drives.T, recording.position[:, :2] @ moves.T
    spectra = _of_recording(recording, u, y, shape)
    return coupling_of(spectra, shape, recording.sampling_rate, band, (names[0], names[1]), recording.measured == "position")


def coupling_of(
    spectra: CrossSpectra, shape: WindowShape, rate: float, band: tuple[float, float], axes: tuple[str, str], differenced: bool
) -> Coupling:
    """Coupling from sums over windows; rate: Hz; differenced: True if the outputs are differences of positions. Raises BadInput as ``coupling``."""
    suu, syu, syy = spectra.inputs, spectra.between, spectra.outputs
    every = np.arange(suu.shape[0]) * rate / shape.length
    used = np.flatnonzero((every > 2 * rate / shape.length) & (every >= band[0]) & (every <= band[1]))
    power = _diagonal(suu)
    if used.size and bool(np.all(power[used].max(axis=0) > 0.0)):
        used = used[np.all(power[used] > 1e-3 * np.quantile(power[used], 0.9, axis=0), axis=1)]
    else:
        raise BadInput("inputs of the two axes", "one that stands still in this band", "both moving", "Drive both axes at once.")
    if spectra.averages < FEWEST or used.size < 2 * BANDS // 3:
        told = f"{spectra.averages:.1f} independent windows, {used.size} excited lines"
        raise BadInput("recording", told, f"{FEWEST:g} and more", "Record longer.")
    alike = float(np.median(np.abs(suu[used, 0, 1]) ** 2 / (power[used, 0] * power[used, 1])))
    if alike > ALIKE:
        act = "Give each axis a signal of its own (seed); with multisines, add a second recording in which one of them is negated."
        raise BadInput("inputs of the two axes", f"alike (coherence {alike:.2f})", f"less than {ALIKE}", act)
    inverse: ComplexArray = np.asarray(np.linalg.inv(suu[used]), dtype=np.complex128)
    between = syu[used]
    response: ComplexArray = between @ inverse
    explained: FloatArray = np.real(response * between.conj())  # (lines, output, input): summed over the inputs, the power of each output
    left = _diagonal(syy)[used] - (explained[:, :, 0] + explained[:, :, 1])
    sigma = np.sqrt(np.maximum(left[:, :, None] * _diagonal(inverse)[:, None, :], 0.0) / max(spectra.averages - 2.0, 1.0))
    if differenced:
        step = divisor(every[used], rate)[:, None, None]
        response, sigma = response / step, sigma / np.abs(step)
    edges, size, most = _by_band(every[used], response, sigma)
    seconds = ((spectra.windows - 1) * shape.hop + shape.length) / rate
    return Coupling(
        axes=axes,
        frequency=every[used],
        response=response,
        sigma=sigma,
        band_edges=edges,
        coupling=size,
        at_most=most,
        windows=spectra.windows,
        seconds=seconds,
        needed=seconds * max(float(np.max(most)) / SUFFICES, 1.0) ** 2,  # the limit falls with the square root of the number of windows
    )


def _diagonal(matrices: ComplexArray) -> FloatArray:
    """(lines, 2) real parts of the diagonals of (lines, 2, 2)."""
    return np.asarray(matrices.real[:, (0, 1), (0, 1)])


def _of_recording(recording: Recording, u: FloatArray, y: FloatArray, shape: WindowShape) -> CrossSpectra:
    """Sums over all windows of a recording, positions differenced; u, y: (n, 2) inputs and outputs."""
    running = RunningCrossSpectra(shape)
    for run in recording.runs():
        moved = (
            np.diff(y[run], axis=0)
            if recording.measured == "position"
            else np.column_stack([as_sensed(column, recording.sampling_rate, recording.measured) for column in y[run].T])
        )
        for begin in range(0, len(moved) - shape.length + 1, shape.hop):
            part = slice(begin, begin + shape.length)
            running.update(u[run][part], moved[part])
    spectra = running.get()
    if spectra.averages == 0.0:
        raise BadInput("longest gap-free run", f"{len(u)} samples", f"more than {shape.length}", "Record longer, or shorten the window.")
    return spectra


def _by_band(frequency: FloatArray, response: ComplexArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Edges (b + 1,) Hz, coupling and its 95 % limit (b,): rms over the lines of each band, minus the contribution of noise."""
    edges = np.geomspace(frequency[0], frequency[-1] * (1 + 1e-9), BANDS + 1)
    place = np.clip(np.searchsorted(edges, frequency, side="right") - 1, 0, BANDS - 1)
    there, first, lines = np.unique(place, return_index=True, return_counts=True)

    def mean(values: FloatArray) -> FloatArray:
        """Mean over the lines of each band; the lines of a band follow one another."""
        return np.asarray(np.add.reduceat(values, first) / lines)

    square = response.real**2 + response.imag**2
    own = np.sqrt(mean(square[:, 0, 0]) * mean(square[:, 1, 1]))  # mean: an antiresonance is no coupling
    size, most = np.zeros(there.size), np.zeros(there.size)
    for i, j in ((0, 1), (1, 0)):
        power, noise = mean(square[:, i, j]) / own, mean(sigma[:, i, j] ** 2) / own
        real = np.maximum(power - noise, 0.0)
        spread = np.sqrt((noise**2 + 2.0 * noise * real) / np.maximum(lines / 2.0, 1.0))  # neighbouring lines are correlated by half
        size = np.maximum(size, np.sqrt(np.maximum(power - noise - 2.0 * spread, 0.0)))
        most = np.maximum(most, np.sqrt(real + 2.0 * spread))
    return np.append(edges[there], edges[there[-1] + 1]), size, most


def _lasting(seconds: float) -> str:
    """A recording length as text."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds > 2.0 * size:
            return f"a recording of about {_figures(seconds / size)} {unit}"
    return f"a recording of about {_figures(seconds)} s"


def _figures(value: float) -> str:
    """A number with two significant digits, without an exponent."""
    return f"{float(f'{value:.2g}'):.10g}"
