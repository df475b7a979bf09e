"""Many recordings -> one table, on several processes, in spite of any failure of these."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import duckdb
import pandas
import polars
import pytest
from helpers.cli_tools import COMMAND, bare, cli, npz, refused

import xy_sysid as xy
from xy_sysid.fleets.columns import TIMES
from xy_sysid.fleets.engine import Cluster, connected, results
from xy_sysid.fleets.estimate import Progress
from xy_sysid.fleets.journal import FILE, journal
from xy_sysid.fleets.of_file import Task, failed, rows_of_file
from xy_sysid.fleets.of_paths import Analysis, run
from xy_sysid.fleets.row import Row
from xy_sysid.fleets.table import as_table, read
from xy_sysid.imports import load, save

SAMPLES, MORE = 300, 1_000  # of most recordings: short, but each is fitted and searched; of the last one
DAYS = ("2026-03-01", "2026-03-02", "2026-03-03")


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    """Two processes of this machine."""
    with connected(Cluster(workers=2)) as found:
        yield found


def made(folder: Path) -> Path:
    """Two machines with three recordings each, and a broken file."""
    for number in (1, 2):
        (folder / f"mill-0{number}").mkdir(parents=True)
        for seed, day in enumerate(DAYS):
            rows = MORE if (number, day) == (2, DAYS[-1]) else SAMPLES
            npz(folder / f"mill-0{number}" / f"{day}.npz", rows=rows, y=lambda c, k=10 * number + seed: c["y"] * (1.0 + 0.001 * k))
    (folder / "mill-02" / "2026-03-09.csv").write_text("rubbish\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("fleet") / "data")


@pytest.fixture(scope="module")
def table(data: Path, client: Any) -> Path:
    folder = data.parent / "table"
    xy.fleet(data, folder, client)
    return folder


def without_times(rows: list[Row]) -> list[Row]:
    return [{name: value for name, value in row.items() if name not in TIMES and value is not None} for row in rows]


def test_a_cluster_leaves_the_environment_of_this_process_as_it_was() -> None:
    """One thread per worker does not affect the caller, whose next report uses all cores."""
    before = dict(os.environ)
    with connected(Cluster(workers=1)):
        pass
    assert dict(os.environ) == before


def test_the_rows_are_the_same_on_any_number_of_processes(data: Path, table: Path) -> None:
    """Two processes of a cluster, and this one alone, give the same result bit for bit."""
    here = [row for path in sorted(data.glob("*/*")) for row in rows_of_file(Task(str(path))).rows]
    assert without_times(read(table).to_pylist()) == without_times(as_table(here).to_pylist())
    assert len(here) == 7


def test_pandas_polars_and_duckdb_read_the_table(table: Path) -> None:
    """Parquet with flat columns for any reader, and an empty hidden file."""
    gains = read(table, ("machine", "gain")).to_pylist()
    assert pandas.read_parquet(table)[["machine", "gain"]].dropna().to_dict("records") == [row for row in gains if row["gain"] is not None]
    assert polars.read_parquet(table / "*.parquet")["gain"].drop_nulls().to_list() == [row["gain"] for row in gains if row["gain"] is not None]
    found = duckdb.execute(f"select machine, count(gain), min(date)::text from '{table}/*.parquet' group by machine order by machine").fetchall()
    assert [(machine, count) for machine, count, _ in found] == [("mill-01", 3), ("mill-02", 3)]
    assert sorted(path.name for path in table.iterdir()) == [FILE, "mill-01.parquet", "mill-02.parquet"]


def test_every_column_in_the_file_has_its_unit_and_meaning(table: Path) -> None:
    """They are in the Parquet files, with the data."""
    field = read(table).schema.field("gain")
    assert field.metadata[b"unit"] == b"m/s/V" and b"velocity gain" in field.metadata[b"meaning"]


def test_what_is_in_the_table_is_not_done_again(data: Path, table: Path, client: Any, tmp_path: Path) -> None:
    """Same content, name and version: unchanged. A new recording is analysed; other options are another analysis."""
    now = run([data], table, Analysis(), client)
    assert (now.unchanged, now.analysed) == (7, 0)
    npz(data / "mill-01" / "2026-03-04.npz", rows=SAMPLES)
    now = run([data], table, Analysis(), client)
    assert (now.unchanged, now.analysed) == (7, 1)
    assert read(table).num_rows == 8
    (data / "mill-01" / "2026-03-04.npz").unlink()
    assert run([data], table, Analysis(), client).unchanged == 7
    assert read(table).num_rows == 8, "the row stays when the recording goes"


def test_a_moved_recording_is_no_second_one(data: Path, client: Any, tmp_path: Path) -> None:
    """The same content with the same machine and date has one row, for any path, and is not analysed again."""
    for folder in ("a", "b"):
        (tmp_path / folder / "mill").mkdir(parents=True)
        npz(tmp_path / folder / "mill" / "2026-03-01.npz", rows=SAMPLES)
    assert run([tmp_path / "a"], tmp_path / "table", Analysis(), client).analysed == 1
    assert run([tmp_path / "b"], tmp_path / "table", Analysis(), client).unchanged == 1
    assert read(tmp_path / "table").num_rows == 1


def test_a_killed_process_loses_nothing(data: Path, tmp_path: Path, client: Any) -> None:
    """kill -9 of a worker during its task: another takes over, and every recording has its row."""
    before = set(workers(client))

    def kill(now: Progress) -> None:
        if now.done == 1:
            os.kill(next(iter(before)), signal.SIGKILL)

    now = run([data], tmp_path / "table", Analysis(), client, kill)
    rows = read(tmp_path / "table").to_pylist()
    assert now.done == 7 and len(rows) == 7
    assert {row["stage"] for row in rows} == {None, "reading"}


def test_a_recording_that_kills_its_process_is_tried_twice_and_is_a_row(data: Path, tmp_path: Path, client: Any) -> None:
    """A fatal task is tried only twice, and others are not affected."""
    deadly = tmp_path / "deadly.py"
    tries = tmp_path / "tries"
    deadly.write_text(f"import os\nopen({str(tries)!r}, 'a').write('x')\nos.kill(os.getpid(), 9)\n", encoding="utf-8")
    paths = sorted((data / "mill-01").glob("*.npz"))[:2]
    tasks = [Task(str(paths[0]), effect_files=(str(deadly),)), *(Task(str(path)) for path in paths[1:])]
    found = {done.path: done.rows[0] for done, _ in results(client, tasks)}
    assert found[str(paths[0])]["stage"] == "worker" and "died twice" in found[str(paths[0])]["problem"]
    assert all(found[str(path)].get("problem") is None for path in paths[1:])
    assert tries.read_text(encoding="utf-8") == "xx"


def test_a_recording_that_kills_its_process_is_not_tried_again_by_the_next_run(data: Path, tmp_path: Path, client: Any) -> None:
    """Its hash is in the table, so that a nightly run does not lose two processes every night. With other options it is tried again."""
    deadly, tries = tmp_path / "deadly.py", tmp_path / "tries"
    lines = ["import os", "from dataclasses import replace", "from xy_sysid.axis.model import STANDARD", f"if os.getpid() != {os.getpid()}:"]
    lines += [
        f"    open({str(tries)!r}, 'a').write('x')",
        "    os.kill(os.getpid(), 9)",
        "EFFECT = replace(STANDARD['coulomb_friction'], name='own')",
    ]
    deadly.write_text("\n".join(lines), encoding="utf-8")
    path, how = data / "mill-01" / f"{DAYS[0]}.npz", Analysis(effect_files=(str(deadly),))
    first, second = (run([path], tmp_path / "table", how, client) for _ in range(2))
    assert (first.failed, first.unchanged, second.failed, second.unchanged) == (1, 0, 0, 1)
    assert tries.read_text(encoding="utf-8") == "xx"
    (row,) = read(tmp_path / "table").to_pylist()
    assert row["stage"] == "worker" and "it is not tried again" in row["problem"] and row["machine"] == "mill-01" and row["date"] is not None
    assert run([path], tmp_path / "table", Analysis(), client).analysed == 1
    assert [one["stage"] for one in read(tmp_path / "table").to_pylist()] == [None]


def workers(client: Any) -> list[int]:
    return list(client.run(os.getpid).values())


def test_a_killed_command_goes_on_where_it_was(tmp_path: Path, client: Any) -> None:
    """kill -9 of the command, which uses an external cluster: finished work is not repeated."""
    data, table = made(tmp_path / "data"), tmp_path / "table"
    arguments = [*COMMAND, "fleet", str(data), "-o", str(table), "--scheduler", client.scheduler.address]
    command = subprocess.Popen(arguments, env=bare(), stderr=subprocess.DEVNULL)
    waited(lambda: (table / FILE).exists() and (table / FILE).stat().st_size > 0)
    command.kill()
    command.wait()
    now = run([data], table, Analysis(), client)
    assert now.unchanged >= 1 and now.done == 7 and read(table).num_rows == 7


def test_ctrl_c_keeps_what_is_done(tmp_path: Path) -> None:
    """Exit code 130, no traceback, no process left, and the finished rows are in the table."""
    data, table = made(tmp_path / "data"), tmp_path / "table"
    arguments = [*COMMAND, "fleet", str(data), "-o", str(table), "--workers", "1"]
    command = subprocess.Popen(arguments, env=bare(), stderr=subprocess.PIPE, text=True, start_new_session=True)
    waited(lambda: (table / FILE).exists() and (table / FILE).stat().st_size > 0)
    os.killpg(command.pid, signal.SIGINT)  # as a terminal does
    said = command.communicate()[1]
    assert command.returncode == 130 and "Traceback" not in said, said
    assert read(table).num_rows >= 1 and (table / FILE).stat().st_size == 0
    waited(lambda: not running(command.pid))


def running(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def waited(happened: Any) -> None:
    """Wait for an event by polling, up to the time limit of the test."""
    while not happened():
        time.sleep(0.02)


SCHEDULER = """
import time
from distributed import LocalCluster
with LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0") as cluster:
    print(cluster.scheduler_address, flush=True)
    time.sleep(600.0)
