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
    """An effect in the making: its pictures, and what to look at in them.

    size: of the effect, empty for the usual one; machine: that has it; excite: how that is driven, else as usual
    """

    effect: str
    pictures: tuple[Picture, ...]
    look: str
    size: str = ""
    machine: str = "rigid.yaml"
    excite: tuple[tuple[str, float], ...] = ()

    @property
    def name(self) -> str:
        """Of its file."""
        return self.effect or "nothing_missing"

    @property
    def typed(self) -> str:
        """As it is given to ``xy-sysid simulate --effect``; empty for none."""
        return f"{self.effect}={self.size}" if self.size else self.effect


FREQUENCY, SPEED, PLACE, TIME, ZOOM, BODE = f.residual, f.residual_speed, f.residual_position, f.residual_time, f.zoom, f.bode

EXAMPLES = (
    Example(
        "",
        (FREQUENCY, SPEED, PLACE),
        "The reference. The error lies on the noise floor at high frequencies and below it at low ones (the floor allows 0.1 % of the signal); "
        "its mean is zero at every velocity and every position.",
    ),
    Example(
        "coulomb_friction",
        (FREQUENCY, SPEED, ZOOM),
        "Look at the mean error against velocity: it jumps from plus to minus at standstill. Just beside zero the axis lags behind the model in "
        "both directions; at the ends it leads, because the fit made the rigid model too weak to make up for the friction. By frequency the "
        "error is the same up to the axis' pole: a sign has all frequencies in it.",
    ),
    Example(
        "stribeck_friction",
        (FREQUENCY, SPEED, ZOOM),
        "The jump of Coulomb friction, but steeper and higher right beside standstill, and the size of the error has a top there: friction is "
        "largest when the axis breaks away.",
    ),
    Example(
        "presliding_hysteresis",
        (FREQUENCY, SPEED, ZOOM),
        "As large by frequency as Coulomb friction, yet the mean against velocity has no jump, only a gentle S: the force follows the way since "
        "the last reversal and not the sign of velocity.",
    ),
    Example(
        "asymmetric_friction",
        (FREQUENCY, SPEED, TIME),
        "The jump of Coulomb friction on a mean that is not zero: friction is larger one way than the other, which pushes like a load "
        "whenever the axis moves to and fro.",
    ),
    Example(
        "asymmetric_viscous_friction",
        (FREQUENCY, SPEED, TIME),
        "The mean error against velocity is a V upside down: of one sign at both ends, and larger the faster. A load is of one sign too, but flat.",
    ),
    Example(
        "constant_load",
        (FREQUENCY, SPEED, TIME),
        "The same mean error at every velocity and every time, and nothing by frequency (a constant has none): weight, a spring at the end of its "
        "way, an offset of the amplifier.",
    ),
    Example(
        "dead_zone",
        (FREQUENCY, SPEED, ZOOM),
        "An S as with friction but without the jump: what is lost depends on the voltage and not on the direction of motion, and at standstill "
        "the voltage may be anything.",
    ),
    Example(
        "saturation",
        (FREQUENCY, SPEED, ZOOM),
        "The S the other way round, bending back at the fastest: only the peaks are cut, and the fit made the model weaker everywhere to make up "
        "for them. In time: single large errors where the voltage peaks.",
    ),
    Example(
        "amplifier_lag",
        (FREQUENCY, BODE, ZOOM),
        "No error at the lowest frequencies, and more and more above; the dip is where the fitted delay happens to turn the phase as the lag does. "
        "The measured magnitude bends down above 100 Hz, which no delay can do.",
    ),
    Example(
        "backlash",
        (FREQUENCY, BODE, ZOOM),
        "Small fast motions stay inside the gap and meet the motor alone: above some frequency the axis moves more than the model. Slow, large "
        "motions see both masses and fit.",
    ),
    Example(
        "cogging",
        (FREQUENCY, PLACE, SPEED),
        "Waves in the mean error against position, with a period of the motor or the screw. Against velocity there is no more than a slope.",
    ),
    Example(
        "lead_error",
        (FREQUENCY, PLACE, SPEED),
        "The size of the error waves along the travel while its mean stays zero, and it grows with speed: the scale of the encoder is wrong by "
        "place, and no force is missing.",
    ),
    Example(
        "position_dependent_gain",
        (FREQUENCY, PLACE, SPEED),
        "The size of the error depends on the place and not on the speed: the fit is right where the gain is the mean one, and errs to both sides. "
        "The mean is nearly zero because the error has the sign of the voltage.",
    ),
    Example(
        "screw_compliance",
        (FREQUENCY, BODE, ZOOM),
        "A deep notch and a peak in the response, and the error has its top there. The model goes straight through.",
    ),
    Example(
        "base_resonance",
        (FREQUENCY, BODE, ZOOM),
        "A small notch with a peak right beside it, near 47 Hz; the error rings at that frequency in time. The same transfer function as a "
        "compliant screw: the name is the likelier by what is usual of both, which is a prior and not a measurement.",
    ),
    Example(
        "hardening_stiffness",
        (FREQUENCY, PLACE, TIME),
        "The mean error bends at both ends of the travel, against the motion: a spring that stiffens. Over a short travel it hides in a "
        "straight line; here it is large (`cubic` 1e6 V/m3).",
        "1e6",
    ),
    Example(
        "return_spring",
        (FREQUENCY, PLACE, SPEED),
        "The mean error is a straight line against position, as of a force towards one place, and grows towards low frequencies, where the motion is "
        "wide. Against velocity its mean stays near zero.",
    ),
    Example(
        "gravity",
        (FREQUENCY, PLACE, SPEED),
        "A joint that turns; 1000 mm stand for 1 rad. The mean error is a piece of a sine: steep where the arm hangs, flat where it is level. "
        "Over a tenth of a turn a spring with a load looks the same.",
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
        "The size of the error depends on the place: the model is right in the middle, too fast at the end that drags more, too slow at the other. "
        "The mean is nearly zero because the error has the sign of the motion.",
        "6",
    ),
    Example(
        "gain_drift",
        (FREQUENCY, SPEED, TIME),
        "A V against time: the fit is right in the middle of the data that it saw, and errs to both sides, most in the part that was held out.",
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
