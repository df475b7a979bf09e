"""Samples of two streams are paired by number or stamp, in spite of any transmission fault."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers import ROOT
from helpers.bag_making import a_bag, a_recording, assert_same, block, both, joint_state, numbered
from helpers.cli_tools import cli, refused

from xy_sysid.bags import BagWriter, stream_blocks
from xy_sysid.bags.cdr import JOINT_TYPE
from xy_sysid.bags.streaming import Topics
from xy_sysid.errors import BadInput, BadRecording, XySysidError
from xy_sysid.imports import blocks, load, save
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.samples.joint_states import JointCounter
from xy_sysid.samples.recording import Recording

ENDINGS = pytest.mark.parametrize("ending", ["", ".db3", ".mcap"])


def of(path: Path, messages: list[tuple[str, Block]]) -> Recording:
    return load(a_bag(path / "bag", messages))


def true(recording: Recording) -> bool:
    """Assert that samples have the values that the test wrote for their numbers."""
    expected = recording.seq[:, None] + np.array([0.0, 0.25])[: len(recording.axes)]
    return np.array_equal(recording.voltage, expected) and np.array_equal(recording.position, 1e-3 * expected)


@ENDINGS
def test_a_bag_gives_back_what_was_saved(tmp_path: Path, ending: str) -> None:
    """Saved and loaded, a recording with gaps, a reference and any length is the same in every bit."""
    keep = np.r_[0:500, 700:1003]
    whole = a_recording(1003)
    recording = Recording(
        2000.0, ("x", "y"), whole.seq[keep], whole.time[keep], whole.voltage[keep], whole.position[keep], reference=whole.position[keep] + 1.0
    )
    save(recording, tmp_path / f"out{ending}")
    loaded = load(tmp_path / f"out{ending}")
    assert_same(loaded, recording)
    assert [note[:5] for note in loaded.notes] == ["1 gap"] and len(loaded.runs()) == 2


def test_units_travel_with_a_bag(tmp_path: Path) -> None:
    """A folder stores A and rad; a single file cannot store them, and an error says so."""
    recording = a_recording(100, ("a",), input_unit="A", output_unit="rad")
    save(recording, tmp_path / "out")
    assert_same(load(tmp_path / "out"), recording)
    with pytest.raises(BadRecording, match="no place for units"):
        save(recording, tmp_path / "out.mcap")


def test_blocks_never_reach_over_a_gap() -> None:
    """The blocks of a recording are consecutive and hold every sample once."""
    whole = a_recording(1000)
    keep = np.r_[0:333, 340:1000]
    recording = Recording(2000.0, ("x", "y"), whole.seq[keep], whole.time[keep], whole.voltage[keep], whole.position[keep])
    made = blocks(recording, 50)
    assert all(np.all(np.diff(v.seq) == 1) and np.array_equal(v.seq, p.seq) for v, p in made)
    np.testing.assert_array_equal(np.concatenate([p.values for _, p in made]), recording.position)


def test_lost_blocks_are_gaps(tmp_path: Path) -> None:
    """A lost block of either stream leaves a gap; the rest is paired correctly, with a note."""
    messages = both(range(0, 2000, 20))
    del messages[21], messages[81]
    recording = of(tmp_path, messages)
    assert true(recording) and len(recording) == 1960 and len(recording.runs()) == 3
    assert sum("no partner" in note for note in recording.notes) == 2


def test_late_and_repeated_blocks_are_put_right(tmp_path: Path) -> None:
    """Blocks up to half a second late are sorted, and repeated ones dropped."""
    messages = both(range(0, 4000, 20))
    messages.insert(130, messages.pop(60))
    messages.insert(40, messages[33])
    messages.insert(300, messages[200])
    recording = of(tmp_path, messages)
    assert true(recording) and len(recording) == 4000
    assert any("out of order" in note for note in recording.notes) and any("twice" in note for note in recording.notes)


def test_a_very_late_block_is_no_restart(tmp_path: Path) -> None:
    """A single block that is seconds late is put in its place, without further consequences."""
    messages = both(range(0, 20_000, 20))
    messages.append(messages.pop(400))
    messages.insert(1500, messages.pop(700))
    recording = of(tmp_path, messages)
    assert true(recording) and len(recording) == 20_000 and not any("anew" in note for note in recording.notes)


@pytest.mark.parametrize("first", [0, 3000])
def test_a_restart_of_the_source_is_a_gap(tmp_path: Path, first: int) -> None:
    """After a restart counters begin again: the parts are kept in sequence and never mixed."""
    recording = of(tmp_path, both(range(first, first + 4000, 20)) + both(range(0, 6000, 20)) + both(range(0, 2000, 20)))
    assert len(recording) == 12_000 and len(recording.runs()) == 3
    assert recording.sampling_rate == 2000.0 and bool(np.all(np.diff(recording.time) > 0))
    assert recording.voltage[:, 0].tolist() == [*range(first, first + 4000), *range(6000), *range(2000)]
    assert any("restarted 2 times" in note for note in recording.notes)


def test_a_restart_of_one_stream_alone_pairs_nothing_wrongly(tmp_path: Path) -> None:
    """If only one counter restarts, the following samples cannot be paired."""
    voltage = [("voltage", numbered(first)) for first in range(0, 8000, 20)]
    position = [("position", numbered(first % 4000, scale=1e-3)) for first in range(0, 8000, 20)]
    recording = of(tmp_path, [message for pair in zip(voltage, position, strict=True) for message in pair])
    assert true(recording) and len(recording) == 4000
    assert any("only the part before" in note for note in recording.notes)


def test_rows_that_are_not_numbers_become_gaps(tmp_path: Path) -> None:
    """NaN and infinity in value, time or number: the row is left out and counted."""
    messages = both(range(0, 2000, 20))
    messages[11][1].values[3, 1] = np.nan
    messages[40][1].time[5] = np.inf
    messages[61][1].seq[7] = np.nan
    recording = of(tmp_path, messages)
    assert true(recording) and len(recording) == 1997 and len(recording.runs()) == 4
    assert sum("not numbers" in note for note in recording.notes) == 2


def test_a_jump_of_the_clock_moves_no_sample(tmp_path: Path) -> None:
    """Samples are paired by number: a step of the clock changes neither the pairs nor the rate."""
    messages = both(range(0, 4000, 20))
    jumped = [(kind, Block(b.axes, b.seq, b.time + (37.0 if b.seq[0] >= 2000 else 0.0), b.values)) for kind, b in messages]
    recording = of(tmp_path, jumped)
    assert true(recording) and len(recording.runs()) == 1 and recording.sampling_rate == 2000.0


def test_unequal_rates_are_refused(tmp_path: Path) -> None:
    """Counters at different rates belong to different instants: one line with both rates."""
    slow = [("voltage", block(np.ones((20, 2)), first, rate=1000.0)) for first in range(0, 2000, 20)]
    with pytest.raises(BadRecording, match="voltage runs at 1000 Hz and position at 2000 Hz"):
        of(tmp_path, slow + both(range(0, 2000, 20))[1::2])


def test_counters_without_a_common_number_are_refused(tmp_path: Path) -> None:
    """Nothing to pair: the error gives the numbers of each stream."""
    with pytest.raises(BadRecording, match="voltage has 0 to 999, position 5000 to 5999"):
        of(tmp_path, both(range(0, 1000, 20))[0::2] + both(range(5000, 6000, 20))[1::2])


def test_axes_that_only_one_stream_has_are_left_out(tmp_path: Path) -> None:
    """Columns are matched by name, never by place; the choice and its order can be given."""
    swapped = [
        (k, Block(("y", "x", "z"), b.seq, b.time, np.column_stack((b.values[:, ::-1], b.seq)))) if k == "position" else (k, b)
        for k, b in both([0, 20])
    ]
    recording = of(tmp_path, swapped)
    assert recording.axes == ("x", "y") and true(recording) and any("are read" in note for note in recording.notes)
    chosen = load(tmp_path / "bag", axes=["y"])
    assert chosen.axes == ("y",) and chosen.voltage[:, 0].tolist() == recording.voltage[:, 1].tolist()
    with pytest.raises(BadInput, match="allowed: x, y"):
        load(tmp_path / "bag", axes=["q"])


def test_wrong_columns_are_left_out_and_said(tmp_path: Path) -> None:
    """Messages with columns other than seq,time,..., or with changing columns, are skipped."""
    messages = both(range(0, 2000, 20))
    with BagWriter(tmp_path / "bag") as writer:
        for count, (kind, content) in enumerate(messages):
            writer.write_block(f"/xy/{kind}", content, count)
            if count in (50, 51):
                writer.write_array(f"/xy/{kind}", ("sample", "time,seq,x,y"), (2, 4), np.ones(8), count)
                writer.write_array(f"/xy/{kind}", ("n",), (8,), np.ones(8), count)
                writer.write_block(f"/xy/{kind}", Block(("q",), np.array([9e5]), np.array([1.0]), np.ones((1, 1))), count)
    recording = load(tmp_path / "bag")
    assert true(recording) and len(recording) == 2000
    assert sum("messages on /xy/" in note for note in recording.notes) == 2
    assert sum("other columns than x, y" in note for note in recording.notes) == 2


def test_topics_can_be_named(tmp_path: Path) -> None:
    """Other topic names are an argument."""
    messages = [(f"/gantry/{'u' if kind == 'voltage' else 'y'}", content) for kind, content in both(range(0, 400, 20))]
    bag = a_bag(tmp_path / "bag", messages)
    assert true(load(bag, voltage_topic="/gantry/u", position_topic="/gantry/y"))


def test_a_part_can_be_taken(tmp_path: Path) -> None:
    """start and stop are seconds after the first sample."""
    bag = a_bag(tmp_path / "bag", both(range(5000, 25_000, 20)))
    part = load(bag, start=2.0, stop=3.5)
    assert true(part) and (part.seq[0], len(part)) == (9000, 3000)
    with pytest.raises(BadInput, match="start and stop"):
        load(bag, start=3.0, stop=3.0)
    with pytest.raises(BadInput, match="start"):
        load(bag, start=99.0)


def joint_bag(path: Path, stamps: list[int], names: tuple[str, ...] = ("x", "y"), effort: bool = True, log: int = 0) -> FloatArray:
    """A bag of joint states, and their positions."""
    position = np.random.default_rng(5).normal(size=(len(stamps), len(names)))
    with BagWriter(path) as writer:
        for count, stamp in enumerate(stamps):
            writer.write_raw(
                "/joint_states",
                JOINT_TYPE,
                joint_state(stamp, position[count], 10 * position[count] if effort else None, names),
                log + count * 500_000,
            )
    return position


def test_joint_states_are_found_and_their_effort_is_the_input(tmp_path: Path) -> None:
    """A robot's bag without our topics: joints are axes, effort is the input, with notes on both."""
    position = joint_bag(tmp_path / "bag", [10**18 + i * 500_000 for i in range(1500)], ("shoulder", "elbow"))
    recording = load(tmp_path / "bag")
    assert recording.axes == ("shoulder", "elbow") and recording.sampling_rate == 2000.0 and recording.input_unit == "effort"
    np.testing.assert_array_equal(recording.position, position)
    np.testing.assert_array_equal(recording.voltage, 10 * position)
    assert any("effort is the input" in note for note in recording.notes)
    told = load(tmp_path / "bag", effort_as_voltage=True)
    assert told.input_unit == "V" and any("taken as V" in note for note in told.notes)
    assert not any("taken as V" in note for note in load(tmp_path / "bag", effort_as_voltage=True, units={"input": "N m", "output": "rad"}).notes)


