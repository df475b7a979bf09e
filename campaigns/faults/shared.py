"""Every command that reads a recording, on recordings of real machines: an answer or one line, without traceback or warning.

The recordings are in $XY_SYSID_DATA, or in ../shared/data next to the project, and are not part of it.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from campaigns.faults.attack import Attack, Found, answered, at_most, command

WORDS = (
    "Every file of the recordings of other people's machines, with the options that it needs, is given to all commands that read a recording: the "
    "result must be an answer or one line. The options are in `campaigns/faults/shared.py`."
)
LONGEST = 600.0  # s, limit for one command on a full recording
DATA = Path(os.environ.get("XY_SYSID_DATA") or Path(__file__).parents[3] / "shared" / "data")


@dataclass(frozen=True, slots=True)
class Shared:
    """One file or bag. options: needed to read it; part: options that select a short part with sufficient motion."""

    path: str
    options: tuple[str, ...] = ()
    part: tuple[str, ...] = ()


def mapped(columns: str, *options: str) -> tuple[str, ...]:
    """The options for columns whose names do not identify them."""
    return ("--map", columns, *options)


RECORDINGS = (
    Shared("ball_plate/Motor2_v73.mat", part=("--axis", "axis2", "--span", "0:2")),
    Shared("ball_plate/motor1.npz", part=("--span", "0:2")),
    Shared("bam_servo/bam_xl330_sin_time_square_kp800.csv"),
    Shared("bam_servo/bam_xl330_sin_time_square_kp800_even.npz"),
    Shared("bam_servo/bam_xl330_up_and_down_kp100.csv"),
    Shared("bam_servo/bam_xl330_up_and_down_kp100_even.npz"),
    Shared(
        "camber/LinA_no-pp-sine-sweep-10mm-0.5Hz.txt",
        mapped("time=1,input=6,output=4", "--unit", "time=ms", "--unit", "output=mm"),
        ("--span", "0:15"),
    ),
    Shared("crane/crane_1.npz", part=("--span", "0:30")),
    Shared("daisy/robot_arm.dat", mapped("input=1,output=2", "--rate", "500", "--unit", "input=N m,output=rad/s^2")),
    Shared(
        "dcmotor_phi/velocity_feedback_comparison.csv",
        mapped("time=time_s,input=commanded_deg_s,output=angle_deg", "--unit", "output=deg"),
        part=("--span", "0:10"),
    ),
    Shared("emps/emps_train.npz", part=("--span", "0:1.5")),
    Shared("f16/f-16.txt", mapped("input=2,output=3", "--rate", "400", "--unit", "input=N", "--unit", "output=m/s^2"), part=("--span", "0:21")),
    Shared("frf_file/G_I_PID_300_AP.dat"),
    Shared("frf_file/G_I_PID_300_DP.csv"),
    Shared("frf_file/G_I_PI_300_DP.csv"),
    Shared("gap_foreign/gap_hertz_16um.npz", part=("--span", "0:1.5")),
    Shared("gap_foreign/gap_linear_12um.npz", part=("--span", "0:1.5")),
    Shared("gap_foreign/gap_linear_37um.npz", part=("--span", "0:1.5")),
    Shared(
        "generator/x_cc.csv",
        mapped("input=x_cc.csv:1,output=y_cc.csv:1", "--rate", "1000", "--unit", "output=rad/s"),
        ("--span", "0:20"),
    ),
    Shared("generator/y_cc.csv", ("--rate", "1000")),
    Shared("hsm150/hsm_pos_0.06_1.npz", part=("--span", "0:3")),
    Shared("joint_state_bags/roblab_hw4"),
    Shared("joint_state_bags/unisa_ur10_exciting", part=("--axis", "wrist_3_joint", "--span", "0:20")),
    Shared("lsb250/lsb250_exp1.npz", part=("--span", "0:1.2")),
    Shared("lsb250/lsb250_exp2.npz", part=("--span", "0:1.2")),
    Shared("raw_mat/crane_meas1.mat", mapped("input=motorinput,output=Motor positie", "--unit", "output=counts"), part=("--span", "0:30")),
    Shared("raw_mat/hsm150_idf_pos_0.06_1.mat", mapped("time=data:1,input=data:5,output=data:3", "--unit", "output=rad"), part=("--span", "0:3")),
    Shared("rm_arm/joint_1.npz", mapped("input=tau_measured:1,output=q:1", "--unit", "input=N m", "--unit", "output=rad"), part=("--span", "0:40")),
    Shared("rm_arm/joint_3.npz", mapped("input=tau_measured:3,output=q:3", "--unit", "input=N m", "--unit", "output=rad"), part=("--span", "0:40")),
    Shared("servo_target/chirp0.csv", mapped("time=time,input=target,output=position")),
    Shared("servo_target/response.json"),
    Shared("tue_bench/load_side.mat", mapped("input=1,output=2", "--rate", "4000", "--unit", "output=rad"), part=("--span", "0:1")),
    Shared("two_inertia_bench/multisineA.npz", part=("--span", "1:3")),
    Shared("two_inertia_bench/multisineB.npz", part=("--span", "1:3")),
    Shared("tx40/curr_data.csv"),
    Shared("tx40/joint1_merged.csv", part=("--span", "0:0.3")),
    Shared("tx40/pos_read_data.csv"),
    Shared("ur10e/ur-20_01_22-joint_1.csv", mapped("time=1,input=14,output=2", "--unit", "input=A", "--unit", "output=rad"), part=("--span", "0:15")),
    Shared("ur10e/ur-20_01_22-joint_6.csv", mapped("time=1,input=19,output=7", "--unit", "input=A", "--unit", "output=rad"), part=("--span", "0:12")),
    Shared("vendor_exports/ctrlx_step.trace.csv"),
    Shared("vendor_exports/dspace_bldc.mat", mapped("input=Switch2,output=Switch", "--unit", "input=duty,output=rad/s")),
    Shared("vendor_exports/mitsubishi_mr.csv"),
    Shared("vendor_exports/tc3_decimalcomma.csv", mapped("input=var_INT8,output=var_UINT8")),
    Shared("vendor_exports/tc3_default.csv", mapped("input=var_INT8,output=var_UINT8")),
)
NO_RECORDINGS = ("README.md",)
COMMANDS = ("columns", "fit", "compare", "diagnose", "refine", "report")
MORE = ("frf", "steps", "servo", "coupling", "fleet")  # commands that the tests leave to this campaign
LITTLE, BRIEF = ("--set", "length=512"), ("--budget", "0.3")
RIGID = ("--set", "numerator_order=0", "--set", "denominator_order=2")  # fixed orders for the report, since fit tests the choice of orders
SHORT = {
    **dict.fromkeys(("frf", "fit", "coupling", "compare"), LITTLE),
    **dict.fromkeys(("diagnose", "refine"), BRIEF),
    "report": (*LITTLE, *RIGID, *BRIEF),
}


def unnamed(folder: Path = DATA) -> list[str]:
    """Files that are in no row; a row with a folder includes all its files."""
    named = tuple(row.path for row in RECORDINGS)
    files = (path.relative_to(folder).as_posix() for path in sorted(folder.rglob("*")) if path.is_file())
    return [file for file in files if file not in NO_RECORDINGS and not any(file == name or file.startswith(f"{name}/") for name in named)]


def words(name: str, row: Shared, folder: Path, short: bool) -> list[str]:
    """The arguments of a command on a recording; folder: for its output."""
    found = [name, *(["--one"] if name == "fleet" else []), str(DATA / row.path)]
    if name == "columns":
        return found
    own = {"refine": ["--auto"], "report": ["-o", str(folder / "report.html"), "--force"]}.get(name, [])
    return [*found, *own, *row.options, *(row.part if short else ()), *(SHORT.get(name, ()) if short else ())]


def told(name: str, row: Shared, folder: Path, short: bool = False, seconds: float = LONGEST) -> Found:
    """The outcome of a command on a recording."""
    asked = words(name, row, folder, short)
    what = f"xy-sysid {' '.join(asked)}"
    with warnings.catch_warnings(record=True) as warned, at_most(seconds):
        warnings.simplefilter("always")
        try:
            found = answered(command(*asked), what)
        except Exception as error:  # noqa: BLE001  any error is a result of the campaign
            return Found("traceback", note=f"{what}: {type(error).__name__}: {error}")
    if warned:
        return Found("not told", note=f"{what}: {warned[0].category.__name__}: {warned[0].message} ({warned[0].filename}:{warned[0].lineno})")
    return found


def walk(name: str, tries: int, folder: Path) -> Iterator[Found]:
    """One command on every recording."""
    if not DATA.is_dir():
        yield Found("skipped", note="no recordings of real machines; give their folder with XY_SYSID_DATA")
        return
    folder.mkdir(parents=True, exist_ok=True)
    for row in RECORDINGS[:tries]:
        yield told(name, row, folder)


def attack(name: str) -> Attack:
    """A row of the page."""
    run: Callable[[int, Path], Iterator[Found]] = partial(walk, name)
    return Attack(f"{name} of each recording", run, len(RECORDINGS), 0, "an answer or one line")


ATTACKS = tuple(attack(name) for name in (*COMMANDS, *MORE))
