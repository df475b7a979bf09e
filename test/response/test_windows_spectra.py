"""The steps from samples to the frequency response."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest
from scipy import signal

from xy_sysid.errors import BadInput
from xy_sysid.response.batch_spectra import batch_spectra
from xy_sysid.response.h1 import H1Options, frequency_response
from xy_sysid.response.spectra import RunningSpectra, Spectra, Transformer
from xy_sysid.response.windows import COSINES, Window, Windower, WindowShape, blur_kernel, error_correlation
from xy_sysid.samples.block import Samples
from xy_sysid.settings import IdentifierSettings

FS = 2000.0
FILTER = signal.butter(2, 47.0, fs=FS)


def noise(samples: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    u = random.standard_normal(samples)
    return u, signal.lfilter(*FILTER, u) + 0.1 * random.standard_normal(samples)


def run(u: np.ndarray, y: np.ndarray, shape: WindowShape, *, differenced: bool, chunk: int = 997, **memory: float) -> RunningSpectra:
    windower, transform = Windower(shape, 1, int(differenced)), Transformer(shape, differenced)
    running = RunningSpectra(shape, forget=memory.get("forget", 1.0), sliding=int(memory.get("sliding", 0)))
    for start in range(0, len(u), chunk):
        for window in windower.feed(Samples(start, u[start : start + chunk, None], y[start : start + chunk, None])):
            running.update(transform(window)[0])
    return running


def full_buffer(u: np.ndarray, y: np.ndarray, shape: WindowShape, *, differenced: bool, weights: np.ndarray | None = None) -> Spectra:
    """The same sums, directly from the definition."""
    taper = signal.get_window(shape.name, shape.length)
    out = np.diff(y) if differenced else y
    starts = range(0, len(out) - shape.length + 1, shape.hop)
    w = np.ones(len(starts)) if weights is None else weights
    x = [np.fft.rfft((u[s : s + shape.length] - u[s : s + shape.length].mean()) * taper) for s in starts]
    z = [np.fft.rfft((out[s : s + shape.length] - out[s : s + shape.length].mean()) * taper) for s in starts]
    gxx = sum(wi * np.abs(xi) ** 2 for wi, xi in zip(w, x, strict=True))
    gyy = sum(wi * np.abs(zi) ** 2 for wi, zi in zip(w, z, strict=True))
    gyx = sum(wi * zi * xi.conj() for wi, xi, zi in zip(w, x, z, strict=True))
    return Spectra(np.asarray(gxx), np.asarray(gyy), np.asarray(gyx), float(w.sum()), np.ones(5))


@pytest.mark.parametrize("name", ["hann", "hamming", "blackman", "boxcar"])
def test_the_plain_variant_agrees_with_scipy_on_the_same_windows(name: str) -> None:
    """H1 and coherence equal scipy.signal's csd, welch and coherence to 1e-12."""
    u, y = noise(60_000)
    shape = WindowShape.of(name, 4096, 0.5)
    spectra = run(u, y, shape, differenced=False).get()
    options: Any = {"fs": FS, "window": name, "nperseg": 4096, "noverlap": 2048}
    _, gyx = signal.csd(u, y, **options)
    _, gxx = signal.welch(u, **options)
    _, coherence = signal.coherence(u, y, **options)
    ours = frequency_response(spectra, shape, FS, H1Options(differenced=False))
    expected = (gyx / gxx)[1:]
    assert np.max(np.abs(ours.response - expected)) < 1e-12 * np.max(np.abs(expected))
    assert np.max(np.abs(ours.coherence - coherence[1:])) < 1e-12


def test_every_taper_of_the_settings_is_scipys_bit_for_bit() -> None:
    """Odd and even lengths; an unknown name is refused with the existing ones."""
    assert set(COSINES) == set(get_args(IdentifierSettings.model_fields["window"].annotation))
    for name in COSINES:
        for length in (16, 255, 1000, 4096):
            assert np.array_equal(WindowShape.of(name, length, 0.5).taper(), signal.get_window(name, length)), (name, length)
    with pytest.raises(BadInput, match="hann, hamming"):
        WindowShape.of("hanning", 16, 0.5).taper()