def test_lost_joint_states_are_gaps_and_repeated_ones_dropped(tmp_path: Path) -> None:
    """Stamps are counted in sample periods, over jitter of a fifth of one."""
    random = np.random.default_rng(6)
    jitter = random.integers(-100_000, 100_000, 3000)
    kept = np.delete(np.arange(3000), [100, 101, 2000])
    stamps = [int(10**18 + i * 500_000 + jitter[i]) for i in kept]
    stamps.insert(500, stamps[499])
    joint_bag(tmp_path / "bag", stamps)
    recording = load(tmp_path / "bag")
    assert recording.seq.tolist() == kept.tolist()
    assert recording.sampling_rate == pytest.approx(2000.0, rel=1e-4)


def test_wild_stamps_are_numbered_as_they_came(tmp_path: Path) -> None:
    """Stamps with jitter of nearly a period, without lost samples, give no false gaps, but a note."""
    random = np.random.default_rng(8)
    joint_bag(tmp_path / "bag", [int(10**18 + i * 500_000 + random.integers(0, 490_000)) for i in range(3000)])
    recording = load(tmp_path / "bag")
    assert len(recording.runs()) == 1 and len(recording) == 3000 and any("jitter" in note for note in recording.notes)
    assert recording.sampling_rate == pytest.approx(2000.0, rel=1e-4)


