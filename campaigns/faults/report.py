"""docs/faults.md from the outcomes of the attacks; a group that was not run keeps its old section."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from campaigns.faults.attack import GOOD, Row

ORDER = (*GOOD, "skipped", "silent", "traceback", "too late", "stump", "not told")
HEAD = """# Faults

Made by `make faults` (`python -m campaigns.faults`): attacks with fixed seeds on all parts that drive a machine, store data or answer a network.
`python -m campaigns.faults --short` is the short campaign that `make test` runs.

Acceptable outcomes: **full** (everything is right), **part-and-said** (a part is missing, the rest is right, and a message says so),
**one line** (refused in one clear line), **zero volts** (the machine stands within the bound), **no sum** (a number changed in a
format without checksum: [files](files.md#damaged-and-hostile-files) says so). Any other outcome is a fault, and the campaign ends
with exit code 1. Seconds are the longest of all tries.
"""
FACTS = "Run on "


def section(title: str, words: str, rows: Sequence[Row]) -> str:
    """One group as Markdown."""
    lines = [f"## {title}", "", words, "", "| attack | tries | outcome | longest | travel | bound |", "|---|---|---|---|---|---|"]
    for row in rows:
        outcome = ", ".join(f"{row.counts[name]} {name}" for name in ORDER if row.counts[name])
        bad = f" **{row.bad[0][:300]}**" if row.bad else ""
        longest = f"{row.seconds:.2g} s" if row.seconds else "-"
        travel = f"{1000 * row.travel:.1f} mm" if row.travel else "-"
        lines.append(f"| {row.name} | {sum(row.counts.values())} | {outcome or 'nothing tried'}{bad} | {longest} | {travel} | {row.bound or '-'} |")
    notes = [f"- {row.name}: {note}" for row in rows for note in dict.fromkeys(row.notes)]
    return "\n".join([*lines, *([""] if notes else []), *notes]).replace("\r", "") + "\n"


def text(sections: Mapping[str, str], before: str, order: Sequence[str], facts: str) -> str:
    """The full page: new sections replace old ones of the same title."""
    old = {part.partition("\n")[0].strip(): f"## {part.rstrip()}\n" for part in re.split(r"^## ", before, flags=re.MULTILINE)[1:]}
    found = {**old, **sections}
    kept = [found[title] for title in order if title in found]
    return "\n".join([HEAD, f"{FACTS}{facts}\n", *kept])
