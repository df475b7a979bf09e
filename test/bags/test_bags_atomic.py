"""Every writer writes completely or not at all: after a full disk the old file remains, with an error of one line and no partial file."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from helpers.bag_making import a_recording
from helpers.cli_tools import RIGID, bare, cli, npz

from xy_sysid.bags.atomic import whole, write_text
from xy_sysid.errors import BadRecording
from xy_sysid.files.state import load_state, save_state
from xy_sysid.imports import save

OLD = b"what was there before"


@contextmanager
def full_disk(room: int = 300) -> Iterator[None]:
    """No file can grow beyond this many bytes: a write fails in its middle, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.fixture(scope="module")
def rec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording; each command has worked on it before, so that nothing has to be compiled on the full disk."""
    folder = tmp_path_factory.mktemp("rec")
    path = npz(folder / "rec.npz", rows=12_000)
    for words in COMMANDS.values():
        assert cli(*[{"REC": path, "OUT": folder / "out"}.get(word, word) for word in words]).code == 0
        if words[0] == "simulate":
            (folder / "out").rename(folder / "made")
        (folder / "out").unlink(missing_ok=True)
    return path


COMMANDS: dict[str, tuple[str, ...]] = {
    "model": ("fit", "REC", *RIGID, "--model", "OUT", "--force"),
    "matlab": ("fit", "REC", *RIGID, "--mat", "OUT", "--force"),
    "response": ("frf", "REC", "--csv", "OUT", "--force"),
    "study": ("study", "REC", "--out", "OUT", *RIGID, "--force"),
    "axis model": ("refine", "REC", "--add", "coulomb_friction", "--model", "OUT", "--force"),
    "axis matlab": ("refine", "REC", "--add", "coulomb_friction", "--mat", "OUT", "--force"),
    "bag": ("simulate", "OUT", "--duration", "2"),
}


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "bag"])
def test_a_full_disk_leaves_the_old_file_whole_and_says_which(name: str, rec: Path, tmp_path: Path) -> None:
    """The old bytes remain, one line names the file, and no partial file is left."""
    out = tmp_path / "out"
    out.write_bytes(OLD)
    words = [{"REC": rec, "OUT": out}.get(word, word) for word in COMMANDS[name]]
    with full_disk():
        said = cli(*words)
    assert said.code == 2 and said.err.startswith(f"xy-sysid: {out}: cannot be written (") and said.err.count("\n") == 1, said
    assert out.read_bytes() == OLD and list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize("ending", ["", ".npz", ".mat", ".csv", ".db3", ".mcap"])
def test_a_recording_that_does_not_fit_on_the_disk_leaves_nothing(ending: str, rec: Path, tmp_path: Path) -> None:
    """simulate in every format: one line that names the file, and an empty folder."""
    out = tmp_path / f"rec{ending}"
    with full_disk(20_000):
        said = cli("simulate", out, "--duration", "2")
    assert said.code == 2 and str(out) in said.err and said.err.count("\n") == 1, said
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("ending", [".npz", ".mat", ".csv", ".db3", ".mcap", ""])
def test_save_is_whole_or_not_at_all(ending: str, tmp_path: Path) -> None:
    """Also the library's save, not only the command: the old file remains, or no file."""
    path = tmp_path / f"rec{ending}"
    table = ending in (".npz", ".mat", ".csv")
    if table:
        path.write_bytes(OLD)
    with full_disk(20_000), pytest.raises(BadRecording, match=r"rec.*cannot be written"):
        save(a_recording(4000), path)
    assert list(tmp_path.iterdir()) == [path] * table and (not table or path.read_bytes() == OLD)


def test_a_state_that_does_not_fit_leaves_the_old_one(tmp_path: Path) -> None:
    """The identifier's saved state is unchanged."""
    path = tmp_path / "state.npz"
    save_state(path, {"a": np.arange(3.0)})
    with full_disk(), pytest.raises(BadRecording, match=r"state\.npz: cannot be written"):
        save_state(path, {"a": np.zeros(10_000)})
    assert load_state(path)["a"].tolist() == [0.0, 1.0, 2.0] and list(tmp_path.iterdir()) == [path]


def test_the_file_is_on_the_disk_before_it_takes_the_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """First fsync of the new file, then the rename, then fsync of the folder: a power failure cannot leave an empty file."""
    done: list[str] = []

    real_fsync, real_replace = os.fsync, Path.replace

    def fsync(handle: int) -> None:
        done.append(str(Path(f"/proc/self/fd/{handle}").readlink()))
        real_fsync(handle)

    def replace(path: Path, other: Path) -> Path:
        done.append("rename")
        return real_replace(path, other)

    monkeypatch.setattr(os, "fsync", fsync)
    monkeypatch.setattr(Path, "replace", replace)
    write_text(tmp_path / "a.txt", "text")
    assert done[0].endswith("/a.txt") and done[0] != str(tmp_path / "a.txt") and done[1:] == ["rename", str(tmp_path)]


KILLED = """
import sys, time
from pathlib import Path
from xy_sysid.bags.atomic import whole
with whole(Path(sys.argv[1])) as part:
    part.write_text("half")
    print("writing", flush=True)
    time.sleep(60)
"""