def test_without_stamps_the_time_of_recording_counts(tmp_path: Path) -> None:
    """All header stamps are zero: the log time is used, with a note."""
    joint_bag(tmp_path / "bag", [0] * 1000, log=5_000_000_000)
    recording = load(tmp_path / "bag")
    assert recording.sampling_rate == 2000.0 and recording.time[0] == 5.0 and any("time of recording" in note for note in recording.notes)


def robot_bag(path: Path, samples: int = 4000) -> tuple[FloatArray, FloatArray]:
    """As by ros2_control: names in any order, a gripper without effort, effort of the previous cycle, and our reference as blocks.

    Returns commands and positions of the two joints, (samples, 2) each.
    """
    random = np.random.default_rng(11)
    effort, position = random.normal(size=(samples, 2)), random.normal(size=(samples, 2))
    clock, stamp = 1_700_000_000.0, 0.0
    with BagWriter(path) as writer:
        for count in range(samples):
            stamp = clock + count / 200.0 + random.uniform(-5e-4, 5e-4)
            before = effort[count - 1] if count else np.zeros(2)
            names = ("gripper", "joint-2", "pan") if count % 3 else ("pan", "gripper", "joint-2")
            place = {"pan": 0, "joint-2": 1}
            told = [(0.0, np.nan) if name == "gripper" else (position[count, place[name]], before[place[name]]) for name in names]
            message = joint_state(round(stamp * 1e9), np.array([item[0] for item in told]), np.array([item[1] for item in told]), names)
            writer.write_raw("/joint_states", JOINT_TYPE, message, round(stamp * 1e9))
            if count % 20 == 19:
                seq = np.arange(count - 19.0, count + 1.0)
                block = Block(("x", "y"), seq + 77.0, clock + seq / 200.0 + 4e-4, np.column_stack((seq, -seq)))
                writer.write_block("/xy/reference", block, round(stamp * 1e9) + 1)
    return effort, position


