"""Changes with date, size, certainty and cause; none on an unchanged axis."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import ROOT
from helpers.browser_tools import browser, needs_browser
from helpers.cli_tools import cli, npz, refused
from helpers.fleet_tables import BEGIN, gain_falls, recorded, scattered_gains, unread
from helpers.html_pages import parsed, plots
from plotly.offline import get_plotlyjs

import xy_sysid as xy
from campaigns.bench.trend import FRICTION, PARAMETERS, axis, delays, limits, until
from campaigns.documents.fleet_columns import document
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.fleets import presence
from xy_sysid.fleets.alike import learned
from xy_sysid.fleets.causes import causes
from xy_sysid.fleets.change import changes, evidence, statistic
from xy_sysid.fleets.history import Axis
from xy_sysid.fleets.row import Row
from xy_sysid.fleets.table import merged
from xy_sysid.fleets.trends import of_axes, of_rows
from xy_sysid.fleets.wander import Series, usual
from xy_sysid.fleets.words import gaps, sentence, summary
from xy_sysid.report.trend_page import overview_figure, trend_page

LEVEL = 10.0  # log of the statistic, as for a weekly recording with seven parameters


def series(values: Any, sigma: float = 0.001) -> Series:
    return Series(np.arange(len(values), dtype=np.float64), np.asarray(values, dtype=np.float64), np.full(len(values), sigma))


def scattered(count: int, spread: float = 0.01, seed: int = 3) -> Any:
    return spread * np.random.default_rng(seed).standard_normal(count)


def test_a_step_is_found_with_its_date_size_and_error() -> None:
    """After three recordings at the latest: level, wander and size are all estimated from the series itself."""
    values = scattered(23)
    values[20:] += 0.1
    (found,) = changes(series(values), usual(), LEVEL)
    assert found.after == 19 and found.first == found.last == 19 and found.declared <= 22
    assert abs(found.size - 0.1) < 3.0 * found.sigma < 0.08


def test_a_gradual_change_has_its_beginning_and_duration() -> None:
    """Growing wear is one change with a duration, not many."""
    values = scattered(45)
    values[20:] += 0.3 * np.clip(np.arange(25) / 20.0, 0.0, 1.0)
    (found,) = changes(series(values), usual(), LEVEL)
    assert found.duration == 20.0 and abs(found.after - 20) <= 3 and found.size == pytest.approx(0.3, abs=0.05)


def test_a_change_that_goes_on_is_told_until_now() -> None:
    """Wear over 80 recordings, of which 25 are available: its size is the change up to the last one."""
    values = scattered(45)
    values[20:] += 0.6 * np.arange(25) / 80.0
    (found,) = changes(series(values), usual(), LEVEL)
    assert found.duration == 44 - found.after == 25 and abs(found.size - 0.6 * 24 / 80) < 3.0 * found.sigma < 0.09


def test_two_changes_are_two() -> None:
    """Later recordings are compared with those after the change."""
    values = scattered(50)
    values[15:] += 0.1
    values[35:] -= 0.15
    first, second = changes(series(values), usual(), LEVEL)
    assert (first.after, second.after) == (14, 34)
    assert first.size == pytest.approx(0.1, abs=0.02) and second.size == pytest.approx(-0.15, abs=0.02)


def test_a_gradual_change_before_another_is_told_whole() -> None:
    """It is declared while it continues, and reported with its size so far."""
    values = scattered(60)
    values[15:] += 0.3 * np.clip(np.arange(45) / 20.0, 0.0, 1.0)
    values[50:] -= 0.25
    first, second = changes(series(values), usual(), LEVEL)
    assert abs(first.size - 0.3) < 3.0 * first.sigma < 0.2 and first.duration == 20.0
    assert abs(second.size + 0.25) < 3.0 * second.sigma < 0.2


@pytest.mark.parametrize("off", [(20,), (20, 21), (12, 14), (5, 20, 30)])
def test_a_recording_that_is_off_is_no_change(off: tuple[int, ...]) -> None:
    """Another load on one day, or on two in a row, is distinguished from a change by later recordings."""
    values = scattered(40)
    values[list(off)] += 0.2
    assert changes(series(values), usual(), LEVEL) == ()


def test_the_statistic_is_what_its_principle_says() -> None:
    """Without a change its mean after n recordings is n at most (Shiryaev and Roberts): so a threshold is a rate of false alarms."""
    random = np.random.default_rng(11)
    last = [np.exp(statistic(evidence(series(0.03 * random.standard_normal(8)))[0], usual())[-1]) for _ in range(40)]
    assert np.mean(last) < 8.0


def test_the_spread_is_learned_from_all_axes_together() -> None:
    """Two recordings after a change of an axis with little history: its wander is known from similar axes only."""
    others = [evidence(series(scattered(12, seed=k)))[0] for k in range(12)]
    values = scattered(9, seed=40)
    values[6:] += 0.08
    assert changes(series(values), usual(), LEVEL) == ()
    (found,) = changes(series(values), learned(others), LEVEL)
    assert found.after == 5


def test_an_effect_that_is_named_from_one_day_on_is_a_change() -> None:
    """Yes and no have the same statistic. The rate of alternation on an unchanged axis is learned from all axes."""
    always, never = np.ones(12, dtype=np.bool_), np.zeros(12, dtype=np.bool_)
    steady = presence.learned([always, never] * 10)
    appeared = np.arange(12) >= 9
    assert presence.statistic(appeared, steady)[-1] > LEVEL and presence.after(appeared, steady)[0] == 8
    random = np.random.default_rng(5)
    fickle = presence.learned([random.uniform(size=12) < 0.3 for _ in range(20)])
    assert presence.statistic(appeared, fickle)[-1] < LEVEL
    assert presence.statistic(random.uniform(size=40) < 0.3, fickle).max() < LEVEL


def test_unchanged_axes_raise_no_alarm_and_the_next_recording_is_inside() -> None:
    """The short form of python -m campaigns.bench trend: wander of temperature, load and friction, outliers, seven parameters."""
    every = [axis(number, 4242, 15) for number in range(4)]
    found = of_axes([until(one, 14) for one in every], causes())
    assert found.events == () and found.pooled
    last = [history.value[-1] for one in every for history in one.histories]
    inside = [one.next[0] <= value <= one.next[1] for one, value in zip(found.trends, last, strict=True)]
    assert np.mean(inside) > 0.85
    friction = found.of("mill-03", "x", "coulomb_friction_coulomb")
    assert 0.01 < friction.spread < 0.05
    own = friction.history
    assert np.all(friction.low < own.low) and np.all(own.high < friction.high), "the spread is part of the interval"


def test_a_change_of_ten_per_cent_is_found_within_three_recordings() -> None:
    """A step of the gain, with 20 other axes and half a year of history; a CUSUM with equal false alarms is later or finds nothing."""
    ours, plain = delays(PARAMETERS[0], before=26, times=4, seed=77)
    assert max(ours) <= 3.0 < min(plain) < np.inf


def test_no_test_with_so_few_false_alarms_finds_every_step_of_ten_per_cent_in_friction() -> None:
    """A documented limit: friction wanders by 2.7 %, and three recordings do not show a step; for a step in the gain they are
    enough."""
    best, known = limits(FRICTION, before=26, times=20, seed=77)
    assert known < best < 0.95 and known < 0.7
    assert min(limits(PARAMETERS[0], before=26, times=20, seed=77)) > 0.9


def worn(*, friction: float = 1.0, gain: float = 1.0, backlash: bool = False) -> Axis:
    """An axis that changes with its twelfth recording."""
    one = axis(0, 5, 18)
    late = np.arange(18) >= 12
    factors = {"coulomb_friction_coulomb": friction, "gain": gain}
    histories = []
    for history in one.histories:
        factor = np.where(late, factors.get(history.column, 1.0), 1.0)
        histories.append(replace(history, value=history.value * factor, low=history.low * factor, high=history.high * factor))
    return replace(one, histories=tuple(histories), named={"backlash": late} if backlash else {})


def test_no_change_takes_longer_than_it_was_seen() -> None:
    """The same in a table: the change lasts until the last recording, with the value of that day."""
    one = axis(0, 3, 45)
    each = one.histories[0]
    risen = np.where(np.arange(45) < 20, 1.0, 1.0 + 0.6 * (np.arange(45) - 20) / 80.0)
    worn = replace(each, value=each.value * risen, low=each.low * risen, high=each.high * risen)
    (trend,) = of_axes([replace(one, histories=(worn,))], causes()).trends
    (moved,) = trend.moved
    assert moved.duration <= (one.dates[-1] - moved.since).days + 7
    assert moved.after == pytest.approx(worn.value[-1], rel=0.03) and moved.sigmas > 4.0


def test_a_gradual_change_is_gradual_however_many_recordings_have_one_date() -> None:
    """Three recordings on each Monday: the usual distance is a week, in the duration as in the test."""
    one = axis(0, 3, 45)
    dates = tuple(one.dates[3 * (k // 3)] for k in range(45))
    each = one.histories[0]
    risen = 1.0 + 0.3 * np.clip((np.arange(45) // 3 - 7) / 5.0, 0.0, 1.0)
    worn = replace(each, dates=dates, value=each.value * risen, low=each.low * risen, high=each.high * risen)
    (trend,) = of_axes([replace(one, dates=dates, histories=(worn,))], causes()).trends
    (moved,) = trend.moved
    assert moved.duration == 5.0 * 21.0


def test_joint_changes_point_to_a_cause() -> None:
    """Friction and backlash up: the nut. Gain down and friction in volts up: the amplifier."""
    (nut,) = of_axes([worn(friction=1.4, backlash=True), *(axis(k, 5, 18) for k in range(1, 3))], causes()).events
    assert nut.cause is not None and nut.cause.cause == "a worn nut"
    text = sentence(nut, worn())
    assert "coulomb_friction_coulomb rose from 0.1" in text and "since 31 March 2025" in text and "backlash is named in 100 %" in text, text
    (drive,) = of_axes([worn(friction=1.0 / 0.85, gain=0.85), *(axis(k, 5, 18) for k in range(1, 3))], causes()).events
    assert drive.cause is not None and drive.cause.cause == "the amplifier or its supply"


def test_recordings_in_other_units_are_not_compared(tmp_path: Path) -> None:
    """An axis recorded in V first and in A from May on: no change of the gain, and the number of omitted recordings is given."""
    unit, factor = ("V",) * 8 + ("A",) * 6, (1.0,) * 8 + (0.3,) * 6
    amperes = [recorded("mill-00", k, gain * factor[k], input_unit=unit[k]) for k, gain in enumerate(scattered_gains(0))]
    volts = [recorded("mill-01", k, gain) for k, gain in enumerate(scattered_gains(1))]
    found = of_rows([*amperes, *volts])
    assert found.events == () and found.axes[0].units == ("A", "m") and len(found.axes[0].dates) == 6
    assert gaps(found) == ["Recordings left out, since the newest of their axis has other units: 8 (mill-00 x: 8)."]
    merged(tmp_path, [*amperes, *volts])
    assert gaps(found)[0] in cli("trend", tmp_path).out
    assert [one["other_units"] for one in cli("trend", tmp_path, "--json").json["axes"]] == [8, 0]


@pytest.fixture(scope="module")
def gone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Nothing changed on mill-00. The files of mill-01 cannot be read from May on, mill-02 has no answer then, and mill-03 is new."""
    folder = tmp_path_factory.mktemp("gone")
    gains = scattered_gains(0)
    rows = [recorded("mill-00", k, gain) for k, gain in enumerate(gains)]
    rows += [recorded("mill-01", k, gains[k]) if k < 9 else unread("mill-01", k) for k in range(14)]
    rows += [recorded("mill-02", k, gains[k], **({} if k < 12 else {"verdict": "not_enough_data"})) for k in range(14)]
    rows += [unread("mill-00", 3), *(recorded("mill-03", k, gains[k]) for k in range(3))]
    merged(folder, rows)
    return folder


