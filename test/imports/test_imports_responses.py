"""A frequency response measured elsewhere: read with its units, fitted, exported; commands that need samples say so."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from helpers.cli_tools import cli, refused
from helpers.real_data import data
from helpers.table_making import T, U, Y, csv_of

import xy_sysid as xy
from xy_sysid.imports import load
from xy_sysid.imports.listing import listing
from xy_sysid.response.frf import ComplexArray

F = np.geomspace(1.0, 400.0, 250)
DELAY, RESONANCE = 2e-3, 60.0


def two_masses() -> ComplexArray:
    """A mass with friction, an antiresonance of 45 Hz and a resonance of 60 Hz, a delay of 2 ms, and 1 % of noise."""
    s, zero, pole = 2j * np.pi * F, 2 * np.pi * 45.0, 2 * np.pi * RESONANCE
    plant = 50 / (s * (s + 30)) * (s * s + 0.05 * zero * s + zero**2) / (s * s + 0.06 * pole * s + pole**2) * (pole / zero) ** 2
    random = np.random.default_rng(1)
    noise = 1 + 0.01 * (random.standard_normal(F.size) + 1j * random.standard_normal(F.size)) / np.sqrt(2)
    return np.asarray(plant * np.exp(-DELAY * s) * noise)


H = two_masses()
PHASE = np.unwrap(np.angle(H))


def written(path: Path, head: str, columns: tuple[np.ndarray, ...], separator: str = ",") -> Path:
    """A text file of these columns."""
    np.savetxt(path, np.column_stack(columns), delimiter=separator, header=head, comments="")
    return path


@pytest.mark.parametrize(
    ("head", "columns", "says"),
    [
        ("Frequency (Hz),Gain (dB),Phase (deg)", (F, 20 * np.log10(abs(H)), np.rad2deg(PHASE)), ("in Hz", "in dB", "in degrees")),
        ("w [rad/s],|H|,arg [rad]", (2 * np.pi * F, abs(H), PHASE), ("in rad/s", "linear", "in radians")),
        (
            "freq,mag,phase",
            (F, 20 * np.log10(abs(H)) + 200.0, np.rad2deg(PHASE)),
            ("in Hz, as", "dB, as their slope", "degrees, by their size"),
        ),
        ("freq,mag,phase", (F, abs(H) * 1e-3, np.angle(H)), ("in Hz", "linear, as their slope", "in radians, by their size")),
        ("Frequency (Hz),Gain (dB),Phase (rad)", (F, 20 * np.log10(abs(H)), np.rad2deg(PHASE)), ("the header says rad", "in dB")),
        ("f_Hz,real,imag", (F, H.real, H.imag), ("real and imaginary",)),
        ("freq_rad_s,real,imag", (2 * np.pi * F, H.real, H.imag), ("in rad/s",)),
        ("Frequency [Rad/s],real,imag", (2 * np.pi * F, H.real, H.imag), ("in rad/s",)),
        ("freq_kHz,real,imag", (1e-3 * F, H.real, H.imag), ("in Hz",)),
    ],
)
def test_hertz_decibels_and_degrees_are_detected_and_said(tmp_path: Path, head: str, columns: tuple[np.ndarray, ...], says: tuple[str, ...]) -> None:
    """From the headers, or from the numbers if the headers are missing or impossible."""
    found = xy.frf_from(written(tmp_path / "frf.csv", head, columns))
    ratio = found.response / H
    assert np.allclose(found.frequency, F) and np.allclose(ratio, ratio[0], rtol=1e-6)
    for text in says:
        assert any(text in note for note in found.origin.notes), found.origin.notes


@pytest.mark.parametrize(
    ("head", "what", "unit"),
    [("Frequency [furlong],|H|,Phase [deg]", "frequency", "Hz"), ("Frequency [Hz],|H|,Phase [mrad]", "phase", "deg")],
)
def test_a_response_in_a_unit_that_is_not_known_is_refused(tmp_path: Path, head: str, what: str, unit: str) -> None:
    """One line gives the allowed values and the option; with it the file is read."""
    path = written(tmp_path / "frf.csv", head, (F, abs(H), np.rad2deg(PHASE)))
    with pytest.raises(xy.BadInput, match=f"the unit of the {what} is .*; allowed: {unit}.* Give it with --unit {what}={unit}"):
        xy.frf_from(path)
    assert np.allclose(xy.frf_from(path, units={what: unit}).frequency, F)


@pytest.mark.parametrize(("name", "linear"), [("|H| [m/N]", True), ("Mag [m/s^2/V]", True), ("Gain (dB)", False), ("mag_dB", False)])
def test_a_unit_of_the_magnitude_says_whether_it_is_in_decibels(tmp_path: Path, name: str, linear: bool) -> None:
    """Even if the other interpretation fits the phase well; no number is negative here."""
    decibels = 20 * np.log10(abs(H))
    size = decibels - decibels.min() + 1.0 if linear else abs(H)
    found = xy.frf_from(written(tmp_path / "frf.csv", f"freq,{name},Phase (deg)", (F, size, np.rad2deg(PHASE))))
    assert np.allclose(abs(found.response), size if linear else 10 ** (size / 20))


def test_keywords_say_of_a_file_what_it_does_not_say(tmp_path: Path) -> None:
    """The averages of a column of coherence; an unknown name is refused."""
    path = written(tmp_path / "frf.csv", "f_Hz,real,imag,coherence", (F, H.real, H.imag, np.full(F.size, 0.9)))
    found = xy.frf_from(path, averages=11, sampling_rate=2000.0)
    assert np.allclose(found.sigma, np.abs(H) * np.sqrt(0.1 / 0.9 / 10)) and found.sampling_rate == 2000.0
    fits = [json.loads(cli("fit", path, "--averages", count, "--json").out)["axes"]["x"] for count in ("5", "50")]
    wide, narrow = (np.diff(fit["estimates"]["delay"]["ci95"]) for fit in fits)
    assert wide == pytest.approx(np.sqrt(49 / 4) * narrow, rel=0.05)
    assert "a file with a measured frequency response" in refused(
        "fit", csv_of(tmp_path, {"time": T, "x_voltage": U, "x_position": Y}), "--averages", "5"
    )
    with pytest.raises(xy.BadInput, match="averages"):
        xy.frf_from(path, avarages=11)


def test_columns_that_are_chosen_say_that_a_file_holds_samples_and_no_response(tmp_path: Path) -> None:
    """Headers of frequency and phase are no response if input and output of an axis are mapped."""
    path = csv_of(tmp_path, {"f": U, "phase": Y})
    assert "no samples in time" in refused("diagnose", path)
    assert load(path, columns={"input": "f", "output": "phase"}, rate=500.0).sampling_rate == 500.0


def test_a_response_from_a_file_is_fitted_and_exported(tmp_path: Path) -> None:
    """Resonance, delay and orders come back with intervals from the scatter of the lines; the model file reloads."""
    path = written(tmp_path / "frf.csv", "Frequency (Hz);Gain (dB);Phase (deg)", (F, 20 * np.log10(abs(H)), np.rad2deg(PHASE)), ";")
    said = cli("fit", path, "--model", tmp_path / "model.yaml", "--unit", "input=V,output=rad", "--json")
    answer = said.json["axes"]["x"]
    assert said.code == 0 and answer["estimates"]["resonance_1.frequency"]["value"] == pytest.approx(RESONANCE, rel=0.01)
    assert answer["estimates"]["delay"]["value"] == pytest.approx(1e3 * DELAY if answer["estimates"]["delay"]["unit"] == "ms" else DELAY, rel=0.05)
    assert answer["trustworthy"] and answer["transfer_function"]["output_unit"] == "rad"
    assert any("1 integrator and hold=none" in note for note in answer["warnings"])
    model = xy.load_model(tmp_path / "model.yaml")
    assert "resonance" in repr(model)


def test_a_response_from_arrays_is_fitted_and_drawn() -> None:
    """With and without a given sigma; the truth is in the intervals; the figure is drawn."""
    for sigma in (None, 0.01 * abs(H)):
        response = xy.frf_from(F, H, axis="x", units={"input": "V", "output": "rad"}, sigma=sigma)
        assert (response.input_unit, response.output_unit) == ("V", "rad")
        model = xy.fit(response)
        (found,) = [one for one in model.intervals_with_misfit if one.name == "resonance_1.frequency"]
        assert found.low < RESONANCE < found.high and found.high - found.low < 2.0 and model.ok
        assert xy.plot.bode(response, model) is not None


def test_coherence_gives_the_uncertainty_with_its_averages() -> None:
    """sigma^2 = |H|^2 (1 - c) / c / (averages - 1), Bendat & Piersol, table 9.6."""
    response = xy.frf_from(F, H, coherence=np.full(F.size, 0.9), averages=11)
    assert np.allclose(response.sigma, np.abs(H) * np.sqrt(0.1 / 0.9 / 10)) and response.averages == 11


def test_what_frf_writes_is_read_again(tmp_path: Path) -> None:
    """The CSV of ``frf --csv``, of two axes: real, imaginary, coherence and sigma."""
    random = np.random.default_rng(3)
    u = random.standard_normal((20_000, 2))
    y = np.cumsum(np.cumsum(u, axis=0) * 1e-6, axis=0)
    np.savez(tmp_path / "a.npz", u=u, y=y, fs=1000.0)
    assert cli("frf", tmp_path / "a.npz", "--csv", tmp_path / "frf.csv").code == 0
    found = xy.frf_from(tmp_path / "frf.csv", axis="y")
    straight = xy.frf(xy.load(tmp_path / "a.npz").run("y"))
    assert np.allclose(found.response, straight.response) and np.allclose(found.sigma, straight.sigma)
    with pytest.raises(xy.BadInput, match="of 2 axes"):
        xy.frf_from(tmp_path / "frf.csv")


def test_what_needs_samples_says_so(tmp_path: Path) -> None:
    """diagnose, compare and loading: one line that names the possible commands; columns lists the interpretation."""
    path = written(tmp_path / "frf.csv", "Frequency (Hz),Gain (dB),Phase (deg)", (F, 20 * np.log10(abs(H)), np.rad2deg(PHASE)))
    for command in (("diagnose",), ("frf",), ("refine", "--auto")):
        assert "holds no samples in time" in refused(command[0], path, *command[1:])
    with pytest.raises(xy.BadRecording, match="xy-sysid fit"):
        load(path)
    assert "250 lines from 1 to 400 Hz" in listing(path).reads
    assert [one.role for one in listing(path).columns] == ["frequency", "magnitude", "phase"]


def test_columns_without_names_are_said(tmp_path: Path) -> None:
    """--map names them by number; the error names missing ones."""
    path = tmp_path / "frf.txt"
    np.savetxt(path, np.column_stack((F, 20 * np.log10(abs(H)), np.rad2deg(PHASE))))
    said = cli("fit", path, "--map", "frequency=1,magnitude=2,phase=3", "--unit", "magnitude=dB,phase=deg")
    assert said.code == 0 and "resonance_1.frequency" in said.out
    assert "no magnitude with phase, or real with imag" in refused("fit", path, "--map", "frequency=1,phase=3")


@pytest.mark.parametrize(
    ("frequency", "response", "sigma", "says"),
    [
        (F, H[:-1], None, "250 frequencies and 249 values"),
        (F[:5], H[:5], None, "8 or more"),
        (F, H, np.ones(3), "of 3 lines"),
        (F, np.full(F.size, np.nan), None, "0 lines"),
    ],
)
def test_arrays_that_are_no_response_are_one_line(frequency: np.ndarray, response: np.ndarray, sigma: np.ndarray | None, says: str) -> None:
    """Different lengths, too few lines, no numbers; and an unknown name."""
    with pytest.raises(xy.BadInput, match=says):
        xy.frf_from(frequency, response, sigma=sigma)
    with pytest.raises(xy.BadInput, match="coherence"):
        xy.frf_from(F, H, coherense=np.ones(F.size))


@pytest.mark.parametrize(
    ("name", "orders", "gain", "zero"),
    [
        ("G_I_PI_300_DP.csv", (2, 2), 8186.0, -9526.0),
        ("G_I_PID_300_DP.csv", (3, 3), 3623.0, -2540.0),
        ("G_I_PID_300_AP.dat", (3, 3), 3635.0, -2550.0),
    ],
)
def test_responses_as_they_were_found(name: str, orders: tuple[int, int], gain: float, zero: float) -> None:
    """Controllers, with a phase in degrees although one header says rad: an integrator, a zero, and no fall at the highest lines.

    The orders come from the data, and two measurements of one controller by different instruments agree within 1 %.
    """
    found = xy.frf_from(data(f"frf_file/{name}"))
    assert len(found) == 300 and any("phases are in degrees" in note for note in found.origin.notes)
    assert any("magnitudes are in dB" in note for note in found.origin.notes)
    model = xy.fit(found)
    assert (model.tf.numerator.size - 1, model.tf.denominator.size - 1) == orders and model.tf.denominator[-1] == 0.0
    assert model.tf.delay == 0.0 and model.tf.gain == pytest.approx(gain, rel=0.01)
    assert max(model.tf.zeros().real) == pytest.approx(zero, rel=0.01)


def test_a_lead_filter_keeps_its_level_and_a_delay_is_told() -> None:
    """As many zeros as poles, no integrator; a delay is found if there is one, and otherwise left out."""
    f = np.geomspace(1.0, 1000.0, 200)
    lead = 2.0 * (1 + 2j * np.pi * f / 60.0) / (1 + 2j * np.pi * f / 900.0)
    random = np.random.default_rng(4)
    for delay in (0.0, 2e-4):
        true = lead * np.exp(-2j * np.pi * f * delay)
        noise = 0.002 * np.abs(true) * (random.normal(size=f.size) + 1j * random.normal(size=f.size))
        model = xy.fit(xy.frf_from(f, true + noise))
        assert (model.tf.numerator.size - 1, model.tf.denominator.size - 1) == (1, 1) and model.tf.denominator[-1] != 0.0
        assert model.tf.poles()[0].real == pytest.approx(-900.0, rel=0.02) and model.tf.zeros()[0].real == pytest.approx(-60.0, rel=0.02)
        assert model.tf.delay == pytest.approx(delay, abs=4e-6)
