"""Options for reading a file, which every reader takes, from keywords or from the options of a command."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from xy_sysid.bags import POSITION, VOLTAGE
from xy_sysid.errors import BadInput

ROLES = ("time", "seq", "joint", "input", "output", "reference")
OF_AN_AXIS = ("input", "output", "reference")
OF_A_RESPONSE = ("frequency", "magnitude", "phase", "real", "imag", "coherence", "sigma")  # columns of a measured frequency response
WHAT = "time, seq, joint, input, output, reference, or one axis's like x.input"
PAIR = re.compile(r",(?=\s*[^,=]*?(?:time|seq|joint|input|output|reference|frequency|magnitude|phase|real|imag|coherence|sigma)\s*=)", re.IGNORECASE)
NUMBER = re.compile(r"[-+]?\d*\.?\d*(e[-+]?\d+)?", re.IGNORECASE)
Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class Reading:
    """The meaning of a file's columns, and the part to read.

    columns: column by role, {"time": "Zeit", "x.input": "Motor Voltage", "output": "Pos"}; without an axis: for any axis
    units:   unit by role, {"x.output": "counts", "time": "ms"}; scales: factor to SI, or to ``units``
    rate:    Hz; samples are used as evenly spaced, and a time column is ignored
    axes:    the axes to read, in this order; None: all
    start, stop: s after the first sample; None: the end
    voltage_topic, position_topic: block topics of a bag; joint_topic: its JointState topic, found if there is only one
    effort_as_voltage: use the joints' effort as the input, even if there is a voltage topic
    joints:  the joint of each axis, as x=shoulder_pan_joint; effort_lag: samples by which effort is older than its stamp
    velocity: use the joints' velocity as the output, even if there are positions
    Raises BadInput for values out of range and unknown roles.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    scales: Mapping[str, float] = field(default_factory=dict)
    rate: float | None = None
    axes: Sequence[str] | None = None
    start: float = 0.0
    stop: float | None = None
    voltage_topic: str = VOLTAGE
    position_topic: str = POSITION
    joint_topic: str | None = None
    effort_as_voltage: bool = False
    joints: Sequence[str] = ()
    effort_lag: int = 0
    velocity: bool = False

    def __post_init__(self) -> None:
        if not self.start >= 0 or (self.stop is not None and not self.stop > self.start):
            raise BadInput("start and stop", f"{self.start}, {self.stop}", "0 <= start < stop, in s", "Choose another part.")
        if self.rate is not None and not (math.isfinite(self.rate) and self.rate > 0):
            raise BadInput("rate", self.rate, "> 0 Hz", "Give the sampling rate in Hz.")
        for option, given in (("--map", self.columns), ("--unit", self.units), ("--scale", self.scales)):
            for what in given:
                if what.rpartition(".")[2] not in (OF_AN_AXIS if "." in what else (*ROLES, *OF_A_RESPONSE)):
                    raise BadInput(option, repr(what), WHAT, f"Write for example {option} x.output=...")
        for what, unit in self.units.items():
            if NUMBER.fullmatch(unit.strip()) and unit.strip() != "1":  # 1 is a part of full scale
                raise BadInput("--unit", f"{what}={unit}", "a unit like V, mm or rad/s, not a number", "A factor is given with --scale.")
        for what, scale in self.scales.items():
            if not (math.isfinite(scale) and scale != 0):
                raise BadInput("--scale", f"{what}={scale}", "a number that is not 0", "Give the factor to SI.")

    def a_response(self, looks_so: bool) -> bool:
        """Whether a file holds a measured frequency response: by the chosen columns, otherwise by its content (``looks_so``)."""
        if any(what in OF_A_RESPONSE for what in self.columns):
            return True
        return looks_so and not any(what.rpartition(".")[2] in OF_AN_AXIS for what in self.columns)

    def unit(self, role: str, axis: str = "") -> str | None:
        """The unit given for a role of an axis; a reference is measured like the output."""
        return _of(self.units, role, axis)

    def scale(self, role: str, axis: str = "") -> float | None:
        """The factor given for a role of an axis."""
        return _of(self.scales, role, axis)


def _of(given: Mapping[str, Value], role: str, axis: str) -> Value | None:
    for name in (role, "output") if role == "reference" else (role,):
        for key in (f"{axis}.{name}", name):
            if key in given:
                return given[key]
    return None


def pairs(texts: Sequence[str], option: str) -> dict[str, str]:
    """WHAT=VALUE pairs as {"time": "Zeit", "x.input": "Motor Voltage"}; a text may hold several, separated by commas. Raises BadInput."""
    found: dict[str, str] = {}
    for text in texts:
        for pair in PAIR.split(text):
            what, equals, value = pair.partition("=")
            what, value = what.strip(), value.strip().strip('"')
            if not (equals and what and value):
                raise BadInput(option, repr(pair), "WHAT=VALUE", f"Write for example {option} x.output=...")
            role = what.rpartition(".")[2].lower()
            found[what[: len(what) - len(role)] + role] = value
    return found


def numbers(texts: Sequence[str], option: str) -> dict[str, float]:
    """``pairs`` with numbers as values. Raises BadInput."""
    found: dict[str, float] = {}
    for what, text in pairs(texts, option).items():
        try:
            found[what] = float(text)
        except ValueError:
            raise BadInput(option, f"{what}={text}", "a number", "Give the factor to SI, for example 0.5e-6.") from None
    return found