MISSING = (
    "Recordings that could not be read: 6 (mill-00: 1, mill-01 with its newest: 5).",
    "Axes whose newest recordings have no answer: 1 (mill-02 x: 2).",
    "Axes that are not compared, since fewer than 4 recordings have a date, an answer and the units of the newest: 1 (mill-03 x: 3).",
)


def test_what_the_table_cannot_tell_is_told(gone: Path, tmp_path: Path) -> None:
    """Nothing changed in the readable data: the command, its JSON and the page list the missing data."""
    said = cli("trend", gone, "-o", tmp_path / "page.html").out
    assert "Nothing changed." in said and all(text in said for text in MISSING), said
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert all(text in page for text in MISSING)
    found = cli("trend", gone, "--json").json
    assert [tuple(one.values()) for one in found["unread"]] == [("mill-00", 1, False), ("mill-01", 5, True)]
    assert [(one["newest_without_answer"], one["compared"]) for one in found["axes"]] == [(0, True), (0, True), (2, True), (0, False)]
    assert gaps(xy.trend(gone, machines=["mill-01"])) == ["Recordings that could not be read: 5 (mill-01 with its newest: 5)."]


def test_a_year_of_twenty_machines_names_the_three_that_go_bad_and_their_causes() -> None:
    """The short form of python -m campaigns.bench fleet: rows of a year with their wander, without recordings."""
    rows = []
    for number in range(20):
        wander = np.random.default_rng(number).standard_normal((3, 12)) * np.array([[0.02], [0.004], [0.004]])
        for k, (rubs, gain, base) in enumerate((1.0 + wander).T.tolist()):
            late = k >= 7
            nut, bolts, amplifier = (late and number == bad for bad in (4, 11, 17))
            values = {
                "gain": 0.1 * gain * (0.88 if amplifier else 1.0),
                "coulomb_friction_coulomb": 0.13 * rubs * (1.33 if nut else 1.0),
                "tf_resonance_1_frequency": 48.0 * base * (0.92 if bolts else 1.0),
            }
            ends = {f"{name}{end}": factor * value for name, value in values.items() for end, factor in (("_low", 0.997), ("_high", 1.003))}
            effects = "coulomb_friction, backlash" if nut else "coulomb_friction"
            rows.append(recorded(f"mill-{number:02d}", k, 0.1) | {"verdict": "missing_effect", "effects": effects} | values | ends)
    found = of_rows(rows)
    told = {event.machine: event.cause.cause for event in found.events if event.cause is not None}
    assert told == {"mill-04": "a worn nut", "mill-11": "loose bolts of the base", "mill-17": "the amplifier or its supply"}
    assert len(found.events) == 3


