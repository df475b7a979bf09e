"""simulate, frf, fit, validate and replay: the answer of each, as text and as one JSON document."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.bag_making import joint_state
from helpers.cli_tools import RIGID, cli, npz, rigid, with_one
from scipy.io import loadmat

import xy_sysid as xy
from xy_sysid.bags import BagWriter
from xy_sysid.bags.cdr import JOINT_TYPE
from xy_sysid.bags.streaming import stream_blocks
from xy_sysid.files.linear_models import read_saved
from xy_sysid.imports import load, save
from xy_sysid.live.replay import replay as plain_replay
from xy_sysid.samples.pairing import QUANTITIES
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import IdentifierSettings


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the recordings, with a name that is difficult for a terminal."""
    return tmp_path_factory.mktemp("käse [bold] :car: 日本")


@pytest.fixture(scope="module")
def paper(folder: Path) -> Path:
    """30 s of the paper's table, with a file of the true parameters."""
    said = cli("simulate", folder / "paper", "--duration", 30, "--truth", folder / "truth.json")
    assert said.code == 0 and said.err == ""
    return folder / "paper"


@pytest.fixture(scope="module")
def model(paper: Path) -> Path:
    """The model fitted to it."""
    path = paper.with_name("model.yaml")
    assert cli("fit", paper, "--model", path, "--mat", path.with_suffix(".mat")).code == 0
    return path


def test_a_search_by_itself_goes_on_after_a_resonance_that_was_given(paper: Path) -> None:
    """The first effect is the given one; the table has no other effects."""
    said = cli("refine", paper, "-a", "x", "--add", "base_resonance", "--auto", "--span", "0:15")
    assert said.code == 0 and said.err == "" and "base_resonance" in said.out


def test_the_program_says_which_version_it_is() -> None:
    said = cli("--version")
    assert (said.code, said.out.strip(), said.err) == (0, f"xy-sysid {xy.__version__}", "")


@pytest.mark.parametrize("name", ["folder", "one.db3", "one.mcap", "one.csv", "one.npz", "one.mat"])
def test_simulate_writes_every_kind_of_file_and_they_hold_the_same(name: str, tmp_path: Path) -> None:
    """With one machine and one seed the samples do not depend on the file format; nothing is overwritten."""
    said = cli("simulate", tmp_path / name, "--duration", 1, "--json")
    assert said.code == 0 and said.err == ""
    assert said.json["samples"] == 2000 and said.json["sampling_rate"] == 2000.0
    back, again = load(tmp_path / name), tmp_path / "again.npz"
    assert cli("simulate", again, "--duration", 1).code == 0
    np.testing.assert_array_equal(back.voltage, load(again).voltage)
    np.testing.assert_array_equal(back.position, load(again).position)
    assert cli("simulate", tmp_path / name).code == 2


def test_simulate_tells_the_truth_unless_it_is_hidden(paper: Path, tmp_path: Path) -> None:
    """Effects and sizes are in the answer and in --truth; a hidden draw is only in --truth."""
    truth = json.loads(paper.with_name("truth.json").read_text())["axes"]["x"]
    assert truth["delay"] == pytest.approx(1.29e-3) and truth["antiresonance_hz"] == pytest.approx(46.2, abs=0.1)
    told = cli("simulate", tmp_path / "a.npz", "--duration", 1, "--effect", "x:coulomb_friction=0.2", "--json").json["truth"]
    assert "coulomb_friction" in json.dumps(told["axes"]["x"]) and "coulomb_friction" not in json.dumps(told["axes"]["y"])
    one = cli("simulate", tmp_path / "b.npz", "--duration", 1, "--hidden", 5, "--truth", tmp_path / "b.json", "--json")
    assert "truth" not in one.json and json.loads((tmp_path / "b.json").read_text())["axes"]["x"]
    two = cli("simulate", tmp_path / "c.npz", "--duration", 1, "--hidden", 5)
    assert two.code == 0 and np.array_equal(load(tmp_path / "b.npz").position, load(tmp_path / "c.npz").position)
    assert cli("simulate", tmp_path / "d.npz", "--duration", 1, "--hidden", 6).code == 0
    assert not np.array_equal(load(tmp_path / "b.npz").position, load(tmp_path / "d.npz").position)


