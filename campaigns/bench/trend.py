"""python -m campaigns.bench trend: false alarms, delay and coverage of the trend, on series of axes whose parameters wander.

Weekly recordings of groups of 20 axes over a year. Seven parameters of each wander with the temperature of the hall (season and weather), with load
and with lubrication (correlated from week to week), and one recording in a hundred has an error of 20 %. Seeds are fixed.
For comparison: a CUSUM (two-sided, k = 0.5, mean and deviation of the first 12 recordings), whose limit is set to the allowed number of false
alarms, and two bounds: that of any test, the likelihood ratio of the true step with known wander, start
and size; and that of the trend's own test with known wander. Finally the wear of two ball screws as published: 30 values of
friction torque, 35 h apart, falling by 38 and 27 % with a scatter of 3 % (simulated from these figures, since the values themselves are not
public). The trend learns the wander of friction from the other axes of the table, and the CUSUM's limit comes from such axes, too.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

import numpy as np
from numpy.typing import NDArray

from campaigns.bench.recordings import markdown
from xy_sysid.fleets.alike import learned
from xy_sysid.fleets.causes import causes
from xy_sysid.fleets.change import evidence, hypotheses, statistic, weighed
from xy_sysid.fleets.history import MONTH, Axis, History
from xy_sysid.fleets.trends import AXIS_MONTHS, of_axes
from xy_sysid.fleets.wander import CERTAIN, Series, divided, usual
from xy_sysid.response.frf import Z95
from xy_sysid.samples.block import FloatArray

BEGIN = datetime(2025, 1, 6, tzinfo=UTC)
WEEKS, GROUP = 53, 20
OFF = 0.01  # fraction of the recordings with an error of 20 %
STEP, SOON = 0.1, 3  # relative change, and the recordings within which it must be found
BASELINE = 12  # recordings from which the CUSUM learns
SCREWS = ((0.38, 0.03), (0.27, 0.03))  # fall, scatter


@dataclass(frozen=True, slots=True)
class Wander:
    """Variation of a parameter of an unchanged axis, as fractions of its value.

    own: standard error of one recording; load: independent from one to the next; weather: correlated over weeks; season: amplitude over the year
    """

    column: str
    value: float
    own: float
    load: float
    weather: float
    season: float


PARAMETERS = (
    Wander(column="gain", value=0.097, own=0.0005, load=0.002, weather=0.003, season=0.003),
    Wander(column="delay", value=1.3e-3, own=0.0005, load=0.0005, weather=0.0, season=0.0),
    Wander(column="pole", value=246.0, own=0.002, load=0.015, weather=0.01, season=0.015),
    Wander(column="coulomb_friction_coulomb", value=0.12, own=0.002, load=0.02, weather=0.015, season=0.015),
    Wander(column="base_resonance_frequency", value=46.0, own=0.0005, load=0.003, weather=0.002, season=0.001),
    Wander(column="noise", value=3.2e-4, own=0.0, load=0.02, weather=0.0, season=0.0),
    Wander(column="held_out_error", value=3.3e-4, own=0.0, load=0.02, weather=0.01, season=0.0),
)
FRICTION = PARAMETERS[3]
SCREW_HEADS = (
    "friction torque of a ball screw",
    "declared with value",
    "alone in its table",
    "CUSUM, limit for wander",
    "CUSUM, limit for scatter alone",
)


def wandering(what: Wander, random: np.random.Generator, weeks: int = WEEKS, off: float = OFF) -> FloatArray:
    """(n,) variation over a year, as fractions of the value, including outlying recordings."""
    weather = np.zeros(weeks)
    weather[0] = random.standard_normal()
    for week in range(1, weeks):  # correlated by 0.7 from week to week
        weather[week] = 0.7 * weather[week - 1] + np.sqrt(1.0 - 0.49) * random.standard_normal()
    season = np.sin(2.0 * np.pi * (np.arange(weeks) / 52.0 + random.uniform(0.0, 1.0)))
    wrong = np.where(random.uniform(size=weeks) < off, 0.2 * random.choice((-1.0, 1.0), size=weeks), 0.0)
    spread = what.load * random.standard_normal(weeks) + what.weather * weather + what.season * season + what.own * random.standard_normal(weeks)
    return np.asarray(spread + wrong)


def axis(number: int, seed: int, weeks: int = WEEKS) -> Axis:
    """An axis that does not change."""
    dates = tuple(BEGIN + timedelta(weeks=week) for week in range(weeks))
    histories = []
    for place, what in enumerate(PARAMETERS):
        value = what.value * (1.0 + wandering(what, np.random.default_rng([seed, number, place]), weeks))
        width = Z95 * what.own * what.value
        histories.append(
            History(column=what.column, unit="", dates=dates, value=value, low=value - width, high=value + width, logarithmic=True, level=what.value)
        )
    name, sources = f"mill-{number:02d}", frozenset(f"{number}-{week}" for week in range(weeks))
    return Axis(name, "x", units=("V", "m"), dates=dates, histories=tuple(histories), named={}, left_out=0, sources=sources)


def until(one: Axis, count: int) -> Axis:
    """The axis with its first recordings only."""
    cut = [replace(each, dates=each.dates[:count], value=each.value[:count], low=each.low[:count], high=each.high[:count]) for each in one.histories]
    return replace(one, dates=one.dates[:count], histories=tuple(cut))


def false_alarms(groups: int, seed: int, weeks: int = WEEKS) -> tuple[int, float, dict[str, tuple[float, float]]]:
    """Alarms on unchanged axes, axis-months, and for each parameter how often the next recording is within the interval with the spread, and
    within the interval of one recording alone."""
    alarms, months = 0, 0.0
    inside: dict[str, list[tuple[bool, bool]]] = {}
    for group in range(groups):
        every = [axis(number, 1000 * seed + group, weeks) for number in range(GROUP)]
        found = of_axes([until(one, weeks - 1) for one in every], causes())
        alarms += len(found.events)
        months += sum(one.months for one in found.axes)
        for one, history in zip(found.trends, (history for each in every for history in each.histories), strict=True):
            last, before = history.value[-1], one.history
            alone = before.low[-1] <= last <= before.high[-1]
            inside.setdefault(before.column, []).append((one.next[0] <= last <= one.next[1], bool(alone)))
        sys.stderr.write(f"trend: {alarms} false alarms in {months:.0f} axis-months\n")
    return alarms, months, {name: (float(np.mean([a for a, _ in both])), float(np.mean([b for _, b in both]))) for name, both in inside.items()}


def delays(what: Wander, before: int, times: int, seed: int) -> tuple[list[float], list[float]]:
    """Recordings from a step of 10 % until it is declared, by the trend and by the CUSUM; infinite if it is not within ten."""
    series = [_series(what, np.random.default_rng([seed, 1, k]), before) for k in range(GROUP)]
    weights = learned([evidence(one)[0] for one in series])
    level = np.log(AXIS_MONTHS * MONTH / 7.0 * len(PARAMETERS))
    limit = cusum_limit(what, seed)
    ours, plain = [], []
    for k in range(times):
        one = _series(what, np.random.default_rng([seed, 2, k]), before + 10)
        stepped = replace(one, value=one.value + np.log1p(STEP) * (np.arange(before + 10) >= before))
        ours.append(_first(statistic(evidence(stepped)[0], weights) >= level, before))
        plain.append(_first(cusum(stepped.value) >= limit, before))
    return ours, plain


def limits(what: Wander, before: int, times: int, seed: int) -> tuple[float, float]:
    """Fraction of the steps of ``delays`` that two other tests find within ``SOON`` recordings, with the same rate of false alarms.

    The first is the most powerful test: it knows the wander, and the start and size of the step (Neyman and Pearson). The second is the
    trend's test with known wander, but unknown start, size and duration of the change, and unknown outliers.
    Its series have no outliers. NaN if its likelihood ratios overflow.
    """
    count = before + SOON
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    slow = what.weather**2 * 0.7**apart + 0.5 * what.season**2 * np.cos(2.0 * np.pi * apart / 52.0)
    covariance = slow + (what.load**2 + what.own**2 + 1e-12) * np.eye(count)
    inverse = np.linalg.inv(covariance)
    step, one = np.log1p(STEP) * (np.arange(count) >= before), np.ones(count)
    across = inverse - np.outer(inverse @ one, inverse @ one) / float(one @ inverse @ one)  # unknown level
    shapes, level = hypotheses(np.arange(count, dtype=np.float64)), np.log(AXIS_MONTHS * MONTH / 7.0 * len(PARAMETERS))
    best, known = [], []
    for k in range(times):
        value = _series(what, np.random.default_rng([seed, 2, k]), before + 10).value[:count] + step
        best.append(float(step @ across @ value - 0.5 * step @ across @ step) >= level)
        value = _series(what, np.random.default_rng([seed, 2, k]), before + 10, off=0.0).value[:count] + step
        off, change = weighed(divided(value, covariance, shapes), shapes)
        found = bool(np.any((change - np.log1p(off.sum(axis=0)))[before:] >= level))
        known.append(found if np.max(change) < CERTAIN else np.nan)
    return float(np.mean(best)), float(np.mean(known))


def _series(what: Wander, random: np.random.Generator, weeks: int, off: float = OFF) -> Series:
    return Series(np.arange(weeks, dtype=np.float64), np.log1p(wandering(what, random, weeks, off)), np.full(weeks, what.own))


def _first(alarm: NDArray[np.bool_], before: int) -> float:
    """Number of recordings from the change to the first alarm."""
    passed = np.flatnonzero(alarm[before:])
    return float(passed[0] + 1) if passed.size else np.inf


def cusum(value: FloatArray) -> FloatArray:
    """(n,) the larger of both sums of a series, in standard deviations; 0 during the baseline. Page, Biometrika 41 (1954)."""
    mean, deviation = float(np.mean(value[:BASELINE])), float(np.std(value[:BASELINE], ddof=1))
    up, down, found = 0.0, 0.0, np.zeros(value.size)
    for place in range(BASELINE, value.size):
        z = (value[place] - mean) / deviation
        up, down = max(up + z - 0.5, 0.0), max(down - z - 0.5, 0.0)
        found[place] = max(up, down)
    return found


def cusum_limit(what: Wander, seed: int, times: int = 4000, weeks: int = WEEKS, a_month: float = MONTH / 7.0, tests: int = len(PARAMETERS)) -> float:
    """The limit at which a CUSUM raises one false alarm in 1,000 axis-months, over ``tests`` series of an axis."""
    highest = [float(np.max(cusum(_series(what, np.random.default_rng([seed, 3, k]), weeks).value))) for k in range(times)]
    months = weeks / a_month
    return float(np.quantile(highest, max(1.0 - months / (AXIS_MONTHS * tests), 0.5)))


def screws(times: int, seed: int) -> list[tuple[str, ...]]:
    """For each screw the median number of the value with which its wear is declared: by the trend, with and without other axes in the table, and by
    a CUSUM whose limit is set with axes that wander like friction, or have white noise."""
    lines = []
    a_month = MONTH * 24.0 / 35.0
    level = np.log(AXIS_MONTHS * a_month)
    known = learned([evidence(_series(FRICTION, np.random.default_rng([seed, 6, k]), 30))[0] for k in range(GROUP)])
    for fall, scatter in SCREWS:
        still = Wander(column="torque", value=1.0, own=0.0, load=scatter, weather=0.0, season=0.0)
        limits = [cusum_limit(what, seed, weeks=30, a_month=a_month, tests=1) for what in (FRICTION, still)]
        found: list[list[float]] = [[], [], [], []]
        for k in range(times):
            random = np.random.default_rng([seed, 4, k])
            value = np.log(1.0 - fall * np.arange(30) / 29.0) + scatter * random.standard_normal(30)
            seen = evidence(Series(np.arange(30.0), value, np.zeros(30)))[0]
            for place, weights in enumerate((known, usual())):
                found[place].append(_first(statistic(seen, weights) >= level, 0))
            for place, limit in enumerate(limits, 2):
                found[place].append(_first(cusum(value) >= limit, 0))
        lines.append((f"-{100 * fall:.0f} % over 30 values", *(_told(float(np.median(one))) for one in found)))
    return lines


def screw_alarms(axes: int, seed: int) -> tuple[int, float]:
    """False alarms and axis-months of unchanged axes recorded like the screws, with the same weights and limit."""
    a_month = MONTH * 24.0 / 35.0
    known = learned([evidence(_series(FRICTION, np.random.default_rng([seed, 6, k]), 30))[0] for k in range(GROUP)])
    alarms = 0
    for k in range(axes):
        seen = evidence(_series(FRICTION, np.random.default_rng([seed, 7, k]), 30))[0]
        alarms += bool(np.any(statistic(seen, known) >= np.log(AXIS_MONTHS * a_month)))
    return alarms, axes * 30 / a_month


def _told(delay: float) -> str:
    return f"{delay:.0f}" if np.isfinite(delay) else "not found"


def main(short: bool = False) -> None:
    """Print the tables."""
    groups, weeks, times = (1, 9, 1) if short else (22, WEEKS, 40)
    alarms, months, inside = false_alarms(groups, 7, weeks)
    rate = f"{alarms} in {months:.0f} axis-months; goal: 1 in {AXIS_MONTHS:.0f} at most"
    sys.stdout.write(f"False alarms: {rate}.\n\n")
    cells = [(name, f"{100 * alone:.0f} %", f"{100 * both:.0f} %") for name, (both, alone) in inside.items()]
    sys.stdout.write(markdown(("the next recording is within the 95 % interval", "of one recording", "with the spread"), cells) + "\n\n")
    if short:
        return
    lines = []
    for what in PARAMETERS:
        for before in (12, 26):
            ours, plain = delays(what, before, times, 58)
            soon = [f"{100 * np.mean(np.array(one) <= SOON):.0f} %" for one in (ours, plain)]
            scatter = np.std([wandering(what, np.random.default_rng([8, 5, k])) for k in range(50)])
            medians = [_told(float(np.median(one))) for one in (ours, plain)]
            most = [f"{100 * part:.0f} %" if np.isfinite(part) else "-" for part in limits(what, before, times, 58)]
            lines.append((what.column, f"{100 * scatter:.1f} %", f"{before}", soon[0], *most, medians[0], soon[1], medians[1]))
            sys.stderr.write(" | ".join(lines[-1]) + "\n")
    heads = (
        "step of 10 % in",
        "scatter of a year",
        "recordings before",
        "found within 3",
        "limit of any test",
        "this test with a known wander",
        "median delay",
        "CUSUM: within 3",
        "CUSUM: median delay",
    )
    sys.stdout.write(markdown(heads, lines) + "\n\n")
    sys.stdout.write(markdown(SCREW_HEADS, screws(times, 9)) + "\n\n")
    false, axis_months = screw_alarms(1000, 9)
    sys.stdout.write(f"False alarms of the trend on unchanged axes that are recorded as the screws: {false} in {axis_months:.0f} axis-months.\n")


if __name__ == "__main__":
    main()
