"""One machine per effect, and which pictures of its rigid model show the effect best."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import plotly.graph_objects as go

from xy_sim.effect_text import with_effects
from xy_sim.machine import Machine
from xy_sysid.excitation.lockstep import drive
from xy_sysid.report import story_figures as f
from xy_sysid.samples.recording import Run
from xy_sysid.settings import AxisExcitation, ExcitationSettings, build
from xy_sysid.story.document import document
from xy_sysid.story.story import begin, tell

SECONDS = 40.0

Picture = Callable[..., go.Figure]


@dataclass(frozen=True, slots=True)
class Example:
    """An example of an effect: its pictures, and the signs of the effect in them.

    size: of the effect, empty for the default; machine: file of the machine; excite: changed excitation settings
    """

    effect: str
    pictures: tuple[Picture, ...]
    look: str
    size: str = ""
    machine: str = "rigid.yaml"
    excite: tuple[tuple[str, float], ...] = ()

    @property
    def name(self) -> str:
        """Name of its file."""
        return self.effect or "nothing_missing"

    @property
    def typed(self) -> str:
        """The value for ``xy-sysid simulate --effect``; empty without an effect."""
        return f"{self.effect}={self.size}" if self.size else self.effect


FREQUENCY, SPEED, PLACE, TIME, ZOOM, BODE = f.residual, f.residual_speed, f.residual_position, f.residual_time, f.zoom, f.bode

EXAMPLES = (
    Example(
        "",
        (FREQUENCY, SPEED, PLACE),
        "The reference. At high frequencies the error is at the noise floor, at low ones below it (the floor allows 0.1 % of the signal). "
        "The mean error is zero at every velocity and position.",
    ),
    Example(
        "coulomb_friction",
        (FREQUENCY, SPEED, ZOOM),
        "The mean error against velocity jumps at standstill. At low speed the axis is slower than the model in both directions. At high "
        "speed it is faster, because the fit compensated for the friction: it made the rigid model too weak. By frequency the error is flat "
        "up to the pole of the axis, because the sign of the velocity contains all frequencies.",
    ),
    Example(
        "stribeck_friction",
        (FREQUENCY, SPEED, ZOOM),
        "A jump as with Coulomb friction, but steeper and higher near standstill. The size of the error has a peak there, because friction "
        "is largest at breakaway.",
    ),
    Example(
        "presliding_hysteresis",
        (FREQUENCY, SPEED, ZOOM),
        "By frequency the error is as large as with Coulomb friction. But the mean error against velocity has no jump, only a smooth S, "
        "because the force follows the distance since the last reversal and not the sign of the velocity.",
    ),
    Example(
        "load_dependent_friction",
        (FREQUENCY, SPEED, ZOOM),
        "By frequency the error is flat up to the pole of the axis, as with Coulomb friction. But against velocity the mean error is small and has "
        "hardly a jump at standstill, because the friction is a fraction of the input, which can have any value there.",
    ),
    Example(
        "asymmetric_friction",
        (FREQUENCY, SPEED, TIME),
        "A jump as with Coulomb friction, around a mean that is not zero: friction is larger in one direction, which acts like a load while "
        "the axis moves to and fro.",
    ),
    Example(
        "asymmetric_viscous_friction",
        (FREQUENCY, SPEED, TIME),
        "The mean error against velocity is an inverted V: the same sign at both ends, and larger at higher speed. The error of a load also "
        "has one sign, but it is flat.",
    ),
    Example(
        "constant_load",
        (FREQUENCY, SPEED, TIME),
        "The mean error is the same at every velocity and time. There is no error by frequency, because a constant force acts at 0 Hz only. "
        "Examples are a weight, a preloaded spring and an offset of the amplifier.",
    ),
    Example(
        "dead_zone",
        (FREQUENCY, SPEED, ZOOM),
        "An S as with friction, but without the jump. The loss depends on the voltage and not on the direction of motion, and at standstill "
        "the voltage can have any value.",
    ),
    Example(
        "saturation",
        (FREQUENCY, SPEED, ZOOM),
        "An inverted S that bends back at the highest speeds. Only the peaks are cut, and the fit made the model weaker everywhere to "
        "compensate. In time: single large errors at the voltage peaks.",
    ),
    Example(
        "amplifier_lag",
        (FREQUENCY, BODE, ZOOM),
        "No error at the lowest frequencies, and an increasing error above. At the dip of the error, the fitted delay has the same phase as "
        "the lag. The measured magnitude bends down above 100 Hz, which a delay cannot do.",
    ),
    Example(
        "backlash",
        (FREQUENCY, BODE, ZOOM),
        "Small fast motions stay inside the gap, so the motor moves without the table: above some frequency the axis moves more than the "
        "model. Slow, large motions move both masses and fit.",
    ),
    Example(
        "cogging",
        (FREQUENCY, PLACE, SPEED),
        "The mean error against position is a wave with a period of the motor or the screw. Against velocity there is only a slope.",
    ),
    Example(
        "lead_error",
        (FREQUENCY, PLACE, SPEED),
        "The size of the error is a wave along the travel and grows with speed. The mean error is zero. The scale of the encoder depends on "
        "the position; no force is missing.",
    ),
    Example(
        "position_dependent_gain",
        (FREQUENCY, PLACE, SPEED),
        "The size of the error depends on the position and not on the speed: the fit is right where the gain has its mean value. The mean "
        "error is nearly zero because the error has the sign of the voltage.",
    ),
    Example(
        "screw_compliance",
        (FREQUENCY, BODE, ZOOM),
        "The response has a deep notch and a peak, and the error is largest there. The model has neither.",
    ),
    Example(
        "base_resonance",
        (FREQUENCY, BODE, ZOOM),
        "A small notch with a peak next to it, near 47 Hz; in time the error oscillates at that frequency. The transfer function is the "
        "same as that of a compliant screw. The name comes from typical parameter values, which are a prior and not a measurement.",
    ),
    Example(
        "hardening_stiffness",
        (FREQUENCY, PLACE, TIME),
        "The mean error bends at both ends of the travel, against the motion: a stiffening spring. Over a short travel it looks like a "
        "straight line, so the effect is made large here (`cubic` 1e6 V/m3).",
        "1e6",
    ),
    Example(
        "return_spring",
        (FREQUENCY, PLACE, SPEED),
        "The mean error against position is a straight line, as for a force towards one position. It grows towards low frequencies, where "
        "the motion is wide. Against velocity the mean error stays near zero.",
    ),
    Example(
        "gravity",
        (FREQUENCY, PLACE, SPEED),
        "A rotary joint; in the pictures 1000 mm stand for 1 rad. The mean error is part of a sine: steep where the arm hangs, flat where it "
        "is level. Over a tenth of a turn a spring with a load looks the same.",
        machine="joint.yaml",
        excite=(
            ("rms", 6.0),
            ("limit", 30.0),
            ("low", 0.05),
            ("high", 100.0),
            ("centring", 0.0),
            ("travel_min", -2.9),
            ("travel_max", 2.9),
            ("brake", 0.1),
        ),
    ),
    Example(
        "position_dependent_drag",
        (FREQUENCY, PLACE, SPEED),
        "The size of the error depends on the position: the model is right in the middle, too fast at the end with more drag, too slow at "
        "the other end. The mean error is nearly zero because the error has the sign of the motion.",
        "6",
    ),
    Example(
        "quadratic_drag",
        (FREQUENCY, SPEED, TIME),
        "The mean error against velocity is an S: the model is too slow at moderate speed and too fast at both ends, because the fit "
        "chose its drag for the usual speed. With dry friction it is the other way round.",
    ),
    Example(
        "gain_drift",
        (FREQUENCY, SPEED, TIME),
        "A V against time: the fit is right in the middle of its data. The error grows to both sides.",
    ),
)


def rigid_model(example: Example) -> dict[str, Any]:
    """The story of axis x of that machine, at its rigid model."""
    return document(begin(_recorded((f"x:{example.typed}",) if example.effect else (), example.machine, example.excite)))


def whole_story() -> dict[str, Any]:
    """A machine with cogging and Coulomb friction, from the rigid model to the noise floor."""
    return document(tell(_recorded(("x:cogging", "x:coulomb_friction"))))


@functools.cache
def _recorded(effects: tuple[str, ...], machine: str = "rigid.yaml", excite: tuple[tuple[str, float], ...] = ()) -> Run:
    table = with_effects(Machine.from_file(machine, None, False), list(effects))
    axes = {axis: build(AxisExcitation, {"seed": seed, **dict(excite)}) for seed, axis in enumerate(table.axes, start=1)}
    settings = ExcitationSettings(rate=table.rate, lockstep=True, speed=0.0, axes=axes)
    return drive(table, settings, SECONDS, lambda seconds: None).run("x")