def test_simulate_cleanly_has_no_encoder_steps(tmp_path: Path) -> None:
    """--clean: positions off the 0.5 um grid; --excite: another signal; off keeps the axis at rest, and is a word, not a boolean."""
    for name, options in (
        ("noisy", ()),
        ("clean", ("--clean",)),
        ("off", ("-e", "kind=off")),
        ("odd", ("-e", "kind=multisine_odd", "-e", "rms=0.5")),
    ):
        assert cli("simulate", tmp_path / f"{name}.npz", "--duration", 5, *options).code == 0
    noisy, clean, off, odd = (load(tmp_path / f"{name}.npz") for name in ("noisy", "clean", "off", "odd"))
    steps = clean.position[:, 0] / 0.5e-6
    assert float(np.mean(np.abs(steps - np.rint(steps)))) > 0.2
    steps = noisy.position[:, 0] / 0.5e-6
    assert float(np.max(np.abs(steps - np.rint(steps)))) < 1e-6
    assert np.ptp(off.voltage) < 0.1 * np.ptp(noisy.voltage) and 0.3 < np.std(odd.voltage[2000:-1000, 0]) < 0.7


def test_frf_prints_a_table_that_fits_80_columns_and_writes_csv(paper: Path) -> None:
    """16 lines per axis with dB, phase, coherence, sigma; the file has every line."""
    path = paper.with_name("frf.csv")
    said = cli("frf", paper, "--csv", path)
    assert said.code == 0 and said.err == ""
    assert "dB (m/V)" in said.out and max(map(len, said.out.splitlines())) <= 90
    rows = path.read_text().splitlines()
    answer = cli("frf", paper, "--axis", "y", "--json").json
    assert rows[0] == "axis,frequency_hz,real,imag,coherence,sigma,trusted" and set(answer["axes"]) == {"y"}
    response = answer["axes"]["y"]["frf"]["response"]
    mine = [row.split(",") for row in rows[1:] if row.startswith("y,")]
    assert len(mine) == len(response) == len(rows[1:]) // 2
    np.testing.assert_array_equal([[float(row[2]), float(row[3])] for row in mine], response)
    assert answer["recording"]["sampling_rate"] == 2000.0 and answer["axes"]["y"]["period"] is None


def test_fit_finds_the_truth_and_says_how_sure_it_is(paper: Path) -> None:
    """Delay within 20 us, the 47 Hz pair within 0.2 Hz, error below 1.5 %; the intervals hold the truth; every verdict passes."""
    truth = json.loads(paper.with_name("truth.json").read_text())["axes"]
    answer = cli("fit", paper, "--json").json
    for axis in ("x", "y"):
        found, estimates = answer["axes"][axis], answer["axes"][axis]["estimates"]
        assert found["converged"] and found["consistent"] and found["relative_error"] < 0.015
        assert estimates["delay"]["value"] == pytest.approx(truth[axis]["delay"], abs=20e-6)
        for name in ("antiresonance", "resonance"):
            item = estimates[f"{name}_1.frequency"]
            assert item["value"] == pytest.approx(truth[axis][f"{name}_hz"], abs=0.2)
            assert item["ci95"][0] < item["value"] < item["ci95"][1] and item["ci95"][1] - item["ci95"][0] < 0.2
        assert all(verdict["ok"] for verdict in found["validation"]["verdicts"])
        assert found["paper"]["confidence"] == pytest.approx(100 - found["paper"]["error_cost"])
        assert len(found["validation"]["pade4"]["denominator"]) == 9
    assert answer["recording"]["sampling_rate_hz"] == 2000.0 and set(answer["recording"]["data_sha256"]) == {"x", "y"}


