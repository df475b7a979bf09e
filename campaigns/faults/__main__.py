"""python -m campaigns.faults [GROUP ...] [--short] [-o FILE]: run all attacks, and write docs/faults.md; exit code 1 if one finds a fault.

Without a name, all groups; soak has its own options: python -m campaigns.faults soak --help.
"""

from __future__ import annotations

import argparse
import importlib
import os
import signal
import sys
import tempfile
import time
from pathlib import Path

from campaigns.facts import facts
from campaigns.faults.groups import GROUPS

PAGE = Path(__file__).parents[2] / "docs" / "faults.md"


def main() -> int:
    """Run the requested groups; the page is written after every attack."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # started in the background: the attacked commands would ignore Ctrl-C
        signal.signal(signal.SIGINT, signal.default_int_handler)
    for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(threads, "1")
    if sys.argv[1:2] == ["soak"]:
        from campaigns.faults import soak

        return soak.main(sys.argv[2:])
    from campaigns.faults.attack import attacked
    from campaigns.faults.report import section, text

    parser = argparse.ArgumentParser(prog="faults", description="attack everything, and say what came of it")
    parser.add_argument("groups", nargs="*", help=f"which of {', '.join(GROUPS)}; without a name all")
    parser.add_argument("--short", action="store_true", help="a few of each; nothing is written unless -o says where")
    parser.add_argument("--only", default="", metavar="WORDS", help="attacks whose name has these words; nothing is written unless -o says where")
    parser.add_argument("-o", type=Path, default=None, metavar="FILE", help="page to write (docs/faults.md)")
    asked = parser.parse_args()
    for name in asked.groups:
        if name not in GROUPS:
            parser.error(f"{name!r} is not a group; there are {', '.join(GROUPS)}, and soak")
    page = asked.o or (None if asked.short or asked.only else PAGE)
    titles = [*GROUPS.values(), "Soak"]
    machine = facts()
    holes = 0
    for name in asked.groups or GROUPS:
        module = importlib.import_module(f"campaigns.faults.{name}")
        rows = []
        for number, attack in enumerate(module.ATTACKS):
            if asked.only not in attack.name or (asked.short and not attack.short):
                continue
            begun = time.monotonic()
            with tempfile.TemporaryDirectory(prefix="faults_") as folder:
                row = attacked(attack, Path(folder) / str(number), asked.short)
            rows.append(row)
            holes += not row.holds
            counts = ", ".join(f"{count} {outcome}" for outcome, count in row.counts.items())
            sys.stderr.write(f"{'holds' if row.holds else 'HOLE '} {name}: {row.name}: {counts}, {time.monotonic() - begun:.1f} s\n")
            sys.stderr.writelines(f"      {bad}\n" for bad in row.bad[:12])
            if page is not None:
                before = page.read_text(encoding="utf-8") if page.exists() else ""
                page.write_text(text({GROUPS[name]: section(GROUPS[name], module.WORDS, rows)}, before, titles, machine), encoding="utf-8")
    sys.stderr.write("no hole\n" if not holes else f"{holes} rows are holes\n")
    return 1 if holes else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
