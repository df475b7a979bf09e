"""Everything together: xy.use, xy-sysid use, and the snippets that they write."""

from __future__ import annotations

import ast
import configparser
import ctypes
import itertools
import re
import sys
import types
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from blark.parse import parse_source_code
from helpers.cli_tools import cli, refused
from helpers.known_models import GAIN, POLE, known, unknown
from helpers.simulated import recorded

import xy_sysid as xy
from xy_sysid.control_design import snippets
from xy_sysid.control_design.compensation import left_words
from xy_sysid.control_design.exports import export
from xy_sysid.control_design.gains import Gains
from xy_sysid.control_design.uncertain import Derived
from xy_sysid.control_design.use import use
from xy_sysid.units import Units

TRAVEL = -0.025, 0.025  # m
FIVE = [(name, ctypes.c_void_p) for name in ("allocate", "deallocate", "reallocate", "zero_allocate", "state")]  # of rcutils_allocator_t


@pytest.fixture(scope="module")
def model() -> xy.PhysicalModel:
    """A table with dry friction, from half a minute."""
    return xy.refine(recorded("coulomb_friction=0.3", 12.0).run("x"), add=["coulomb_friction"], auto=False).model


@pytest.fixture(scope="module")
def other() -> xy.Run:
    """Another recording of the same table."""
    return recorded("coulomb_friction=0.3", 6.0, seed=77).run("x")


def test_before_and_after_are_told_on_the_machines_own_recording(model: xy.PhysicalModel, other: xy.Run) -> None:
    """The recorded input is predicted from the recorded motion, and each feedforward makes the simulated tracking error smaller, within the limit."""
    used = use(model, other)
    assert used.predicted is not None and used.refused == ()
    assert used.predicted.whole < 1.01 * used.predicted.simple < 0.5 * used.predicted.inertia < used.predicted.voltage
    assert [item.path for item in used.tracking] == ["S-curve over the travel", "the recorded motion"]
    for item in used.tracking:
        assert item.whole < item.simple / 3.0 and item.whole < item.feedback / 10.0
        assert item.worst >= item.whole and item.largest <= item.limit == np.max(np.abs(other.voltage))
        (states,) = item.loops
        assert states.name == "state feedback" and states.largest <= item.limit
        assert states.compensated < states.alone / 10.0 and states.compensated <= states.worst < 2.0 * item.worst
    assert used.gains["kS"].low < 0.3 < used.gains["kS"].high
    assert not used.notes
    assert "fitted to this recording" in " ".join(use(model, recorded("coulomb_friction=0.3", 12.0).run("x")).notes)


def test_a_filter_in_the_loop_is_tried_along_the_same_path() -> None:
    """The loop with the notch or low-pass has a higher bandwidth, and a smaller error along the path, alone and with the compensation."""
    used = use(known("screw_compliance", spread=0.02), rate=2000.0, limit=10.0, travel=(-0.05, 0.05))
    assert used.filter is not None
    by_name = {item.name: item for item in used.tracking[0].loops}
    assert set(by_name) == {f"with the {used.filter.kind}", "state feedback"}
    better = by_name[f"with the {used.filter.kind}"]
    assert better.alone < used.tracking[0].feedback and better.compensated < 0.1 * better.alone and better.largest < 10.0