"""


def test_a_scheduler_without_workers_and_one_that_goes_away_are_told(data: Path, tmp_path: Path) -> None:
    """The command says that it waits; when the scheduler is killed, one line and no traceback."""
    with ExitStack() as stack:
        scheduler = stack.enter_context(subprocess.Popen([sys.executable, "-c", SCHEDULER], env=bare(), stdout=subprocess.PIPE, text=True))
        stack.callback(scheduler.kill)
        assert scheduler.stdout is not None
        arguments = [*COMMAND, "fleet", str(data), "-o", str(tmp_path / "t"), "--scheduler", scheduler.stdout.readline().strip()]
        command = stack.enter_context(subprocess.Popen(arguments, env=bare(), stderr=subprocess.PIPE, text=True))
        stack.callback(command.kill)
        assert command.stderr is not None
        assert "waiting for workers of the scheduler" in command.stderr.readline()
        scheduler.kill()
        lost = "xy-sysid: The connection to the scheduler is lost. Finished recordings are in the table: run the same command again.\n"
        assert (command.communicate()[1], command.returncode) == (lost, 2)


def test_only_one_run_writes_a_table(tmp_path: Path, data: Path) -> None:
    """The second one gets an error in one line."""
    with journal(tmp_path / "table"):
        assert "one that no other run is writing" in refused("fleet", data, "-o", tmp_path / "table")


def test_the_command_says_what_it_did(data: Path, tmp_path: Path) -> None:
    """Counts, rate, and why there is no answer; a scheduler that does not answer is bad input."""
    assert "tcp://HOST:PORT" in refused("fleet", data, "-o", tmp_path / "t", "--scheduler", "nonsense")
    assert "recordings or folders" in refused("fleet", data)


def test_bags_and_patterns_are_recordings_too_and_counts_are_json(tmp_path: Path, client: Any) -> None:
    """A bag next to a table file, named by a folder and by a pattern; --json lists the work, and the next run has none."""
    folder, table = tmp_path / "mill-03", tmp_path / "table"
    folder.mkdir()
    save(load(npz(folder / "2026-03-01.npz", rows=SAMPLES)), folder / "2026-03-02")
    (folder / "2026-03-03.csv").write_text("rubbish\n", encoding="utf-8")
    command = ("fleet", folder, tmp_path / "*" / "2026-03-0[1-2]*", "-o", table, "--scheduler", client.scheduler.address, "--json")
    first, second = cli(*command).json, cli(*command).json
    counts = ("recordings", "analysed", "unchanged", "without_an_answer")
    assert [first[name] for name in counts] == [3, 3, 0, 1] and first["seconds"] > 0.0 < first["an_hour"]
    assert [second[name] for name in counts] == [3, 0, 3, 0]
    assert {row["machine"] for row in read(table).to_pylist()} == {"mill-03"}
    rows = sorted(read(table).to_pylist(), key=lambda row: str(row["date"]))
    assert rows[0]["data_sha256"] == rows[1]["data_sha256"] and rows[2]["stage"] == "reading"


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch, data: Path, tmp_path: Path) -> None:
    """One line that says what to install."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    said = refused("fleet", data, "-o", tmp_path / "t")
    assert "pip install 'xy_sysid[fleet]'" in said


def test_the_estimate_holds_what_is_left() -> None:
    """An interval from the times so far and their spread; none from fewer than three recordings."""
    now = Progress(total=100, done=50, elapsed=50.0, spent=100.0, square=220.0, workers=2)
    low, high = now.remaining() or (0.0, 0.0)
    assert low < 50.0 < high < 60.0 and "3.6e+03 an hour on 2 processes" in now.sentence()
    assert Progress(total=10, done=2, elapsed=3.0, spent=3.0, square=4.5).remaining() is None
    assert threading.active_count() >= 1 and cli("fleet", "--help").code == 0


def test_a_row_whose_writing_is_interrupted_is_in_the_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C between the journal and the disk: the row is known, so it is not lost."""

    def interrupted(_: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("os.fsync", interrupted)
    row = failed("data/mill-01/a.csv", "reading", "is no table")
    with pytest.raises(KeyboardInterrupt), journal(tmp_path / "table") as kept:
        try:
            kept.add([row])
        finally:
            monkeypatch.undo()
    assert [one["problem"] for one in read(tmp_path / "table").to_pylist()] == ["is no table"]
