"""The numbers in the configuration formats of ros2_control, Klipper, LinuxCNC, ODrive and TwinCAT: one function for each target."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from dataclasses import dataclass

from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.cascade import ESTIMATOR, RATE, cascade
from xy_sysid.control_design.closed_loop import NO_LIMIT
from xy_sysid.control_design.feedback import TURN, Feedback, in_milliseconds
from xy_sysid.control_design.filters import Shaper
from xy_sysid.control_design.gains import Gains
from xy_sysid.errors import BadInput
from xy_sysid.units import Units

DEGREE = TURN / 360.0  # rad
WIDTH = 100  # characters of a line of comment
LEAST_GAIN, LEAST_PHASE = 1.7, 35.0  # margins without the derivative's low-pass or with rounded times: a machine that warms up needs them


@dataclass(frozen=True, slots=True)
class Designed:
    """The content of a snippet: the axis' name and model, and the designs for it.

    calculation: periods from reading to writing; speed: m/s, the largest of the fastest path; None if the limit of the drive is unknown
    """

    axis: str
    model: PhysicalModel
    gains: Gains
    feedback: Feedback | None
    calculation: float
    shaper: Shaper | None = None
    speed: float | None = None

    @property
    def units(self) -> Units:
        """Units of the model."""
        return self.model.units


@dataclass(frozen=True, slots=True)
class Snippet:
    """target: its name; file: name of the file; text: in the target's own syntax, with the note as a comment; note: what it cannot represent."""

    target: str
    file: str
    text: str
    note: str


def ros2_control(of: Designed) -> Snippet:
    """Parameters of pid_controller/PidController, with the names of control_toolbox."""
    loop = _unfiltered_loop(of, "ros2_control")
    limit = loop.controller.limit
    bound, shared = ".inf", "u_clamp limits the PID alone, not its sum with the feedforward"
    if limit < NO_LIMIT:
        fed = abs(of.gains.value("kV")) * (of.speed or 0.0)
        bound = f"{limit - fed:.6g}"
        shared += f": of {limit:.4g} {of.units.input} it leaves {fed:.3g} to the feedforward, for up to {of.speed or 0.0:.3g} {of.units.speed}"
    name = "'" + of.axis.replace("'", "''") + "'"  # in quotes: the parser of ROS 2 reads a plain y or no as a bool, and 1 as an integer
    head = f"# u = p e + i int(e) + d de/dt in {of.units.input}, e in {of.units.output}, at {loop.sampling_rate:g} Hz"
    lines = [
        "pid_controller:",
        "  ros__parameters:",
        f"    dof_names: [{name}]",
        "    command_interface: effort",
        "    reference_and_state_interfaces: [position, velocity]",
        "    enable_feedforward: true",
        "    gains:",
        f"      {name}:",
        f"        p: {loop.controller.kp:.6g}",
        f"        i: {loop.controller.ki:.6g}",
        f"        d: {loop.controller.kd:.6g}",
        f"        i_clamp_max: {bound}",
        f"        i_clamp_min: -{bound}",
        f"        u_clamp_max: {bound}",
        f"        u_clamp_min: -{bound}",
        "        antiwindup_strategy: conditional_integration",
        f"        feedforward_gain: {of.gains.value('kV'):.6g}{_unsure(of, 'kV', '  # ')}",
    ]
    note = (
        "feedforward_gain is kV: the controller multiplies the commanded velocity by it while enable_feedforward is true; a version "
        "without this parameter has the service ~/set_feedforward_control instead. "
        f"{shared}; kS ({of.gains.value('kS'):.4g} {of.units.input}) and kA ({of.gains.value('kA'):.4g} {of.units.input}/({of.units.output}/s2)) "
        f"have no place in it, add them in a controller of your own.{_gravity(of)} {_unfiltered(loop)}"
    )
    return Snippet("ros2_control", "controllers.yaml", _text([head, *_comment(note), *lines]), note)


