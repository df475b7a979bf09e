"""The table of docs/search.md, made from the search's criteria: python -m campaigns.documents.search --write"""

from __future__ import annotations

from xy_sysid.hypotheses.criteria import TABLE

BEGIN, END = "<!-- made from xy_sysid/hypotheses/criteria -->\n", "<!-- end -->\n"


def document() -> str:
    """The table, between its marks."""
    rows = (f"| {row.name} | {row.value:.6g} | {row.unit} | {row.because} |\n" for row in TABLE)
    return "".join((BEGIN, "| name | value | unit | because |\n|---|---|---|---|\n", *rows, END))


def with_table(page: str) -> str:
    """A page with its table replaced by the current one."""
    before, _, rest = page.partition(BEGIN)
    return before + document() + rest.partition(END)[2]


if __name__ == "__main__":
    import sys
    from pathlib import Path

    if sys.argv[1:] == ["--write"]:
        path = Path("docs/search.md")
        path.write_text(with_table(path.read_text(encoding="utf-8")), encoding="utf-8")
    else:
        sys.stdout.write(document())