def test_the_swing_of_the_load_is_told_without_and_with_the_shaper() -> None:
    """After the fastest path: as a simulation of mass, spring and damper in small steps gives it, and a tenth at most with the shaper."""
    used = use(known("screw_compliance", spread=0.001), rate=2000.0, limit=10.0, travel=(-0.05, 0.05))
    assert used.rings is not None and used.fastest is not None and used.shaper is not None
    mode, steps = used.modes[0], 20
    w, h = 2.0 * np.pi * mode.held.value, 1.0 / (2000.0 * steps)
    place = speed = 0.0
    driven = np.concatenate((used.fastest.path.position, np.full(200, used.fastest.path.position[-1])))
    fine = np.interp(np.arange((driven.size - 1) * steps) / steps, np.arange(driven.size), driven - driven[0])
    last, swing = int(np.flatnonzero(np.abs(fine - fine[-1]) > 1e-9 * np.ptp(fine))[-1]), []
    for k, (at, rate) in enumerate(zip(fine[:-1], np.diff(fine) / h, strict=True)):
        speed += h * (w * w * (at - place) + 2.0 * mode.held_damping * w * (rate - speed))
        place += h * speed
        if k > last:
            swing.append(place)
    assert used.rings[0] == pytest.approx(0.5 * np.ptp(swing), rel=0.05) and used.rings[0] > 1e-7
    assert used.rings[1] < 0.1 * used.rings[0]


def test_a_model_without_intervals_is_used_with_a_warning() -> None:
    """Its numbers have no intervals, and the answer says so."""
    used = use(unknown("coulomb_friction"))
    assert "no intervals" in used.notes[0] and used.feedback is not None and used.feedback.count == 1


def test_the_rate_is_that_of_the_models_recording_or_is_asked_for(tmp_path: Path, model: xy.PhysicalModel) -> None:
    """A file contains the rate of the recording of its model; if it is unknown, none is assumed, and the travel is unchanged."""
    file = tmp_path / "axes.yaml"
    for name, of in (("fitted", model), ("known", replace(known("cogging"), sampling_rate=500.0))):
        xy.save(of, file, force=True)
        read = xy.load_model(file)
        assert isinstance(read, xy.PhysicalModel) and read.sampling_rate == of.sampling_rate == {"fitted": 2000.0, "known": 500.0}[name]
    said = cli("use", file, "--limit", "5", "--json").json["axes"]["x"]
    assert said["sampling_rate"] == 500.0 and said["rate_from"] == "of the recording that the model was fitted to" and said["travel"] is None
    assert said["tables"] == [] and said["fastest"] is None and said["tracking"] == []
    assert "--travel LOW HIGH" in {item["what"]: item["reason"] for item in said["refused"]}["path and tables by position"]
    xy.save(replace(known(), sampling_rate=None), file, force=True)
    assert "--controller-rate" in refused("use", file, "--limit", "5")
    assert cli("use", file, "--controller-rate", "1000", "--json").json["axes"]["x"]["rate_from"] == "given"


def test_an_axis_that_measures_its_speed_only_gets_feedforward_and_no_position_loop(tmp_path: Path) -> None:
    """The integral of a speed drifts: no position loop, position table or travel; a file names the measured quantity. Noise is that of the speed."""
    run = recorded("coulomb_friction=0.3", 6.0, seed=77).run("x")
    speed = np.diff(run.position, prepend=run.position[0]) * run.sampling_rate + 5e-3 * np.random.default_rng(2).standard_normal(len(run))
    fast = replace(run, position=np.cumsum(speed) / run.sampling_rate, measured="velocity")
    model = replace(known("coulomb_friction", "cogging"), units=fast.units)
    used = use(model, fast)
    assert used.feedback is None and used.states is None and not used.tracking and not used.tables and used.travel is None and used.fastest is None
    assert {"feedback", "state feedback"} <= {what for what, why in used.refused if "velocity is measured, and no position" in why}
    assert used.gains["kV"].determined and used.predicted is not None
    with pytest.raises(xy.BadInput, match="without a controller"):
        export(used, "linuxcnc")
    size = 0.05 * float(np.std(run.voltage)) * GAIN * POLE / 5e-3 / (2.0 * np.pi)
    assert used.predicted.below == pytest.approx(size, rel=0.2) and 10.0 < size < 100.0
    xy.save(model, tmp_path / "speed.yaml")
    read = xy.load_model(tmp_path / "speed.yaml")
    assert isinstance(read, xy.PhysicalModel) and read.units.sensed == "velocity" and use(read).feedback is None


