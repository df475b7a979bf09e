"""Two axes at once: the 2 x 2 response and its verdict."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.cli_tools import cli, refused
from helpers.table_making import csv_of
from scipy import signal

from xy_sysid.errors import BadInput
from xy_sysid.fitting.two_axes import coupling_in
from xy_sysid.response.coupling import Coupling, coupling
from xy_sysid.response.windows import WindowShape
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings

RATE, SHAPE, BAND = 500.0, WindowShape.of("hann", 512, 0.5), (2.0, 100.0)


def machine(cross: float, mix: FloatArray | None = None, seconds: float = 120.0, alike: bool = False) -> Recording:
    """Two axes with different lags, each moved a little by the other's drive; mix: drives and encoders are sums and differences."""
    random = np.random.default_rng(6)
    u = random.normal(size=(int(seconds * RATE), 2))
    if alike:
        u[:, 1] = u[:, 0]
    own = np.column_stack([signal.lfilter([0.1], [1.0, -1.0 + p, 0.0], u[:, k]) for k, p in enumerate((0.1, 0.2))])
    moved = own + cross * own[:, ::-1]
    position = np.cumsum(moved, axis=0) / RATE + 1e-7 * random.normal(size=moved.shape)
    if mix is not None:
        u, position = u @ np.linalg.inv(mix).T, position @ mix.T
    return Recording.from_arrays(RATE, u, position, axes=("x", "y") if mix is None else ("a", "b"))


def of(recording: Recording, combine: str = "") -> Coupling:
    """With the windows of this test."""
    return coupling(recording, SHAPE, BAND, combine)


def test_axes_that_are_not_coupled_get_a_limit() -> None:
    """In per cent and dB, with the band, and the verdict that two single-axis models suffice."""
    found = of(machine(0.0))
    assert found.suffice
    assert "two single-axis models suffice" in found.sentence and "dB" in found.sentence


@pytest.mark.parametrize("cross", [0.03, 0.2])
def test_axes_that_are_coupled_are_said_to_be(cross: float) -> None:
    """With size and band of the coupling; the cross responses are right within their sigma."""
    found = of(machine(cross))
    assert not found.suffice and "do not suffice" in found.sentence
    assert float(np.median(found.coupling)) == pytest.approx(cross, rel=0.5)
    across = found.response[:, 0, 1] / found.response[:, 1, 1]
    assert float(np.median(np.abs(across - cross))) < 0.2 * cross


def noisy(seconds: float) -> Recording:
    """Two uncoupled axes with encoder noise."""
    quiet = machine(0.0, seconds=seconds)
    return Recording.from_arrays(RATE, quiet.voltage, quiet.position + 2e-4 * np.random.default_rng(1).normal(size=quiet.position.shape))


def test_too_little_data_rule_nothing_out_and_how_long_a_recording_would_is_said() -> None:
    """Undecided: the band with too few windows, the upper limit of the coupling there, and the required time."""
    found = of(noisy(6.0))
    assert not found.suffice and not found.coupled
    assert f"too few windows ({found.windows})" in found.sentence and "may be up to" in found.sentence
    assert "With this excitation, a recording of about" in found.sentence


def test_the_sentence_of_a_few_windows_has_no_exponents() -> None:
    """If noise exceeds the axis's own motion, the size is unlimited, and hours are whole numbers."""
    found = replace(of(noisy(6.0)), at_most=np.full(1, 1.4), coupling=np.zeros(1), band_edges=np.array([1.0, 1.3]), needed=468_000.0)
    assert "there it may be of any size" in found.sentence and "about 130 h" in found.sentence


def test_the_time_that_is_said_to_suffice_does_not_depend_on_the_recording() -> None:
    """The limit falls with the root of the time: 30 s and 240 s give the same required time, within the noise."""
    short, long = of(noisy(30.0)), of(noisy(240.0))
    assert long.largest < 0.6 * short.largest
    assert 0.4 < long.needed / short.needed < 2.5


@pytest.mark.parametrize(("combine", "axes"), [("corexy", ("x", "y")), ("gantry", ("travel", "yaw"))])
def test_drives_that_both_move_both_axes_are_taken_apart(combine: str, axes: tuple[str, str]) -> None:
    """By the motors of a CoreXY, or the sides of a gantry, both are coupled; as x and y, or travel and yaw, they are not; a real coupling stays."""
    mix = np.array([[1.0, 1.0], [1.0, -1.0]])
    recording = machine(0.0, mix=mix)
    assert not of(recording).suffice
    found = of(recording, combine)
    assert found.axes == axes and found.suffice, found.sentence
    assert float(np.median(of(machine(0.2, mix=mix), combine).coupling)) == pytest.approx(0.2, rel=0.5)


def test_inputs_that_are_alike_are_refused() -> None:
    """With one signal on both axes the cross responses are unknown."""
    with pytest.raises(BadInput, match="alike"):
        of(machine(0.0, alike=True))


def multisine(seed: int, rows: int, period: int = 4096) -> FloatArray:
    """All lines to 300 Hz at 1 kHz, with random phases, repeated."""
    spectrum = np.zeros(period // 2 + 1, dtype=np.complex128)
    spectrum[1:1228] = np.exp(2j * np.pi * np.random.default_rng(seed).random(1227))
    one: FloatArray = np.fft.irfft(spectrum)
    return np.tile(one / one.std(), rows // period + 1)[:rows]


def driven(u: FloatArray, cross: float) -> FloatArray:
    """Position of two axes with a lag, each moved a little by the other's drive."""
    own = signal.lfilter(*signal.butter(1, 0.05), u, axis=0)
    return np.asarray(np.cumsum(own + cross * own[:, ::-1], axis=0) / 1000.0 + 1e-6 * np.random.default_rng(5).standard_normal(u.shape))


@pytest.mark.parametrize("negated", [False, True])
@pytest.mark.parametrize("cross", [0.0, 0.05])
def test_two_multisines_tell_the_coupling(cross: float, negated: bool) -> None:
    """One realisation, in windows shorter than its period; or a second one with one axis negated: orthogonal multisines."""
    rows = 60_000
    u = np.column_stack((multisine(1, rows), multisine(2, rows)))
    parts = [u, u * (1.0, -1.0)] if negated else [u]
    seq = np.concatenate([np.arange(rows) + k * (rows + 100) for k in range(len(parts))])
    recording = Recording(1000.0, ("x", "y"), seq, seq / 1000.0, np.concatenate(parts), np.concatenate([driven(part, cross) for part in parts]))
    found = coupling_in(recording, IdentifierSettings())
    assert found.coupled == (cross > 0.0) and float(np.max(found.at_most)) < 0.1
    assert not cross or float(np.median(found.coupling)) == pytest.approx(cross, rel=0.3)


def test_the_command_answers(tmp_path: Path) -> None:
    """Sentence and table; a recording of one axis is refused in one line."""
    recording = machine(0.0)
    columns = {"time": recording.time}
    for k, axis in enumerate("xy"):
        columns |= {f"{axis}_voltage": recording.voltage[:, k], f"{axis}_position": recording.position[:, k]}
    path = csv_of(tmp_path, columns)
    options = ("--set", "length=512", "--set", "band_low=2", "--set", "band_high=100")
    assert "suffice" in cli("coupling", path, *options).out
    assert cli("coupling", path, *options, "--json").json["suffice"] is True
    assert "two" in refused("coupling", path, "--axis", "x")