def test_a_robots_joints_become_axes_with_their_effort_and_the_reference(tmp_path: Path) -> None:
    """Two of three joints, with our names and order; each sample with the effort that acts from then on, and its reference."""
    effort, position = robot_bag(tmp_path / "bag")
    units = {"input": "N m", "output": "rad"}
    found = load(tmp_path / "bag", effort_as_voltage=True, joints=("y=joint-2", "x=pan"), effort_lag=1, units=units)
    assert found.axes == ("y", "x") and found.units == ("N m", "rad")
    rows = found.seq.astype(int)
    assert len(rows) == 3999 and rows[0] == 0
    np.testing.assert_array_equal(found.position, position[rows][:, ::-1])
    np.testing.assert_array_equal(found.voltage, effort[rows][:, ::-1])
    assert found.reference is not None
    np.testing.assert_array_equal(found.reference[:, 1], rows)
    one = load(tmp_path / "bag", effort_as_voltage=True, joints=("x=pan",), effort_lag=0, axes=("x",))
    np.testing.assert_array_equal(one.voltage[1:, 0], effort[:-1, 0])
    every = load(tmp_path / "bag")
    assert set(every.axes) == {"pan", "joint-2"} and every.reference is None  # with their own names the reference cannot be assigned
    assert any("--joint" in note for note in every.notes) and any("gripper" in note for note in every.notes)


@pytest.mark.parametrize(
    ("joints", "words"),
    [(("x",), "axis=joint"), (("x=pan", "x=joint-2"), "once"), (("x=pan", "y=pan"), "a joint of its own"), (("x=elbow",), "no joint elbow among")],
)
def test_a_wrong_joint_is_one_line(tmp_path: Path, joints: tuple[str, ...], words: str) -> None:
    """No pair, an axis or a joint twice, an unknown joint."""
    robot_bag(tmp_path / "bag", 400)
    with pytest.raises(XySysidError, match=words):
        load(tmp_path / "bag", effort_as_voltage=True, joints=joints)


def test_replay_of_a_robots_bag_takes_the_nodes_own_parameters(tmp_path: Path) -> None:
    """The parameter file of the live identifier contains topic, joints, lag and units; they can also be given as options."""
    robot_bag(tmp_path / "bag")
    parameters = tmp_path / "live.yaml"
    live = {"source": "joint_state", "joint_topic": "/joint_states", "joints": ["y=joint-2", "x=pan"], "effort_as_voltage": True, "effort_lag": 1}
    content = {"/xy/identifier": {"ros__parameters": {**live, "input_unit": "N m", "output_unit": "rad", "length": 256, "band_high": 60.0}}}
    parameters.write_text(yaml.safe_dump(content))
    told = cli("replay", tmp_path / "bag", "--params", parameters, "--json").json
    assert told["units"] == {"input": "N m", "output": "rad"} and set(told["axes"]) == {"x", "y"}
    said = cli(
        "replay", tmp_path / "bag", "--effort", "--joint", "y=joint-2", "--joint", "x=pan", "--effort-lag", "1", "--set", "length=256",
        "--set", "band_high=60", "--set", "input_unit=N m", "--set", "output_unit=rad", "--json",
    ).json  # fmt: skip
    assert said["axes"] == told["axes"]
    assert "rad/s/(N m)" in " ".join(told["axes"]["x"]["values"]) or told["axes"]["x"]["values"]["input unit"] == "N m"