def test_the_page_of_the_fleet_lists_every_column() -> None:
    """python -m campaigns.documents.fleet_columns --write"""
    assert document() in (ROOT / "docs" / "fleet.md").read_text(encoding="utf-8")


def test_users_add_causes_of_their_own(tmp_path: Path) -> None:
    """A file in the same form takes precedence over the table of the package; it may only name known quantities."""
    own = tmp_path / "causes.yaml"
    own.write_text("causes:\n  - {cause: the blue hose, when: [gain down], also: [friction up]}\n", encoding="utf-8")
    found = causes(own).likeliest([("gain", "down"), ("coulomb_friction_coulomb", "up")])
    assert found is not None and found.cause == "the blue hose"
    own.write_text("causes:\n  - {cause: the blue hose, when: [hose down]}\n", encoding="utf-8")
    with pytest.raises(BadInput, match="hose down"):
        causes(own)
    own.write_text("causes:\n  - {cause: the blue hose}\n", encoding="utf-8")
    with pytest.raises(BadInput, match="when of 'the blue hose' is empty; allowed: one change or more"):
        causes(own)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("causes: [{cause: hose, wenn: [gain down]}]", "allowed: cause, when, also, check. Did you mean 'when'?"),
        ("causes: [{when: [gain down]}]", "cause 1 is without a name"),
        ("", "causes is None; allowed: a list."),
    ],
)
def test_a_mistake_in_a_file_of_causes_is_told_with_what_is_allowed_there(text: str, words: str, tmp_path: Path) -> None:
    own = tmp_path / "causes.yaml"
    own.write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match=re.escape(words)):
        causes(own)


