"""docs/blind.md from the results of the cases."""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from campaigns.blind.cases import EFFECTS
from campaigns.blind.judge import CONFIDENT, FAINT, Judged

WORDS = {
    "imperfect 0.2 %": "dirt that changes the motion by 0.2 %",
    "imperfect 1 %": "dirt, 1 %",
    "imperfect 3 %": "dirt, 3 %",
    "clean dirt": "no effect, dirt of 0.2, 1 and 3 %",
    "outside": "outside the library, without dirt and with 0.2, 1 and 3 %",
    "further laws": "laws that the other sets do not draw, one effect",
    "hard": "mild friction, a 1 um encoder and a tenth of another effect",
    "two effects": "all named",
    "three effects": "all named",
    "first order": "stops and contacts resolved to 25 us only",
    "1 % two effects": "two effects with 1 % of dirt, all named",
    "10 s": "10 s records",
    "half": "half the excitation",
    "5 um": "a 5 um encoder (without backlash)",
    "quarter": "a quarter of the excitation",
    "tenth": "effects at a tenth of their size",
    "5 s": "5 s records",
    "sweep": "swept sine",
    "foreign axes": "motors of MuJoCo: 14 kinds, driven with noise",
    "foreign axes, closed loop": "the same under a position controller",
    "foreign joints": "robot joints of MuJoCo, current to angle, along slow paths",
    "prbs": "PRBS",
}
REMARKS = "\n## Remarks\n"  # the text from here on is written by people, and kept
GOALS = {
    "imperfect 0.2 %": 97,
    "imperfect 1 %": 95,
    "imperfect 3 %": 90,
    "hard": 97,
    "two effects": 97,
    "three effects": 85,
    "foreign axes": 95,
    "foreign axes, closed loop": 95,
    "foreign joints": 95,
}  # % right
BINS = (0.0, 0.3, 0.5, 0.7, 0.9, 0.99, 1.0)  # of confidence; the last one is closed


def text(results: dict[str, list[Judged]], draws: str, command: str, facts: str) -> str:
    """The full page."""
    head = [
        "# Blind campaigns",
        "",
        f"Made by `{command}`: machines of `xy_sim` with hidden effects and hidden base parameters, {draws} draws. {facts}",
        "",
        "Development draws (another random stream) were used for tuning; reporting draws never were.",
        "",
        "- **Dirt**: three to five small imperfections of a real machine ([machines](machines.md#what-is-simulated); quadratic drag counts as "
        "one), scaled together to a fraction of the motion.",
        "- **Right**: the true effect is named first (`hard`: anywhere in the list; several effects: all of them). For a clean axis: "
        f"nothing is missing. For dirt alone and for effects outside the library: no effect is named with confidence {CONFIDENT:g} or more.",
        f"- **Phantom**: an effect that the axis does not have is named with confidence {CONFIDENT:g} or more, alone or together with the true one.",
        f"- **Wrong**: the first name is not one of the true effects, with confidence {CONFIDENT:g} or more.",
        f"- **Unseen**: an effect changes the motion by less than {100 * FAINT:.0f} % of the change by noise and dirt, and by less than the answer "
        "says could be hidden. It need not be named: the answer is right if all other effects are, and nothing that the axis does not have.",
        "- **Hidden**: an effect changes the motion as little as that, but the answer is not right, or does not say that an effect of this size "
        "could be hidden.",
        "- Effects are compared by their laws: asymmetric friction counts as Coulomb friction with a constant load, and every dry friction that "
        "slides contains Coulomb friction.",
        "- Seconds are processor time.",
        "",
    ]
    parts = [*head, *_table(results), *_reliability(results)]
    if "exact" in results:
        parts += _standard(results["exact"])
    parts += _phantoms(results) + _misses(results)
    return "\n".join(parts) + "\n"


def _rows(results: dict[str, list[Judged]]) -> Iterator[tuple[str, str, list[Judged]]]:
    """Name, goal and axes of each row; the exact set is three."""
    for name, items in results.items():
        if name == "exact":
            yield "exact: one effect", ">= 149 of 150", [item for item in items if item.case.known and item.case.truth]
            yield "exact: no effect", "all", [item for item in items if not item.case.truth]
            yield "exact: outside the library", "all", [item for item in items if not item.case.known]
        else:
            goal = f">= {GOALS[name]} %" if name in GOALS else "all" if name in ("clean dirt", "outside") else "-"
            yield f"`{name}`: {WORDS[name]}" if name in WORDS else f"`{name}`", goal, items


