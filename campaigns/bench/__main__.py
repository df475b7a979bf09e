"""python -m campaigns.bench [--short] [name ...]: run the benchmarks and write docs/benchmarks.md.

Without a name: h1, frf, fit, replay, bags, live and intervals. Only by name:
    long_bag (a day of data, gigabytes on disk), axis_model, settle, settle_limits, settle_precision,
    use (a path after a minute of identification: half an hour), fleet (a year of 20 machines), trend
    real_fits, peers, diagnoses, emps_force, next_part: with the recordings of real machines in $XY_SYSID_DATA
peers and diagnoses write their tables to docs/real-machines.md, use and emps_force to docs/use.md.
--short: a small part of each, as in the tests; nothing is written.
"""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path

from campaigns.bench.tables import Table
from campaigns.facts import facts

TABLES = ("h1", "frf", "fit", "replay", "bags", "live", "intervals")
SCRIPTS = (
    "long_bag",
    "axis_model",
    "real_fits",
    "peers",
    "diagnoses",
    "settle",
    "settle_limits",
    "settle_precision",
    "use",
    "emps_force",
    "next_part",
    "fleet",
    "fleet_scale",
    "trend",
)
PACKAGES = ("numpy", "scipy", "numba", "rosbags", "scikit-rf", "pyFRF")
PAGE = Path(__file__).parents[2] / "docs" / "benchmarks.md"


def text(name: str, table: Table) -> str:
    """One benchmark as Markdown."""
    lines = [f"## {table.title}", "", f"`python -m campaigns.bench {name}`", "", table.text.strip(), ""]
    lines += [f"| {' | '.join(table.columns)} |", "|" + "---|" * len(table.columns), *(f"| {' | '.join(row)} |" for row in table.rows), ""]
    lines += ["| figure | measured | goal | met |", "|---|---|---|---|"]
    lines += [f"| {c.what} | {c.measured} | {c.goal} | {'-' if c.met is None else 'yes' if c.met else 'no'} |" for c in table.checks]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Run the requested benchmarks; the page is written after all have run."""
    for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):  # before numpy is imported: one core for all software
        os.environ.setdefault(threads, "1")
    asked = [word for word in sys.argv[1:] if word != "--short"]
    short = len(asked) < len(sys.argv) - 1
    unknown = [name for name in asked if name not in (*TABLES, *SCRIPTS)]
    if unknown:
        sys.stderr.write(f"bench: {unknown[0]} is not a benchmark; there are {', '.join((*TABLES, *SCRIPTS))}\n")
        return 2
    parts = []
    for name in asked or TABLES:
        if name in SCRIPTS:
            sys.argv = [name]
            importlib.import_module(f"campaigns.bench.{name}").main(short)
            continue
        table: Table = importlib.import_module(f"campaigns.bench.{name}").run(lambda line: sys.stderr.write(line + "\n"), short)
        parts.append(text(name, table))
        sys.stdout.write(parts[-1] + "\n")
        sys.stdout.flush()
    if not asked and not short:
        head = f"# Benchmarks\n\nMade by `make bench`; every ratio is from one run. {facts(*PACKAGES)}\n"
        PAGE.write_text("\n".join([head, *parts]), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