def test_a_quantity_of_a_user_comes_before_those_of_the_package(tmp_path: Path) -> None:
    """A column in both files measures the quantity of the user's file."""
    own = tmp_path / "causes.yaml"
    text = "quantities: {rail drag: [coulomb_friction_coulomb]}\ncauses:\n  - {cause: a dry rail, when: [rail drag up]}\n"
    own.write_text(text, encoding="utf-8")
    for path in (own, str(own)):
        found = causes(path).likeliest([("coulomb_friction_coulomb", "up")])
        assert found is not None and found.cause == "a dry rail"


def test_causes_are_read_before_the_long_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A missing file gives an error before any part of the recording is analysed."""
    monkeypatch.setattr("xy_sysid.fleets.parts.row_of", lambda *_: pytest.fail("a part was analysed"))
    assert "nowhere.yaml" in refused("trend", npz(tmp_path / "long.npz", rows=4_000), "--every", "1s", "--causes", tmp_path / "nowhere.yaml")


@pytest.mark.parametrize(
    ("load", "words", "part"),
    [
        (-0.2, "changed from -0.1 to -0.2 V since 11 May 2026 (+100 %, more than 99 sigma)", 1.0),
        (-0.05, "changed from -0.1 to -0.05 V since 11 May 2026 (-50 %, more than 99 sigma)", -0.5),
        (0.05, "changed from -0.1 to 0.05 V since 11 May 2026 (more than 99 sigma)", np.nan),
    ],
)
def test_a_negative_value_changes_and_has_no_per_cent_across_zero(load: float, words: str, part: float) -> None:
    """-0.2 V is less than -0.1 V, although its size is larger; and a value that changes its sign has no ratio."""
    column = "constant_load_load"
    found = of_rows(
        [recorded("m1", k, gain, **{column: now, f"{column}_low": now - 1e-5, f"{column}_high": now + 1e-5})
         for k, gain in enumerate(scattered_gains(1)) for now in [load if k >= 9 else -0.1]]
    )  # fmt: skip
    (event,) = found.events
    assert f"{column} {words}" in sentence(event, found.axes[0])
    assert event.moved[0].part == pytest.approx(part, rel=1e-3, nan_ok=True)


def test_a_parameter_without_an_interval_has_no_error_of_a_recording(tmp_path: Path) -> None:
    """A dash, not 0 %."""
    merged(tmp_path, [recorded("m1", k, gain, noise=1e-6 * gain) for k, gain in enumerate(scattered_gains(1))])
    (line,) = (line for line in cli("trend", tmp_path).out.splitlines() if line.startswith("noise"))
    assert line.split()[-1] == "-"


def test_recordings_of_one_date_have_no_order_and_the_command_says_so() -> None:
    """The gain is halved after the seventh, which nobody can date."""
    found = of_rows([recorded("m1", k, gain / (1 + (k > 7))) | {"date": BEGIN} for k, gain in enumerate(scattered_gains(1))])
    assert gaps(found) == ["Axes on which no change can be found, since all recordings have the same date: 1 (m1 x: 14)."]


def test_an_axis_whose_newest_recording_has_other_units_is_named_with_the_reason() -> None:
    """All 14 recordings have a date and an answer."""
    alone = [recorded("m1", k, gain, input_unit="A" if k == 13 else "V") for k, gain in enumerate(scattered_gains(1))]
    found = of_rows([*alone, *(recorded("m2", k, gain) for k, gain in enumerate(scattered_gains(2)))])
    assert "fewer than 4 recordings have a date, an answer and the units of the newest: 1 (m1 x: 1)." in gaps(found)[0]


def test_a_recording_of_two_axes_counts_once() -> None:
    """Its time, too."""
    rows = [recorded("m1", k, gain) | {"date": BEGIN + timedelta(seconds=8 * k)} for k, gain in enumerate(scattered_gains(1, 5))]
    assert summary(of_rows([*rows, *(row | {"axis": "y"} for row in rows)])) == "2 axes, 5 recordings, 32 s"


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three axes, one of which loses gain in May."""
    return gain_falls(tmp_path_factory.mktemp("trend") / "table")


