"""python -m campaigns.bench settle: pairs of effects that one recording does not distinguish, and experiments that do.

Each pair is simulated with either effect true. A short recording comes first. Then at most two designed experiments with 60 s of motion in total
are run on the machine. For comparison one experiment of each method is run for 60 s: the designed one, the D-optimal one and broadband
noise, all chosen with the same knowledge. The needed seconds are those from its start that settle the case together with the first recording.
Every case is a line of build/settle.jsonl, and the table is made from all lines there, so a stopped campaign can continue.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from campaigns.bench.settle_pairs import PAIRS, Pair, Rig, carry_out, first_recording, left_limits, limits, machine
from xy_sysid.axis.model import STANDARD
from xy_sysid.experiment_design.beliefs import Belief
from xy_sysid.experiment_design.criteria import FITTED
from xy_sysid.experiment_design.design import judge
from xy_sysid.experiment_design.experiment import Experiment
from xy_sysid.experiment_design.limits import MachineLimits
from xy_sysid.experiment_design.loop import Budget, Choose, Decision, Ending, NextChoice, Question, Signals, after, best_design, decide
from xy_sysid.experiment_design.precision import Information, informations
from xy_sysid.experiment_design.prediction import Setting
from xy_sysid.experiment_design.proposals import neighbours, proposals

PLACE = Path(os.environ.get("SETTLE_FILE", "build/settle.jsonl"))
SEEDS = range(101, 102)  # never used to choose a number
MOST = 60.0  # s of motion
DRAWS = 4  # draws of the parameters of each set
PARTS = (2.0, 4.0, 8.0, 16.0, 32.0, MOST)  # s of an experiment, from its start
COLUMNS = (
    "pair",
    "one recording settles",
    "right before",
    "settled",
    "right after",
    "seconds",
    "needed: designed",
    "needed: D-optimal",
    "needed: noise",
)


def noise(setting: Setting, beliefs: Sequence[Belief], asked: MachineLimits) -> NextChoice:
    """Broadband noise, as strong as the limits allow under the present knowledge."""
    for item in proposals(asked, setting.layout.sampling_rate):
        told = item.excitation
        broadband = told.kind == "noise" and told.slow == 0.0 and told.low == 0.1 and told.high > 50.0
        if broadband and not judge(setting, beliefs, asked, 1, 1, item).broken:
            return NextChoice(item)
    return NextChoice(None)


def volume(belief: Belief, found: Sequence[Information], seconds: float) -> float:
    """Logarithm of the volume of the parameters' confidence region after an experiment (D-optimality), mean over draws."""
    return float(np.mean([-0.5 * np.linalg.slogdet(belief.precision + FITTED * seconds * item.each_second)[1] for item in found]))


def d_optimal(setting: Setting, beliefs: Sequence[Belief], asked: MachineLimits) -> NextChoice:
    """The D-optimal experiment for the parameters of all sets together, from the same candidates as ``design``."""
    rate = setting.layout.sampling_rate

    def total(item: Experiment) -> float:
        found = [(belief, informations(setting, belief, asked, item, draws=1)) for belief in beliefs]
        return sum(volume(belief, told, 10.0) if told else math.inf for belief, told in found)

    judged = [(total(item), number, item) for number, item in enumerate(proposals(asked, rate))]
    best = min(judged)
    if not math.isfinite(best[0]):
        return NextChoice(None)
    near = [(total(item), -1 - number, item) for number, item in enumerate(neighbours(best[2], asked, rate))]
    return NextChoice(min([best, *near])[2])


CarryOut = Callable[[Experiment], Signals | None]  # runs an experiment; None if it was stopped


@dataclass(frozen=True)
class Settled:
    """ended: reason; steps: decision after the first recordings and after each experiment; recordings: of the experiments; seconds: of motion."""

    ended: Ending
    steps: tuple[Decision, ...]
    recordings: tuple[Signals, ...]
    seconds: float

    @property
    def effects(self) -> tuple[str, ...]:
        """The set that explains all recordings best."""
        return self.steps[-1].chosen


def settle(question: Question, asked: MachineLimits, run: CarryOut, budget: Budget | None = None, choose: Choose = best_design) -> Settled:
    """Decide and run experiments until one set remains, no experiment helps, or the budget is used up."""
    budget = budget or Budget()
    recordings: list[Signals] = []
    steps: list[Decision] = []
    spent = 0.0
    while True:
        steps.append(decide(question, recordings, asked, choose, steps[-1].standing if steps else None, budget.draws))
        following = after(steps[-1], budget, len(recordings), spent)
        if isinstance(following, str):
            return Settled(following, tuple(steps), tuple(recordings), spent)
        found = run(following)
        if found is None:
            return Settled("stopped", tuple(steps), tuple(recordings), spent)
        recordings.append(found)
        spent += following.seconds


QUICK = 5  # index of the fastest pair
WAYS: dict[str, Choose] = {"designed": best_design, "d_optimal": d_optimal, "noise": noise}


