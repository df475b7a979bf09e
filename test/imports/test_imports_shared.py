"""Every measured file in at most two commands: ``columns`` tells what is in it, and a second one answers. The options are those of docs/files.md."""

from __future__ import annotations

import pytest
from helpers.cli_tools import cli
from helpers.real_data import data

N_M, ANGLE = "input=N m,output=rad", "input=V,output=rad"
# file, command, options, what the answer says
ANSWERS: dict[str, tuple[str, tuple[str, ...], str]] = {
    "emps/emps_train.npz": ("frf", (), "V"),
    "lsb250/lsb250_exp1.npz": ("frf", (), "axis x"),
    "two_inertia_bench/multisineA.npz": ("frf", (), "19 windows"),
    "joint_state_bags/unisa_ur10_exciting": ("frf", (), "axis"),
    "bam_servo/bam_xl330_sin_time_square_kp800.csv": ("frf", (), "rad/V"),
    "crane/crane_1.npz": ("frf", (), "axis x"),
    "hsm150/hsm_pos_0.06_1.npz": ("frf", (), "rad/(N m)"),
    "raw_mat/crane_meas1.mat": ("frf", ("--map", "input=motorinput,output=Motor positie", "--unit", "output=counts"), "counts/V"),
    "raw_mat/hsm150_idf_pos_0.06_1.mat": ("frf", ("--map", "time=data:1,input=data:5,output=data:3", "--unit", N_M), "rad/(N m)"),
    "ur10e/ur-20_01_22-joint_6.csv": ("frf", ("--map", "time=1,input=19,output=7", "--unit", "input=A,output=rad"), "rad/A"),
    "tue_bench/load_side.mat": ("frf", ("--map", "input=1,output=2", "--rate", "4000", "--unit", ANGLE), "rad/V"),
    "tx40/joint1_merged.csv": ("frf", (), "rad/A"),
    "tx40/curr_data.csv": (
        "frf",
        ("--map", "input=curr_data.csv:Joint_1,output=pos_read_data.csv:Joint_1", "--rate", "5000", "--unit", "input=A,output=rad"),
        "rad/A",
    ),
    "generator/x_cc.csv": (
        "frf",
        ("--map", "input=x_cc.csv:1,output=y_cc.csv:1", "--rate", "1000", "--unit", "input=V,output=rad/s"),
        "rad/s/V",
    ),
    "daisy/robot_arm.dat": ("frf", ("--map", "input=1,output=2", "--rate", "500", "--unit", "input=N m,output=rad/s^2"), "100 of 511 lines trusted"),
    "f16/f-16.txt": ("frf", ("--map", "input=2,output=3", "--rate", "400", "--unit", "input=N,output=m/s^2"), "m/s^2/N"),
    "rm_arm/joint_3.npz": ("frf", ("--map", "input=tau_measured:3,output=q:3", "--unit", N_M), "rad/(N m)"),
    "ball_plate/Motor2_v73.mat": ("frf", ("--axis", "axis2", "--unit", "input=V"), "rad/V"),
    "ball_plate/motor1.npz": ("frf", (), "rad/V"),
    "vendor_exports/tc3_default.csv": ("frf", ("--map", "input=var_INT8,output=func_OS", "--set", "frozen=60"), "m/V"),
    "vendor_exports/tc3_decimalcomma.csv": ("frf", ("--map", "input=var_INT8,output=func_OS", "--set", "frozen=60"), "m/V"),
    "vendor_exports/ctrlx_step.trace.csv": (
        "frf",
        ("--map", "input=HMI_SP_Local_Automatico,output=Velocidad_Scaled", "--unit", "input=%,output=rpm"),
        "rad/s/FS",
    ),
    "vendor_exports/dspace_bldc.mat": ("frf", ("--map", "input=Switch,output=Sum3", "--unit", "input=V,output=rpm"), "rad/s/V"),
    "servo_target/response.json": (
        "frf",
        ("--map", "input=data[*].actions,output=data[*].sensor_data", "--rate", "50", "--unit", "input=rad,output=rad"),
        "rad/rad",
    ),
    "servo_target/chirp0.csv": ("frf", ("--map", "input=target,output=position"), "rad/rad"),
    "frf_file/G_I_PI_300_DP.csv": ("columns", (), "300 lines from 10 to 4.9e+04 Hz"),
    "camber/LinA_no-pp-sine-sweep-10mm-0.5Hz.txt": ("frf", ("--map", "time=1,input=6,output=4", "--unit", "time=ms,input=mA,output=mm"), "m/A"),
    "dcmotor_phi/velocity_feedback_comparison.csv": ("columns", (), "angle_deg"),
    "gap_foreign/gap_linear_37um.npz": ("frf", (), "axis x"),
}


@pytest.mark.parametrize("name", ANSWERS)
def test_every_measured_file_answers_in_two_commands(name: str) -> None:
    """The first lists its columns; the second answers, with its quantity and unit, and asks for no window."""
    command, options, says = ANSWERS[name]
    path = data(name)
    assert cli("columns", path).code == 0
    said = cli(command, path, *options)
    assert said.code == 0, said.err
    assert says in said.out, said.out