def test_fit_for_people_is_a_table_with_units_and_verdicts(paper: Path) -> None:
    """Display units ms and mm/s/V; one line per verdict; nothing on stderr without a problem."""
    said = cli("fit", paper, "--axis", "x")
    assert said.code == 0 and said.err == ""
    lines = said.out.splitlines()
    assert lines[0].startswith("axis x: ml, 613 lines from 0.977 to 299.8 Hz")
    rows = {line.split()[0]: line.split()[1:] for line in lines if line[:1].isalpha()}
    assert rows["parameter"] == ["value", "95", "%", "interval", "unit"]
    assert rows["delay"][-1] == "ms" and float(rows["delay"][1]) < 1.29 < float(rows["delay"][3]) and rows["gain"][-1] == "mm/s/V"
    assert sum(line.startswith("  ok   ") for line in lines) == 10 and "WARN" not in said.out
    assert max(len(line.rstrip()) for line in lines if line.split() and line.split()[0] in rows and line[:4] != "axis") <= 80


@pytest.mark.parametrize("method", ["lls", "iwls", "nlls", "ml", "nllsfdi"])
def test_fit_knows_every_method(method: str, paper: Path) -> None:
    """Each method answers, gives its name, and a resonance near the truth; the paper's method absorbs the delay."""
    found = cli("fit", paper, "--axis", "x", "--method", method, "--json").json["axes"]["x"]
    assert found["method"] == {"nlls": "levenberg_marquardt"}.get(method, method) and np.isfinite(found["relative_error"])
    assert (found["transfer_function"]["delay"] == 0.0) == (method == "nllsfdi")
    if method != "nllsfdi":
        assert found["relative_error"] < (0.5 if method == "lls" else 0.1)


@pytest.mark.parametrize("weighting", ["sigma", "relative", "uniform"])
def test_fit_knows_every_weighting(weighting: str, paper: Path) -> None:
    """All find the same delay."""
    found = cli("fit", paper, "--axis", "x", "--weighting", weighting, "--json").json["axes"]["x"]
    assert found["transfer_function"]["delay"] == pytest.approx(1.29e-3, abs=40e-6)


def test_fit_in_z_is_a_discrete_model_that_validates(paper: Path, tmp_path: Path) -> None:
    """--domain z: a sampling time, whole samples of delay; the file reloads and the check in time works."""
    said = cli("fit", paper, "--axis", "x", "--domain", "z", "--set", "numerator_order=3", "--model", tmp_path / "z.yaml", "--json")
    told = said.json["axes"]["x"]["transfer_function"]
    assert told["sampling_time"] == 0.0005 and told["delay"] / 0.0005 == pytest.approx(round(told["delay"] / 0.0005))
    checked = cli("validate", paper, tmp_path / "z.yaml", "--axis", "x", "--json").json["axes"]["x"]
    assert checked["relative_error"] < 0.1 and checked["simulation"]["nrmse"] > 95


def test_fit_keeps_the_last_part_out(paper: Path) -> None:
    """--held-out: its simulation covers that part, except the first half second, in which the start decays; 0 means no such check."""
    half = cli("fit", paper, "--axis", "x", "--held-out", 0.5, "--json").json["axes"]["x"]["validation"]["simulation"]
    assert half["seconds"] == pytest.approx(14.5, abs=0.01) and half["nrmse"] > 95 and half["compared"] == "velocity"
    assert cli("fit", paper, "--axis", "x", "--held-out", 0, "--json").json["axes"]["x"]["validation"]["simulation"] is None


def test_the_model_files_reload(model: Path) -> None:
    """YAML quotes "y" and gives the same numbers back; .mat holds what MATLAB's tf() takes."""
    text = model.read_text()
    assert '"y":' in text and yaml.safe_load(text)["axes"]["y"]["transfer_function"]["variable"] == "s"
    tf = read_saved(model)["y"].tf
    content = loadmat(str(model.with_suffix(".mat")))
    np.testing.assert_array_equal(content["y_num"].ravel(), tf.numerator)
    np.testing.assert_array_equal(content["y_den"].ravel(), tf.denominator)
    assert content["y_delay"].item() == tf.delay and content["y_units"][0] == "m/V" and content["x_frf"].size == content["x_freq_hz"].size