@pytest.mark.parametrize("name", ["ros2_control.yaml", "real.yaml"])
def test_a_run_file_to_copy_fixes_no_orders(name: str) -> None:
    """They come from the data of the machine, not from the template."""
    nodes = yaml.safe_load((ROOT / "config" / name).read_text(encoding="utf-8"))["nodes"]
    (own,) = [node.get("parameters") or {} for node in nodes if node["executable"] == "identifier"]
    assert not {"numerator_order", "denominator_order"} & own.keys()


def test_replay_takes_the_run_file_of_the_guide(tmp_path: Path) -> None:
    """docs/ros2-control.md writes one file for ``run`` and ``replay``: the template, with the names of the joint set, replays a bag of that joint."""
    robot_bag(tmp_path / "bag")
    text = (ROOT / "config" / "ros2_control.yaml").read_text(encoding="utf-8")
    run_file = tmp_path / "my_joint.yaml"
    run_file.write_text(text.replace("shoulder_pan_joint", "pan").replace("length: 512", "length: 256"), encoding="utf-8")
    told = cli("replay", tmp_path / "bag", "--params", run_file, "--json").json
    assert told["units"] == {"input": "N m", "output": "rad"} and set(told["axes"]) == {"x"}
    said = cli(
        "replay", tmp_path / "bag", "--effort", "--joint", "x=pan", "--effort-lag", "1", "--axis", "x", "--set", "length=256",
        "--set", "band_high=60", "--set", "input_unit=N m", "--set", "output_unit=rad", "--json",
    ).json  # fmt: skip
    assert said["axes"] == told["axes"]


def test_a_run_file_says_where_its_identifier_listens(tmp_path: Path) -> None:
    """Namespace, remapping, a parameter file beside it and its own parameters over that: as ``run`` starts the node."""
    (tmp_path / "cell.yaml").write_text("/**/watcher: {ros__parameters: {length: 128, band_high: 40.0}}")
    node = {"executable": "identifier", "name": "watcher", "params_file": "cell.yaml", "remap": {"voltage": "/drive/command"}}
    content = {"namespace": "/cell/left", "nodes": [{**node, "parameters": {"length": 256}}, {"executable": "recorder"}]}
    (tmp_path / "run.yaml").write_text(yaml.safe_dump(content))
    with BagWriter(tmp_path / "bag") as writer:
        for voltage, position in blocks(a_recording(4000)):
            writer.write_block("/drive/command", voltage, int(voltage.time[-1] * 1e9))
            writer.write_block("/cell/left/position", position, int(position.time[-1] * 1e9))
    found = cli("replay", tmp_path / "bag", "--params", tmp_path / "run.yaml", "--json").json
    said = cli(
        "replay", tmp_path / "bag", "--topic", "voltage=/drive/command", "--topic", "position=/cell/left/position", "--set", "length=256",
        "--set", "band_high=40", "--json",
    ).json  # fmt: skip
    assert found["axes"] == said["axes"]


def test_a_run_file_of_two_machines_is_refused_in_one_line(tmp_path: Path) -> None:
    """The choice between nodes is not guessed."""
    save(a_recording(400), tmp_path / "bag")
    two = [{"executable": "identifier", "name": name} for name in ("left", "right")]
    (tmp_path / "run.yaml").write_text(yaml.safe_dump({"nodes": two}))
    assert "with 2 of executable: identifier" in refused("replay", tmp_path / "bag", "--params", tmp_path / "run.yaml")


def test_a_diagnosis_of_a_bag_heeds_the_run_files_diagnoser(tmp_path: Path) -> None:
    """Its tolerance is in the story, as in live operation."""
    save(a_recording(40_000), tmp_path / "bag")
    nodes = [{"executable": "identifier"}, {"executable": "diagnoser", "parameters": {"tolerance": 0.02}}]
    (tmp_path / "run.yaml").write_text(yaml.safe_dump({"nodes": nodes}))
    found = cli("replay", tmp_path / "bag", "--params", tmp_path / "run.yaml", "--diagnose", "--axis", "x", "--json").json
    assert found["stories"]["x"]["tolerance"] == 0.02


