"""python -m campaigns.bench settle: pairs of effects that one recording does not distinguish, and the experiments that do.

Each pair is drawn with either effect true. A short recording comes first. Then at most two designed experiments with 60 s of motion in all
are run on the machine; for comparison the same seconds of broadband noise, and of a D-optimal experiment. Every case is a line of
build/settle.jsonl, and the table is made from all lines there: a campaign that was stopped goes on.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from campaigns.bench.settle_pairs import PAIRS, Pair, carry_out, first_recording, left_limits, limits, machine
from xy_sysid.axis.model import STANDARD
from xy_sysid.experiment_design.beliefs import Belief
from xy_sysid.experiment_design.design import judge
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.loop import Budget, Choice, Choose, Question, Signals, best_design, settle
from xy_sysid.experiment_design.precision import informations, volume
from xy_sysid.experiment_design.prediction import Setting
from xy_sysid.experiment_design.proposals import proposals

PLACE = Path(os.environ.get("SETTLE_FILE", "build/settle.jsonl"))
SEEDS = range(101, 102)  # never used to choose a number
MOST = 60.0  # s of motion
DRAWS = 4  # of the parameters of each set
COLUMNS = (
    "pair",
    "one recording settles",
    "right before",
    "settled",
    "right after",
    "seconds",
    "noise",
    "D-optimal",
    "noise, 60 s",
    "D-optimal, 60 s",
)


def noise(setting: Setting, beliefs: Sequence[Belief], asked: MachineLimits) -> Choice:
    """Broadband noise, as loud as the limits allow for what is believed."""
    for item in proposals(asked, setting.layout.sampling_rate):
        told = item.excitation
        broadband = told.kind == "noise" and told.slow == 0.0 and told.low == 0.1 and told.high > 50.0
        if broadband and not judge(setting, beliefs, asked, item).broken:
            return Choice(item)
    return Choice(None)


def d_optimal(setting: Setting, beliefs: Sequence[Belief], asked: MachineLimits) -> Choice:
    """The experiment that makes the parameters of all sets known best, together."""
    best: tuple[float, Experiment] | None = None
    for item in proposals(asked, setting.layout.sampling_rate):
        total = 0.0
        for belief in beliefs:
            found = informations(setting, belief, asked, item, draws=1)
            total += volume(belief, found, 10.0) if found else math.inf
        if math.isfinite(total) and (best is None or total < best[0]):
            best = (total, item)
    return Choice(None if best is None else best[1])


QUICK = 5  # place of the pair that takes least time
WAYS = {"noise": noise, "d_optimal": d_optimal}


def case(pair: Pair, truth: int, seed: int, short: bool = False) -> dict[str, Any]:
    """One draw of one pair, with all three ways to choose experiments."""
    made, asked = machine(pair, truth, seed), limits(pair)
    first = first_recording(pair, made, seed)
    question = Question(made.rate, [first], pair.sets, STANDARD)
    told: list[str] = []

    def run(experiment: Experiment) -> Signals:
        told.append(f"{experiment.words}, {experiment.seconds:.0f} s")
        return carry_out(made, experiment)

    begun = time.process_time()
    found = settle(question, asked, run, Budget(experiments=2, seconds=MOST, draws=DRAWS), best_design)
    line: dict[str, Any] = {
        "pair": pair.name,
        "truth": truth,
        "seed": seed,
        "first_right": found.steps[0].standing.chosen == truth,
        "first_left": len(found.steps[0].left),
        "first_settled": len(found.steps[0].left) == 1 and found.steps[0].standing.chosen == truth,
        "right": found.effects == pair.sets[truth],
        "ended": found.ended,
        "seconds": found.seconds,
        "experiments": told,
        "runs": len(found.recordings),
        "outside": left_limits(pair, found.recordings),
        "processor": time.process_time() - begun,
    }
    for name, choose in () if short or not found.recordings else WAYS.items():
        line[name] = _other(pair, (truth, seed), choose, found.seconds)
    return line


def longer(line: dict[str, Any]) -> bool:
    """Give the other ways all the seconds where they did not settle a case that the designed experiments settled; whether there was one."""
    pair = next(pair for pair in PAIRS if pair.name == line["pair"])
    ways = [way for way in WAYS if line["ended"] == "settled" and way in line and not line[way]["settled"] and "longer" not in line[way]]
    for way in ways:
        line[way]["longer"] = _other(pair, (line["truth"], line["seed"]), WAYS[way], MOST)
    return bool(ways)


def _other(pair: Pair, draw: tuple[int, int], choose: Choose, seconds: float) -> dict[str, Any]:
    """Whether one experiment that is chosen in another way settles a case in some seconds."""
    made, asked = machine(pair, *draw), limits(pair)
    question = Question(made.rate, [first_recording(pair, made, draw[1])], pair.sets, STANDARD)

    def chosen(setting: Setting, beliefs: Sequence[Belief], among: MachineLimits) -> Choice:
        item = choose(setting, beliefs, among).experiment
        return Choice(None if item is None else item.lasting(seconds))

    found = settle(question, asked, lambda item: carry_out(made, item), Budget(experiments=1, seconds=seconds, draws=DRAWS), chosen)
    right = found.effects == pair.sets[draw[0]]
    return {"settled": right and found.ended == "settled", "right": right, "outside": left_limits(pair, found.recordings)}


def table(lines: Sequence[dict[str, Any]]) -> str:
    """All lines as Markdown."""
    rows = [f"| {' | '.join(COLUMNS)} |", "|" + "---|" * len(COLUMNS)]
    names = list(dict.fromkeys(line["pair"] for line in lines))
    for name in [*names, "all"]:
        own = [line for line in lines if name in ("all", line["pair"])]
        count = len(own)

        def part(key: str, own: Sequence[dict[str, Any]] = own) -> str:
            return f"{sum(bool(line[key]) for line in own)} of {len(own)}"

        good = [line for line in own if line["ended"] == "settled" and line["right"]]
        compared = [line for line in own if "noise" in line]
        seconds = sorted(line["seconds"] for line in own if line["seconds"] > 0.0)
        middle = f"{seconds[len(seconds) // 2]:.0f}" if seconds else "-"
        cells = [name, part("first_settled"), part("first_right"), f"{len(good)} of {count}", part("right"), middle]
        cells += [f"{sum(line[way]['settled'] for line in compared)} of {len(compared)}" for way in ("noise", "d_optimal")]
        for way in ("noise", "d_optimal"):
            late = [line for line in compared if line[way]["settled"] or line[way].get("longer", {}).get("settled")]
            cells.append(f"{len(late)} of {len(compared)}")
        rows.append(f"| {' | '.join(cells)} |")
    runs = sum(line["runs"] for line in lines)
    rows.append("")
    rows.append(f"Designed experiments that were run: {runs}; that left a limit: {sum(line['outside'] for line in lines)}.")
    return "\n".join(rows)


def main(short: bool = False) -> None:
    """Run what is not in the file yet, and print the table."""
    PLACE.parent.mkdir(exist_ok=True)
    seeds = [int(word) for word in os.environ.get("SETTLE_SEEDS", "").split(",") if word] or list(SEEDS)
    done = [json.loads(text) for text in PLACE.read_text(encoding="utf-8").splitlines()] if PLACE.exists() and not short else []
    known = {(line["pair"], line["truth"], line["seed"]) for line in done}
    for seed in seeds[: 1 if short else None]:
        for pair in PAIRS[QUICK : QUICK + 1] if short else PAIRS:
            for truth in (1,) if short else (0, 1):
                if (pair.name, truth, seed) in known:
                    continue
                line = case(pair, truth, seed, short)
                done.append(line)
                sys.stderr.write(json.dumps(line) + "\n")
                if not short:
                    with PLACE.open("a", encoding="utf-8") as file:
                        file.write(json.dumps(line) + "\n")
    for line in () if short else done:
        if longer(line):
            sys.stderr.write(json.dumps(line) + "\n")
            PLACE.write_text("".join(json.dumps(one) + "\n" for one in done), encoding="utf-8")
    sys.stdout.write(table(done) + "\n")


if __name__ == "__main__":
    main()