def test_validate_holds_on_the_same_machine_and_says_where_another_is_off(model: Path, folder: Path) -> None:
    """Another seed: at the noise floor. Loosened bolts: an error, largest near the 47 Hz pair. The same data: no validation."""
    assert cli("simulate", folder / "other", "--duration", 30, "--seed", 100).code == 0
    holds = cli("validate", folder / "other", model)
    assert holds.code == 0 and holds.err == "" and holds.out.count("the model holds") == 2
    same = cli("validate", folder / "paper", model, "--axis", "x")
    assert "not a validation" in same.err
    assert cli("simulate", folder / "loose", "--duration", 30, "--seed", 100, "--effect", "base_resonance=40").code == 0
    other = cli("validate", folder / "loose", model, "--axis", "x", "--json")
    assert other.code == 1 == cli("validate", folder / "loose", model, "--axis", "x").code
    off = other.json
    found = off["axes"]["x"]
    assert off["same_data_as_the_fit"] == [] and found["rms_sigma"] > 5 and 38 < found["worst_hz"] < 50
    assert "off by" in found["sentence"] and found["relative_error"] > 5 * found["noise_floor"]


def test_replay_gives_what_the_plain_logic_gives(paper: Path, tmp_path: Path) -> None:
    """Table, JSON and bag: the bag holds exactly the bytes of the updates, in order."""
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    said = cli("replay", paper, "--out", tmp_path / "out")
    assert said.code == 0 and "times real time" in said.out and "axis y: relative error" in said.out
    settings = IdentifierSettings()
    updates = list(plain_replay(((kind, block) for kind, block in stream_blocks(paper) if kind in QUANTITIES), settings, ("x", "y")))
    wanted = [(f"/xy/{message.topic}", message.data) for update in updates for message in update.arrays()]
    store: Any = get_typestore(Stores.ROS2_JAZZY)
    with Reader(tmp_path / "out") as reader:
        written = [(item.topic, store.deserialize_cdr(raw, item.msgtype)) for item, _, raw in reader.messages()]
    assert [name for name, _ in written] == [name for name, _ in wanted]
    for (_, message), (_, data) in zip(written, wanted, strict=True):
        np.testing.assert_array_equal(message.data, data)
    answer, last = cli("replay", paper, "--json").json, updates[-1].axes["x"].fit
    assert last is not None
    assert answer["updates"] == len(updates) and answer["faults"] == {} and answer["alarms"] == {}
    assert float(answer["axes"]["x"]["values"]["delay (s)"]) == pytest.approx(last.tf.delay, rel=1e-8)


def test_json_is_one_document_and_progress_stays_off_a_pipe(paper: Path, model: Path) -> None:
    """Only the document on stdout, and only sentences on stderr."""
    for arguments in (("frf", paper), ("fit", paper, "--axis", "x"), ("validate", paper, model), ("replay", paper)):
        said = cli(*arguments, "--json")
        assert said.code == 0 and isinstance(said.json, dict) and said.out.endswith("}\n") and said.out.count("\n") == 1
        assert "reading" not in said.err and "\n\n" not in said.err


def test_parameter_files_settings_and_spans_change_the_answer(paper: Path, tmp_path: Path) -> None:
    """--params as read by the nodes, with --set on top of it, --span in seconds."""
    (tmp_path / "p.yaml").write_text("/**/identifier:\n  ros__parameters:\n    length: 2048\n    window: blackman\n")
    resolution = 2000 / 2048
    one = cli("frf", paper, "--axis", "x", "--params", tmp_path / "p.yaml", "--json").json["axes"]["x"]["frf"]
    assert one["resolution"] == resolution
    two = cli("frf", paper, "--axis", "x", "--params", tmp_path / "p.yaml", "--set", "length=1024", "--span", "10:20", "--json").json
    assert two["axes"]["x"]["frf"]["resolution"] == 2 * resolution and two["recording"]["samples"] == 20_000


def test_other_units_are_carried_into_every_answer(tmp_path: Path) -> None:
    """A current and an angle keep their units; mV and um are converted to V and m, with a note."""
    path = npz(tmp_path / "a.npz", u_unit="A", y_unit="rad")
    assert "rad/s/A" in cli("fit", path, *RIGID).out and "dB (rad/A)" in cli("frf", path).out
    said = cli("fit", npz(tmp_path / "b.npz", u_unit="mV", y_unit="um"), *RIGID)
    assert "note: the input is converted from mV to V" in said.err and "mm/s/V" in said.out


