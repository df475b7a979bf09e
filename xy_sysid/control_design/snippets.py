"""The numbers in the words and files of controllers that people use: ros2_control, Klipper, LinuxCNC, ODrive. One function a target."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from xy_sysid.control_design.closed_loop import NO_LIMIT
from xy_sysid.control_design.feedback import Feedback
from xy_sysid.control_design.filters import Shaper
from xy_sysid.control_design.gains import Gains
from xy_sysid.errors import BadInput
from xy_sysid.units import Units

TURN = 2.0 * math.pi  # rad
LEAST_GAIN = 1.7  # margin without a filter on the derivative: less is near the end for a machine that warms up


@dataclass(frozen=True, slots=True)
class Designed:
    """What a snippet is written from: the axis' name and units, and what was designed for it."""

    axis: str
    units: Units
    gains: Gains
    feedback: Feedback | None
    shaper: Shaper | None = None


@dataclass(frozen=True, slots=True)
class Snippet:
    """target: its name; file: where the text goes; text: in the target's own syntax; note: what it cannot say."""

    target: str
    file: str
    text: str
    note: str


def ros2_control(of: Designed) -> Snippet:
    """Parameters of pid_controller/PidController, with the names of control_toolbox."""
    loop = _unfiltered_loop(of, "ros2_control")
    limit = loop.controller.limit
    bound = f"{limit:.6g}" if limit < NO_LIMIT else ".inf"
    low = f"-{limit:.6g}" if limit < NO_LIMIT else "-.inf"
    lines = [
        f"# u = p e + i int(e) + d de/dt in {of.units.input}, e in {of.units.output}, at {loop.sampling_rate:g} Hz",
        "pid_controller:",
        "  ros__parameters:",
        f"    dof_names: [{of.axis}]",
        "    command_interface: effort",
        "    reference_and_state_interfaces: [position, velocity]",
        "    gains:",
        f"      {of.axis}:",
        f"        p: {loop.controller.kp:.6g}",
        f"        i: {loop.controller.ki:.6g}",
        f"        d: {loop.controller.kd:.6g}",
        f"        u_clamp_max: {bound}",
        f"        u_clamp_min: {low}",
        "        antiwindup_strategy: conditional_integration",
        "    feedforward_gain: 0.0",
    ]
    note = f"kS, kV and kA have no place in this controller: add them to the effort in a controller of your own. {_unfiltered(loop)}"
    return Snippet("ros2_control", "controllers.yaml", "\n".join(lines) + "\n", note)


def klipper(of: Designed) -> Snippet:
    """The section [input_shaper] of printer.cfg."""
    if of.shaper is None:
        raise BadInput("klipper", "an axis without a resonance", "a model with one", "There is nothing to shape.")
    axis = of.axis if of.axis in ("x", "y") else "x"
    lines = [
        "[input_shaper]",
        f"shaper_type_{axis}: {of.shaper.name}",
        f"shaper_freq_{axis}: {of.shaper.frequency:.2f}",
        f"damping_ratio_{axis}: {of.shaper.damping:.4f}",
    ]
    note = "Klipper drives steppers without feedback: only the shaper applies"
    return Snippet("klipper", "printer.cfg", "\n".join(lines) + "\n", note)


def linuxcnc(of: Designed) -> Snippet:
    """HAL commands for a pid component; lengths in mm, as a metric configuration counts."""
    loop = _unfiltered_loop(of, "linuxcnc")
    per, length = (1e-3, "mm") if of.units.output == "m" else (1.0, of.units.output)
    at = of.axis
    values = {
        "Pgain": loop.controller.kp * per,
        "Igain": loop.controller.ki * per,
        "Dgain": loop.controller.kd * per,
        "FF1": of.gains.value("kV") * per,
        "FF2": of.gains.value("kA") * per,
        "bias": of.gains.value("kG"),
        "maxoutput": loop.controller.limit if loop.controller.limit < NO_LIMIT else 0.0,
    }
    lines = [f"# command in {of.units.input}, position in {length}; run the thread at {loop.sampling_rate:g} Hz"]
    lines += [f"setp pid.{at}.{name} {value:.6g}" for name, value in values.items()]
    note = f"pid has no kS: add {of.gains.value('kS'):.4g} {of.units.input} with the sign of the commanded velocity. {_unfiltered(loop)}"
    return Snippet("linuxcnc", "axis.hal", "\n".join(lines) + "\n", note)


def odrive(of: Designed) -> Snippet:
    """Assignments in odrivetool. Raises BadInput for an axis that is not in N m and rad, or A and rad with the torque constant left to the user."""
    loop = _loop(of, "odrive")
    if of.units.output != "rad" or of.units.input not in ("N m", "Nm", "A"):
        asked = f"{of.units.input} and {of.units.output}"
        raise BadInput(
            "odrive", f"an axis in {asked}", "N m (or A) and rad", "ODrive commands a torque: convert the recording with --unit and --scale."
        )
    torque = "torque_constant * " if of.units.input == "A" else ""
    at = "odrv0.axis0"
    lines = [f"torque_constant = {at}.config.motor.torque_constant"] if torque else []
    lines += [
        f"{at}.controller.config.pos_gain = {loop.position_gain:.6g}",
        f"{at}.controller.config.vel_gain = {torque}{loop.velocity_gain * TURN:.6g}",
        f"{at}.controller.config.vel_integrator_gain = {torque}{loop.velocity_integral * TURN:.6g}",
        f"{at}.controller.config.inertia = {torque}{of.gains.value('kA') * TURN:.6g}",
    ]
    note = "ODrive's loops run at 8 kHz: these gains keep their margins there; its inertia is what kA is here, per turn"
    return Snippet("odrive", "odrivetool", "\n".join(lines) + "\n", note)


TARGETS: dict[str, Callable[[Designed], Snippet]] = {"ros2_control": ros2_control, "klipper": klipper, "linuxcnc": linuxcnc, "odrive": odrive}


def _loop(of: Designed, target: str) -> Feedback:
    if of.feedback is None:
        raise BadInput(target, "an axis without a controller", "one for which a feedback was designed", "See why it was refused.")
    return of.feedback


def _unfiltered_loop(of: Designed, target: str) -> Feedback:
    """The feedback for a target without a filter on the derivative; refused where it takes too much of the margins."""
    loop = _loop(of, target)
    if not (loop.bare.stable and loop.bare.gain >= LEAST_GAIN):
        given = f"gain margin {loop.bare.gain:.3g} without a filter on the derivative, which {target} lacks"
        raise BadInput(target, given, f"at least {LEAST_GAIN:g}", f"Ask for less than {loop.nominal.crossover:.3g} Hz with --bandwidth.")
    return loop


def _unfiltered(loop: Feedback) -> str:
    margins = f"a phase margin of {loop.bare.phase:.3g} degrees and a gain margin of {loop.bare.gain:.3g} are left"
    return f"Its derivative is not filtered: {margins}, and more of the encoder's noise comes through"