def test_joint_states_are_numbered_in_a_replay_as_they_were_live(tmp_path: Path) -> None:
    """Late cycles that catch up, and lost ones: samples are numbered one by one, with the same numbers and times as in a node."""
    random = np.random.default_rng(3)
    late = np.where(random.random(3000) < 0.02, random.uniform(1.0, 5.0, 3000), 0.0)
    begins = np.maximum.accumulate(np.arange(3000) + late)
    kept = np.delete(np.arange(3000), np.arange(1200, 1240))
    stamps = (10**18 + np.round(begins * 5e6 + 1e3 * np.arange(3000)).astype(np.int64))[kept]
    position = joint_bag(tmp_path / "bag", stamps.tolist())
    counter = JointCounter(("x", "y"), with_voltage=False)
    live = [counter.add(float(stamp) * 1e-9, np.concatenate((row, 10 * row))) for stamp, row in zip(stamps, position, strict=True)]
    whole = [part for part in live if part is not None]
    replayed = [part for kind, part in stream_blocks(tmp_path / "bag", Topics(effort_as_voltage=True)) if kind == "position"]
    assert len(whole) > 100
    for name, width in (("seq", None), ("time", None), ("values", 2)):
        one, other = (np.concatenate([getattr(part, name) for part in parts]) for parts in (whole, replayed))
        np.testing.assert_array_equal(one[:, :width] if width else one, other)


def test_joint_states_pair_with_voltage_blocks_by_stamp(tmp_path: Path) -> None:
    """Position of a real machine as joint states, voltage as blocks: nearest voltage sample, no drift over a lossy stream."""
    random = np.random.default_rng(9)
    position = random.normal(size=(6000, 2))
    clock = 1_700_000_000.0
    with BagWriter(tmp_path / "bag") as writer:
        for first in range(0, 6000, 20):
            seq = np.arange(first, first + 20.0)
            writer.write_block("/xy/voltage", Block(("x", "y"), seq, clock + seq * 0.5003e-3, np.column_stack((seq, seq))), first)
            for index in range(first, first + 20):
                if not 1000 <= index < 1010:
                    stamp = round((clock + index * 0.5003e-3 + random.uniform(-1e-4, 1e-4)) * 1e9)
                    writer.write_raw("/joint_states", JOINT_TYPE, joint_state(stamp, position[index], None, ("y", "x")), first)
    recording = load(tmp_path / "bag", joint_topic="/joint_states")
    assert recording.axes == ("x", "y") and recording.input_unit == "V"
    assert recording.seq.tolist() == [*range(1000), *range(1010, 6000)]
    np.testing.assert_array_equal(recording.position, position[recording.seq][:, ::-1])
    np.testing.assert_array_equal(recording.voltage[:, 0], recording.seq)
    found = [content for kind, content in stream_blocks(tmp_path / "bag") if kind == "position"]
    assert np.concatenate([content.seq for content in found]).tolist() == recording.seq.tolist()


def test_joint_states_without_an_input_are_one_line(tmp_path: Path) -> None:
    """No voltage topic and no effort, or zero effort: the error names the missing input."""
    joint_bag(tmp_path / "none", [i * 500_000 for i in range(1, 100)], effort=False)
    with pytest.raises(BadRecording, match="fewer than 2 samples of effort"):
        load(tmp_path / "none")
    with BagWriter(tmp_path / "zero") as writer:
        for i in range(1, 100):
            writer.write_raw("/joint_states", JOINT_TYPE, joint_state(i * 500_000, np.ones(2), np.zeros(2)), i)
    with pytest.raises(BadRecording, match="zero throughout"):
        load(tmp_path / "zero")


def test_several_joint_topics_need_a_choice(tmp_path: Path) -> None:
    """The choice is not guessed; the error names them and the option."""
    with BagWriter(tmp_path / "bag") as writer:
        for i in range(1, 100):
            for arm in ("left", "right"):
                writer.write_raw(f"/{arm}/joint_states", JOINT_TYPE, joint_state(i * 500_000, np.ones(2), np.ones(2) * (arm == "left") + 1), i)
    with pytest.raises(BadRecording, match=r"/left/joint_states, /right/joint_states.*--topic joints="):
        load(tmp_path / "bag")
    assert load(tmp_path / "bag", joint_topic="/right/joint_states").voltage[0, 0] == 1.0