def case(pair: Pair, truth: int, seed: int) -> dict[str, Any]:
    """One draw of one pair with designed experiments."""
    made, asked = machine(pair, truth, seed), limits(pair)
    told: list[str] = []

    def run(experiment: Experiment) -> Signals:
        told.append(f"{experiment.words}, {experiment.seconds:.0f} s")
        return carry_out(made, experiment)

    begun = time.process_time()
    found = settle(_question(pair, made, seed), asked, run, Budget(experiments=2, seconds=MOST, draws=DRAWS), best_design)
    return {
        "pair": pair.name,
        "truth": truth,
        "seed": seed,
        "first_right": found.steps[0].chosen == pair.sets[truth],
        "first_left": len(found.steps[0].left),
        "first_settled": len(found.steps[0].left) == 1 and found.steps[0].chosen == pair.sets[truth],
        "right": found.effects == pair.sets[truth],
        "ended": found.ended,
        "seconds": found.seconds,
        "experiments": told,
        "runs": len(found.recordings),
        "outside": left_limits(pair, found.recordings),
        "processor": time.process_time() - begun,
    }


def compared(pair: Pair, truth: int, seed: int) -> dict[str, Any]:
    """The experiment of each method, and the seconds that it needs (None if it does not settle the case)."""
    made, asked = machine(pair, truth, seed), limits(pair)
    question = _question(pair, made, seed)
    chosen: dict[str, NextChoice] = {}

    def all_ways(setting: Setting, beliefs: Sequence[Belief], among: MachineLimits) -> NextChoice:
        chosen.update({name: choose(setting, beliefs, among) for name, choose in WAYS.items()})
        return NextChoice(None)

    first = decide(question, (), asked, all_ways, draws=DRAWS)
    line: dict[str, Any] = {}
    for name, choice in chosen.items():
        if choice.experiment is None:
            line[name] = {"needed": None, "experiment": "", "outside": 0}
            continue
        voltage, position = carry_out(made, choice.experiment.lasting(MOST))
        needed = None
        for part in PARTS:
            count = round(part * made.rate)
            then = decide(question, [(voltage[:count], position[:count])], asked, lambda *_: NextChoice(None), first.standing, DRAWS)
            if then.left == (pair.sets[truth],):
                needed = part
                break
        line[name] = {"needed": needed, "experiment": choice.experiment.words, "outside": left_limits(pair, [(voltage, position)])}
    return line


def _question(pair: Pair, made: Rig, seed: int) -> Question:
    return Question(made.rate, [first_recording(pair, made, seed)], pair.sets, STANDARD)


def table(lines: Sequence[dict[str, Any]]) -> str:
    """All lines as Markdown."""
    rows = [f"| {' | '.join(COLUMNS)} |", "|" + "---|" * len(COLUMNS)]
    names = list(dict.fromkeys(line["pair"] for line in lines))
    for name in [*names, "all"]:
        own = [line for line in lines if name in ("all", line["pair"])]
        count = len(own)
        good = [line for line in own if line["ended"] in ("settled", "alike") and line["right"]]
        seconds = sorted(line["seconds"] for line in own if line["seconds"] > 0.0)
        parts = [f"{sum(bool(line[key]) for line in own)} of {count}" for key in ("first_settled", "first_right", "right")]
        middle = f"{seconds[len(seconds) // 2]:.0f}" if seconds else "-"
        cells = [name, parts[0], parts[1], f"{len(good)} of {count}", parts[2], middle, *(_needed(own, way, name == "all") for way in WAYS)]
        rows.append(f"| {' | '.join(cells)} |")
    ways = [line["ways"] for line in lines if "ways" in line]
    runs = sum(line["runs"] for line in lines) + sum(bool(way["experiment"]) for each in ways for way in each.values())
    left = sum(line["outside"] for line in lines) + sum(way["outside"] for each in ways for way in each.values())
    rows.append("")
    rows.append(f"Experiments that were run: {runs}; that left a limit: {left}.")
    return "\n".join(rows)


def _needed(lines: Sequence[dict[str, Any]], way: str, together: bool) -> str:
    """Seconds of each case, or the sum of all, in which an unsettled case counts as 60 s."""
    own = [line["ways"][way]["needed"] for line in lines if "ways" in line]
    if not own:
        return "-"
    if together:
        return f"{sum(MOST if item is None else item for item in own):.0f} s in all, {sum(item is None for item in own)} of {len(own)} open"
    return ", ".join(f"> {MOST:.0f}" if item is None else f"{item:.0f}" for item in own)


def main(short: bool = False) -> None:
    """Run the cases that are not in the file yet, and print the table."""
    PLACE.parent.mkdir(exist_ok=True)
    seeds = [int(word) for word in os.environ.get("SETTLE_SEEDS", "").split(",") if word] or list(SEEDS)
    done = [json.loads(text) for text in PLACE.read_text(encoding="utf-8").splitlines()] if PLACE.exists() and not short else []
    known = {(line["pair"], line["truth"], line["seed"]) for line in done}
    for seed in seeds[: 1 if short else None]:
        for pair in PAIRS[QUICK : QUICK + 1] if short else PAIRS:
            for truth in (1,) if short else (0, 1):
                if (pair.name, truth, seed) not in known:
                    done.append(case(pair, truth, seed))
                    sys.stderr.write(json.dumps(done[-1]) + "\n")
                    _keep(done, short)
    for line in () if short else done:
        if "ways" not in line and line["first_left"] > 1:
            line["ways"] = compared(next(pair for pair in PAIRS if pair.name == line["pair"]), line["truth"], line["seed"])
            sys.stderr.write(json.dumps(line) + "\n")
            _keep(done, short)
    sys.stdout.write(table(done) + "\n")


def _keep(done: Sequence[dict[str, Any]], short: bool) -> None:
    if not short:
        PLACE.write_text("".join(json.dumps(one) + "\n" for one in done), encoding="utf-8")


if __name__ == "__main__":
    main()