def test_the_command_names_the_change(table: Path) -> None:
    """Size, date, certainty and cause in one sentence, and the spread between recordings of an axis."""
    said = cli("trend", table)
    assert said.code == 0, said
    assert (
        "mill-01 x: gain fell from 100" in said.out and "since 25 May 2026" in said.out and "Likely cause: the amplifier or its supply." in said.out
    )
    assert "; 1 row without a date or an answer is left out." in said.out and said.out.count("\n- ") == 1
    found = cli("trend", table, "--json").json
    (event,) = found["events"]
    (change,) = event["changes"]
    assert change["parameter"] == "gain" and change["part"] == pytest.approx(-0.1, abs=0.01) and change["once_in_axis_months"] > 1000.0
    assert f"- {event['sentence']}" in said.out and change["sentence"].removesuffix(".") in event["sentence"] and change["duration_days"] == 0.0
    assert len(found["parameters"]) == 3 and found["parameters"][0]["spread_between_recordings"] < 0.01


def test_the_page_shows_every_parameter_and_opens_offline(table: Path, tmp_path: Path) -> None:
    """One figure for each event, one for each parameter of all axes, and the spread in a table."""
    page = tmp_path / "trend.html"
    assert cli("trend", table, "-o", page).code == 0
    text = page.read_text(encoding="utf-8")
    assert "mill-01 x, 25 May 2026: the amplifier or its supply" in text and 'id="plot-gain"' in text
    assert parsed(text) is not None
    ids = re.findall(r'\bid="([^"]+)"', text.split('<script type="application/json"')[0])
    assert len(ids) == len(set(ids)), "a figure has a place of its own"
    assert "allowed: a name that is not there yet" in refused("trend", table, "-o", page)


