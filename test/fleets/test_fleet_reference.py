"""The effects tried first in a recording are those of the axis's first recording, independent of the order of the analysis."""

from __future__ import annotations

import random
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from helpers.simulated import recorded

from xy_sysid.fleets.columns import TIMES
from xy_sysid.fleets.naming import Names
from xy_sysid.fleets.of_file import Done, Task, rows_of_file
from xy_sysid.fleets.reference import References
from xy_sysid.fleets.row import Row
from xy_sysid.imports import save

DAYS = [f"2026-03-0{day}" for day in range(1, 6)]
NUT = (("x", ("coulomb_friction", "backlash")),)


def tasks(machine: str = "mill-01", days: Sequence[str] = DAYS) -> list[Task]:
    return [Task(f"/data/{machine}/{day}.npz") for day in days]


def answer(effects: str = "coulomb_friction, backlash", **more: Any) -> Row:
    return {"machine": "mill-01", "axis": "x", "verdict": "missing_effect", "effects": effects} | more


def in_table(day: str, key: str = "") -> Row:
    return answer(date=datetime.fromisoformat(day).replace(tzinfo=UTC), source=f"/data/mill-01/{day}.npz", key=key)


def test_the_first_recording_by_date_tells_the_others_what_is_tried_first() -> None:
    """In any order of the arguments."""
    given = tasks()
    random.Random(3).shuffle(given)
    plan = References(given, ())
    (asked,) = plan.next()
    assert asked.path.endswith(DAYS[0] + ".npz") and asked.first == ()
    plan.hear(Done(asked.path, (answer(),)))
    assert plan.next() == []
    assert plan.rest() == [replace(task, first=NUT) for task in tasks(days=DAYS[1:])]


def test_each_machine_has_a_first_recording_of_its_own() -> None:
    """All of them can be analysed at the same time."""
    plan = References([*tasks("mill-01"), *tasks("mill-02")], ())
    assert [Path(task.path).parent.name for task in plan.next()] == ["mill-01", "mill-02"]


def test_a_first_recording_without_an_answer_gives_way_to_the_next() -> None:
    """A broken file gives no information; a rigid axis is an answer without effects to try first."""
    plan = References(tasks(), ())
    for row in ({"problem": "rubbish"}, answer("", verdict="not_enough_data"), answer("", verdict="nothing_missing")):
        (asked,) = plan.next()
        plan.hear(Done(asked.path, (row,)))
    assert plan.next() == [] and {task.first for task in plan.rest()} == {()} and len(plan.rest()) == 2


def test_the_table_knows_earlier_recordings() -> None:
    """Recordings not given again need no analysis, and unchanged ones are found by their key."""
    plan = References(tasks(days=DAYS[1:]), [in_table(DAYS[0])])
    assert plan.next() == [] and {task.first for task in plan.rest()} == {NUT} and len(plan.rest()) == 4
    plan = References(tasks(), [in_table(DAYS[0], key="k")])
    (asked,) = plan.next()
    plan.hear(Done(asked.path, (), unchanged=True, key="k"))
    assert plan.next() == [] and {task.first for task in plan.rest()} == {NUT}


def test_recordings_without_a_date_in_their_path_are_searched_as_if_nothing_were_known() -> None:
    """The first one is unknown before all are read."""
    plan = References(tasks(days=["a", "b"]), ())
    assert plan.next() == [] and [task.first for task in plan.rest()] == [(), ()]


def test_axes_that_the_path_tells_are_apart() -> None:
    """Each file holds one axis: its own first recording counts."""
    names = Names(pattern="{machine}/{axis}/{date}.npz")
    plan = References([Task(f"/d/m/{axis}/{day}.npz", names) for axis in "xz" for day in DAYS], ())
    assert [task.path for task in plan.next()] == [f"/d/m/{axis}/{DAYS[0]}.npz" for axis in "xz"]


def test_a_row_from_a_known_set_has_the_parameters_of_a_whole_search(tmp_path: Path) -> None:
    """The row lists the effects tried first; a set that does not explain the recording changes only the key."""
    path = tmp_path / "mill-01" / "2026-03-01.npz"
    save(recorded("coulomb_friction=0.15", seconds=10.0), path)
    whole, known, wrong = (
        rows_of_file(Task(str(path), first=(("x", names),))).rows[0] for names in ((), ("coulomb_friction", "constant_load"), ("constant_load",))
    )
    assert known["tried_first"] == "coulomb_friction, constant_load" and known["effects"] == whole["effects"] == "coulomb_friction"
    for name in ("gain", "delay", "pole", "coulomb_friction_coulomb"):
        assert abs(known[name] - whole[name]) < 0.05 * (whole[f"{name}_high"] - whole[f"{name}_low"])
    differs = {*TIMES, "key"}
    assert {k: v for k, v in wrong.items() if k not in differs} == {k: v for k, v in whole.items() if k not in differs}
    assert len({row["key"] for row in (whole, known, wrong)}) == 3 and whole["tried_first"] == ""