def klipper(of: Designed) -> Snippet:
    """The section [input_shaper] of printer.cfg."""
    if of.shaper is None:
        raise BadInput("klipper", "an axis without a resonance", "a model with one", "There is nothing to shape.")
    axis = of.axis if of.axis in ("x", "y") else "x"
    other = f"; the axis is {of.axis!r}, and Klipper shapes x and y: change _x to _y if it is that one" if axis != of.axis else ""
    lines = [
        "[input_shaper]",
        f"shaper_type_{axis}: {of.shaper.name}",
        f"shaper_freq_{axis}: {of.shaper.frequency:.2f}",
        f"damping_ratio_{axis}: {of.shaper.damping:.4f}",
    ]
    note = f"Klipper drives steppers without feedback: only the shaper applies{other}"
    head = [f"# of axis {of.axis!r}, written as x"] if other else []
    return Snippet("klipper", "printer.cfg", _text([*head, *_comment(note), *lines]), note)


def linuxcnc(of: Designed) -> Snippet:
    """HAL commands for a pid component, in mm, or in degrees for a rotary axis. Raises BadInput if the limit leaves nothing for the PID."""
    loop = _unfiltered_loop(of, "linuxcnc")
    per, length = {"m": (1e-3, "mm"), "rad": (DEGREE, "deg")}.get(of.units.output, (1.0, of.units.output))
    at = of.axis
    size, outside = loop.controller.limit, abs(of.gains.value("kS")) + abs(of.gains.value("kCos"))
    if size <= outside:
        raise BadInput("linuxcnc", f"a limit of {size:g} {of.units.input}", f"more than kS and kCos, {outside:.3g}", "Check --limit, or the model.")
    values = {
        "Pgain": loop.controller.kp * per,
        "Igain": loop.controller.ki * per,
        "Dgain": loop.controller.kd * per,
        "FF1": of.gains.value("kV") * per,
        "FF2": of.gains.value("kA") * per,
        "bias": of.gains.value("kG"),
        "maxoutput": size - outside if size < NO_LIMIT else 0.0,
    }
    head = f"# output in {of.units.input}, position in {length}; run the thread at {loop.sampling_rate:g} Hz; needs loadrt pid names=pid.{at}"
    unsure = {name: _unsure(of, gain) for name, gain in (("FF1", "kV"), ("FF2", "kA"), ("bias", "kG"))}
    lines = [f"# {name} is {doubt}" for name, doubt in unsure.items() if doubt]
    lines += [f"setp pid.{at}.{name} {value:.6g}" for name, value in values.items()]
    note = (
        f"pid has no kS: add {of.gains.value('kS'):.4g} {of.units.input} with the sign of the commanded velocity.{_gravity(of)} "
        f"{'maxoutput leaves room for it. ' if outside and size < NO_LIMIT else ''}{_unfiltered(loop)}"
    )
    return Snippet("linuxcnc", "axis.hal", _text([head, *_comment(note), *lines]), note)


def odrive(of: Designed) -> Snippet:
    """Assignments in odrivetool. Raises BadInput for an axis that is not in N m and rad, or A and rad with the torque constant left to the user."""
    loop = _loop(of, "odrive")
    if of.units.output != "rad" or of.units.input not in ("N m", "Nm", "A"):
        asked = f"{of.units.input} and {of.units.output}"
        raise BadInput(
            "odrive", f"an axis in {asked}", "N m (or A) and rad", "ODrive commands a torque: convert the recording with --unit and --scale."
        )
    own = cascade(of.model, loop.asked, of.calculation)
    torque = "torque_constant * " if of.units.input == "A" else ""
    at = "odrv0.axis0"
    lines = [f"torque_constant = {at}.config.motor.torque_constant"] if torque else []
    lines += [
        f"{at}.config.encoder_bandwidth = {ESTIMATOR:g}  # rad/s",
        f"{at}.controller.config.pos_gain = {own.position_gain:.6g}",
        f"{at}.controller.config.vel_gain = {torque}{own.velocity_gain * TURN:.6g}",
        f"{at}.controller.config.vel_integrator_gain = {torque}{own.velocity_integral * TURN:.6g}",
        f"{at}.controller.config.inertia = {torque}{of.gains.value('kA') * TURN:.6g}{_unsure(of, 'kA', '  # ')}",
    ]
    limit = loop.controller.limit
    if limit < NO_LIMIT:  # limit of the sum of feedback and feedforward
        lines += [f"{at}.config.torque_soft_{end} = {torque}{size:.6g}" for end, size in (("max", limit), ("min", -limit))]
    note = (
        f"designed for ODrive's own loops at {RATE:g} Hz with its encoder estimator of {ESTIMATOR:g} rad/s, which firmware before 0.6 calls "
        f"encoder.config.bandwidth. Crossover {own.nominal.crossover:.3g} Hz; worst of {own.count} samples: phase margin {own.worst.phase:.3g} "
        f"degrees, gain margin {own.worst.gain:.3g}. The model has to contain ODrive's current loop: its input is the torque (or current) command. "
        "ODrive's inertia is what kA is here, per turn. "
        f"It has no kS and kV: add their torque to input_torque.{_gravity(of)}"
    )
    return Snippet("odrive", "odrivetool", _text([*_comment(note), *lines]), note)