def test_the_page_shows_each_parameter_of_each_axis_with_its_interval(table: Path, tmp_path: Path) -> None:
    """Also where nothing changed: one figure for each axis, and one of all axes, in which each has a name."""
    page = tmp_path / "trend.html"
    assert cli("trend", table, "-o", page).code == 0
    found = plots(page.read_text(encoding="utf-8"))
    for number in range(3):
        (curve,) = found[f"axis-{number}"]["data"]
        assert curve["mode"] == "markers" and curve["error_y"]["array"] and curve["name"] == "gain (mm/s/V)"
        assert found[f"axis-{number}"]["layout"]["annotations"][0]["text"] == "gain (mm/s/V)"
        assert len(found[f"axis-{number}"]["layout"].get("shapes", [])) == (2 if number == 1 else 0), "date of the change and its interval"
    assert [curve["name"] for curve in found["plot-gain"]["data"]] == ["mill-01 x", "mill-00 x", "mill-02 x"]
    assert all(curve["error_y"]["array"] and curve["showlegend"] for curve in found["plot-gain"]["data"])
    assert all(one["layout"]["xaxis"]["hoverformat"] == "" for one in found.values()), "a date is no number"


def test_the_lines_of_many_axes_are_one_curve_with_names() -> None:
    """More axes than colours: the unchanged ones are grey together, and each point has the name of its axis."""
    own = of_axes([axis(k, 5, 6) for k in range(8)], causes()).trends
    (curve,) = overview_figure([one for one in own if one.history.column == "gain"]).data
    assert len(curve.x) == len(curve.y) == len(curve.text) == 8 * 7 and set(curve.text) == {f"mill-{k:02d} x" for k in range(8)}


def test_a_page_of_twenty_machines_is_small() -> None:
    """Seven parameters of ten recordings each; most of the page is Plotly."""
    found = of_axes([axis(k, 5, 10) for k in range(20)], causes())
    assert len(trend_page(found, "table").encode()) < len(get_plotlyjs().encode()) + 500_000


@needs_browser
@pytest.mark.parametrize("width", [1400, 400])
def test_a_menu_of_the_page_shows_another_machine_and_another_parameter(tmp_path: Path, width: int) -> None:
    """From a file, without a network; long names fit, and the whole table is in sight."""
    page = tmp_path / "trend.html"
    long = "Querträger-Übergabestation <b>" + "x" * 10 + " & Co, Halle 3, Linie 12, Platz 7"
    column = "position_dependent_gain_period"
    rows = [
        recorded(name, k, gain, **{column: gain, f"{column}_low": gain, f"{column}_high": gain})
        for number, name in enumerate((long, "mill"))
        for k, gain in enumerate(scattered_gains(number))
    ]
    page.write_text(trend_page(of_rows(rows), "table"), encoding="utf-8")
    with browser() as made:
        tab = made.new_context(viewport={"width": width, "height": 900}, offline=True).new_page()
        tab.goto(page.as_uri())
        for name, place in (("machines", "axis-1"), ("all", f"plot-{column}")):
            tab.locator(f"select[data-choice={name}]").select_option(index=1)
            tab.locator(f"#{place}").scroll_into_view_if_needed()
            tab.locator(f"#{place} .scatterlayer .trace").first.wait_for(timeout=10_000)
            assert tab.locator(f"#{name} .plot:visible").count() == 1
        assert tab.evaluate("document.documentElement.scrollWidth") <= width
        inside = "[...document.querySelectorAll('.scroll')].every((box) => box.scrollWidth <= box.clientWidth)"
        assert tab.evaluate(inside), "no column is cut"
        cut = "[...document.querySelectorAll('#all > :not([hidden]) .legendtext')].every((text) => text.getBoundingClientRect().right <= innerWidth)"
        assert tab.evaluate(cut), "no name is cut"