@pytest.mark.parametrize("differenced", [False, True])
def test_incremental_and_full_buffer_agree_to_1e_12(differenced: bool) -> None:
    """Adding windows one by one equals the full buffer."""
    u, y = noise(50_000, 3)
    shape = WindowShape.of("hann", 2048, 0.75)
    ours, full = run(u, y, shape, differenced=differenced).get(), full_buffer(u, y, shape, differenced=differenced)
    assert ours.weight == full.weight
    for a, b in ((ours.gxx, full.gxx), (ours.gyy, full.gyy), (ours.gyx, full.gyx)):
        assert np.max(np.abs(a - b)) < 1e-12 * np.max(np.abs(b))


def test_forgetting_weighs_windows_by_their_age() -> None:
    """After n windows the k-th newest counts forget^k."""
    u, y = noise(30_000, 4)
    shape = WindowShape.of("hann", 1024, 0.5)
    ours = run(u, y, shape, differenced=False, forget=0.9).get()
    number = len(range(0, 30_000 - 1023, shape.hop))
    full = full_buffer(u, y, shape, differenced=False, weights=0.9 ** np.arange(number - 1, -1, -1))
    assert np.max(np.abs(ours.gyx - full.gyx)) < 1e-12 * np.max(np.abs(full.gyx))
    assert ours.averages == pytest.approx(19 / (1 + 2 / 36), rel=0.01)  # (1 + forget) / (1 - forget), minus the effect of the overlap


def test_sliding_keeps_only_the_newest_windows() -> None:
    """Dropping the oldest window removes its influence completely."""
    u, y = noise(30_000, 5)
    shape = WindowShape.of("hann", 1024, 0.5)
    ours = run(u, y, shape, differenced=False, sliding=6).get()
    number = len(range(0, 30_000 - 1023, shape.hop))
    newest = (np.arange(number) >= number - 6).astype(float)
    full = full_buffer(u, y, shape, differenced=False, weights=newest)
    assert np.max(np.abs(ours.gyx - full.gyx)) < 1e-12 * np.max(np.abs(full.gyx))


@pytest.mark.parametrize("chunk", [1, 20, 4096, 30_000])
def test_any_chunking_gives_the_same_bits(chunk: int) -> None:
    """The result depends on windows, not on chunks."""
    u, y = noise(30_000, 6)
    shape = WindowShape.of("hann", 4096, 0.5)
    assert np.array_equal(run(u, y, shape, differenced=True, chunk=chunk).get().gyx, run(u, y, shape, differenced=True, chunk=777).get().gyx)


def test_a_late_observer_sees_the_same_windows() -> None:
    """Windows lie on a grid of the counter, so that missing first samples shift nothing."""
    shape = WindowShape.of("hann", 64, 0.5)
    values = np.random.default_rng(1).standard_normal((500, 1))
    whole = Windower(shape, 1, 1).feed(Samples(0, values, values))
    late = Windower(shape, 1, 1).feed(Samples(37, values[37:], values[37:]))
    assert [w.index for w in late] == [w.index for w in whole][2:]
    assert all(np.array_equal(a.position, b.position) for a, b in zip(late, whole[2:], strict=True))


def test_no_window_reaches_across_a_gap() -> None:
    """A step in the counter ends a run."""
    shape = WindowShape.of("hann", 64, 0.5)
    windower = Windower(shape, 1, 0)
    first = windower.feed(Samples(0, np.zeros((100, 1)), np.zeros((100, 1))))
    second = windower.feed(Samples(120, np.ones((100, 1)), np.ones((100, 1))))
    assert [w.index for w in first] == [0, 1]
    assert [w.index for w in second] == [4]
    assert all(np.ptp(w.voltage) == 0 for w in first + second)


def test_the_differenced_estimate_has_no_integrator_leakage() -> None:
    """For an integrator the error of the differenced estimate is at least ten times smaller at low frequency."""
    random = np.random.default_rng(2)
    u = signal.sosfilt(signal.butter(4, [0.5, 300], "bandpass", fs=FS, output="sos"), random.standard_normal(240_000))
    pole = np.exp(-246.0 / FS)
    velocity = signal.lfilter([0, 0.097 * (1 - pole)], [1, -pole], u)
    position = np.concatenate(([0.0], np.cumsum(velocity)[:-1])) / FS
    shape = WindowShape.of("hann", 4096, 0.5)
    errors = []
    for differenced in (False, True):
        frf = frequency_response(
            run(u, position, shape, differenced=differenced).get(), shape, FS, H1Options(differenced=differenced, band=(1.0, 20.0))
        )
        z = np.exp(2j * np.pi * frf.frequency / FS)
        truth = 0.097 * (1 - pole) / (z - pole) / (z - 1) / FS
        errors.append(np.sqrt(np.mean(np.abs(frf.response / truth - 1) ** 2)))
    assert errors[1] < 0.1 * errors[0]
    assert errors[1] < 0.005


