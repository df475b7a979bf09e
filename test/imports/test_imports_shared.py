"""Every measured file with at most two commands: ``columns``, and that of docs/files.md, which answers with quantity, unit and parameters."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable
from typing import Any

import pytest
from helpers import ROOT
from helpers.cli_tools import cli
from helpers.real_data import data

from campaigns.faults.shared import NO_RECORDINGS, RECORDINGS

# expected answer: words, or estimates with their tolerance (None: the unit alone)
SAYS: dict[str, str] = {
    "bam_servo/bam_xl330_up_and_down_kp100.csv": "rad/V",
    "bam_servo/bam_xl330_up_and_down_kp100_even.npz": "rad/V",
    "crane/crane_1.npz": "counts/V",
    "joint_state_bags/roblab_hw4": "PoseWithCovarianceStamped",
    "joint_state_bags/unisa_ur10_exciting": "axis wrist_3_joint",
    "lsb250/lsb250_exp2.npz": "19 windows",
    "raw_mat/crane_meas1.mat": "counts/V",
    "raw_mat/hsm150_idf_pos_0.06_1.mat": "rad/(N m)",
    "rm_arm/joint_1.npz": "rad/(N m)",
    "servo_target/chirp0.csv": "rad/rad",
    "vendor_exports/tc3_decimalcomma.csv": "15.62      0.00",
    "vendor_exports/tc3_default.csv": "15.62      0.00",
}
FINDS: dict[str, dict[str, tuple[float | None, float, str]]] = {
    "ball_plate/Motor2_v73.mat": {"gain": (0.244, 0.03, "rad/s/V")},
    "ball_plate/motor1.npz": {
        "constant_load.load": (0.835, 0.04, "V"),
        "coulomb_friction.coulomb": (0.35, 0.0175, "V"),
        "saturation.limit": (2.94, 0.147, "V"),
    },
    "bam_servo/bam_xl330_sin_time_square_kp800.csv": {"gravity.phase": (0.0, 0.05, "rad")},  # the arm hangs at 0
    "bam_servo/bam_xl330_sin_time_square_kp800_even.npz": {"gravity.phase": (0.0, 0.05, "rad")},
    "camber/LinA_no-pp-sine-sweep-10mm-0.5Hz.txt": {"gain": (None, 0.0, "m/s/A")},
    "daisy/robot_arm.dat": {"resonance_2.frequency": (63.35, 0.1, "Hz"), "antiresonance_1.frequency": (16.9, 0.98, "Hz")},  # lines: 0.98 Hz
    "dcmotor_phi/velocity_feedback_comparison.csv": {"gain": (0.987, 0.003, "rad/s/(rad/s)")},
    # 203.5034 N s/m / 95.1089 kg, 35.15065 / 203.5034, 20.3935 / 35.15065
    "emps/emps_train.npz": {
        "pole": (2.140, 0.107, "rad/s"),
        "gain": (0.1727, 0.0086, "m/s/V"),
        "coulomb_friction.coulomb": (0.5802, 0.029, "V"),
        "asymmetric_viscous_friction.asymmetry": ((166.7 - 240.4) / (166.7 + 240.4), 0.01, ""),
    },
    "f16/f-16.txt": {"resonance_1.frequency": (7.4, 0.1, "Hz"), "resonance_2.frequency": (9.1, 0.1, "Hz")},
    "frf_file/G_I_PI_300_DP.csv": {"gain": (8186.0, 80.0, "out/s/in")},
    "frf_file/G_I_PID_300_DP.csv": {"gain": (3629.0, 36.0, "out/s/in")},
    "frf_file/G_I_PID_300_AP.dat": {"gain": (3629.0, 36.0, "out/s/in")},
    "gap_foreign/gap_hertz_16um.npz": {"backlash.gap": (16e-6, 0.8e-6, "m")},
    "gap_foreign/gap_linear_12um.npz": {"backlash.gap": (12e-6, 0.6e-6, "m"), "backlash.rate": (4084.0, 82.0, "rad/s")},  # 650 Hz
    "gap_foreign/gap_linear_37um.npz": {"backlash.gap": (37e-6, 1.85e-6, "m"), "backlash.rate": (4084.0, 82.0, "rad/s")},
    "generator/x_cc.csv": {"gain": (None, 0.0, "rad/s/V")},
    "hsm150/hsm_pos_0.06_1.npz": {"inertia": (1.2e-4, 0.24e-4, "kg m^2")},  # "about"
    "lsb250/lsb250_exp1.npz": {"antiresonance_1.frequency": (11.8, 0.3, "Hz"), "resonance_1.frequency": (13.5, 0.3, "Hz")},  # distorted by friction
    "rm_arm/joint_3.npz": {"friction": (0.33, 0.01, "N m")},
    "servo_target/response.json": {"delay": (0.044, 0.004, "s")},
    "tue_bench/load_side.mat": {"resonance_1.frequency": (58.9, 0.2, "Hz")},
    "two_inertia_bench/multisineA.npz": {"antiresonance_1.frequency": (53.9, 0.3, "Hz"), "resonance_1.frequency": (76.2, 0.3, "Hz")},
    "two_inertia_bench/multisineB.npz": {"antiresonance_1.frequency": (53.9, 0.3, "Hz"), "resonance_1.frequency": (76.2, 0.5, "Hz")},
    "tx40/curr_data.csv": {"friction": (0.216, 0.022, "A")},
    "tx40/joint1_merged.csv": {"friction": (0.216, 0.022, "A")},
    "ur10e/ur-20_01_22-joint_1.csv": {"friction": (1.38, 0.04, "A"), "kV": (2.17, 0.065, "A/(rad/s)")},
    "ur10e/ur-20_01_22-joint_6.csv": {"friction": (0.243, 0.007, "A"), "kV": (0.316, 0.01, "A/(rad/s)"), "kA": (0.049, 0.0025, "A/(rad/s2)")},
    "vendor_exports/dspace_bldc.mat": {"gain": (236.5, 7.5, "rad/s/FS")},  # its Hall counts (30 a turn) over the duty give 229 to 244
    "vendor_exports/ctrlx_step.trace.csv": {
        "time_constant": (0.036, 0.003, "s"),
        "delay": (0.172, 0.003, "s"),
        "gain": (1.075 * 100.0 * 2.0 * math.pi / 60.0, 0.06, "rad/s/FS"),
    },
}
# least explained part of the error's power (refine) or of the speed's (steps)
EXPLAINED = {
    "bam_servo/bam_xl330_sin_time_square_kp800.csv": 0.95,
    "bam_servo/bam_xl330_sin_time_square_kp800_even.npz": 0.95,
    "emps/emps_train.npz": 0.97,
    "tx40/curr_data.csv": 1.0 - (8.1 / 82.0) ** 2,  # least squares leaves 8.1 of 82 rad/s
    "tx40/joint1_merged.csv": 1.0 - (8.1 / 82.0) ** 2,
}
# what else the answer has to say of the axis
ALSO: dict[str, Callable[[dict[str, Any]], bool]] = {
    "camber/LinA_no-pp-sine-sweep-10mm-0.5Hz.txt": lambda axis: not axis["trustworthy"],  # least squares is poor, too
    "gap_foreign/gap_hertz_16um.npz": lambda axis: axis["effects"] == ["backlash"],
    "gap_foreign/gap_linear_12um.npz": lambda axis: axis["effects"] == ["backlash"],
    "gap_foreign/gap_linear_37um.npz": lambda axis: axis["effects"] == ["backlash"],
    "generator/x_cc.csv": lambda axis: axis["error"]["rms"] / 5994.0 < 57.0 / 600.0,  # least squares leaves 57 of a swing of 600
    "rm_arm/joint_3.npz": lambda axis: "does not describe this" in axis["sentences"][0],
    "tue_bench/load_side.mat": lambda axis: not any("antiresonance" in name for name in axis["estimates"]),  # the encoder is on the load
    "ur10e/ur-20_01_22-joint_6.csv": lambda axis: axis["error"]["rms"] < 0.0245,  # least squares leaves 24 mrad/s
}
REFUSES = {"vendor_exports/mitsubishi_mr.csv": "one move in one direction"}
BESIDE = {"generator/y_cc.csv", "tx40/pos_read_data.csv"}  # the outputs of the previous files


def documented() -> dict[str, list[str]]:
    """The commands of docs/files.md, by file: command and options."""
    page = (ROOT / "docs" / "files.md").read_text(encoding="utf-8")
    block = page.partition("**One command for each measured file**")[2].partition("\nEffects, friction")[0]
    words = [shlex.split(line, comments=True) for line in block.splitlines() if line.startswith("    xy-sysid")]
    return {path: [command, *options] for _, command, path, *options in words}


def test_every_file_has_its_command() -> None:
    """Every file of the data has a command, and each command has an expectation."""
    commands = documented()
    assert set(commands) == {*SAYS, *FINDS, *REFUSES}
    assert {row.path for row in RECORDINGS} - set(commands) == BESIDE and not set(NO_RECORDINGS) & set(commands)


@pytest.mark.parametrize("name", [*SAYS, *FINDS, *REFUSES])
def test_every_measured_file_answers_in_two_commands(name: str) -> None:
    """The first lists its columns; the second answers with quantity, unit and parameters, without a request for a window."""
    command, *options = documented()[name]
    path = data(name)
    assert cli("columns", path).code == 0
    if name in FINDS:
        said = cli(command, path, *options, "--json")
        assert said.code == 0, said.err
        axis: dict[str, Any] = next(iter(said.json["axes"].values()))
        found = numbers(command, axis)
        for parameter, (value, within, unit) in FINDS[name].items():
            assert found[parameter]["unit"] == unit and (value is None or found[parameter]["value"] == pytest.approx(value, abs=within)), found[
                parameter
            ]
        assert axis.get("explained", 0.0) > EXPLAINED.get(name, -1.0) and (name not in ALSO or ALSO[name](axis)), axis
        return
    said = cli(command, path, *options)
    assert said.code == (2 if name in REFUSES else 0), said.err
    assert SAYS.get(name, "") in said.out and REFUSES.get(name, "") in said.err, said.out + said.err


def numbers(command: str, axis: dict[str, Any]) -> dict[str, Any]:
    """Parameters of the answer of a command, by name."""
    if command == "refine":
        return {**axis["mechanics"], **axis["model"]["parameters"]}
    if command == "diagnose":
        return dict(axis["candidates"][0]["parameters"])
    return dict(axis["quantities" if command in ("servo", "steps") else "estimates"])
