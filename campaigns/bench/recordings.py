"""The recordings of real machines, axis by axis, as a command reads them; and their tables in docs/real-machines.md."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from campaigns.faults.shared import DATA, RECORDINGS, Shared
from xy_sysid.cli import options as o
from xy_sysid.cli.reading import read_each, reads, runs_of
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.samples.recording import Run

if TYPE_CHECKING:
    from xy_sysid.imports.reading import Reading

PAGE = Path(__file__).parents[2] / "docs" / "real-machines.md"
SHORT = ("hsm150/hsm_pos_0.06_1.npz",)  # small recordings for --short


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis of a recording. runs: its stretches; empty with a reason."""

    name: str
    runs: tuple[Run, ...]
    refused: str = ""


def rows(short: bool) -> tuple[Shared, ...]:
    """The available recordings; raises BadInput if there is no folder of them."""
    if not DATA.is_dir():
        raise BadInput("recordings of real machines", str(DATA), "a folder with them", "Say where they are with XY_SYSID_DATA.")
    return tuple(row for row in RECORDINGS if (DATA / row.path).exists() and (not short or row.path in SHORT))


def asked(row: Shared) -> tuple[list[Path], Reading]:
    """The path of a recording, and the options of its row for reading it. Raises BadInput for invalid options."""
    found: list[tuple[list[Path], Reading]] = []
    app = typer.Typer()

    @app.command()
    @reads
    def read(recs: o.Recs, reading: Reading) -> None:
        found.append((recs, reading))

    app([str(DATA / row.path), *row.options], standalone_mode=False)
    return found[0]


def axes(row: Shared) -> Iterator[Axis]:
    """Every axis of a recording, read with the options of its row."""
    try:
        read = read_each(*asked(row), quiet=True)
    except (BadInput, BadRecording) as refusal:
        yield Axis(row.path, (), str(refusal).replace(f"{DATA}/", "").removeprefix(f"{row.path}: "))
        return
    for name in read[0].axes:
        title = row.path if len(read[0].axes) == 1 else f"{row.path}, {name}"
        try:
            yield Axis(title, runs_of(read, name))
        except BadInput as refusal:
            yield Axis(title, (), str(refusal))


def markdown(columns: Sequence[str], cells: Iterable[Sequence[str]]) -> str:
    """A table as Markdown."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (columns, ["---"] * len(columns), *cells))


def between(page: str, name: str, made: str) -> str:
    """The page with the table between the marks of this name replaced."""
    begin, end = f"<!-- made by python -m campaigns.bench {name} -->", f"<!-- end of {name} -->"
    before, rest = page.split(begin)
    return f"{before}{begin}\n\n{made.strip()}\n\n{end}{rest.split(end)[1]}"


def written(name: str, made: str) -> None:
    """Write a table to docs/real-machines.md."""
    PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), name, made), encoding="utf-8")