def test_sigma_tells_the_true_scatter() -> None:
    """Over independent runs the error has the stated variance, and neighbours the stated correlation."""
    shape = WindowShape.of("hann", 512, 0.5)
    squares, products = [], []
    for seed in range(60):
        u, y = noise(20_000, 100 + seed)
        frf = frequency_response(run(u, y, shape, differenced=False).get(), shape, FS, H1Options(differenced=False, band=(200, 900)))
        _, truth = signal.freqz(*FILTER, frf.frequency, fs=FS)
        error = (frf.response - truth) / frf.sigma
        squares.append(np.mean(np.abs(error) ** 2))
        products.append(np.mean((error[1:] * error[:-1].conj()).real))
    assert np.mean(squares) == pytest.approx(1.0, abs=0.03)
    assert np.mean(products) / np.mean(squares) == pytest.approx(frf.line_correlation[1], abs=0.03)


def test_the_blur_kernel_predicts_the_bias_at_a_sharp_resonance() -> None:
    """The expected estimate is the response smoothed by the window; without the kernel the error is many times larger."""
    fs, f0, zeta = 1000.0, 50.0, 0.01
    b, a = signal.bilinear([1.0], [1 / (2 * np.pi * f0) ** 2, 2 * zeta / (2 * np.pi * f0), 1.0], fs)
    u = np.random.default_rng(8).standard_normal(1_000_000)
    y = signal.lfilter(b, a, u)
    shape = WindowShape.of("hann", 1024, 0.5)
    frf = frequency_response(run(u, y, shape, differenced=False).get(), shape, fs, H1Options(differenced=False, band=(45, 55)))
    _, sharp = signal.freqz(b, a, frf.frequency, fs=fs)
    grid = frf.frequency[:, None] + frf.kernel_offset[None, :]
    blurred = signal.freqz(b, a, grid.ravel(), fs=fs)[1].reshape(grid.shape) @ frf.kernel_weight
    scale = np.max(np.abs(sharp))
    assert np.max(np.abs(frf.response - sharp)) > 0.1 * scale
    assert np.max(np.abs(frf.response - blurred)) < 0.02 * scale


def test_overlapping_windows_are_not_counted_as_independent() -> None:
    """75 % overlap of Hann windows gives about twice, not four times, the averages of no overlap."""
    numbers = {}
    u, y = noise(200_000, 9)
    for overlap in (0.0, 0.5, 0.75):
        numbers[overlap] = run(u, y, WindowShape.of("hann", 1024, overlap), differenced=False).get().averages
    assert 1.8 < numbers[0.5] / numbers[0.0] < 2.0
    assert 1.9 < numbers[0.75] / numbers[0.0] < 2.2


