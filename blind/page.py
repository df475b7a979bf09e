"""docs/blind.md from what came of the cases."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence

import numpy as np

from blind.cases import EFFECTS, OUTSIDE
from blind.judge import CONFIDENT, Judged

SMALL = {"quarter": "a quarter of the excitation", "tenth": "effects at a tenth of their size", "5 s": "5 s records"}
WORDS = {
    "hard": "hard: mild friction, a 1 um encoder and a tenth of another effect besides",
    "10 s": "10 s records",
    "half": "half the excitation",
    "5 um": "a 5 um encoder (without backlash)",
    "2 effects": "two effects, both named",
    "3 effects": "three effects, all named",
    "multisine": "multisine",
    "sweep": "swept sine",
    "prbs": "PRBS",
    "1 kHz": "1 kHz",
    "5 kHz": "5 kHz",
    **SMALL,
}
REMARKS = "\n## Remarks\n"  # from here on people write, and the command leaves it
GOALS = {"hard": 95, "10 s": 95, "half": 95, "5 um": 95, "2 effects": 90, "3 effects": 75}


def text(results: dict[str, list[Judged]], draws: str, command: str, facts: str) -> str:
    """The whole page."""
    head = [
        "# Blind campaigns",
        "",
        f"Made by `{command}`: machines of `xy_sim` with hidden effects and hidden base parameters, {draws} draws. {facts}",
        "",
        "Development draws (another random stream) were used for tuning; reporting draws never were. A name counts as wrong with "
        f"confidence when it comes first, is not in the truth, and has confidence {CONFIDENT:g} or more. Of several effects, "
        "asymmetric friction counts as Coulomb friction with a constant load, and the other way round: it is one law. "
        "Seconds are of one core's time.",
        "",
    ]
    parts = [*head]
    if "standard" in results:
        parts += _standard(results["standard"])
    others = [name for name in results if name != "standard"]
    if others:
        parts += _others(results, others)
    parts += _misses(results)
    return "\n".join(parts) + "\n"


def with_remarks(made: str, old: str) -> str:
    """The page, with the remarks that people wrote at the end of the old one."""
    _, mark, remarks = old.partition(REMARKS)
    return f"{made}\n{mark.lstrip()}{remarks}" if mark else made


def _standard(items: Sequence[Judged]) -> list[str]:
    one = [item for item in items if item.case.known and item.case.truth]
    clean = [item for item in items if not item.case.truth]
    outside = [item for item in items if not item.case.known]
    rows = [
        "## One effect, 60 s",
        "",
        "| effect | named | held-out error over that of the truth | largest parameter error: median, worst |",
        "|---|---|---|---|",
    ]
    for name in EFFECTS:
        own = [item for item in one if item.case.truth == (name,)]
        ratios = [item.ratio for item in own if item.ratio is not None]
        worst = [max(item.errors.values()) for item in own if item.errors]
        ratio = f"{max(ratios):.3g}{' (innovation over noise)' if name == 'backlash' else ''}" if ratios else "-"
        error = f"{100 * float(np.median(worst)):.2g} %, {100 * max(worst):.2g} %" if worst else "-"
        rows.append(f"| {name} | {sum(item.right for item in own)} of {len(own)} | {ratio} | {error} |")
    inside = [value for item in one for value in item.inside.values()]
    seconds = [item.seconds for item in items]
    counts = Counter(item.case.truth[0] for item in outside if item.wrong)
    rows += [
        "",
        f"- named: {sum(item.right for item in one)} of {len(one)} (goal 99 %, and 9 of 10 for each)",
        f"- false alarms on clean axes: {sum(not item.right for item in clean)} of {len(clean)} (goal 0)",
        f"- outside the library ({', '.join(OUTSIDE)}), wrongly named with confidence: "
        f"{sum(item.wrong for item in outside)} of {len(outside)} (goal 0)" + (f": {dict(counts)}" if counts else ""),
        f"- 95 % intervals that hold the truth: {100 * float(np.mean(inside)):.0f} % of {len(inside)} (goal 90-98 %)" if inside else "",
        f"- time per axis: median {np.median(seconds):.2f} s, worst {max(seconds):.1f} s (goal 1 s, 3 s); worst of those with a known effect "
        f"{max(item.seconds for item in one):.1f} s",
        "",
        *_confusion(items),
    ]
    return rows


def _confusion(items: Sequence[Judged]) -> list[str]:
    table: dict[str, Counter[str]] = defaultdict(Counter)
    for item in items:
        said = item.effects[0] if item.verdict == "missing_effect" and item.effects else item.verdict
        table["+".join(item.case.truth) or "none"][said] += 1
    rows = ["Truth, and what was said first:", "", "| truth | said |", "|---|---|"]
    return [*rows, *(f"| {name} | {', '.join(f'{said} {count}' for said, count in row.most_common())} |" for name, row in table.items()), ""]


def _others(results: dict[str, list[Judged]], names: Sequence[str]) -> list[str]:
    rows = [
        "## Harder, shorter, weaker, several, other signals",
        "",
        "Right: the truth is named first; of several effects, all are named.",
        "",
        "| set | right | goal | named first | all named, of one effect that alone | wrong with confidence | time: median, worst |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in names:
        items = results[name]
        count, seconds = len(items), [item.seconds for item in items]
        right = sum(_hit(item) for item in items)
        goal = f">= {GOALS[name]} %" if name in GOALS else "never wrong with confidence" if name in SMALL else "-"
        rows.append(
            f"| {WORDS.get(name, name)} | {right} of {count} ({100 * right / count:.0f} %) | {goal} | {sum(item.first for item in items)} "
            f"| {sum(item.right for item in items)} | {sum(item.wrong for item in items)} | {np.median(seconds):.2f} s, {max(seconds):.1f} s |"
        )
    return [*rows, ""]


def _hit(item: Judged) -> bool:
    """Right for the set that it is of."""
    return item.right if item.case.group == "standard" or item.case.group.endswith("effects") else item.first


def _misses(results: dict[str, list[Judged]]) -> list[str]:
    lines = [
        f"- {item.case.name}: {item.verdict} {' + '.join(item.effects) or '-'} (confidence {item.confidence:.2f})"
        for items in results.values()
        for item in items
        if not _hit(item)
    ]
    return ["## Every miss", "", *(lines or ["None."])]