def test_samples_that_are_missing_are_stepped_over(tmp_path: Path) -> None:
    """One NaN removes only the windows around it; a jump of time is a gap."""
    whole = cli("fit", npz(tmp_path / "a.npz"), *RIGID, "--json").json["axes"]["x"]
    for name, changes in (("u", {"u": lambda d: with_one(d["u"], 9000, np.nan)}), ("t", {"t": lambda d: d["t"] + 1e3 * (d["t"] > 15)})):
        found = cli("fit", npz(tmp_path / f"{name}.npz", **changes), *RIGID, "--json").json["axes"]["x"]
        assert found["windows"] < whole["windows"]
        low, high = found["estimates"]["gain"]["ci95"]
        assert low < 1.005e-3 and high > 0.995e-3


def test_a_frozen_or_leaping_encoder_does_not_spoil_the_answer(tmp_path: Path) -> None:
    """Windows with it are left out and counted, as online; a step of the input after rest is no fault."""
    for name, change, words in (
        ("frozen", lambda d: with_one(d["y"], slice(12_000, 13_000), d["y"][12_000]), "the encoder repeated one value"),
        ("leap", lambda d: with_one(d["y"], 12_000, 1.0), "the encoder leapt further"),
    ):
        said = cli("fit", npz(tmp_path / f"{name}.npz", y=change), *RIGID, "--json").json["axes"]["x"]
        assert any(words in note and "windows are left out" in note for note in said["warnings"])
        low, high = said["estimates"]["gain"]["ci95"]
        assert low < 1.005e-3 and high > 0.995e-3 and said["consistent"]
    still = cli("frf", npz(tmp_path / "step.npz", u=lambda d: 1.0 * (d["t"] > 10), y=lambda d: np.maximum(d["t"] - 10, 0)), "--json")
    assert not any("left out" in note for note in still.json["axes"]["x"]["notes"])


def test_an_output_that_does_not_follow_the_input_is_said(tmp_path: Path) -> None:
    """Noise against noise: lines that are coherent by chance do not give an answer."""
    path = npz(tmp_path / "r.npz", y=lambda d: np.random.default_rng(9).normal(size=30_000))
    said = cli("frf", path)
    assert said.code == 0 and "the output hardly follows the input" in said.err
    found = cli("fit", path, *RIGID, "--json").json["axes"]["x"]
    assert any("chance alone" in note for note in found["warnings"]) and found["relative_error"] > 0.9


def test_a_recording_with_one_window_has_no_uncertainty_and_no_fit(tmp_path: Path) -> None:
    """With such a window the response is shown with the note that no line can be trusted; a fit is refused."""
    path, window = npz(tmp_path / "r.npz", rows=4097), ("--set", "length=4095")
    said = cli("frf", path, *window)
    assert said.code == 0 and "0 of 1226 lines trusted" in said.out and "no uncertainty" in said.err
    refusal = cli("fit", path, *window, *RIGID, "--held-out", 0)
    assert refusal.code == 2 and "independent windows is 1.0; allowed: 2 or more" in refusal.err


def test_a_short_recording_that_starts_between_two_windows_is_used(tmp_path: Path) -> None:
    """Windows lie on a grid of the counter; if none of it fits into the data, they start with the data."""
    t, u, y = rigid(8000).values()
    late = Recording(1000.0, ("x",), np.arange(1000, 9000), t, u[:, None], y[:, None])
    save(late, tmp_path / "bag")
    for length in (7000, 3000):
        assert cli("frf", tmp_path / "bag", "--set", f"length={length}", "--json").json["axes"]["x"]["windows"] >= 1


