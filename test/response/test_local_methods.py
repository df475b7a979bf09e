"""Local polynomial and local rational method: transients removed, sharp resonances of short records without bias."""

from __future__ import annotations

import numpy as np
import pytest

import xy_sysid as xy
from campaigns.bench.frf import RESONANCE, axis
from xy_sysid.live.identifier import Identifier
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.response.h1 import H1Options
from xy_sysid.response.methods import METHODS
from xy_sysid.response.windows import Window
from xy_sysid.samples.block import Samples
from xy_sysid.settings import IdentifierSettings, changed

SAMPLES = 8192


def estimated(method: str, seed: int = 1) -> tuple[FrequencyResponse, float, float]:
    """A response of eight seconds, its relative error and its error over sigma."""
    recording, truth = axis(SAMPLES, seed)
    found = xy.frf(recording, band_low=1.0, band_high=300.0, response=method)
    lines = found.select(found.trusted)
    off = lines.response - truth(lines.frequency)
    relative = np.sqrt(np.mean(np.abs(off / truth(lines.frequency)) ** 2))
    return found, float(relative), float(np.sqrt(np.mean((np.abs(off) / lines.sigma) ** 2)))


def test_a_short_record_with_a_sharp_resonance_has_less_error() -> None:
    """Also behind an integrator: a third of H1's error for the polynomial, a fifth for the rational method; sigma agrees with the error."""
    (_, plain, _), (_, polynomial, _), (found, rational, ratio) = (estimated(name) for name in ("h1", "local_polynomial", "local_rational"))
    assert polynomial < 0.7 * plain and rational < 0.2 * plain
    assert 0.8 < ratio < 1.4
    near = int(np.argmin(np.abs(found.frequency - RESONANCE)))
    assert abs(found.response[near] / axis(SAMPLES, 1)[1](found.frequency[near : near + 1])[0] - 1.0) < 0.01


def test_a_transfer_function_is_fitted_to_it() -> None:
    """The fit accounts for correlated lines: noise explains the cost; the resonance has an error below 0.1 mHz."""
    model = xy.fit(estimated("local_rational")[0].band(20.0, 120.0), numerator_order=2, denominator_order=4)
    assert model.fit is not None and model.fit.cost == pytest.approx(model.fit.expected_cost, rel=0.3)
    assert min(abs(mode.frequency - RESONANCE) for mode in model.tf.pole_modes()) < 1e-4


@pytest.mark.parametrize("name", METHODS)
def test_every_method_adds_windows_one_by_one_as_it_does_whole_records(name: str) -> None:
    """Online and from a file: the same sums, and the same response after a restart."""
    method, length = METHODS[name], 256
    shape, random = method.shape("hann", length, 0.5), np.random.default_rng(5)
    u, y, r = random.normal(size=(3, 4 * length + 1))
    transform, running = method.transform(shape, True), method.running(shape, 1.0, 0)
    for index in range((4 * length) // shape.hop - length // shape.hop + 1):
        part = slice(index * shape.hop, index * shape.hop + length)
        longer = slice(part.start, part.stop + 1)
        running.update(transform(Window(index, u[part, None], y[longer, None], r[part, None]))[0])
    options = H1Options(differenced=True)
    whole = method.estimate(method.whole([(0, r, u, y)], shape, True), shape, 1000.0, options)
    again = method.running(shape, 1.0, 0)
    again.restore(running.state())
    for sums in (running.get(), again.get()):
        np.testing.assert_allclose(method.estimate(sums, shape, 1000.0, options).response, whole.response, rtol=1e-7)


def test_the_identifier_runs_with_it() -> None:
    """response: local_rational in the settings of the node."""
    recording, truth = axis(SAMPLES, 3)
    settings = changed(IdentifierSettings(), {"response": "local_rational", "length": 2048, "refit": 1.0, "band_low": 1.0, "band_high": 300.0})
    identifier = Identifier(settings, ("x",))
    requests = identifier.take(Samples(0, recording.voltage, recording.position), recording.sampling_rate)
    found = requests[-1].axes["x"].frf
    lines = found.select(found.trusted)
    assert float(np.median(np.abs(lines.response / truth(lines.frequency) - 1.0))) < 0.01
