"""Exports of a model for other programs: each is loaded by an independent program."""

from __future__ import annotations

import ctypes
import subprocess
import sys
import types
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import fmpy.validation
import mujoco
import numpy as np
import pytest
import scipy.io
from helpers.cli_tools import cli
from helpers.known_models import axis, known
from helpers.sampled import simulate_alone
from helpers.simulated import recorded
from scipy import signal

import xy_sysid as xy
from xy_sysid.axis.model import STANDARD, AxisModel
from xy_sysid.control_design import to_c, to_python
from xy_sysid.control_design.exports import export
from xy_sysid.control_design.inverse import feedforward
from xy_sysid.control_design.mjcf import Mjcf, mjcf
from xy_sysid.control_design.path import Bounds, s_curve
from xy_sysid.control_design.program import program
from xy_sysid.control_design.sdf import sdf
from xy_sysid.control_design.use import use
from xy_sysid.effects import Effect, Parameter, law
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import Units

RATE = 2000.0
ALL = [effect.name for effect in STANDARD.acting if effect.name != "load_side_resonance"]
MIXED = ("base_resonance", "coulomb_friction", "cogging", "lead_error", "saturation", "amplifier_lag")
LOST = {"asymmetric_viscous_friction", "backlash", "dead_zone", "gain_drift", "lead_error", "position_dependent_drag", "position_dependent_gain"}
LOST |= {"load_dependent_friction"}


def noise(count: int = 500) -> FloatArray:
    raw = np.random.default_rng(2).standard_normal(count)
    shaped = signal.lfilter(*signal.butter(2, 300.0, fs=RATE), raw)
    return np.asarray(1.2 * shaped / np.std(shaped))