def test_an_axis_without_an_answer_does_not_take_the_others_with_it(paper: Path, model: Path, tmp_path: Path) -> None:
    """An axis at rest: the others get their results, and this one a reason; alone, it is an error."""
    recording = load(paper)
    position = recording.position.copy()
    position[:, 0] = 0.0
    save(replace(recording, position=position), tmp_path / "still.npz")
    for command, words in (("fit", "no model"), ("frf", "no response")):
        said = cli(command, tmp_path / "still.npz")
        assert said.code == 0 and f"axis x: {words}. output of axis x is constant" in said.out and "axis y" in said.out
        assert "constant" in cli(command, tmp_path / "still.npz", "--json").json["axes"]["x"]["problem"]
        assert cli(command, tmp_path / "still.npz", "--axis", "x").code == 2
    checked = cli("validate", tmp_path / "still.npz", model)
    assert checked.code == 1 and "axis x: not checked" in checked.out and "axis y: the model holds" in checked.out


def test_replay_names_the_units_of_its_bag(tmp_path: Path) -> None:
    """A bag of a current and an angle, and joint states with an effort: no number is given in metres or volts."""
    t, u, y = rigid(9000).values()
    save(Recording(1000.0, ("x",), np.arange(9000), t, u[:, None], y[:, None], input_unit="A", output_unit="rad"), tmp_path / "bag")
    said = cli("replay", tmp_path / "bag", *RIGID, "--set", "length=1024")
    assert said.code == 0 and "rad/s/A" in said.out and "m/s" not in said.out
    with BagWriter(tmp_path / "joints") as writer:
        for k in range(9000):
            writer.write_raw("/joint_states", JOINT_TYPE, joint_state(10**9 + k * 10**6, y[k : k + 1], u[k : k + 1], ("a",)), 10**9 + k * 10**6)
    told = cli("replay", tmp_path / "joints", *RIGID, "--set", "length=1024", "--json").json
    assert told["units"] == {"input": "effort", "output": "position"} and "gain (position/s/effort)" in told["axes"]["a"]["values"]


def test_an_output_that_is_the_input_is_answered_without_noise_on_the_terminal(tmp_path: Path) -> None:
    """A synthetic signal without noise has no scatter; any order, window and method gives an answer or one line."""
    path = npz(tmp_path / "same.npz", rows=10_000, y=lambda d: d["u"])
    for orders in ((0, 1), (3, 6), (8, 9)):
        for method in ("best", "iwls", "lls", "nllsfdi"):
            for extra in (("--period", "100"), ("--set", "length=256", "--set", "window=boxcar", "--domain", "z")):
                settings = ("--set", f"numerator_order={orders[0]}", "--set", f"denominator_order={orders[1]}", "--set", "integrators=0")
                said = cli("fit", path, *settings, "--method", method, *extra, "--json")
                assert said.code in (0, 2) and "Warning" not in said.err
                assert said.json if said.code == 0 else said.err.count("\n") == 1


@pytest.mark.parametrize("strange", ["in random order", "against time"])
def test_compare_says_that_input_and_output_do_not_belong_together(strange: str, tmp_path: Path) -> None:
    """A model that explains little of the motion is no model; text and JSON say so before any number."""
    position = rigid(30_000)["y"]
    own = np.random.default_rng(2).permutation(position) if strange == "in random order" else position[::-1]
    file = npz(tmp_path / "rec.npz", y=own)
    assert "does not describe this axis" in cli("compare", file).err
    assert "does not describe this axis" in cli("compare", file, "--json").json["notes"][-1]
    assert "does not describe this axis" not in cli("compare", npz(tmp_path / "right.npz")).err


def test_compare_without_a_model_says_which_model_its_numbers_belong_to(tmp_path: Path) -> None:
    """Its linear model and its third of the data are not those of diagnose and report, so its multiple of the floor differs; no note with a model."""
    file, model = npz(tmp_path / "a.npz"), tmp_path / "model.yaml"
    for said in (cli("compare", file).err.replace("\n  ", " "), " ".join(cli("compare", file, "--json").json["notes"])):
        assert "a linear one is fitted to the first two thirds and judged on the last third" in said
    assert cli("fit", file, *RIGID, "--model", model).code == 0
    assert "no model is given" not in cli("compare", npz(tmp_path / "b.npz", rows=20_000), model).err
    assert cli("simulate", tmp_path / "two", "--duration", "10").code == 0
    assert cli("compare", tmp_path / "two").err.count("no model is given") == 1, "a note about both axes is said once"