def twincat(of: Designed) -> Snippet:
    """Structured text with FB_CTRL_PID of Tc2_ControllerToolbox, kS, kV, kA and kG behind it; lengths in mm. Raises BadInput for an uneven cycle.

    The block is kp (1 + 1 / (Tn s) + Tv s / (1 + Td s)) with times in whole milliseconds; the margins are those of the rounded times.
    """
    loop = _loop(of, "twincat")
    cycle = 1e3 / loop.sampling_rate
    if abs(cycle - round(cycle)) > 1e-9 * cycle or cycle < 1.0:
        allowed = "a cycle of 1 ms or a multiple of it, which FB_CTRL_PID needs"
        raise BadInput("twincat", f"a rate of {loop.sampling_rate:g} Hz", allowed, "Choose one with --controller-rate, 1000 for instance.")
    if not (loop.counted.stable and loop.counted.gain >= LEAST_GAIN and loop.counted.phase >= LEAST_PHASE):
        given = f"phase margin {loop.counted.phase:.3g} degrees and gain margin {loop.counted.gain:.3g} with times in whole ms"
        advice = f"Ask for less than {loop.nominal.crossover:.3g} Hz with --bandwidth."
        raise BadInput("twincat", given, f"at least {LEAST_PHASE:g} degrees and {LEAST_GAIN:g}", advice)
    per, length = (1e-3, "mm") if of.units.output == "m" else (1.0, of.units.output)
    own = in_milliseconds(loop.controller)
    times = {
        "tCtrlCycleTime": 1e-3 * cycle,
        "tTaskCycleTime": 1e-3 * cycle,
        "tTn": own.kp / own.ki,
        "tTv": own.kd / own.kp,
        "tTd": own.derivative_time,
    }
    fields = [f"{name} := T#{round(1e3 * value)}MS" for name, value in times.items()]
    fields.append(f"fKp := {own.kp * per:.9E}")
    limited = own.limit < NO_LIMIT
    if limited:
        fields += [f"fOutMaxLimit := {own.limit:.9E}", f"fOutMinLimit := {-own.limit:.9E}"]
    kept = [f"    {name} : LREAL := {value:.9E}; (* {unit} *)" for name, value, unit in _feedforward(of, per, length)]
    fed = "fKS * fSign + fKV * fSetVelocity + fKA * fSetAcceleration + fKG"
    fed += " + fKCos * COS(fSetPosition - fZero)" if of.gains.value("kCos") else ""
    shared = [
        f"fFeedforward := LIMIT({-own.limit:.9E}, {fed}, {own.limit:.9E});",
        f"stParams.fOutMaxLimit := {own.limit:.9E} - fFeedforward; (* the sum stays within the limit, and the integral stops there *)",
        f"stParams.fOutMinLimit := {-own.limit:.9E} - fFeedforward;",
    ]
    head = f"(* Axis {of.axis}: input in {of.units.input}, position in {length}. Call it in a task of {cycle:g} ms. *)"
    lines = [
        f"PROGRAM {plain_name(of.axis, 'Axis')}",
        "VAR_INPUT",
        f"    fSetPosition : LREAL; (* {length} *)",
        f"    fSetVelocity : LREAL; (* {length}/s *)",
        f"    fSetAcceleration : LREAL; (* {length}/s2 *)",
        f"    fActPosition : LREAL; (* {length} *)",
        "END_VAR",
        "VAR_OUTPUT",
        f"    fOutput : LREAL; (* {of.units.input} *)",
        "END_VAR",
        "VAR",
        "    fbPid : FB_CTRL_PID;",
        "    stParams : ST_CTRL_PID_PARAMS := (",
        *(f"        {field}{',' if field != fields[-1] else ''}" for field in fields),
        "    );",
        *kept,
        "    fSign : LREAL;",
        "    fFeedforward : LREAL;",
        "END_VAR",
        "",
        "fSign := SEL(fSetVelocity > 0.0, SEL(fSetVelocity < 0.0, 0.0, -1.0), 1.0);",
        *(shared if limited else [f"fFeedforward := {fed};"]),
        "fbPid(fSetpointValue := fSetPosition, fActualValue := fActPosition, eMode := eCTRL_MODE_ACTIVE, stParams := stParams);",
        "fOutput := fbPid.fOut + fFeedforward;",
        "END_PROGRAM",
    ]
    left = f"a phase margin of {loop.counted.phase:.3g} degrees and a gain margin of {loop.counted.gain:.3g} are left"
    doubt = f"; {of.gains.doubt}" if of.gains.doubt else ""
    note = f"needs Tc2_ControllerToolbox; times are whole milliseconds, so {left}; the integral stops with the sum at the limit{doubt}"
    return Snippet("twincat", "axis.st", _text([head, *_comment(note, "(* ", " *)"), *lines]), note)


