"""python -m campaigns.bench diagnoses: results of ``xy-sysid diagnose`` for every recording of a real machine, each with its own command.

The table is written to docs/real-machines.md. Errors are those of the rigid model and of the final one, in held-out windows.
Seconds are processor time of the full command, with imports and reading.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

from campaigns.bench.recordings import markdown, rows, written
from campaigns.faults.shared import DATA, Shared
from xy_sysid.units import moved

COLUMNS = ("recording", "verdict", "effects", "confidence", "explained", "held-out error, rigid to final", "seconds")


def asked(row: Shared) -> tuple[dict[str, Any] | None, str, float]:
    """The answer of the command (None on failure), its error message, and its processor time, s."""
    before = os.times()
    words = [sys.executable, "-m", "xy_sysid", "diagnose", str(DATA / row.path), *row.options, "--json"]
    said = subprocess.run(words, capture_output=True, text=True, check=False)
    after = os.times()
    seconds = after.children_user + after.children_system - before.children_user - before.children_system
    return json.loads(said.stdout) if said.returncode == 0 else None, said.stderr.strip().replace(f"{DATA}/", ""), seconds


def line(title: str, found: dict[str, Any], seconds: str) -> tuple[str, ...]:
    """The row of one axis."""
    error = found.get("error") or {}
    before, after = error.get("now"), error.get("held_out")
    fell = f"{moved(before, error['unit'])} to {moved(after, error['unit'])}" if before and after else ""
    explained = f"{100.0 * max(1.0 - (after / before) ** 2, 0.0):.1f} %" if before and after and found["effects"] else ""
    sure = ">0.99" if found["confidence"] > 0.99 else f"{found['confidence']:.2f}"
    return title, f"`{found['verdict']}`", ", ".join(found.get("effects", ())), sure, explained, fell, seconds


def main(short: bool = False) -> None:
    """Print the table as Markdown, and write it to the page."""
    lines, refused, why = [], [], []
    for row in rows(short):
        answer, words, seconds = asked(row)
        if answer is None:
            reason = words.removeprefix("xy-sysid: ")
            refused.append(f"- {reason}" if reason.startswith(row.path) else f"- {row.path}: {reason}")
            continue
        for number, (name, found) in enumerate(answer["axes"].items()):
            title = row.path if len(answer["axes"]) == 1 else f"{row.path}, {name}"
            lines.append(line(title, found, f"{seconds:.1f}" if number == 0 else ""))
            if found["verdict"] == "not_enough_data":
                why.append(f"- {title}: {found['sentence'].removeprefix('Not enough data: ')}")
            sys.stderr.write(f"{' | '.join(lines[-1])}\n")
    parts = [markdown(COLUMNS, lines)]
    parts += ["What is missing where there is not enough data:\n\n" + "\n".join(why)] if why else []
    parts += ["Not read as a recording of an axis:\n\n" + "\n".join(refused)] if refused else []
    told = "\n\n".join(parts)
    sys.stdout.write(told + "\n")
    if not short:
        written("diagnoses", told)


if __name__ == "__main__":
    main()
