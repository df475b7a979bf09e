"""Our recorder stores checksums of sqlite3 bags; replay and fit detect a changed value."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from helpers.cli_tools import RIGID, cli

from xy_sysid.bags import sums
from xy_sysid.bags.sums import KEY, Sums, check_sums
from xy_sysid.errors import BadRecording
from xy_sysid.imports import load

ROWS = "SELECT topics.name, messages.data FROM messages JOIN topics ON topics.id = messages.topic_id ORDER BY messages.id"


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """Eight seconds of samples; every writer of sqlite3 here adds the checksums, as the recorder node does."""
    path = tmp_path / "bag"
    assert cli("simulate", path, "--duration", "8").code == 0
    return path


def _change_one_byte(bag: Path, place: int = 3000) -> None:
    """The last byte but three of one position message: a value of the last sample."""
    with closing(sqlite3.connect(bag / "bag.db3")) as file, file:
        number, data = file.execute("SELECT id, data FROM messages WHERE topic_id = 2 AND id <= ? ORDER BY id DESC LIMIT 1", (place,)).fetchone()
        file.execute("UPDATE messages SET data = ? WHERE id = ?", (data[:-4] + bytes([data[-4] ^ 1]) + data[-3:], number))


@pytest.mark.parametrize("words", [("replay", "--set", "length=1024"), ("fit", *RIGID), ("frf",)])
def test_a_changed_value_is_seen(words: tuple[str, ...], bag: Path) -> None:
    """One changed bit of one position: an error with the topic, and the way to read it nevertheless; without the change it is read."""
    command = (words[0], bag, *words[1:])
    assert cli(*command).code == 0
    _change_one_byte(bag)
    said = cli(*command)
    assert said.code == 2 and "the messages on /xy/position are not those that were recorded" in said.err and KEY in said.err, said
    metadata = bag / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(KEY, "deleted"))
    assert cli(*command).code == 0


def test_what_a_killed_recorder_wrote_after_its_last_sum_is_read(bag: Path) -> None:
    """More messages than in the checksum are no damage; a change among those in the checksum is."""
    metadata = bag / "metadata.yaml"
    running = Sums()
    with closing(sqlite3.connect(bag / "bag.db3")) as file:
        for topic, data in file.execute(ROWS + " LIMIT 200"):
            running.add(topic, data)
    told = json.loads(metadata.read_text())
    told["rosbag2_bagfile_information"]["custom_data"] = running.text()
    metadata.write_text(json.dumps(told))
    assert check_sums(bag) == "good"
    _change_one_byte(bag, 1000)
    assert check_sums(bag) == "good"
    _change_one_byte(bag, 100)
    with pytest.raises(BadRecording, match="/xy/position"):
        check_sums(bag)


def test_an_intact_bag_is_checked_without_sql(bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The pages are read in compiled code, as for the data; SQL, which takes many times longer, only decides what is wrong."""
    monkeypatch.setattr(sums, "BODY", "none")
    assert check_sums(bag) == "good"
    _change_one_byte(bag)
    assert check_sums(bag) == "damaged"  # as this SQL says


def test_the_library_and_the_page_see_it_too(bag: Path) -> None:
    """The check applies to every reader of the bag, not only to commands."""
    assert len(load(bag)) == 16_000
    _change_one_byte(bag)
    with pytest.raises(BadRecording, match="not those that were recorded"):
        load(bag)


def test_where_damage_hides_the_sums_it_is_said_that_numbers_may_be_wrong(bag: Path) -> None:
    """A page of the file with random bytes: the rest is read, and not reported as checked."""
    file = bag / "bag.db3"
    whole = bytearray(file.read_bytes())
    whole[40 * 4096 : 41 * 4096] = np.random.default_rng(1).bytes(4096)
    file.write_bytes(whole)
    try:
        notes = load(bag).notes
    except BadRecording as refused:
        notes = (str(refused),)
    assert any("check sum" in note for note in notes), notes


@pytest.mark.parametrize(
    "text", ["", "[", "{}", "[1]", "[" * 100_000, '{"rosbag2_bagfile_information": {"custom_data": {"xy_sysid_crc32": "{\\"a\\": 1}"}}}']
)
def test_strange_metadata_has_no_sums_and_does_no_harm(text: str, tmp_path: Path) -> None:
    """The reader reports the damage."""
    (tmp_path / "metadata.yaml").write_text(text)
    assert check_sums(tmp_path) == check_sums(tmp_path / "none") == "none"