def _comment(note: str, before: str = "# ", after: str = "") -> list[str]:
    """The note as lines of comment: who pastes the file months later reads what it lacks."""
    return [f"{before}{line}{after}" for line in textwrap.wrap(note, WIDTH)]


def _text(lines: list[str]) -> str:
    return "\n".join(lines) + "\n"


def _feedforward(of: Designed, per: float, length: str) -> list[tuple[str, float, str]]:
    unit = of.units.input
    return [
        ("fKS", of.gains.value("kS"), f"{unit}{_unsure(of, 'kS', ', ')}"),
        ("fKV", of.gains.value("kV") * per, f"{unit}/({length}/s){_unsure(of, 'kV', ', ')}"),
        ("fKA", of.gains.value("kA") * per, f"{unit}/({length}/s2){_unsure(of, 'kA', ', ')}"),
        ("fKG", of.gains.value("kG"), f"{unit}{_unsure(of, 'kG', ', ')}"),
        *([("fKCos", of.gains.value("kCos"), unit), ("fZero", of.gains.value("zero"), length)] if of.gains.value("kCos") else []),
    ]


def _gravity(of: Designed) -> str:
    """The term to add for an arm, which the target cannot represent; and the gains that are 0 because the data do not determine them."""
    size, zero = of.gains.value("kCos"), of.gains.value("zero")
    arm = (
        f" It has no kCos: add {size:.4g} {of.units.input} times the cosine of the angle minus {zero:.4g} rad ({zero / DEGREE:.4g} degrees)."
        if size
        else ""
    )
    return f"{arm} {of.gains.doubt}." if of.gains.doubt else arm


def _unsure(of: Designed, gain: str, before: str = "") -> str:
    """A comment on a gain that the data do not determine; before: text in front of it."""
    return f"{before}not determined by the data" if gain in of.gains.unsure else ""


def plain_name(axis: str, prefix: str = "axis") -> str:
    """A name that is valid in every language."""
    return f"{prefix}_" + "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in axis)


TARGETS: dict[str, Callable[[Designed], Snippet]] = {
    "ros2_control": ros2_control,
    "klipper": klipper,
    "linuxcnc": linuxcnc,
    "odrive": odrive,
    "twincat": twincat,
}


def _loop(of: Designed, target: str) -> Feedback:
    if of.feedback is None:
        raise BadInput(target, "an axis without a controller", "one for which a feedback was designed", "See why it was refused.")
    return of.feedback


def _unfiltered_loop(of: Designed, target: str) -> Feedback:
    """The feedback for a target without a low-pass on the derivative. Raises BadInput if the gain margin is too small without it."""
    loop = _loop(of, target)
    if not (loop.bare.stable and loop.bare.gain >= LEAST_GAIN):
        given = f"gain margin {loop.bare.gain:.3g} without a filter on the derivative, which {target} lacks"
        raise BadInput(target, given, f"at least {LEAST_GAIN:g}", f"Ask for less than {loop.nominal.crossover:.3g} Hz with --bandwidth.")
    return loop


def _unfiltered(loop: Feedback) -> str:
    margins = f"a phase margin of {loop.bare.phase:.3g} degrees and a gain margin of {loop.bare.gain:.3g} are left"
    return f"Its derivative is not filtered: {margins}, and more of the encoder's noise comes through"