def test_what_cannot_be_designed_safely_is_refused_and_the_rest_is_told() -> None:
    """An undetermined gain gives no controller; the gains are marked; tables are still written."""
    used = use(known("cogging", gain=0.9), limit=5.0, travel=TRAVEL)
    assert used.feedback is None and not used.tracking
    assert dict(used.refused)["feedback"].startswith("gain is known to worse than a factor of two")
    assert any("kV is not determined" in note for note in used.notes) and used.tables


def test_backlash_becomes_a_correction_by_direction() -> None:
    """The gap with its interval, and its use."""
    used = use(known("backlash"))
    assert used.gap is not None and used.gap.value == pytest.approx(20e-6) and "half of it" in used.gap.meaning
    assert dict(used.not_undone)["backlash"]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"rate": 0.0001}, "rate is 0.0001 Hz"),
        ({"limit": -1.0}, "limit is -1 V"),
        ({"travel": (0.1, 0.0)}, "travel is 0.1 to 0"),
    ],
)
def test_values_out_of_range_are_refused_in_one_line(values: dict[str, Any], words: str) -> None:
    """The given value, the allowed values, the next action."""
    with pytest.raises(xy.BadInput, match=words):
        use(known(), **values)  # a wrong value on purpose


def test_a_transfer_function_is_refused() -> None:
    """Only a model with physical effects has friction, limits and positions."""
    linear = xy.LinearModel(known().tf)
    with pytest.raises(xy.BadInput, match="a model with physical effects"):
        use(linear)  # a wrong type on purpose


def test_a_ros2_control_snippet_is_yaml_with_the_names_of_pid_controller() -> None:
    """Gains, clamps and strategy under the joint's name."""
    used = use(known("coulomb_friction"), limit=5.0, travel=TRAVEL)
    (text,) = export(used, "ros2_control").files.values()
    own = yaml.safe_load(text)["pid_controller"]["ros__parameters"]
    assert own["dof_names"] == ["x"] and used.feedback is not None
    assert own["gains"]["x"]["p"] == pytest.approx(used.feedback.controller.kp, rel=1e-5) and used.fastest is not None
    fed = used.gains.value("kV") * used.fastest.bounds.speed
    assert 1.0 < fed < 4.0 and own["gains"]["x"]["u_clamp_max"] == -own["gains"]["x"]["u_clamp_min"] == pytest.approx(5.0 - fed, rel=1e-5)
    clamps = {"i_clamp_max", "i_clamp_min", "u_clamp_max", "u_clamp_min"}
    assert set(own["gains"]["x"]) == {"p", "i", "d", *clamps, "antiwindup_strategy", "feedforward_gain"}
    assert own["gains"]["x"]["feedforward_gain"] == pytest.approx(used.gains["kV"].value, rel=1e-5), "it multiplies the velocity that is asked for"
    assert set(own) == {"dof_names", "command_interface", "reference_and_state_interfaces", "enable_feedforward", "gains"}
    assert own["enable_feedforward"] is True, "it is off by default, and the gain does nothing then"
    note = export(used, "ros2_control").note
    assert "~/set_feedforward_control" in note and "not its sum with the feedforward" in note