def test_hann_constants_are_the_textbook_ones() -> None:
    """Errors of neighbouring lines under one Hann window correlate by (2/3)^2, of the next by (1/6)^2."""
    shape = WindowShape.of("hann", 4096, 0.0)
    assert error_correlation(shape)[0] == pytest.approx([1, 4 / 9, 1 / 36, 0, 0], abs=1e-9)
    kernel = blur_kernel(shape)
    assert kernel.sum() == pytest.approx(1.0)
    assert kernel[len(kernel) // 2] == pytest.approx(1 / 3, rel=1e-4)


def test_too_few_windows_are_not_trusted() -> None:
    """One window has coherence 1, which is meaningless."""
    u, y = noise(4096)
    shape = WindowShape.of("hann", 4096, 0.5)
    frf = frequency_response(run(u, y, shape, differenced=False).get(), shape, FS, H1Options(differenced=False))
    assert not frf.trusted.any()
    assert np.all(np.isinf(frf.sigma))


def test_a_state_goes_on_where_it_stopped() -> None:
    """Saved and restored spectra continue bit for bit."""
    u, y = noise(40_000, 10)
    shape = WindowShape.of("hann", 1024, 0.5)
    kinds: list[dict[str, Any]] = [{"forget": 0.97}, {"sliding": 5.0}]
    for memory in kinds:
        whole = run(u, y, shape, differenced=False, **memory)
        part = run(u[:20_480], y[:20_480], shape, differenced=False, **memory)
        again = RunningSpectra(shape, forget=memory.get("forget", 1.0), sliding=int(memory.get("sliding", 0)))
        again.restore(part.state())
        transform, windower = Transformer(shape, False), Windower(shape, 1, 0)
        for window in windower.feed(Samples(19_968, u[19_968:, None], y[19_968:, None])):
            again.update(transform(window)[0])
        assert np.array_equal(again.get().gyx, whole.get().gyx)
        assert again.get().averages == whole.get().averages


def test_an_impossible_overlap_is_refused() -> None:
    """The error gives the value and the allowed range."""
    with pytest.raises(BadInput, match=r"overlap is 0\.999"):
        WindowShape.of("hann", 16, 0.999)


def test_a_window_holds_its_own_copy() -> None:
    """Later samples do not change a returned window."""
    windower = Windower(WindowShape.of("hann", 16, 0.5), 1, 0)
    window: Window = windower.feed(Samples(0, np.arange(16.0)[:, None], np.zeros((16, 1))))[0]
    windower.feed(Samples(16, np.full((100, 1), -1.0), np.zeros((100, 1))))
    assert np.array_equal(window.voltage[:, 0], np.arange(16.0))


@pytest.mark.parametrize("differenced", [False, True])
def test_the_batch_agrees_with_the_incremental_run_to_1e_12(differenced: bool) -> None:
    """A full recording with a gap at once equals the result window by window."""
    u, y = noise(60_000, 11)
    shape = WindowShape.of("hann", 1024, 0.5)
    windower, transform, running = Windower(shape, 1, int(differenced)), Transformer(shape, differenced), RunningSpectra(shape)
    runs = [(0, u[:20_000], y[:20_000]), (20_100, u[20_100:], y[20_100:])]
    for seq, a, b in runs:
        for window in windower.feed(Samples(seq, a[:, None], b[:, None])):
            running.update(transform(window)[0])
    ours, batch = running.get(), batch_spectra(runs, shape, differenced)
    assert ours.weight == batch.weight
    for a, b in ((ours.gxx, batch.gxx), (ours.gyy, batch.gyy), (ours.gyx, batch.gyx), (ours.quadratic, batch.quadratic)):
        assert np.max(np.abs(a - b)) < 1e-12 * np.max(np.abs(b))


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e6])
def test_the_batch_is_as_exact_in_any_unit(unit: float) -> None:
    """Both signals share one complex transform: rounding of the larger one must not affect the smaller one."""
    u, y = noise(20_000, 12)
    shape = WindowShape.of("hann", 1024, 0.5)
    batch, full = batch_spectra([(0, u, unit * y)], shape, False), full_buffer(u, y, shape, differenced=False)
    for a, b in ((batch.gxx, full.gxx), (batch.gyy, unit**2 * full.gyy), (batch.gyx, unit * full.gyx)):
        assert np.max(np.abs(a - b)) < 1e-12 * np.max(np.abs(b))


def test_an_output_that_stands_still_has_no_spectrum() -> None:
    """A constant without its mean is zero, and the input is unchanged."""
    u, y = noise(5_000, 13)
    shape = WindowShape.of("hann", 1024, 0.5)
    still = batch_spectra([(0, u, np.full(u.size, 0.25))], shape, False)
    assert np.max(np.abs(still.gyy)) < 1e-24 * np.max(still.gxx)
    assert np.allclose(still.gxx, batch_spectra([(0, u, y)], shape, False).gxx, rtol=1e-9)


def test_a_recording_without_a_whole_window_says_how_long_it_is() -> None:
    """The error gives the longest run and the required length."""
    with pytest.raises(BadInput, match=r"longest gap-free run is 100 samples; allowed: >= 1025"):
        batch_spectra([(0, np.zeros(100), np.zeros(100))], WindowShape.of("hann", 1024, 0.5), True)