@pytest.mark.filterwarnings("error")
def test_a_parameter_that_is_zero_is_drawn_over_its_interval() -> None:
    """There is no per cent of 0: one interval's width is 100."""
    found = of_rows([recorded("m1", k, 0.0, gain_low=-0.1, gain_high=0.1) for k in range(5)])
    (curve,) = overview_figure(found.trends).data
    assert np.all(np.asarray(curve.y) == 0.0) and np.all(np.asarray(curve.error_y.array) > 49.0)


def test_one_long_recording_is_a_trend_of_its_parts(tmp_path: Path) -> None:
    """--every: the gain of a recording of 4 s rises after 2 s; without a date, times are from the start, also on the page."""

    def risen(content: Any) -> Any:
        steps = np.diff(content["y"], prepend=0.0)
        return np.cumsum(np.where(content["t"] < 2.0, steps, 1.3 * steps))

    path = npz(tmp_path / "long.npz", rows=4_000, y=risen)
    (gain,) = (one for one in cli("trend", path, "--every", "1s", "--json").json["parameters"] if one["parameter"] == "gain")
    assert gain["values"] == pytest.approx([1e-3, 1e-3, 1.3e-3, 1.3e-3], rel=0.05)
    assert [date[14:19] for date in gain["dates"]] == ["00:00", "00:01", "00:02", "00:03"]
    page = tmp_path / "page.html"
    assert "long.npz: 1 axis, 4 recordings, 3 s." in cli("trend", path, "--every", "1s", "-o", page).out
    assert "min after the start" in page.read_text(encoding="utf-8") and "1970-01-01" not in page.read_text(encoding="utf-8")
    assert "a number and one of the units" in refused("trend", path, "--every", "soon")


@pytest.mark.parametrize(("months", "words"), [(0.3, "9 d"), (0.02, "15 h"), (1e-3, "44 min"), (1e-5, "26 s"), (12.0, "12 axis-months")])
def test_how_long_was_looked_at_is_told_in_a_unit_that_people_read(months: float, words: str) -> None:
    """Parts of one recording of a day do not count as a fraction of a month."""
    one = axis(0, 3, 6)
    months_of_it = one.months
    stretched = tuple(one.dates[0] + (date - one.dates[0]) * months / months_of_it for date in one.dates)
    found = of_axes([replace(one, dates=stretched)], causes())
    assert summary(found) == f"1 axis, 6 recordings, {words}"


@pytest.mark.filterwarnings("error")
def test_an_interval_that_knows_nothing_has_no_end() -> None:
    """A value with an error of a million times its size: no warning of overflow."""
    one = axis(0, 3, 6).histories[0]
    found = of_axes([replace(axis(0, 3, 6), histories=(replace(one, low=one.value - 1e6 * one.value, high=one.value + 1e6 * one.value),))], causes())
    assert np.all(np.isinf(found.trends[0].high)) and np.all(np.isfinite(found.trends[0].history.value))


def test_what_is_no_table_is_refused(tmp_path: Path, table: Path) -> None:
    """In one line that says what to do."""
    assert "xy-sysid fleet PATH -o TABLE" in refused("trend", tmp_path)
    with pytest.raises(BadRecording):
        xy.trend(tmp_path / "nowhere")
    with pytest.raises(BadInput, match="content of the table is 4 rows, 1 of which could not be read; allowed: an axis with 4 of them"):
        of_rows([unread("mill-00", 3), *(recorded("mill-00", k, 0.1) for k in range(3))])
    with pytest.raises(BadInput, match="content of the table is 1 row, 0 of which"):
        of_rows([recorded("mill-00", 0, 0.1)])
    assert "machine is mill-99; allowed: one of mill-00, mill-01, mill-02." in refused("trend", table, "--machine", "mill-99")


@pytest.mark.parametrize("name", ["long.csv", "page.html", "long.parquet"])
def test_a_recording_in_place_of_a_table_is_never_to_be_removed(name: str, tmp_path: Path) -> None:
    """--every is missing; a file that is not a table's is named as such."""
    path = tmp_path / name
    path.write_text("t,u,y\n", encoding="utf-8")
    said = refused("trend", path)
    assert "Remove" not in said
    assert "add --every 10min" in said or name.endswith(".parquet")


