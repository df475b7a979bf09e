"""Every benchmark runs in its short form, with checks of the numbers that do not depend on the computer."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from helpers import ROOT
from helpers.cli_tools import bare
from helpers.real_data import data
from helpers.ros_tools import needs_ros

from campaigns.bench import emps_force, peers
from campaigns.bench.__main__ import SCRIPTS, TABLES, main, text
from campaigns.bench.recordings import between
from campaigns.bench.tables import Table
from xy_sysid.axis.model import AxisModel, simulate
from xy_sysid.greybox.axis_data import prepare

HERE = [name for name in TABLES if name != "live"]  # which starts processes that communicate


@cache
def short(name: str) -> Table:
    """The short form of a benchmark in this process; each runs once."""
    run: Callable[..., Table] = importlib.import_module(f"campaigns.bench.{name}").run
    return run(lambda line: None, short=True)


@pytest.mark.parametrize("name", HERE)
def test_a_benchmark_gives_its_table(name: str) -> None:
    """Rows of the same width, and numbers with goals."""
    table = short(name)
    assert table.rows and table.checks
    assert {len(row) for row in table.rows} == {len(table.columns)}
    assert " nan" not in text(name, table)


def test_what_is_compared_is_equal() -> None:
    """Compared programs give the same answers: H1 is that of scipy, and the cost that of least_squares."""
    for name, words in (("h1", "largest relative difference"), ("fit", "cost of xy_sysid")):
        (check,) = (check for check in short(name).checks if check.what.startswith(words))
        assert check.met, check


@needs_ros
def test_the_live_benchmark_gives_its_table() -> None:
    """Nodes as processes: all sent samples are paired."""
    done = subprocess.run(
        [sys.executable, "-m", "campaigns.bench", "--short", "live"], cwd=ROOT, env=bare(), capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert "| lost, dropped or refused | none |" in done.stdout


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_benchmark_that_is_asked_for_by_name_runs(name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """It prints its results, and writes no page."""
    if name == "real_fits":
        monkeypatch.setenv("XY_SYSID_DATA", os.fspath(data("two_inertia_bench").parent))
    if name == "long_bag":  # measures the memory of its process
        done = subprocess.run(
            [sys.executable, "-m", "campaigns.bench", "--short", name], cwd=ROOT, env=bare(), capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0 and done.stdout, done.stderr
        return
    monkeypatch.setattr("sys.argv", ["bench", "--short", name])
    if name in ("peers", "diagnoses"):
        data("hsm150/hsm_pos_0.06_1.npz")
    if name == "next_part":
        data("gap_foreign/gap_linear_37um.npz")
    if name == "emps_force":
        data("emps/emps_train.npz")
    pages = [ROOT / "docs" / name for name in ("benchmarks.md", "real-machines.md", "use.md")]
    before = [page.read_bytes() for page in pages]
    assert main() == 0
    said = capsys.readouterr().out
    assert len(said.splitlines()) > 2 and " nan" not in said
    assert [page.read_bytes() for page in pages] == before


def test_the_input_of_emps_is_predicted_within_three_per_cent() -> None:
    """Second half from the motion, by model and table of the first: below 3 % at every frequency of the comparison, the model alone up to 50 Hz."""
    data("emps/emps_train.npz")
    rows = {name: [float(cell.removesuffix(" %")) for cell in cells] for name, *cells in emps_force.parts(short=True)}
    assert list(rows) == ["10 Hz", "20 Hz", "50 Hz", "100 Hz"]
    for name, (inertia, simple, whole, tabled) in rows.items():
        assert tabled < 3.0 and tabled < whole < simple / 2.0 < inertia / 8.0, name
        assert whole < (3.0 if name != "100 Hz" else 3.5), name


def test_peers_reach_the_axis_that_made_the_data() -> None:
    """Output error within 1 %, inverse dynamics within 25 % (its low-pass smooths reversals); without friction both are twice as far off."""
    truth = AxisModel(0.1, 0.0, 20.0).with_effect("coulomb_friction", (0.3,))
    voltage = np.convolve(np.random.default_rng(2).normal(size=20_000), np.ones(20) / 4.0, "same")
    velocity = simulate(truth, 1000.0, voltage, np.zeros(voltage.size))
    data = prepare(1000.0, voltage, np.round(np.concatenate(([0.0], np.cumsum(velocity))) / 1000.0, 7))
    reached = peers.peers(data, friction=True)
    for name, part in (("output error", 0.01), ("inverse dynamics", 0.25)):
        assert list(reached[name].model.values().values()) == pytest.approx(list(truth.values().values()), rel=part, abs=1e-4)
        assert reached[name].error < 0.5 * peers.peers(data, friction=False)[name].error


def test_a_table_takes_the_place_of_the_one_before() -> None:
    """Between its marks; the rest of the page is unchanged."""
    page = "a\n\n<!-- made by python -m campaigns.bench peers -->\n\nold\n\n<!-- end of peers -->\n\nb\n"
    assert between(page, "peers", "new\n") == page.replace("old", "new")


def test_every_benchmark_is_among_these() -> None:
    """A new file of campaigns/bench/ must have a short form, too."""
    files = {path.stem for path in (ROOT / "campaigns" / "bench").glob("*.py")} - {
        "__init__",
        "__main__",
        "mujoco_machine",
        "recordings",
        "settle_pairs",
        "tables",
        "use_machines",
        "workshop",
    }
    assert files == {*TABLES, *SCRIPTS}


def test_an_unknown_benchmark_is_one_line(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The error lists the existing names."""
    monkeypatch.setattr("sys.argv", ["bench", "bag"])
    assert main() == 2
    assert capsys.readouterr().err.startswith("bench: bag is not a benchmark; there are h1, ")
