"""A run writes only files of its table's folder."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.cli_tools import refused

from xy_sysid.errors import BadRecording
from xy_sysid.fleets.journal import FILE, journal


@pytest.mark.parametrize("name", [FILE, "mill-01.parquet"])
def test_a_run_follows_no_link_in_its_table(name: str, tmp_path: Path) -> None:
    """Refused in one line before any work; the target of the link is not changed or created."""
    data, table, other = tmp_path / "mill-01" / "2026-03-01.csv", tmp_path / "table", tmp_path / "precious"
    data.parent.mkdir()
    data.write_text("rubbish\n", encoding="utf-8")
    table.mkdir()
    (table / name).symlink_to(other)
    assert f"a link to {other}" in refused("fleet", data.parent, "-o", table) and not other.exists()
    other.write_bytes(b"what was there before")
    assert f"a link to {other}" in refused("fleet", data.parent, "-o", table)
    assert other.read_bytes() == b"what was there before"


def test_a_journal_that_is_no_file_is_refused(tmp_path: Path) -> None:
    """A folder of its name."""
    (tmp_path / FILE).mkdir()
    with pytest.raises(BadRecording, match="no file"), journal(tmp_path):
        pass