def _table(results: dict[str, list[Judged]]) -> list[str]:
    rows = [
        "| set | right | of these unseen | goal | right and named first | phantoms | wrong | hidden | intervals that contain the true value "
        "| time: median, worst |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    every = [item for items in results.values() for item in items]
    for name, goal, items in [*_rows(results), ("**all**", "phantoms and wrong <= 1 %", every)]:
        if not items:
            continue
        count, right = len(items), [item for item in items if hit(item)]
        inside = [value for item in items for value in item.inside.values()]
        seconds = [item.seconds for item in items]
        rows.append(
            f"| {name} | {len(right)} of {count} ({100 * len(right) / count:.0f} %) | {sum(bool(item.unseen) for item in right)} | {goal} "
            f"| {sum(item.first for item in right)} "
            f"| {_part(sum(item.phantom for item in items), count)} | {_part(sum(item.wrong for item in items), count)} "
            f"| {sum(item.hidden and not hit(item) for item in items)} "
            f"| {f'{100 * float(np.mean(inside)):.0f} % of {len(inside)}' if inside else '-'} | {np.median(seconds):.2f} s, {max(seconds):.1f} s |"
        )
    return [*rows, "", "Goals: intervals 90 to 98 %; time median 1 s exact, 2 s with dirt, worst 10 s.", ""]


def _part(some: int, count: int) -> str:
    return f"{some} ({100 * some / count:.1f} %)" if some else "0"


def _reliability(results: dict[str, list[Judged]]) -> list[str]:
    """Is the confidence correct?"""
    every = [item for items in results.values() for item in items if item.verdict != "not_enough_data"]
    rows = [
        "## Is the confidence correct?",
        "",
        f"All sets; verdicts that are right and without a phantom, by their confidence (goal: 95 % from {CONFIDENT:g} on).",
        "",
        "| confidence | verdicts | right | mean confidence |",
        "|---|---|---|---|",
    ]
    ends = [*itertools.pairwise(BINS), (CONFIDENT, 1.0)]
    for low, high in ends:
        inside = [item for item in every if low <= item.confidence < high or (high == 1.0 and item.confidence >= high)]
        if inside:
            good = sum(hit(item) and not item.phantoms for item in inside)
            mean = float(np.mean([item.confidence for item in inside]))
            rows.append(f"| {low:g} to {high:g} | {len(inside)} | {good} ({100 * good / len(inside):.0f} %) | {mean:.2f} |")
    return [*rows, ""]


def with_remarks(made: str, old: str) -> str:
    """The page, with the remarks at the end of the old one."""
    _, mark, remarks = old.partition(REMARKS)
    return f"{made}\n{mark.lstrip()}{remarks}" if mark else made


def _standard(items: Sequence[Judged]) -> list[str]:
    one = [item for item in items if item.case.known and item.case.truth]
    rows = [
        "## One effect, exact, 60 s",
        "",
        "| effect | named | held-out error / that of the true model | largest parameter error: median, worst |",
        "|---|---|---|---|",
    ]
    for name in EFFECTS:
        own = [item for item in one if item.case.truth == (name,)]
        ratios = [item.ratio for item in own if item.ratio is not None]
        worst = [max(item.errors.values()) for item in own if item.errors]
        ratio = f"{max(ratios):.3g}{' (innovation over noise)' if name == 'backlash' else ''}" if ratios else "-"
        error = f"{100 * float(np.median(worst)):.2g} %, {100 * max(worst):.2g} %" if worst else "-"
        rows.append(f"| {name} | {sum(item.right for item in own)} of {len(own)} | {ratio} | {error} |")
    return [*rows, "", *_confusion(items)]


def _confusion(items: Sequence[Judged]) -> list[str]:
    table: dict[str, Counter[str]] = defaultdict(Counter)
    for item in items:
        said = item.effects[0] if item.verdict == "missing_effect" and item.effects else item.verdict
        table["+".join(item.case.truth) or "none"][said] += 1
    rows = ["True effect, and the one that was named first:", "", "| true | named first |", "|---|---|"]
    return [*rows, *(f"| {name} | {', '.join(f'{said} {count}' for said, count in row.most_common())} |" for name, row in table.items()), ""]


def hit(item: Judged) -> bool:
    """True if the result is right by the rule of its set."""
    if not item.case.known or (item.case.dirt and not item.case.truth):
        return not (item.verdict == "missing_effect" and item.confidence >= CONFIDENT)
    alone = len(item.case.truth) == 1 and not item.case.nuisance and item.case.group != "standard"
    return item.first or (item.right and bool(item.unseen)) if alone else item.right


def _line(item: Judged) -> str:
    seen = [f"{name} {100 * part:.2g} %" for name, part in item.change.items()] + [f"noise {100 * item.noise:.2g} %"] * bool(item.change)
    seen += [f"dirt {100 * item.dirt:.2g} % ({', '.join(item.kinds)})"] if item.kinds else []
    said = f"- {item.case.name}: {item.verdict} {' + '.join(item.effects) or '-'} (confidence {item.confidence:.2f})"
    return said + (f"; of the motion: {', '.join(seen)}" if seen else "") + ("; hidden" if item.hidden else "")


def _phantoms(results: dict[str, list[Judged]]) -> list[str]:
    lines = [f"{_line(item)}; not there: {', '.join(item.phantoms)}" for items in results.values() for item in items if item.phantom]
    return ["## Every phantom", "", *(lines or ["None."]), ""]


def _misses(results: dict[str, list[Judged]]) -> list[str]:
    lines = [_line(item) for items in results.values() for item in items if not hit(item)]
    return ["## Every miss", "", *(lines or ["None."])]