def in_c(model: AxisModel, folder: Path, voltage: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Positions, and the feedforward of a path with its expected value, from the compiled C source."""
    of = program(model, RATE)
    header, text = to_c.source(of, "axis", "a test")
    (folder / "axis.h").write_text(header)
    (folder / "axis.c").write_text(text)
    made = folder / f"axis{len(list(folder.iterdir()))}.so"
    strict = ("-O1", "-std=c99", "-Wall", "-Wextra", "-Wno-unused", "-Werror", "-ffp-contract=off")
    subprocess.run(["gcc", *strict, "-shared", "-fPIC", "-o", made, folder / "axis.c", "-lm"], check=True)
    library = ctypes.CDLL(str(made))
    step, inverse = library.axis_step, library.axis_feedforward
    step.restype = inverse.restype = ctypes.c_double
    state = ctypes.create_string_buffer(8 * (of.states + of.room))
    library.axis_reset(state)
    shown = [0.0, *(step(state, ctypes.c_double(volts)) for volts in voltage[:-1])]
    path = s_curve([0.0, 0.005, 0.0], Bounds(0.1, 2.0, 100.0), RATE, settle=0.01)
    wanted = feedforward(model, path)
    early = path.ahead(wanted.ahead)
    library.axis_reset(state)
    rows = zip(early.position, early.speed, early.acceleration, strict=True)
    return np.array(shown), np.array([inverse(state, *map(ctypes.c_double, row)) for row in rows]), wanted.voltage


def test_c_source_is_the_simulation_and_its_inverse(tmp_path: Path) -> None:
    """All effects that can act together, and a gap: gcc compiles without a warning, and the numbers are equal bit for bit."""
    rest = tuple(name for name in ALL if name not in ("backlash", "coulomb_friction", "stribeck_friction", "asymmetric_friction"))
    for names in (MIXED, rest, ("backlash", "stribeck_friction", "asymmetric_friction")):
        shown, voltage, wanted = in_c(axis(*names), tmp_path, noise())
        assert np.array_equal(shown, simulate_alone(axis(*names), RATE, noise())) and np.array_equal(voltage, wanted), names


def test_python_source_needs_nothing_and_is_the_same(tmp_path: Path) -> None:
    """The module imports only math; an interpreter without our packages gives the same numbers."""
    file = tmp_path / "axis.py"
    file.write_text(to_python.source(program(axis(*MIXED), RATE), "a test"))
    voltage = noise(200)
    code = "import sys, axis; a = axis.Axis(); print([0.0] + [a.step(float(u)) for u in sys.argv[1].split()][:-1])"
    said = subprocess.run([sys.executable, "-S", "-c", code, " ".join(map(repr, voltage.tolist()))], cwd=tmp_path, capture_output=True, check=True)
    assert np.array_equal(np.array(eval(said.stdout)), simulate_alone(axis(*MIXED), RATE, voltage))
    module = types.ModuleType("axis")
    exec(file.read_text(), vars(module))
    path = s_curve([0.0, 0.005], Bounds(0.1, 2.0, 100.0), RATE, settle=0.01)
    early, own = path.ahead(module.AHEAD), module.Feedforward()
    found = [own.input(*map(float, row)) for row in zip(early.position, early.speed, early.acceleration, strict=True)]
    assert np.array_equal(np.array(found), feedforward(axis(*MIXED), path).voltage)


@law
def _push(size: float, x: float) -> float:
    return float(size * (1.0 if x > 0.0 else -1.0) * abs(x) ** 0.5)


@law
def _divided(size: float, x: float) -> float:
    return float(size * (x * x + 1 / 4) ** (3 / 2) * (7 / 2))


@law
def _strange(size: float, x: float) -> float:
    return size * float(np.sum(np.array([x, x])))


def _own(function: Callable[..., float]) -> AxisModel:
    effect = Effect(
        name="own_effect",
        law="F",
        meaning="a test",
        validity="a test",
        source="a test",
        category="force",
        parameters=(Parameter("size", "V", 0.0, 10.0, 0.3, "size"),),
        shows="",
        look_alikes=(),
        experiment="",
        functions={"force": function},  # either of the two above
    )
    return AxisModel(0.097, 1.63e-3, 236.0, library=STANDARD.extended([effect])).with_effect("own_effect")


@pytest.mark.parametrize("function", [_push, _divided])
def test_an_effect_of_ones_own_is_printed_or_refused(tmp_path: Path, function: Callable[..., float]) -> None:
    """A user's law with arithmetic, ifs, powers and quotients of integers is translated to C; any other is refused in one line."""
    of = program(_own(function), RATE)
    header, text = to_c.source(of, "axis", "a test")
    (tmp_path / "axis.h").write_text(header)
    main = 'int main(void) { axis_state s; axis_reset(&s); for (int k = 0; k < 400; k++) printf("%.17g\\n", axis_step(&s, k % 50 - 20.0)); }'
    (tmp_path / "main.c").write_text(f"#include <stdio.h>\n{text}{main}\n")
    subprocess.run(["gcc", "-ffp-contract=off", "-o", tmp_path / "main", tmp_path / "main.c", "-lm"], check=True)
    said = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout.split()
    module = types.ModuleType("axis")
    exec(to_python.source(of, "a test"), vars(module))
    own = module.Axis()
    assert [float(word) for word in said] == [own.step(k % 50 - 20.0) for k in range(400)]
    with pytest.raises(xy.BadInput, match="Write it in simpler terms"):
        to_c.source(program(_own(_strange), RATE), "axis", "a test")


def test_an_fmu_is_run_by_fmpy_to_our_numbers(tmp_path: Path) -> None:
    """FMPy validates the description, loads the binary and simulates within 1e-6 of the rms of our simulation, with friction and a resonance."""
    model = known(*MIXED)
    file = tmp_path / "axes.yaml"
    xy.save(model, file)
    assert cli("use", file, "--limit", "5", "--controller-rate", RATE, "--to", "fmu", "-o", tmp_path).code == 0
    packed = tmp_path / "axis_x.fmu"
    assert fmpy.validation.validate_fmu(str(packed)) == []
    told = fmpy.read_model_description(str(packed))
    assert {item.name: item.unit for item in told.modelVariables if item.name != "time"} == {"u": "V", "y": "m", "v": "m/s"}
    assert {item.name: item.baseUnit.s for item in told.unitDefinitions} == {"V": -3, "m": 0, "m/s": -1}
    voltage = noise(2000)
    at = np.arange(voltage.size) / RATE
    given = np.array(list(zip(at, voltage, strict=True)), dtype=[("time", float), ("u", float)])
    found = fmpy.simulate_fmu(
        str(packed), start_time=0.0, stop_time=at[-1], step_size=1 / RATE, output_interval=1 / RATE, input=given, output=["y", "v"], validate=True
    )
    ours = simulate_alone(model.model, RATE, voltage)
    size = float(np.sqrt(np.mean(ours**2)))
    assert found["y"].size == ours.size and float(np.sqrt(np.mean((found["y"] - ours) ** 2))) < 1e-6 * size


def in_mujoco(made: Mjcf, voltage: FloatArray) -> FloatArray:
    """(n,) the joint's position at each sample."""
    model = mujoco.MjModel.from_xml_string(made.text)
    data = mujoco.MjData(model)
    place, shown = model.joint("axis").qposadr[0], np.empty(voltage.size)
    for k, volts in enumerate(voltage):
        shown[k] = data.qpos[place]
        data.ctrl[0] = volts
        mujoco.mj_step(model, data, made.steps)
    return shown


def speeds_apart(model: AxisModel, voltage: FloatArray) -> float:
    """rms of the difference of the speeds in MuJoCo and here, relative to the motion."""
    theirs, ours = (np.diff(position) for position in (in_mujoco(mjcf(model, RATE), voltage), simulate_alone(model, RATE, voltage)))
    return float(np.sqrt(np.mean((theirs - ours) ** 2) / np.mean(ours**2)))


def test_mujoco_says_each_effect_or_names_it_as_lost() -> None:
    """Effects that are not listed as lost move in MuJoCo as here, within 0.2 % of the motion, without dry friction within 0.02 %."""
    voltage = noise(1000)
    for names in [(), *((name,) for name in ALL)]:
        model = axis(*names)
        lost = {name for name, _ in mjcf(model, RATE).lost}
        assert lost == set(names) & (LOST | {"stribeck_friction"}), names
        if not lost:
            dry = any(STANDARD[name].category in ("friction", "bristle") for name in names)
            assert speeds_apart(model, voltage) < (0.002 if dry else 0.0002), names


@pytest.mark.parametrize("delay", [0.0, 0.1e-3, 0.37e-3, 1.29e-3, 1.5e-3, 4.3e-3])
@pytest.mark.parametrize("names", [(), ("coulomb_friction",), ("amplifier_lag",)])
def test_mujoco_is_as_late_as_the_model(names: tuple[str, ...], delay: float) -> None:
    """MuJoCo delays by whole steps, and its integrators are a part of a step early: 0.02 to 0.15 % of the motion are left, 0.4 % at whole samples."""
    bound = 0.004 if delay in (0.0, 1.5e-3) else 0.0015 if "coulomb_friction" in names else 0.0006
    assert speeds_apart(axis(*names, delay=delay), noise(1000)) < bound


@pytest.mark.parametrize("effect", [effect.name for effect in STANDARD.acting if effect.category == "force" and effect.name not in LOST])
def test_mujoco_says_each_force_of_an_axis_that_is_wired_backwards(effect: str) -> None:
    """With a negative gain a spring still acts towards its rest: the same motion in MuJoCo as here, within 1 %."""
    model = replace(axis(effect), gain=-axis().gain)
    assert not mjcf(model, RATE).lost and speeds_apart(model, noise(1000)) < 0.01


def test_an_mjcf_file_says_its_units_and_how_long_an_input_is_held() -> None:
    """A mass of 0.04 is no kilogram: the comment names the unit, and the steps to a sample of the input."""
    made = mjcf(axis("coulomb_friction"), RATE)
    assert f"forces are in the unit of the input: the mass is kA, the damping kV; hold each input for {made.steps} steps, 1/2000 s -->" in made.text


def test_an_axis_in_radians_turns_in_mujoco() -> None:
    """A rotary axis has only hinges, also behind a resonance; an axis in metres has slides."""
    for output, kind in (("rad", mujoco.mjtJoint.mjJNT_HINGE), ("m", mujoco.mjtJoint.mjJNT_SLIDE)):
        (text,) = export(use(known("base_resonance", units=Units("V", output)), limit=5.0), "mujoco").files.values()
        assert mujoco.MjModel.from_xml_string(text).jnt_type.tolist() == [kind, kind], output


@pytest.mark.parametrize(
    "effect", ["coulomb_friction=0.3", "presliding_hysteresis=0.3", "cogging=0.2", "screw_compliance", "coulomb_friction=0.3+cogging=0.2"]
)
def test_the_circle_through_mujoco_closes(effect: str) -> None:
    """With a recorded input, MuJoCo's held-out error is at most 1.05 times ours; its motion shows the effects, and no other."""
    names = tuple(word.partition("=")[0] for word in effect.split("+"))
    run, judge = recorded(effect, 10.0).run("x"), recorded(effect, 3.0, seed=99).run("x")
    model = xy.refine(run, add=names, auto=False).model.model
    measured = np.diff(judge.position)
    ours, theirs = (np.diff(position) for position in (simulate_alone(model, RATE, judge.voltage), in_mujoco(mjcf(model, RATE), judge.voltage)))
    error, other = (float(np.sqrt(np.mean((moved - measured) ** 2))) for moved in (ours, theirs))
    assert other <= 1.05 * error
    shown = in_mujoco(mjcf(model, RATE), run.voltage) + 1e-7 * np.random.default_rng(1).standard_normal(len(run))
    again = xy.diagnose(xy.Recording.from_arrays(RATE, run.voltage, np.round(shown / 5e-7) * 5e-7).run("x"))
    assert again.effects == names and again.confidence > 0.9


def test_a_urdf_is_parsed_by_mujoco_and_names_what_it_loses() -> None:
    """Another parser reads mass, damping, friction and limits; each effect that URDF cannot describe is in a comment and in the note."""
    made = export(use(known("coulomb_friction", "cogging"), limit=5.0, travel=(-0.025, 0.025)), "urdf")
    (text,) = made.files.values()
    model = mujoco.MjModel.from_xml_string(text)
    assert model.dof_damping[0] == pytest.approx(1 / 0.097) and model.dof_frictionloss[0] == pytest.approx(0.2)
    assert model.jnt_range[0] == pytest.approx([-0.025, 0.025]) and model.body_mass[1] == pytest.approx(1 / (0.097 * 236.0))
    assert "<!-- lost: cogging" in text and "cogging" in made.note and "delay" in made.note


@pytest.mark.parametrize("output", ["m", "rad"])
def test_a_joint_whose_travel_nobody_knows_has_no_ends(output: str) -> None:
    """Without a recording and without --travel no limit of the position is written, and the note says so; with a travel its ends are there."""
    model = known(units=Units("V", output))
    unlimited, limited = (use(model, limit=5.0, travel=ends) for ends in (None, (-0.02, 0.03)))
    for target, lower, upper in (("sdf", "<lower>", "<upper>"), ("urdf", 'lower="', 'upper="')):
        (free,), (ended,) = (export(used, target).files.values() for used in (unlimited, limited))
        assert "0.025" not in free and "travel (it is not known)" in export(unlimited, target).note, target
        assert f"{lower}-0.02" in ended and f"{upper}0.03" in ended and "travel" not in export(limited, target).note, target
    joint = ElementTree.fromstring(next(iter(export(unlimited, "sdf").files.values()))).find("model/joint/axis/limit")
    assert joint is not None and joint.find("lower") is None and joint.findtext("effort") == "5"
    (text,) = export(unlimited, "urdf").files.values()
    of = mujoco.MjModel.from_xml_string(text)
    assert not of.jnt_limited[0] or of.jnt_range[0].tolist() == [-1e16, 1e16]


def test_an_sdf_says_what_the_model_is_and_names_what_it_loses() -> None:
    """Mass, damping, friction and spring are in elements of SDFormat 1.9; effects that SDF cannot describe are in a comment and in the note."""
    made = export(use(known("coulomb_friction", "return_spring", "cogging"), limit=5.0), "sdf")
    (text,) = made.files.values()
    root = ElementTree.fromstring(text)
    assert root.tag == "sdf" and root.get("version") == "1.9" and root.find("model/joint[@type='prismatic']/axis/xyz") is not None

    def number(path: str) -> float:
        return float(root.findtext(f"model/{path}") or "nan")

    assert number("link[@name='axis']/inertial/mass") == pytest.approx(1 / (0.097 * 236.0))
    dynamics = "joint[@type='prismatic']/axis/dynamics"
    assert number(f"{dynamics}/damping") == pytest.approx(1 / 0.097) and number(f"{dynamics}/friction") == pytest.approx(0.2)
    assert root.find(f"model/{dynamics}/spring_stiffness") is None, "with cogging beside it, the force is no straight spring"
    assert "<!-- lost: cogging" in text and "cogging" in made.note and "return_spring" in made.note and "delay" in made.note
    straight = replace(axis(), effects=(("return_spring", (10.0, 0.002, 0.0)),))
    spring, lost = sdf(straight, (-0.02, 0.02), 5.0, angular=False)
    assert "<spring_reference>0.002</spring_reference><spring_stiffness>10</spring_stiffness>" in spring and [name for name, _ in lost] == ["delay"]


def test_damping_in_sdf_and_urdf_is_the_viscous_part_alone() -> None:
    """Neither has drag with the square of speed: it is listed as lost, and not added to the damping."""
    used = use(known("quadratic_drag"), limit=5.0)
    sdf_text, urdf_text = (next(iter(export(used, target).files.values())) for target in ("sdf", "urdf"))
    damping = ElementTree.fromstring(sdf_text).findtext("model/joint[@type='prismatic']/axis/dynamics/damping")
    dynamics = ElementTree.fromstring(urdf_text).find("joint/dynamics")
    assert dynamics is not None and damping == dynamics.get("damping") and float(damping or "nan") == pytest.approx(1 / 0.097)
    assert "<!-- lost: quadratic_drag" in sdf_text


def test_matlab_gets_parameters_and_a_function(tmp_path: Path) -> None:
    """The .mat file is read back by scipy; the function's ifs, fors and functions are all closed."""
    file = tmp_path / "axes.yaml"
    xy.save(known(*MIXED), file)
    assert cli("use", file, "--limit", "5", "--to", "matlab", "-o", tmp_path).code == 0
    found = scipy.io.loadmat(tmp_path / "axis_x.mat", simplify_cells=True)
    assert found["parameters"]["coulomb_friction_coulomb"] == 0.2 and found["gains"]["kV"] == pytest.approx(1 / 0.097)
    assert list(found["ci95"]["pole"]) == pytest.approx([0.98 * 236.0, 1.02 * 236.0])
    words = [line.split("(")[0].split()[0] for line in (tmp_path / "axis_x.m").read_text().splitlines() if line.strip()]
    assert words.count("end") == sum(words.count(word) for word in ("function", "if", "for"))


def test_every_target_writes_for_an_axis_that_has_all_of_it(tmp_path: Path) -> None:
    """--to all writes the possible targets, and names the others."""
    file = tmp_path / "axes.yaml"
    xy.save(known(*MIXED), file)
    said = cli("use", file, "--limit", "5", "--to", "all", "-o", tmp_path / "out")
    assert said.code == 0, said
    names = {path.suffix for path in (tmp_path / "out").iterdir()}
    assert {".c", ".h", ".py", ".m", ".mat", ".fmu", ".xml", ".urdf", ".sdf", ".yaml", ".cfg", ".hal", ".csv"} <= names
    told = " ".join(said.err.split())
    assert "axis x to odrive: " in told and "axis x to twincat: " in told and "axis x to urdf" not in told
