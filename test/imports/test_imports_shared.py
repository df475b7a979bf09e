"""Every measured file with at most two commands: ``columns``, and that of docs/files.md, which answers with quantity, unit and parameters."""

from __future__ import annotations

import shlex
from typing import Any

import pytest
from helpers import ROOT
from helpers.cli_tools import cli
from helpers.real_data import data

from campaigns.faults.shared import NO_RECORDINGS, RECORDINGS

# expected answer: words, or estimates with their tolerance
SAYS: dict[str, str] = {
    "ball_plate/motor1.npz": "rad/V",
    "bam_servo/bam_xl330_sin_time_square_kp800.csv": "rad/V",
    "bam_servo/bam_xl330_sin_time_square_kp800_even.npz": "rad/V",
    "bam_servo/bam_xl330_up_and_down_kp100.csv": "rad/V",
    "bam_servo/bam_xl330_up_and_down_kp100_even.npz": "rad/V",
    "crane/crane_1.npz": "/V",
    "gap_foreign/gap_hertz_16um.npz": "m/V",
    "gap_foreign/gap_linear_12um.npz": "m/V",
    "gap_foreign/gap_linear_37um.npz": "m/V",
    "generator/x_cc.csv": "rad/s/V",
    "hsm150/hsm_pos_0.06_1.npz": "rad/(N m)",
    "joint_state_bags/roblab_hw4": "PoseWithCovarianceStamped",
    "joint_state_bags/unisa_ur10_exciting": "axis wrist_3_joint",
    "lsb250/lsb250_exp2.npz": "19 windows",
    "raw_mat/crane_meas1.mat": "counts/V",
    "raw_mat/hsm150_idf_pos_0.06_1.mat": "rad/(N m)",
    "rm_arm/joint_1.npz": "rad/(N m)",
    "servo_target/chirp0.csv": "rad/rad",
    "tx40/curr_data.csv": "rad/A",
    "tx40/joint1_merged.csv": "rad/A",
    "ur10e/ur-20_01_22-joint_1.csv": "rad/A",
    "ur10e/ur-20_01_22-joint_6.csv": "rad/A",
    "vendor_exports/dspace_bldc.mat": "rad/s/V",
    "vendor_exports/tc3_decimalcomma.csv": "15.62      0.00",
    "vendor_exports/tc3_default.csv": "15.62      0.00",
}
FINDS: dict[str, dict[str, tuple[float, float, str]]] = {
    "ball_plate/Motor2_v73.mat": {"gain": (0.244, 0.03, "rad/s/V")},
    "camber/LinA_no-pp-sine-sweep-10mm-0.5Hz.txt": {"gain": (0.0, 10.0, "m/s/A")},  # least squares is poor, too: the unit alone
    "daisy/robot_arm.dat": {"resonance_2.frequency": (63.35, 0.1, "Hz")},
    "dcmotor_phi/velocity_feedback_comparison.csv": {"gain": (0.987, 0.003, "rad/s/(rad/s)")},
    "emps/emps_train.npz": {"gain": (0.09, 0.06, "m/s/V")},
    "f16/f-16.txt": {"resonance_1.frequency": (7.4, 0.1, "Hz"), "resonance_2.frequency": (9.1, 0.1, "Hz")},
    "frf_file/G_I_PI_300_DP.csv": {"gain": (8186.0, 80.0, "out/s/in")},
    "frf_file/G_I_PID_300_DP.csv": {"gain": (3629.0, 36.0, "out/s/in")},
    "frf_file/G_I_PID_300_AP.dat": {"gain": (3629.0, 36.0, "out/s/in")},
    "lsb250/lsb250_exp1.npz": {"antiresonance_1.frequency": (11.8, 0.3, "Hz"), "resonance_1.frequency": (13.5, 0.3, "Hz")},  # distorted by friction
    "rm_arm/joint_3.npz": {"friction": (0.33, 0.03, "N m")},
    "servo_target/response.json": {"delay": (0.044, 0.004, "s")},
    "tue_bench/load_side.mat": {"resonance_1.frequency": (58.9, 0.2, "Hz")},
    "two_inertia_bench/multisineA.npz": {"antiresonance_1.frequency": (53.9, 0.3, "Hz"), "resonance_1.frequency": (76.2, 0.3, "Hz")},
    "two_inertia_bench/multisineB.npz": {"antiresonance_1.frequency": (53.9, 0.3, "Hz"), "resonance_1.frequency": (76.2, 0.5, "Hz")},
    "vendor_exports/ctrlx_step.trace.csv": {"time_constant": (0.036, 0.003, "s"), "delay": (0.172, 0.003, "s")},
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
        found = axis["quantities" if command in ("servo", "steps") else "estimates"]
        for parameter, (value, within, unit) in FINDS[name].items():
            assert found[parameter]["value"] == pytest.approx(value, abs=within) and found[parameter]["unit"] == unit, found[parameter]
        return
    said = cli(command, path, *options)
    assert said.code == (2 if name in REFUSES else 0), said.err
    assert SAYS.get(name, "") in said.out and REFUSES.get(name, "") in said.err, said.out + said.err