@pytest.mark.parametrize("name", ["y", "no", "1", "it's"])
def test_the_parser_of_ros_2_reads_an_axis_name_as_text(name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """rcl reads a plain y as true and 1 as an integer; quoted, each is a name, in the list of joints and in the gains."""
    file = tmp_path / "controllers.yaml"
    (text,) = export(use(replace(known(), axis=name)), "ros2_control").files.values()
    file.write_text(text)
    own = yaml.safe_load(text)["pid_controller"]["ros__parameters"]
    assert own["dof_names"] == [name] and list(own["gains"]) == [name]
    library = Path(sys.prefix) / "lib" / "librcl_yaml_param_parser.so"
    if not library.exists():
        pytest.skip("rcl comes with the extra [ros]")
    rcl, allocator = ctypes.CDLL(str(library)), ctypes.CDLL(str(library.with_name("librcutils.so"))).rcutils_get_default_allocator
    allocator.restype, rcl.rcl_yaml_node_struct_init.restype = type("Allocator", (ctypes.Structure,), {"_fields_": FIVE}), ctypes.c_void_p
    found = ctypes.c_void_p(rcl.rcl_yaml_node_struct_init(allocator()))
    assert rcl.rcl_parse_yaml_file(str(file).encode(), found)
    rcl.rcl_yaml_node_struct_print(found)
    ctypes.CDLL(None).fflush(None)
    printed = capfd.readouterr().out
    assert f" dof_names: {name}, \n" in printed and f" gains.{name}.p: " in printed


def test_a_klipper_snippet_is_a_section_that_its_parser_reads() -> None:
    """[input_shaper] with type, frequency and damping; an axis without a mode has none."""
    (text,) = export(use(known("base_resonance")), "klipper").files.values()
    read = configparser.RawConfigParser()
    read.read_string(text)
    section = read["input_shaper"]
    assert section["shaper_type_x"] in ("zv", "mzv", "zvd", "ei") and float(section["shaper_freq_x"]) == pytest.approx(46.0, abs=0.1)
    with pytest.raises(xy.BadInput, match="nothing to shape"):
        export(use(known()), "klipper")


def test_a_linuxcnc_snippet_is_hal_commands_with_the_pins_of_pid() -> None:
    """One setp for each pin, in V and mm."""
    used = use(known("coulomb_friction"), limit=5.0, travel=TRAVEL)
    (text,) = export(used, "linuxcnc").files.values()
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    found = {m[1]: float(m[2]) for line in lines if (m := re.fullmatch(r"setp pid\.x\.(\w+) (-?[\d.e+-]+)", line))}
    assert len(found) == len(lines) and set(found) == {"Pgain", "Igain", "Dgain", "FF1", "FF2", "bias", "maxoutput"}
    assert found["FF1"] == pytest.approx(1e-3 * used.gains["kV"].value, rel=1e-5)
    assert found["maxoutput"] == pytest.approx(5.0 - used.gains["kS"].value), "kS is added behind the limit of pid"
    with pytest.raises(xy.BadInput, match="more than kS and kCos"):
        export(use(known("coulomb_friction"), limit=0.1), "linuxcnc")


def test_a_rotary_axis_of_linuxcnc_is_in_degrees() -> None:
    """An input for 1 rad/s is that for 57.3 degrees/s; the note also gives the angle of an arm in degrees."""
    used = use(known("gravity", units=Units("V", "rad")), limit=5.0)
    made = export(used, "linuxcnc")
    (text,) = made.files.values()
    found = dict(re.findall(r"setp pid\.x\.(\w+) (\S+)", text))
    assert "position in deg;" in text and float(found["FF1"]) == pytest.approx(used.gains["kV"].value * np.pi / 180.0, rel=1e-5)
    assert used.feedback is not None and float(found["Pgain"]) == pytest.approx(used.feedback.controller.kp * np.pi / 180.0, rel=1e-5)
    assert "(90 degrees)" in made.note


def test_a_klipper_snippet_of_another_axis_says_so() -> None:
    """Shapers exist for x and y only: any other axis is written as x, in the text and in the note."""
    made = export(use(replace(known("base_resonance"), axis="gantry")), "klipper")
    (text,) = made.files.values()
    assert text.startswith("# of axis 'gantry', written as x\n") and "\n[input_shaper]\n" in text and "the axis is 'gantry'" in made.note
    assert "written as" not in "".join(export(use(replace(known("base_resonance"), axis="y")), "klipper").files.values())


@pytest.mark.parametrize("target", snippets.TARGETS)
def test_a_pasted_file_says_itself_what_it_lacks(target: str) -> None:
    """Who opens the file later has not seen the command's output: the whole note is in the file, as comments."""
    units = Units("N m", "rad") if target == "odrive" else Units("V", "m")
    used = use(known("coulomb_friction", "base_resonance", units=units), rate=1000.0, limit=5.0, travel=TRAVEL)
    made = export(used, target)
    (text,) = made.files.values()
    comments = [line for line in text.splitlines() if line.startswith(("# ", "(* "))]
    told = " ".join(line.removeprefix("# ").removeprefix("(* ").removesuffix(" *)") for line in comments)
    assert made.note and made.note in told
    if target in ("linuxcnc", "ros2_control"):
        assert "kS" in told and f"{used.gains.value('kS'):.4g} V" in told


def test_a_linuxcnc_file_names_the_component_that_it_needs() -> None:
    """pid.x exists only after loadrt with this name; without it, each setp fails."""
    (text,) = export(use(replace(known(), axis="z"), limit=5.0), "linuxcnc").files.values()
    assert "loadrt pid names=pid.z\n" in text and "setp pid.z.Pgain" in text


def test_an_odrive_snippet_is_python_in_turns() -> None:
    """Assignments for odrivetool; an axis in volts is refused, because ODrive commands a torque."""
    (text,) = export(use(known("coulomb_friction", units=Units("N m", "rad"))), "odrive").files.values()
    targets = [ast.unparse(node.targets[0]) for node in ast.parse(text).body if isinstance(node, ast.Assign)]
    gains = [f"controller.config.{name}" for name in ("pos_gain", "vel_gain", "vel_integrator_gain", "inertia")]
    assert targets == [f"odrv0.axis0.{name}" for name in ("config.encoder_bandwidth", *gains)]
    (amperes,) = export(use(known(units=Units("A", "rad")), limit=5.0), "odrive").files.values()
    assert ast.parse(amperes) and "config.torque_soft_min = torque_constant * -5\n" in amperes, "its limit is of the sum with the feedforward"
    with pytest.raises(xy.BadInput, match="ODrive commands a torque"):
        export(use(known()), "odrive")


def test_a_twincat_program_is_parsed_by_blark_with_the_fields_of_fb_ctrl_pid() -> None:
    """Times in whole ms, gains in mm, limits, and kS, kV, kA behind it; a cycle below 1 ms is refused."""
    used = use(known("coulomb_friction"), rate=1000.0, limit=5.0)
    (text,) = export(used, "twincat").files.values()
    assert parse_source_code(text).exception is None
    fields = dict(re.findall(r"(\w+) := ([^\s,]+),?\n", text))
    names = {"tCtrlCycleTime", "tTaskCycleTime", "fKp", "tTn", "tTv", "tTd", "fOutMaxLimit", "fOutMinLimit"}
    assert names <= set(fields) and fields["tCtrlCycleTime"] == "T#1MS" and used.feedback is not None
    own = used.feedback.controller
    assert float(fields["fKp"]) == pytest.approx(1e-3 * own.kp) and fields["tTn"] == f"T#{round(1e3 * own.kp / own.ki)}MS"
    assert f"fKV : LREAL := {1e-3 * used.gains['kV'].value:.9E}" in text and "fKS * fSign +" in text
    assert used.feedback.counted.phase >= 35.0
    arm = use(known("gravity", units=Units("A", "rad")), rate=1000.0, limit=5.0)
    (turning,) = export(arm, "twincat").files.values()
    assert parse_source_code(turning).exception is None and "+ fKCos * COS(fSetPosition - fZero)" in turning
    assert "no kCos: add" in export(arm, "linuxcnc").note and "no kCos: add" in export(arm, "ros2_control").note
    with pytest.raises(xy.BadInput, match=r"rate of 2000 Hz.*--controller-rate"):
        export(use(known("coulomb_friction"), rate=2000.0), "twincat")


def test_the_twincat_program_keeps_the_sum_of_feedback_and_feedforward_within_the_limit() -> None:
    """With a block that stops at its limits, like FB_CTRL_PID: no sum exceeds the limit, and the block gets the rest beside the feedforward."""
    used = use(known("coulomb_friction"), rate=1000.0, limit=5.0)
    (text,) = export(used, "twincat").files.values()
    body = text.rsplit("END_VAR\n\n", 1)[1].split("END_PROGRAM")[0]
    program = re.sub(r"\(\*.*?\*\)", "", body).replace(":=", "=").replace(";", "")
    params = types.SimpleNamespace(fOutMaxLimit=5.0, fOutMinLimit=-5.0)

    class Block:
        fOut = 0.0

        def __call__(self, fSetpointValue: float, fActualValue: float, eMode: object, stParams: Any) -> None:
            self.fOut = min(max(1e6 * (fSetpointValue - fActualValue), stParams.fOutMinLimit), stParams.fOutMaxLimit)

    names: dict[str, Any] = {
        "SEL": lambda choice, no, yes: yes if choice else no,
        "LIMIT": lambda low, value, high: min(max(value, low), high),
        "eCTRL_MODE_ACTIVE": 1, "fbPid": Block(), "stParams": params, "fKG": 0.0,
        **{f"f{name.upper()[0]}{name[1:]}": used.gains.value(name) * (1.0 if name == "kS" else 1e-3) for name in ("kS", "kV", "kA")},
    }  # fmt: skip
    for speed, off in itertools.product((-1000.0, -300.0, 0.0, 300.0, 1000.0), (-1.0, 0.0, 1.0)):
        exec(program, names, asked := {"fSetPosition": off, "fActPosition": 0.0, "fSetVelocity": speed, "fSetAcceleration": 0.0})
        wanted = {-1.0: -5.0, 0.0: asked["fFeedforward"], 1.0: 5.0}[off]
        assert asked["fOutput"] == pytest.approx(wanted) and abs(asked["fOutput"]) <= 5.0 + 1e-12
        fed = used.gains.value("kS") * np.sign(speed) + 1e-3 * used.gains.value("kV") * speed
        assert asked["fFeedforward"] == pytest.approx(np.clip(fed, -5.0, 5.0))


def test_a_gain_that_the_data_do_not_determine_is_exported_as_0_and_named() -> None:
    """kS with an interval that contains 0 is not written; an angle, and a model without intervals, keep their values, since 0 would not be better."""
    unsure = use(known("coulomb_friction", coulomb_friction__coulomb=1.5), rate=1000.0, limit=5.0)
    assert unsure.gains["kS"].low < 0.0 < unsure.gains["kS"].value and unsure.gains.value("kS") == 0.0
    assert "fKS : LREAL := 0.000000000E+00; (* V, not determined by the data *)" in export(unsure, "twincat").files["x_twincat_axis.st"]
    matlab = export(unsure, "matlab")
    assert matlab.mat["axis_x.mat"]["gains"]["kS"] == 0.0 and matlab.mat["axis_x.mat"]["gains"]["kV"] == unsure.gains["kV"].value
    assert "add 0 V" in export(unsure, "linuxcnc").note
    for target in ("twincat", "matlab", "linuxcnc", "ros2_control"):
        assert "0 stands for kS, which the data do not determine" in export(unsure, target).note, target
    (loaded,) = export(use(known("constant_load", constant_load__load=1.5), limit=5.0), "linuxcnc").files.values()
    assert "# bias is not determined by the data\n" in loaded and "setp pid.x.bias 0\n" in loaded
    assert use(unknown("coulomb_friction")).gains.value("kS") == 0.2
    assert Gains((Derived("zero", 0.5, 0.2, 0.8, "rad", "level"),)).value("zero") == 0.5


def test_exported_source_undoes_what_is_predicted_to_help() -> None:
    """The exported feedforward omits the same laws as the compensation, and the note names them."""
    models = known("cogging"), known("cogging", cogging__phase=40.0, cogging__amplitude=2.0)
    sure, unsure = (use(model, limit=5.0, travel=TRAVEL) for model in models)
    assert sure.compensation is not None and sure.compensation.terms == ("base", "cogging")
    assert "undoes base, cogging" in export(sure, "c").note
    assert unsure.compensation is not None and "cogging" not in unsure.compensation.terms, "its phase is not known"
    made = export(unsure, "python")
    (text,) = made.files.values()
    module = types.ModuleType("axis")
    exec(text, vars(module))
    told = [module.Feedforward().input(place, 0.0, 0.0) for place in (0.0, 0.001)]
    if unsure.compensation.inverse is None:
        assert "kS kV kA alone are predicted" in made.note
    else:
        assert told == [0.0, 0.0] and "but not cogging" in made.note
    for item in unsure.tracking:
        assert item.compensated <= 1.001 * item.simple
    assert (
        left_words([("a", "it harms"), ("b", "it harms"), ("c", "it is at its bound")])
        == ", but not a and b (it harms), but not c (it is at its bound)"
    )


def test_margins_that_are_asked_for_are_kept() -> None:
    """A larger phase margin reduces the bandwidth; margins out of range are refused with the allowed range."""
    usual, more = use(known("base_resonance")), use(known("base_resonance"), margins=(55.0, 3.0))
    assert usual.feedback is not None and more.feedback is not None and more.states is not None
    assert more.feedback.worst.phase >= 55.0 and more.feedback.worst.gain >= 3.0 and more.feedback.crossover < usual.feedback.crossover
    assert more.states.worst.phase >= 55.0 and more.states.worst.gain >= 3.0
    for asked, words in (((95.0, 2.0), "phase margin is 95 degrees"), ((45.0, 0.5), "gain margin is 0.5")):
        with pytest.raises(xy.BadInput, match=words):
            use(known(), margins=asked)


def test_the_command_tells_gains_and_writes_files(tmp_path: Path, model: xy.PhysicalModel) -> None:
    """kS, kV and kA with intervals and units, margins, and each target's file; a file is replaced only with --force; --json is one document."""
    file = tmp_path / "axes.yaml"
    xy.save(model, file)
    said = cli("use", file, "--limit", "5", "--to", "tables", "--to", "ros2_control", "-o", tmp_path / "out")
    assert said.code == 0, said
    assert {"kS", "kV", "kA"} <= set(said.out.split()) and "phase margin" in said.out
    assert "contributes most to each interval: kS coulomb_friction.coulomb, kV gain," in " ".join(said.out.split())
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"x_friction.csv", "x_ros2_control_controllers.yaml"}
    assert "add --force" in refused("use", file, "--to", "tables", "-o", tmp_path / "out")
    found = cli("use", file, "--limit", "5", "--travel", "-0.02", "0.02", "--json").json["axes"]["x"]
    assert found["gains"]["kS"]["unit"] == "V" and found["gains"]["kS"]["determined"]
    assert found["feedback"]["worst"]["phase"] >= 45.0 and found["tracking"][0]["whole"] < found["tracking"][0]["feedback"]


def test_an_unknown_target_or_a_linear_model_is_refused_in_one_line(tmp_path: Path, model: xy.PhysicalModel) -> None:
    """The error gives the nearest spelling, or the next action."""
    file = tmp_path / "axes.yaml"
    xy.save(model, file)
    assert "klipper" in refused("use", file, "--to", "kliper")
    linear = tmp_path / "linear.yaml"
    xy.save(xy.LinearModel(known().tf), linear)
    assert "xy-sysid refine --model" in refused("use", linear)
    assert "axis" in refused("use", file, "--axis", "z")
    second = tmp_path / "second.yaml"
    xy.save(model, second)
    assert "one folder for two models" in refused("use", file, second, "--to", "urdf", "-o", tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert "a folder" in refused("use", file, "--to", "urdf", "-o", file)
    assert "fmu without a folder" in refused("use", file, "--to", "fmu")