@pytest.mark.parametrize("changes", [{"date": "1 May"}, {"gain": "much"}])
def test_a_table_with_text_in_place_of_dates_or_numbers_is_refused(changes: Row, tmp_path: Path) -> None:
    """In one line; numbers and dates that another program wrote in another precision are read."""
    import pyarrow
    import pyarrow.parquet

    rows = [recorded("mill-00", k, 0.1) for k in range(5)]
    other = pyarrow.Table.from_pylist(rows).drop_columns("gain_low").append_column("gain_low", pyarrow.array([0.09] * 5, pyarrow.float32()))
    pyarrow.parquet.write_table(other, tmp_path / "good.parquet")
    assert len(xy.trend(tmp_path).axes[0].dates) == 5
    pyarrow.parquet.write_table(pyarrow.Table.from_pylist([row | changes for row in rows]), tmp_path / "good.parquet")
    assert "a column of another kind" in refused("trend", tmp_path)


@pytest.mark.parametrize("option", ["--causes", "--names"])
def test_an_impossible_date_in_a_yaml_file_is_told(option: str, table: Path, tmp_path: Path) -> None:
    """YAML reads 2026-13-02 as a date."""
    path = tmp_path / "own.yaml"
    path.write_text("recordings: {a.csv: {date: 2026-13-02}}", encoding="utf-8")
    command = ("trend", table, "--causes", path) if option == "--causes" else ("fleet", "--one", path, "--names", path)
    assert "own.yaml: no YAML. Correct it: month must be in 1..12" in refused(*command)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("FILE", "--every", "'10m'"), "allowed: a number and one of the units s, min, h and d"),
        (("FILE", "--every", "1H"), "--every is '1H'; allowed: a number and one of the units s, min, h and d"),
        (("FILE", "--every", "0.1s"), "--every is '0.1s'; allowed: a time of 1 s or more"),
        (("FILE", "--every", "1d"), "--every is '1d'; allowed: a time that divides the recording into 4 parts or more. Choose a shorter time."),
        (("nowhere",), "nowhere: does not exist"),
        (("TABLE", "--axis-months", "inf"), "--axis-months is inf; allowed: a finite number"),
    ],
)
def test_a_value_that_cannot_be_used_is_told_with_the_reason(words: tuple[str, ...], said: str, table: Path, tmp_path: Path) -> None:
    """With what to change."""
    assert said in refused("trend", *({"TABLE": table, "FILE": npz(tmp_path / "a.npz", rows=2_000)}.get(word, word) for word in words))


@pytest.mark.parametrize("option", [("--axis", "z"), ("--map", "x.input=foo"), ("--span", "0:3"), ("--rate", "100"), ("--velocity",)])
def test_options_for_a_recording_are_refused_for_a_table(option: tuple[str, ...], table: Path) -> None:
    """They would change nothing."""
    assert "without --every" in refused("trend", table, *option)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("trend", "TABLE", "-o", "page.txt"), "page.txt; allowed: a name that ends with .html"),
        (("fleet", "--one", "FILE", "-o", "row.csv"), "row.csv; allowed: a name that ends with .parquet"),
        (("fleet", "--one", "FILE", "FILE"), "given with --one"),
        (("fleet", "--one", "FILE", "--workers", "3"), "given with --one"),
        (("fleet", "--one", "FILE", "--scheduler", "tcp://here:1"), "given with --one"),
        (("fleet", "FILE", "-o", "table", "--force"), "--force is given without --one"),
    ],
)
def test_an_option_without_an_effect_is_refused(
    words: tuple[str, ...], said: str, table: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before any work."""
    monkeypatch.chdir(tmp_path)
    path = npz(tmp_path / "a.npz", rows=300)
    assert said in refused(*({"TABLE": table, "FILE": path}.get(word, word) for word in words))


def test_one_machine_has_the_trend_that_it_has_among_all(table: Path) -> None:
    """--machine selects the output, not the axes from which the wander is learned."""
    (one,) = xy.trend(table, machines=["mill-01"]).trends
    every = xy.trend(table)
    assert (one.spread, one.moved) == (every.of("mill-01", "x", "gain").spread, every.of("mill-01", "x", "gain").moved)
    assert xy.trend(table, machines=["mill-00"]).events == () and len(every.events) == 1
