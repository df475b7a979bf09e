"""A result as a short table: read as text, and taken on to a paper, a data frame or a page."""

from __future__ import annotations

import html
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from xy_sysid.errors import MissingExtra

Cell = str | float | None
LATEX = str.maketrans({mark: f"\\{mark}" for mark in "&%$#_{}"} | {"~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}"})


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of words and numbers under named columns; an empty cell is None. ``print`` shows it; a notebook draws it."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def __len__(self) -> int:
        return len(self.rows)

    def __iter__(self) -> Iterator[tuple[Cell, ...]]:
        return iter(self.rows)

    def __str__(self) -> str:
        lines = self._text()
        shape = [(max(map(len, column)), ">" if self._counts(k) else "<") for k, column in enumerate(zip(*lines, strict=True))]
        return "\n".join("  ".join(f"{cell:{side}{wide}}" for cell, (wide, side) in zip(line, shape, strict=True)).rstrip() for line in lines)

    def to_frame(self) -> Any:
        """A pandas DataFrame, numbers as numbers. Raises MissingExtra without pandas."""
        try:
            import pandas
        except ImportError:
            raise MissingExtra("pandas", "frames") from None
        return pandas.DataFrame(self.rows, columns=list(self.columns))

    def to_markdown(self) -> str:
        """A table for a Markdown page."""
        head, *lines = ([cell.replace("|", "\\|") for cell in line] for line in self._text())
        return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *lines))

    def to_latex(self) -> str:
        """A ``tabular`` with horizontal lines, for any LaTeX document."""
        head, *lines = ([cell.translate(LATEX) for cell in line] for line in self._text())
        rows = (rf"{' & '.join(line)} \\" for line in lines)
        layout = "".join("r" if self._counts(k) else "l" for k in range(len(head)))
        return "\n".join((rf"\begin{{tabular}}{{{layout}}}", r"\hline", rf"{' & '.join(head)} \\", r"\hline", *rows, r"\hline", r"\end{tabular}"))

    def _repr_html_(self) -> str:
        head, *lines = self._text()
        body = "".join(f"<tr>{_cells('td', line)}</tr>" for line in lines)
        return f"<table><tr>{_cells('th', head)}</tr>{body}</table>"

    def _counts(self, column: int) -> bool:
        """A column has no words."""
        return not any(isinstance(row[column], str) for row in self.rows)

    def _text(self) -> list[list[str]]:
        return [list(self.columns), *([_shown(cell) for cell in row] for row in self.rows)]


def with_sentence(sentence: str, table: Table) -> str:
    """A result as text: its sentence, and its table unless that is empty."""
    return f"{sentence}\n\n{table}" if len(table) else sentence


def _cells(tag: str, line: list[str]) -> str:
    return "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in line)


def _shown(cell: Cell) -> str:
    """Words as they are, numbers with four digits."""
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return "-"
    return cell if isinstance(cell, str) else f"{cell:.4g}"
