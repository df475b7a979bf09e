"""A damaged bag gives its readable part with a note, or one clear line: never a traceback, never wrong numbers."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.bag_making import a_bag, assert_true_numbers, both, in_chunks, the_file

from xy_sysid.errors import BadInput, BadRecording, XySysidError
from xy_sysid.imports import load

STORAGES = pytest.mark.parametrize("storage", ["sqlite3", "mcap"])


def error_of(path: Path) -> str:
    with pytest.raises(BadRecording) as caught:
        load(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@STORAGES
def test_a_bag_cut_short_gives_what_is_left(tmp_path: Path, storage: str) -> None:
    """Truncated anywhere: the read samples are right, there is a note, and most of the remaining data are read."""
    bag = a_bag(tmp_path / "bag", both(range(0, 20_000, 20)), storage=storage)
    file = the_file(bag)
    whole = file.read_bytes()
    most = 0
    for part in (0.0001, 0.01, 0.1, 0.3, 0.5, 0.9, 0.99, 0.999999):
        file.write_bytes(whole[: int(len(whole) * part)])
        try:
            recording = load(bag)
        except BadRecording as error:
            assert part < 0.2 and "\n" not in str(error)
            continue
        assert_true_numbers(recording)
        assert recording.notes, f"nothing was said about a bag of which {part} is there"
        assert len(recording) > 20_000 * (part - 0.2)
        most = max(most, len(recording))
    assert most > 19_000


@STORAGES
def test_a_bag_with_wrong_bytes_never_ends_in_a_traceback(tmp_path: Path, storage: str) -> None:
    """200 bags with a stretch of random bytes somewhere: a recording or one line."""
    bag = tmp_path / "bag"
    in_chunks(bag, storage, 3000)
    file = the_file(bag)
    whole = file.read_bytes()
    random = np.random.default_rng(3)
    answers = {"read": 0, "refused": 0}
    for _ in range(200):
        damaged = bytearray(whole)
        size = int(random.choice([1, 4, 64, 5000]))
        place = int(random.integers(0, len(whole) - size))
        damaged[place : place + size] = random.bytes(size)
        file.write_bytes(damaged)
        try:
            load(bag)
            answers["read"] += 1
        except XySysidError as error:
            assert "\n" not in str(error)
            answers["refused"] += 1
    assert answers["read"] > 20


def test_a_damaged_chunk_is_left_out(tmp_path: Path) -> None:
    """MCAP chunks have a checksum: a wrong byte loses its chunk, and the rest is right."""
    path = tmp_path / "bag"
    in_chunks(path, "mcap", 4000)
    raw = bytearray(the_file(path).read_bytes())
    raw[len(raw) // 2] ^= 0x10
    the_file(path).write_bytes(raw)
    recording = load(path)
    assert_true_numbers(recording)
    assert len(recording) == 3600 and len(recording.runs()) == 2
    assert any("checksum" in note for note in recording.notes)


@STORAGES
def test_a_file_that_metadata_names_is_not_there(tmp_path: Path, storage: str) -> None:
    """Another file in the folder is read with a note; if there is none, the line names the missing one."""
    bag = a_bag(tmp_path / "bag", both(range(0, 400, 20)), storage=storage)
    file = the_file(bag)
    file.rename(bag / f"renamed{file.suffix}")
    recording = load(bag)
    assert len(recording) == 400
    assert any(file.name in note and "renamed" in note for note in recording.notes)
    the_file(bag).unlink()
    assert file.name in error_of(bag)


def test_counts_that_do_not_fit_are_said(tmp_path: Path) -> None:
    """metadata.yaml gives too many messages: the bag is read, with a note."""
    bag = a_bag(tmp_path / "bag", both(range(0, 400, 20)))
    content = yaml.safe_load((bag / "metadata.yaml").read_text())
    content["rosbag2_bagfile_information"]["topics_with_message_count"][0]["message_count"] = 999
    (bag / "metadata.yaml").write_text(yaml.safe_dump(content))
    recording = load(bag)
    assert len(recording) == 400
    assert any("999" in note and "20 are there" in note for note in recording.notes)


@pytest.mark.parametrize(
    "text", ["", "{", "- 1\n- 2\n", "rosbag2_bagfile_information: 3", "rosbag2_bagfile_information: {relative_file_paths: [1]}", "\xff\xfe"]
)
def test_metadata_that_is_none_does_not_matter(tmp_path: Path, text: str) -> None:
    """The files in the folder are read with a note; without them there is one line."""
    bag = a_bag(tmp_path / "bag", both(range(0, 400, 20)))
    (bag / "metadata.yaml").write_bytes(text.encode("latin-1"))
    recording = load(bag)
    assert len(recording) == 400 and any("metadata.yaml" in note for note in recording.notes)
    the_file(bag).unlink()
    assert "metadata.yaml" in error_of(bag)


@STORAGES
def test_an_empty_bag_is_one_line(tmp_path: Path, storage: str) -> None:
    """No topics, or topics without messages: the error line says so."""
    a_bag(tmp_path / "none", [], storage=storage)
    assert "no topics" in error_of(tmp_path / "none")
    bag = a_bag(tmp_path / "one", both([0])[:1], storage=storage)
    assert "/xy/position" in error_of(bag) and "it has /xy/voltage (Float64MultiArray)" in error_of(bag)


@STORAGES
def test_a_foreign_bag_says_what_it_has(tmp_path: Path, storage: str) -> None:
    """A bag without the default topics: the error lists its topics, and the options to choose them."""
    bag = a_bag(tmp_path / "bag", [("/gantry/drive", both([0])[0][1])], storage=storage)
    text = error_of(bag)
    assert "/gantry/drive (Float64MultiArray)" in text and "--topic voltage=" in text


def test_what_is_no_bag_is_one_line(tmp_path: Path) -> None:
    """Zero bytes, a text, an empty folder, another sqlite database, a missing path: each error names the cause."""
    (tmp_path / "empty.db3").touch()
    (tmp_path / "empty.mcap").touch()
    (tmp_path / "text.db3").write_text("hello " * 1000)
    (tmp_path / "text.mcap").write_text("hello " * 1000)
    (tmp_path / "folder").mkdir()
    import sqlite3

    with sqlite3.connect(tmp_path / "other.db3") as database:
        database.execute("CREATE TABLE songs(id)")
    assert "0 bytes" in error_of(tmp_path / "empty.db3") and "0 bytes" in error_of(tmp_path / "empty.mcap")
    assert "not readable as an sqlite3 bag" in error_of(tmp_path / "text.db3")
    assert "not an MCAP file" in error_of(tmp_path / "text.mcap")
    assert "not a bag" in error_of(tmp_path / "folder")
    assert "without the tables" in error_of(tmp_path / "other.db3")
    assert "No such file" in error_of(tmp_path / "nowhere")
    assert "not a recording" in error_of(Path(shutil.copy(tmp_path / "text.db3", tmp_path / "text.pdf")))


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_no_permission_is_one_line(tmp_path: Path) -> None:
    """A bag without read permission: the error says so."""
    bag = a_bag(tmp_path / "bag", both(range(0, 400, 20)))
    the_file(bag).chmod(0)
    assert "Permission denied" in error_of(bag)


def test_a_bag_that_does_not_fit_in_memory_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A day of samples is not loaded at once; a part of it is."""
    bag = a_bag(tmp_path / "bag", both(range(0, 200_000, 200), 200))
    monkeypatch.setattr("xy_sysid.imports.limits.SHARE", 2e-4)
    monkeypatch.setattr("os.sysconf", lambda name: {"SC_PHYS_PAGES": 5_000_000, "SC_PAGE_SIZE": 4096}[name])
    assert "--span" in error_of(bag)
    part = load(bag, start=90.0, stop=91.5)
    assert part.time[0] == 90.0 and len(part) == 3000
    with pytest.raises(BadInput, match=r"within the recording|within 0 to"):
        load(bag, start=500.0)
