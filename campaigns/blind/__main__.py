"""python -m campaigns.blind [SET ...] [OPTION ...]: hidden effects, and how often the diagnosis is right; --help lists the options.

Sets: exact, imperfect 0.2 %, imperfect 1 %, imperfect 3 %, clean dirt, outside, hard, two effects, three effects, first order,
1 % two effects, 10 s, half, 5 um, quarter, tenth, 5 s, multisine, sweep, prbs, 1 kHz, 5 kHz;
of MuJoCo (extra mujoco): foreign axes, foreign axes, closed loop, foreign joints.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from campaigns.facts import facts

PAGE = Path(__file__).parents[2] / "docs" / "blind.md"


def main() -> int:
    """Run the requested sets; the page is written after every set."""
    for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):  # before numpy is imported: one core each
        os.environ.setdefault(threads, "1")
    import joblib

    from campaigns.blind.cases import Case, sets
    from campaigns.blind.foreign import Foreign, foreign, judged
    from campaigns.blind.judge import Judged
    from campaigns.blind.page import text, with_remarks
    from campaigns.blind.store import add, load

    parser = argparse.ArgumentParser(prog="blind", description="hidden effects on simulated machines, and how often the diagnosis is right")
    parser.add_argument("sets", nargs="*", help="which; without a name all")
    parser.add_argument("--draws", choices=("development", "reporting"), default="reporting", help="tune on development draws only")
    parser.add_argument("--part", type=int, default=1, metavar="N", help="every Nth case of each set")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="begin at the Kth case of each set, counted from 0")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="cases at a time, one core each")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="what came of each case; those in it already are not run again")
    parser.add_argument("--recordings", type=Path, metavar="DIR", help="keep what was simulated there, and take it from there the next time")
    parser.add_argument("-o", type=Path, default=PAGE, metavar="FILE", help="page to write (docs/blind.md)")
    asked = parser.parse_args()
    known: dict[str, list[Case | Foreign]] = {name: list(cases) for part in (sets(asked.draws), foreign(asked.draws)) for name, cases in part.items()}
    if asked.part < 1 or asked.first < 0:
        parser.error(f"--part {asked.part} --first {asked.first}: the one is at least 1, the other at least 0")
    for name in asked.sets:
        if name not in known:
            parser.error(f"{name!r} is not a set; there are {', '.join(known)}")
    results: dict[str, list[Judged]] = {}
    known_already = load(asked.keep) if asked.keep else {}
    command = " ".join(
        [
            "python -m campaigns.blind",
            *(repr(name) for name in asked.sets),
            *([f"--part {asked.part}"] if asked.part > 1 else []),
            *([f"--first {asked.first}"] if asked.first else []),
        ]
    )
    machine = facts()
    try:
        for name in asked.sets or known:
            cases = known[name][asked.first :: asked.part]
            results[name] = [known_already[case] for case in cases if case in known_already]
            left = [case for case in cases if case not in known_already]
            for item in joblib.Parallel(asked.jobs, return_as="generator_unordered")(joblib.delayed(judged)(case, asked.recordings) for case in left):
                results[name].append(item)
                if asked.keep:
                    add(asked.keep, item)
                said = " + ".join(item.effects) or item.verdict
                good = "right" if item.right else "first" if item.first else "WRONG" if item.wrong else "missed"
                good += f" PHANTOM {'+'.join(item.phantoms)}" if item.phantom else ""
                sys.stderr.write(f"{good:6} {item.case.name}: {said} ({item.confidence:.2f}), {item.seconds:.1f} s\n")
            results[name].sort(key=lambda item: cases.index(item.case))
            before = asked.o.read_text(encoding="utf-8") if asked.o.exists() else ""
            asked.o.write_text(with_remarks(text(results, asked.draws, command, machine), before), encoding="utf-8")
    except KeyboardInterrupt:
        return 130
    sys.stderr.write(f"{asked.o} written\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
