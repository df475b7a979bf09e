"""Parameters that have left their interval since commissioning: the comparison, its files, and the status of the nodes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.live_nodes import Source, newest
from helpers.ros_tools import World, needs_ros, world_in

import xy_sysid as xy
from xy_sysid.axis.model import STANDARD
from xy_sysid.errors import BadInput, BadRecording
from xy_sysid.fleets.baseline import AGREEING, Baseline, compare
from xy_sysid.fleets.baseline_words import status
from xy_sysid.fleets.causes import causes
from xy_sysid.fleets.commissioned import of_axis_models, of_transfer_functions
from xy_sysid.fleets.history import MONTH
from xy_sysid.fleets.wander import Series
from xy_sysid.live.plain_messages import OK, WARN, StatusMessage
from xy_sysid.nodes.since_commissioning import SinceCommissioning
from xy_sysid.response.estimate import Estimate
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import DiagnoserSettings, IdentifierSettings

IDENTIFIER, DIAGNOSER = "xy_sysid.nodes.identifier", "xy_sysid.nodes.diagnoser"


def estimate(name: str, value: float, unit: str = "V", width: float = 0.004) -> Estimate:
    """An estimate with an interval of this fraction of its value on either side."""
    return Estimate(name=name, value=value, unit=unit, low=value * (1.0 - width), high=value * (1.0 + width))


KNOWN = (estimate("gain", 0.1, "m/s/V"), estimate("coulomb_friction.coulomb", 0.12))


def heard(gain: float, friction: float, times: int = AGREEING, spreads: dict[str, float] | None = None) -> StatusMessage:
    """The status after several stretches of an axis whose parameters are these fractions of those at commissioning."""
    baseline = Baseline(KNOWN, spreads or {})
    for k in range(times):
        baseline.hear([replace(item, value=item.value * part) for item, part in zip(KNOWN, (gain, friction), strict=True)], k, k + 1)
    return status("x", baseline, causes(), 1000.0)


def test_a_parameter_that_left_its_interval_is_named_with_its_size_and_a_cause() -> None:
    """Values then and now, change, and likely cause, in one sentence; the values give both intervals."""
    told = heard(1.0, 1.45)
    assert told.level == WARN
    assert told.message.startswith("axis x: since commissioning coulomb_friction.coulomb rose from 0.12 to 0.174 V (+45 %). Likely cause: lack of")
    values = dict(told.values)
    assert values["coulomb_friction.coulomb at commissioning (V)"] == "0.12" and float(values["gain 95 % low"]) < 0.1
    assert float(values["coulomb_friction.coulomb by chance once in (axis-months)"]) > 1000.0


def test_a_load_that_changes_its_sign_has_no_per_cent() -> None:
    """Neither did it fall."""
    known = estimate("constant_load.load", -0.1)
    baseline = Baseline([known], {})
    for k in range(AGREEING):
        baseline.hear([replace(known, value=0.05)], k, k + 1)
    assert "constant_load.load changed from -0.1 to 0.05 V. Likely" in status("x", baseline, causes(), 1000.0).message


def test_what_lies_within_the_usual_spread_has_not_left() -> None:
    """Without a table, recordings of an unchanged axis are assumed to differ by 3 %."""
    assert heard(1.03, 0.95).level == OK


def test_a_table_that_says_how_little_recordings_differ_finds_smaller_changes() -> None:
    """A gain that wanders by 0.4 % and fell by 5 %."""
    assert heard(0.95, 1.0).level == OK
    told = heard(0.95, 1.0, spreads={"gain": 0.004})
    assert told.level == WARN and "gain fell from 100 to 95 mm/s/V (-5 %). Likely cause: the amplifier or its supply." in told.message


def test_a_parameter_in_another_unit_is_not_compared() -> None:
    """A gain per ampere cannot be compared with one per volt: the status says so, and judges the other parameters."""
    baseline = Baseline(KNOWN, {})
    for k in range(AGREEING):
        baseline.hear([estimate("gain", 0.3, "m/s/A"), KNOWN[1]], k, k + 1)
    told = status("x", baseline, causes(), 1000.0)
    assert told.level == WARN and [item.name for item in baseline.compared(1000.0)] == ["coulomb_friction.coulomb"]
    assert told.message == (
        "axis x: every parameter that is compared is within its interval since commissioning; "
        "gain is not compared, since its unit was m/s/V at commissioning and is m/s/A"
    )


def test_a_model_with_other_effects_than_at_commissioning_is_named() -> None:
    """Gain and pole of models with and without friction differ; repeatedly found backlash is reported, too."""
    baseline = Baseline(KNOWN, {}, effects=STANDARD.effects)
    gap = estimate("backlash.gap", 1e-5, "m")
    for k, today in enumerate(([*KNOWN], [*KNOWN, gap], [KNOWN[0], gap], [KNOWN[0], gap])):
        baseline.hear(today, k, k + 1)
    told = status("x", baseline, causes(), 1000.0)
    assert told.message.endswith(
        "; today's model has other effects than that of commissioning, on which gain and pole depend: "
        "with backlash (3 of 3 estimates), without coulomb_friction (2 of 3 estimates)"
    )
    baseline.hear(KNOWN, 4, 5)
    assert status("x", baseline, causes(), 1000.0).message == "axis x: every parameter is within its interval since commissioning"


def test_one_or_two_stretches_that_are_off_are_no_change() -> None:
    """As in a trend: the third one in a row declares it."""
    assert [heard(1.0, 2.0, times).level for times in range(4)] == [OK, OK, OK, WARN]
    assert heard(1.0, 2.0, 2).message == "axis x: 2 of 3 estimates that are compared with commissioning"
    baseline = Baseline(KNOWN, {})
    for k, part in enumerate((1.0, 2.0, 2.0, 1.0, 1.0)):
        baseline.hear([estimate("gain", 0.1 * part, "m/s/V")], k, k + 1)
        assert status("x", baseline, causes(), 1000.0).level != WARN


def test_stretches_with_common_samples_do_not_count_twice() -> None:
    """An overlapping stretch is ignored; another fit of the same stretch replaces the first."""
    baseline = Baseline(KNOWN, {})
    for begin in (0.0, 5.0, 9.0):
        baseline.hear([estimate("gain", 0.2, "m/s/V")], begin, begin + 10.0)
    assert baseline.stretches == 1
    baseline.hear([estimate("gain", 0.1, "m/s/V")], 0.0, 10.0)
    (one,) = baseline.compared(1000.0)
    assert one.now == 0.1 and baseline.stretches == 1


def test_unchanged_axes_leave_no_interval_more_often_than_is_allowed() -> None:
    """60 starts of a node on another day than commissioning, with a wander of 3 % on both days: none raises an alarm."""
    random = np.random.default_rng(8)
    level = np.log(1000.0 * MONTH * 5)
    wander = 0.03 * random.standard_normal((60, 2))
    assert max(compare(Series(np.arange(2.0), row, np.full(2, 0.002)), 0.03) for row in wander) < level


def test_files_of_other_kinds_are_refused_in_one_line(tmp_path: Path) -> None:
    """The identifier takes a file of fit, the diagnoser one of refine; each says which."""
    linear, physical = tmp_path / "linear.yaml", tmp_path / "physical.yaml"
    run = Recording.from_arrays(2000.0, *moving(20_000)).run("x")
    xy.save(xy.fit(xy.frf(run)), linear)
    xy.save(xy.refine(run).model, physical)
    tf, known = of_transfer_functions(linear)["x"]
    assert {"gain", "delay"} <= {item.name for item in known} and tf.denominator.size > 1
    assert [item.name for item in of_axis_models(physical, STANDARD)["x"]] == ["gain", "delay", "pole"]
    with pytest.raises((BadInput, BadRecording), match="fit --model"):
        of_transfer_functions(physical)
    with pytest.raises(BadRecording, match="refine --model"):
        of_axis_models(linear, STANDARD)


def test_a_table_without_a_baseline_is_not_read(tmp_path: Path) -> None:
    """The trend of a table takes long: neither node reads it without a baseline."""
    nowhere = str(tmp_path / "nowhere")
    assert SinceCommissioning.of_identifier(IdentifierSettings(baseline_table=nowhere), ("x",)).statuses() == []
    assert SinceCommissioning.of_diagnoser(DiagnoserSettings(baseline_table=nowhere), ("x",), STANDARD).statuses() == []


def moving(count: int, gain: float = 0.1) -> tuple[Any, Any]:
    """Voltage and position of a lagging integrator, as in ``Source``."""
    rate, pole = 2000.0, 320.0
    u = np.random.default_rng(6).standard_normal(count)
    a = float(np.exp(-pole / rate))
    speed, path = 0.0, np.zeros(count)
    for n in range(count - 1):
        lag = speed - gain * u[n]
        path[n + 1] = path[n] + gain / rate * u[n] + lag * (1 - a) / pole
        speed = a * speed + gain * (1 - a) * u[n]
    return u, np.round(path / 5e-7) * 5e-7


def all_heard(statuses: list[Any], seconds: float) -> bool:
    """The diagnoser has received all samples except the newest one or two blocks."""
    return float(newest(statuses, "diagnoser").get("seconds heard (s)", "0")) >= seconds - 0.2


@pytest.fixture
def world(tmp_path: Path) -> Iterator[World]:
    with world_in(tmp_path) as made:
        yield made


@needs_ros
def test_the_identifier_says_that_the_gain_fell(world: World, tmp_path: Path) -> None:
    """One axis had another gain at commissioning: diagnostics name it, and report nothing for the unchanged axis."""
    runs = {name: Recording.from_arrays(2000.0, *moving(20_000, gain)).run("x") for name, gain in (("x", 0.16), ("y", 0.1))}
    xy.save({name: xy.fit(xy.frf(run)) for name, run in runs.items()}, tmp_path / "baseline.yaml")
    statuses = world.statuses("/diagnostics")
    source = Source(world)
    node = world.start(IDENTIFIER, {"length": 1024, "refit": 0.5, "baseline": str(tmp_path / "baseline.yaml")})
    assert world.until(source.found, 30.0), node.output()
    source.send(0, 30_000)
    assert world.until(lambda: newest(statuses, "xy/identifier: baseline x").get("level") == str(WARN), 20.0), node.output()
    told = newest(statuses, "xy/identifier: baseline x")["message"]
    assert re.search(r"since commissioning gain fell from 160 to (100|99\.\d+|100\.\d+) mm/s/V \(-37", told), told
    quiet = newest(statuses, "xy/identifier: baseline y")
    assert (quiet["level"], quiet["message"]) == (str(OK), "axis y: every parameter is within its interval since commissioning")


@needs_ros
def test_the_diagnoser_compares_each_diagnosis_with_commissioning(world: World, tmp_path: Path) -> None:
    """Three fits of stretches without a common sample; the third one declares the change."""
    from std_srvs.srv import Trigger

    run = Recording.from_arrays(2000.0, *moving(20_000, 0.16)).run("x")
    xy.save(xy.refine(run).model, tmp_path / "baseline.yaml")
    statuses = world.statuses()
    source = Source(world, ("x",))
    settings = {"axes": '["x"]', "memory": 3.0, "minimum": 2.0, "baseline": str(tmp_path / "baseline.yaml")}
    node = world.start(DIAGNOSER, settings)
    assert world.until(source.found, 30.0), node.output()
    for number in range(AGREEING):
        source.send(8_000 * number, 8_000 * (number + 1))
        assert world.until(partial(all_heard, statuses, 4.0 * (number + 1)), 20.0)
        assert world.call(Trigger, "/xy/diagnoser/renew", Trigger.Request(), 60.0).success
    assert world.until(lambda: newest(statuses, "baseline x").get("level") == str(WARN), 20.0), node.output()
    told = newest(statuses, "baseline x")["message"]
    assert re.search(r"gain fell from 160 to (100|99\.\d+|100\.\d+) mm/s/V", told), told


@needs_ros
def test_a_baseline_that_cannot_be_used_ends_the_node_in_one_line(world: World, tmp_path: Path) -> None:
    """At the start, before any sample."""
    node = world.start(IDENTIFIER, {"baseline": str(tmp_path / "nothing.yaml")})
    assert node.wait(30.0) == 2
    assert "nothing.yaml" in node.output() and "Traceback" not in node.output()