def test_what_kill_9_leaves_is_removed_by_the_next_writer_and_what_the_living_write_is_not(tmp_path: Path) -> None:
    """Two writers in one folder. The first is killed: a third writer removes its remains, and the second still succeeds."""
    writers = [
        subprocess.Popen([sys.executable, "-c", KILLED, str(tmp_path / name)], stdout=subprocess.PIPE, env=bare()) for name in ("first", "second")
    ]
    try:
        for writer in writers:
            assert writer.stdout is not None and writer.stdout.readline() == b"writing\n"
        writers[0].kill()
        writers[0].wait()
        assert len(list(tmp_path.iterdir())) == 2
        write_text(tmp_path / "third", "whole")
        (left,) = tmp_path.glob(".xy_part_*")
        assert [item.name for item in left.iterdir()] == ["second"] and (tmp_path / "third").read_text() == "whole"
    finally:
        for writer in writers:
            writer.kill()
            writer.wait()
    write_text(tmp_path / "third", "again")
    assert list(tmp_path.iterdir()) == [tmp_path / "third"]


def test_only_the_folders_of_writers_are_removed(tmp_path: Path) -> None:
    """Another folder with a similar name is kept, and so is a link with its target."""
    own, link = tmp_path / ".xy_part_of_mine", tmp_path / f".xy_part_{'0' * 16}"
    own.mkdir()
    (own / "kept").write_bytes(OLD)
    link.symlink_to(own)
    write_text(tmp_path / "new", "whole")
    assert (own / "kept").read_bytes() == OLD and link.is_symlink()


def test_a_folder_that_is_removed_before_its_writer_has_locked_it_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another writer may look between the two steps; the file is complete nevertheless."""
    real, removed = os.open, list[str]()

    def slow(path: str | Path, flags: int, mode: int = 0o777, *, dir_fd: int | None = None) -> int:
        if Path(path).name.startswith(".xy_part_") and not removed:
            removed.append(str(path))
            Path(path).rmdir()
        return real(path, flags, mode, dir_fd=dir_fd)

    monkeypatch.setattr(os, "open", slow)
    write_text(tmp_path / "new", "whole")
    assert removed and (tmp_path / "new").read_text() == "whole" and list(tmp_path.iterdir()) == [tmp_path / "new"]


@pytest.mark.parametrize("problem", [KeyboardInterrupt(), SystemExit(3), ValueError("x")])
def test_what_ends_the_work_in_its_middle_leaves_the_old_file(problem: BaseException, tmp_path: Path) -> None:
    """Ctrl-C and errors of every kind."""
    path = tmp_path / "a.txt"
    path.write_bytes(OLD)

    def work() -> None:
        with whole(path) as part:
            part.write_text("half")
            raise problem

    with pytest.raises(type(problem)):
        work()
    assert path.read_bytes() == OLD and list(tmp_path.iterdir()) == [path]


def test_links_modes_and_streams_are_what_they_were(tmp_path: Path) -> None:
    """A link is kept, a file keeps its mode, a new file has the default mode, and a device is written to, not replaced."""
    real, link = tmp_path / "real.txt", tmp_path / "link.txt"
    write_text(real, "one")
    other = tmp_path / "other.txt"
    other.write_text("usual")
    assert real.stat().st_mode == other.stat().st_mode
    real.chmod(0o640)
    link.symlink_to(real)
    write_text(link, "two")
    assert link.is_symlink() and real.read_text() == "two" and real.stat().st_mode & 0o777 == 0o640
    write_text(Path("/dev/null"), "gone")
    assert Path("/dev/null").is_char_device()


def _cut(text: str) -> str:
    return text[: text.rindex("denominator") + 40]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_cut, "cut off or changed"),
        (lambda text: text[:-1], "cut off or changed"),
        (lambda text: text.replace("delay_s: 0", "delay_s: 1"), "cut off or changed"),
        (lambda text: text.partition("\n")[2][:-9], "ends inside a line"),
    ],
)
def test_a_cut_or_changed_model_is_refused(change: Callable[[str], str], words: str, rec: Path, tmp_path: Path) -> None:
    """A file truncated inside a number is not a model, with or without the line with the checksum."""
    model = tmp_path / "m.yaml"
    assert cli("fit", rec, *RIGID, "--model", model).code == 0
    assert cli("validate", rec, model, *RIGID).code == 0
    text = model.read_text()
    assert change(text) != text
    model.write_text(change(text))
    said = cli("validate", rec, model, *RIGID)
    assert said.code == 2 and words in said.err and str(model) in said.err and said.err.count("\n") == 1, said


def test_a_model_without_the_sum_loads(rec: Path, tmp_path: Path) -> None:
    """A file of an older version, or one changed by hand after its checksum line was deleted, as that line suggests."""
    model = tmp_path / "m.yaml"
    assert cli("fit", rec, *RIGID, "--model", model).code == 0
    first, _, rest = model.read_text().partition("\n")
    assert first.startswith("# sha256") and "delete this line" in first
    model.write_text(rest)
    assert cli("validate", rec, model, *RIGID).code == 0
