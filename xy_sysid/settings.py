"""All settings, each defined once: default, unit, limits and meaning.

ROS parameters, CLI options, YAML files, the page and docs/settings.md are made from these classes. Units are SI.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, TypeVar, get_args

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, field_validator, model_validator

from xy_sysid.errors import BadInput
from xy_sysid.units import Units

NAMESPACE = "/xy"  # of the topics, and of the nodes unless a run file says otherwise
Names = Annotated[list[str], BeforeValidator(lambda value: value.split(",") if isinstance(value, str) else value)]
CHOICE = re.compile(r"'([^']*)'")
SIGNS = {"ge": ">= ", "gt": "> ", "le": "<= ", "lt": "< ", "expected": ""}  # how a limit that was broken is told
KINDS = {"list_type": "a list", "string_type": "text", "dict_type": "names with values", "model_type": "names with values"}  # of values in YAML
SAID = dict.fromkeys(("fs", "sample_rate"), ("sampling_rate", "rate")) | {
    "u": ("voltage", "input"),
    "y": ("position", "output"),
}  # names in other tools
AnySettings = TypeVar("AnySettings", bound="Settings")


def knob(default: Any, meaning: str, unit: str = "", **limits: Any) -> Any:
    """One setting: its default, meaning, unit and limits (ge, gt, le, lt)."""
    return Field(default=default, description=meaning, json_schema_extra={"unit": unit}, **limits)


class Settings(BaseModel):
    """A group of settings that cannot be changed in place; an unknown name is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


LEAST_COHERENCE = 0.3  # of a trusted line, unless the user chooses another

# what people type for a kind of signal
ALSO = {"chirp": "sweep", "sine": "stepped_sine", "sines": "multisine", "random": "noise", "white": "noise", "binary": "prbs", "pulse": "impulse"}


class AxisExcitation(Settings):
    """What one axis is driven with."""

    kind: Literal["noise", "multisine", "multisine_odd", "multisine_detect", "sweep", "stepped_sine", "prbs", "impulse", "step", "off"] = knob(
        "noise", "signal; multisine_detect is odd with one random line left out of each group of four, to show distortion"
    )
    rms: float = knob(
        1.0,
        "root mean square of the signal (impulse and step: its height); with joint_trajectory, 0: the largest that the limits allow",
        "V",
        ge=0.0,
        le=100.0,
    )
    limit: float = knob(10.0, "no sample exceeds this magnitude", "V", gt=0.0, le=1000.0)
    low: float = knob(0.1, "lowest frequency excited", "Hz", ge=0.0, le=100_000.0)
    high: float = knob(300.0, "highest frequency excited", "Hz", gt=0.0, le=100_000.0)
    period: float = knob(4.096, "period of a multisine or PRBS, length of a sweep or step, dwell of a stepped sine", "s", gt=0.0, le=3600.0)
    steps: int = knob(60, "frequencies of a stepped sine, spread evenly on a log axis", "", ge=1, le=10_000)
    offset: float = knob(0.0, "constant voltage added", "V", ge=-100.0, le=100.0)
    seed: int = knob(1, "seed of the random numbers; give every axis its own", "", ge=0, le=2**31 - 1)
    centring: float = knob(2.0, "pull back to the start, volts per metre of distance from it; 0: open loop", "V/m", ge=0.0, le=10_000.0)
    travel_min: float = knob(-0.14, "soft limit of travel, lower", "m", ge=-1000.0, le=1000.0)
    travel_max: float = knob(0.14, "soft limit of travel, upper", "m", ge=-1000.0, le=1000.0)
    brake: float = knob(0.02, "length of the zone before a soft limit in which outward voltage is faded to inward braking", "m", gt=0.0, le=100.0)
    brake_voltage: float = knob(1.0, "inward voltage at and beyond a soft limit", "V", ge=0.0, le=100.0)
    slow: float = knob(0.0, "amplitude of a slow sine added to the signal, which takes a joint through its range", "V", ge=0.0, le=1000.0)
    slow_period: float = knob(10.0, "period of that sine", "s", gt=0.0, le=3600.0)
    velocity_gain: float = knob(0.0, "steady speed per volt from the first run, for the guards; 0: not known", "m/s/V", ge=0.0, le=1000.0)
    max_speed: float = knob(0.0, "with joint_trajectory: largest speed of the reference", "m/s", ge=0.0, le=1000.0)
    max_acceleration: float = knob(
        0.0, "with joint_trajectory: largest acceleration of the reference, also for stopping", "m/s^2", ge=0.0, le=100_000.0
    )
    breakaway: float = knob(
        0.0, "voltage at which friction may still hold the axis at rest, for the guards; 0: 0.5 V or limit / 20", "V", ge=0.0, le=1000.0
    )

    @field_validator("kind", mode="before")
    @classmethod
    def _called(cls, value: object) -> object:
        return ALSO.get(value, value) if isinstance(value, str) else value

    @model_validator(mode="after")
    def _ordered(self) -> AxisExcitation:
        if self.low >= self.high:
            raise ValueError(f"low is {self.low} Hz; allowed: below high = {self.high} Hz")
        if self.travel_max - self.travel_min <= 2 * self.brake:
            raise ValueError(f"travel from {self.travel_min} to {self.travel_max} m; allowed: wider than two brake zones of {self.brake} m")
        return self


class ExcitationSettings(Settings):
    """Node ``excitation``."""

    rate: float = knob(2000.0, "samples per second", "Hz", ge=10.0, le=100_000.0)
    block: int = knob(20, "samples in one message", "", ge=1, le=10_000)
    speed: float = knob(1.0, "times faster than real time, for a simulated machine only; 0: as fast as possible", "", ge=0.0, le=1000.0)
    lockstep: bool = knob(False, "wait for the machine's answer before going on (simulated machines); on a real machine leave it off")
    ahead: int = knob(3, "with lockstep: blocks that may be sent before the first answer", "", ge=1, le=1000)
    duration: float = knob(0.0, "stop after this many seconds of signal; 0: never", "s", ge=0.0, le=1e9)
    ramp: float = knob(0.5, "time to fade in, and out at an orderly end", "s", ge=0.0, le=60.0)
    watchdog: float = knob(0.05, "if no position comes for this long while active, fade to zero and go inactive", "s", gt=0.0, le=10.0)
    abort_ramp: float = knob(0.02, "time to fade out when a guard trips, and on deactivate", "s", ge=0.0, le=10.0)
    patience: float = knob(10.0, "how long to wait for the first position, at 0 V, and with lockstep for any answer", "s", gt=0.0, le=3600.0)
    experiment: str = knob("", "file of xy-sysid next that is used from configure on, if it stays within limit and travel; empty: none")
    autostart: bool = knob(False, "configure and activate automatically, as soon as a machine is present")
    output: Literal["blocks", "commands"] = knob("blocks", "blocks of voltage for a driver, or commands for a controller of ros2_control")
    interface: Literal["effort", "velocity", "position"] = knob(
        "effort", "with commands: the controller's command interface; rms, limit, offset and all others in V are in its unit"
    )
    command: Literal["forward", "joint_trajectory"] = knob(
        "forward", "with commands: one number for each joint for a forward controller, or pieces of trajectory for a JointTrajectoryController"
    )
    horizon: float = knob(
        0.5,
        "with joint_trajectory: duration of the motion that is sent ahead; without a newer message the joint then brakes to rest",
        "s",
        ge=0.05,
        le=10.0,
    )
    unit: Literal["m", "rad"] = knob("m", "unit of positions: m, or rad for a joint that turns")
    command_topic: str = knob("/forward_command_controller/commands", "with commands: topic of the controller")
    controller_joints: Names = knob([""], "with commands: all joints of the controller, in its order; empty: those of the axes")
    joint_topic: str = knob("joint_states", "with commands: topic of the joint states; that of ros2_control is /joint_states")
    joints: Names = knob([""], 'with commands: the joint of an axis, as "x=shoulder_pan_joint"; an axis without an entry has the name of its joint')
    renamed: bool = knob(False, "the topic voltage is renamed: its receiver expects blocks, not commands")
    axes: dict[str, AxisExcitation] = Field(
        default_factory=lambda: {"x": AxisExcitation(seed=1), "y": AxisExcitation(seed=2)}, description="one group per axis"
    )

    @model_validator(mode="after")
    def _consistent(self) -> ExcitationSettings:
        if self.speed == 0 and not self.lockstep:
            raise ValueError("speed is 0 without lockstep; allowed: above 0, or lockstep with a simulated machine")
        if not self.axes:
            raise ValueError("axes is empty; allowed: at least one axis")
        if self.output == "commands":
            self._as_commands()
        elif self.command != "forward":
            raise ValueError(f"command is {self.command} with output {self.output}; allowed: output commands, interface position")
        return self

    def _as_trajectory(self) -> None:
        """A motion within limits that are given, and nothing that would be added to it."""
        if self.interface != "position":
            raise ValueError(f"command is joint_trajectory with interface {self.interface}; allowed: position")
        for name, axis in self.axes.items():
            if axis.kind not in ("multisine", "sweep", "off"):
                raise ValueError(f"{name}.kind is {axis.kind} with joint_trajectory; allowed: multisine, sweep, off")
            for limit, unit in (("max_speed", f"{self.unit}/s"), ("max_acceleration", f"{self.unit}/s^2")):
                if axis.kind != "off" and not getattr(axis, limit) > 0.0:
                    raise ValueError(f"{name}.{limit} is 0 {unit} with joint_trajectory; allowed: above 0, the joint's own limit or less")
            for added in ("offset", "slow"):
                if getattr(axis, added) != 0.0:
                    raise ValueError(f"{name}.{added} is {getattr(axis, added):g} with joint_trajectory; allowed: 0, nothing is added to the motion")

    def _as_commands(self) -> None:
        if self.command == "joint_trajectory":
            self._as_trajectory()
        if self.lockstep or self.speed != 1.0:
            raise ValueError("output is commands with lockstep or a speed; allowed: the controller's own time, lockstep false and speed 1")
        for name, axis in self.axes.items():
            unit = self.units[0]
            if axis.rms > axis.limit:
                raise ValueError(f"{name}.rms is {axis.rms:g} {unit}; allowed: up to limit = {axis.limit:g} {unit}")
            room = (axis.travel_max - axis.travel_min) / 2
            if self.interface == "position" and axis.limit > room:
                raise ValueError(f"{name}.limit is {axis.limit:g} {unit} of reference; allowed: up to half the travel, {room:g} {unit}")

    @property
    def units(self) -> Units:
        """Of what is sent and of position."""
        if self.output == "blocks":
            return Units("V", self.unit)
        sent = {"effort": {"m": "N", "rad": "N m"}[self.unit], "velocity": f"{self.unit}/s", "position": self.unit}
        return Units(sent[self.interface], self.unit)

    @property
    def step(self) -> int:
        """Samples that are sent at a time."""
        return 1 if self.output == "commands" else self.block

    @property
    def holds(self) -> bool:
        """Whether positions are sent, so that what is safe is where the machine is, and not zero."""
        return self.output == "commands" and self.interface == "position"


class StreamSettings(Settings):
    """The streams of samples that a node receives."""

    source: Literal["blocks", "joint_state"] = knob("blocks", "type of the position topic")
    output: Literal["position", "velocity"] = knob(
        "position", "with joint_state: the field that is the output; a velocity, of drives whose position is empty, NaN or wraps, is integrated"
    )
    effort_as_voltage: bool = knob(False, "with joint_state: take the input from `effort` instead of the voltage topic")
    joints: Names = knob(
        [""], 'with joint_state: the joint of an axis, as "x=shoulder_pan_joint"; an axis without an entry has the name of its joint'
    )
    joint_topic: str = knob("joint_states", "with joint_state: their topic; that of ros2_control is /joint_states")
    effort_lag: int = knob(
        0, "samples by which effort in joint states is older than its stamp; 1 if it is that of the previous cycle", "", ge=0, le=100
    )
    input_unit: str = knob("V", "unit of the input, for example N m for an effort; shown in every answer")
    output_unit: str = knob("m", "unit of the position, m or rad, also where the output is a velocity")
    reorder: float = knob(0.5, "how late a block may come before its samples count as lost", "s", gt=0.0, le=60.0)

    @property
    def units(self) -> Units:
        """Of input and position; whoever has named the unit of a velocity, rad/s, has said that of its integral."""
        return Units(self.input_unit, self.output_unit.removesuffix("/s") if self.output == "velocity" else self.output_unit)


class IdentifierSettings(StreamSettings):
    """Node ``identifier``, and every offline command that estimates."""

    window: Literal["hann", "hamming", "blackman", "blackmanharris", "flattop", "boxcar"] = knob("hann", "window of the spectra")
    length: int = knob(4096, "samples in a window", "", ge=16, le=2**22)
    overlap: float = knob(0.5, "part of a window shared with the next", "", ge=0.0, le=0.95)
    response: Literal["h1", "joint_input_output", "local_polynomial", "local_rational"] = knob(
        "h1", "output over input (h1); in closed loop by the reference (joint_input_output); with transients removed, for few windows (local_*)"
    )
    differenced: bool = knob(
        True, "apply the window to the difference of the position (no leakage of the integrator); off: plain windows, as in the paper"
    )
    memory: float = knob(0.0, "forget exponentially with this time constant; 0: forget nothing", "s", ge=0.0, le=1e9)
    sliding: int = knob(0, "keep only this many of the newest windows; 0: keep all", "", ge=0, le=100_000)
    band_low: float = knob(0.5, "lowest frequency used in a fit", "Hz", ge=0.0, le=1e6)
    band_high: float = knob(300.0, "highest frequency used in a fit", "Hz", gt=0.0, le=1e6)
    min_coherence: float = knob(LEAST_COHERENCE, "lines below this coherence are not trusted", "", ge=0.0, le=1.0)
    numerator_order: int = knob(-1, "order of the transfer function's numerator; -1: see denominator_order", "", ge=-1, le=12)
    denominator_order: int = knob(
        0, "order of its denominator, integrators included; 0 with numerator_order -1: both are chosen from the data, else 4 and 2", "", ge=0, le=12
    )
    integrators: int = knob(1, "poles fixed at zero", "", ge=0, le=2)
    delay: bool = knob(True, "estimate a delay")
    hold: Literal["zoh", "none"] = knob("zoh", "how the voltage behaves between samples: held (zoh) or band-limited (none)")
    refit: float = knob(2.0, "seconds of data between two fits", "s", gt=0.0, le=3600.0)
    frozen: float = knob(0.25, "an encoder that repeats one value for this long while the voltage moves counts as frozen", "s", gt=0.0, le=60.0)
    alarm_windows: int = knob(5, "number of newest windows from which the watched resonance is fitted", "", ge=3, le=1000)
    alarm_sigma: float = knob(4.0, "a resonance has moved if it is this many standard errors from its reference", "", ge=1.0, le=100.0)
    state_file: str = knob("", "file that keeps the spectra over a restart; empty: none")
    save_every: float = knob(10.0, "seconds between two saves of the state", "s", gt=0.0, le=3600.0)
    baseline: str = knob("", "model file of fit --model from commissioning, with which the newest estimates are compared; empty: none")
    baseline_table: str = knob("", "table of xy-sysid fleet, with the spread of the estimates between recordings; empty: 3 % for every parameter")

    @model_validator(mode="after")
    def _ordered(self) -> IdentifierSettings:
        if self.band_low >= self.band_high:
            raise ValueError(f"band_low is {self.band_low} Hz; allowed: below band_high = {self.band_high} Hz")
        numerator, denominator = self.orders
        if numerator > denominator:
            raise ValueError(f"numerator_order is {numerator}; allowed: up to denominator_order = {denominator}")
        if self.integrators > denominator:
            raise ValueError(f"integrators is {self.integrators}; allowed: up to denominator_order = {denominator}")
        return self

    @property
    def orders(self) -> tuple[int, int]:
        """Of numerator and denominator: those asked for, or those of a rigid body with one resonance."""
        asked = self.numerator_order if self.numerator_order >= 0 else min(2, self.denominator_order or 2)
        return asked, self.denominator_order or 4

    @property
    def orders_from_data(self) -> bool:
        """Nobody asked for orders."""
        return self.numerator_order < 0 and self.denominator_order == 0


class DiagnoserSettings(StreamSettings):
    """Node ``diagnoser``."""

    memory: float = knob(120.0, "newest seconds without a gap that are kept and analysed", "s", ge=1.0, le=36_000.0)
    minimum: float = knob(10.0, "seconds without a gap that an analysis needs", "s", ge=0.5, le=36_000.0)
    interval: float = knob(0.0, "diagnose again after this many seconds of data; 0: only on request", "s", ge=0.0, le=1e9)
    tolerance: float = knob(0.001, "part of the signal that is treated as noise; real machines need 0.01 or more", "", ge=1e-6, le=0.5)
    effect_files: Names = knob([""], "Python files with effects of your own; they are executed")
    baseline: str = knob("", "model file of refine --model from commissioning, with which each diagnosis is compared; empty: none")
    baseline_table: str = knob("", "table of xy-sysid fleet, with the spread of the estimates between recordings; empty: 3 % for every parameter")
    effects: dict[str, Names] = Field(
        default_factory=lambda: {"x": [""], "y": [""]},
        description="effects in the model of this axis: setting them adds or removes them and fits again; an empty name: none",
    )

    def chosen(self, axis: str) -> tuple[str, ...]:
        """The effects that the model of an axis is to have."""
        return given(self.effects.get(axis, []))


AXES = ("x", "y")  # by default


def for_axes(cls: type[AnySettings], axes: Sequence[str]) -> AnySettings:
    """The defaults of a node for these axes."""
    groups: dict[str, Any] = {}
    if cls is ExcitationSettings:
        groups["axes"] = {axis: AxisExcitation(seed=number) for number, axis in enumerate(axes, start=1)}
    if cls is DiagnoserSettings:
        groups["effects"] = {axis: [""] for axis in axes}
    return cls(**groups)


def of_other_axes(cls: type[Settings], names: Iterable[str], axes: Sequence[str]) -> set[str]:
    """Those of the names that set axis x or y, which default.yaml always does, where the axes are others."""
    unused = {item.name for item in knobs(for_axes(cls, [axis for axis in AXES if axis not in axes]))} if set(AXES) - set(axes) else set()
    return (set(names) & unused) - {item.name for item in knobs(for_axes(cls, axes))}


def given(names: list[str]) -> tuple[str, ...]:
    """The names of a list that are not empty: ROS has no empty lists in its parameter files."""
    return tuple(name.strip() for name in names if name.strip())


class BallscrewSettings(Settings):
    """Node ``ballscrew``: the simulated machine."""

    machine: str = knob("paper.yaml", "machine file: a path, or a name in config/machines")
    seed: int = knob(0, "seed of noise and hidden effects; 0: that of the machine file", "", ge=0, le=2**31 - 1)
    clean: bool = knob(False, "without encoder noise and quantization")
    realtime: bool = knob(False, "continue by the clock when no voltage comes, as a real machine does; off: time stands still until the next block")
    watchdog: float = knob(
        0.05,
        "with realtime: time after the last block at which the voltage goes to 0 V, as in a real drive; 0: never, the last voltage stays",
        "s",
        ge=0.0,
        le=10.0,
    )


class RecorderSettings(Settings):
    """Node ``recorder``."""

    output: str = knob("", "folder of the new bag; empty: xy_<date>")
    storage: Literal["sqlite3", "mcap"] = knob("sqlite3", "file format of the bag")
    topics: list[str] = Field(
        default_factory=lambda: [
            "voltage",
            "position",
            "reference",
            "joint_states",
            "/joint_states",
            "frf/.*",
            "transfer_function/.*",
            "metrics",
            "diagnosis",
            "comparison/.*",
            "cross_frf/.*",
            "coupling/.*",
            "error_ladder/.*",
            "story/.*",
        ],
        description="topics to record, as regular expressions relative to the namespace",
    )
    seconds: float = knob(0.0, "stop after this time; 0: never", "s", ge=0.0, le=1e9)
    machine: str = knob("", "name of the machine, kept in the meta data of the bag and shown by report")


@dataclass(frozen=True, slots=True)
class Knob:
    """One setting, flattened: ``x.rms`` for the rms of axis x."""

    name: str
    value: Any
    default: Any
    unit: str
    meaning: str
    low: float | None
    high: float | None
    choices: tuple[str, ...]
    above: bool = False  # low itself is not allowed
    below: bool = False  # high itself is not allowed


def _limit(metadata: list[Any], *names: str) -> float | None:
    for item in metadata:
        for name in names:
            found = getattr(item, name, None)
            if found is not None:
                return float(found)
    return None


def knobs(settings: Settings, prefix: str = "") -> Iterator[Knob]:
    """Every setting of a group, axes as ``<axis>.<name>``, lists by axis as ``<name>.<axis>``."""
    for name, info in type(settings).model_fields.items():
        value = getattr(settings, name)
        if isinstance(value, dict):
            for axis, group in value.items():
                if isinstance(group, Settings):
                    yield from knobs(group, f"{prefix}{axis}.")
                else:
                    yield Knob(
                        name=f"{prefix}{name}.{axis}",
                        value=group,
                        default=[""],
                        unit="",
                        meaning=info.description or "",
                        low=None,
                        high=None,
                        choices=(),
                    )
            continue
        extra = info.json_schema_extra if isinstance(info.json_schema_extra, dict) else {}
        choices = tuple(getattr(info.annotation, "__args__", ())) if "Literal" in str(info.annotation) else ()
        yield Knob(
            name=prefix + name,
            value=value,
            default=info.get_default(call_default_factory=True),
            unit=str(extra.get("unit", "")),
            meaning=info.description or "",
            low=_limit(info.metadata, "ge", "gt"),
            high=_limit(info.metadata, "le", "lt"),
            choices=choices,
            above=_limit(info.metadata, "gt") is not None,
            below=_limit(info.metadata, "lt") is not None,
        )


def _nested(cls: type[Settings], flat: Mapping[str, Any]) -> dict[str, Any]:
    groups = {name for name, info in cls.model_fields.items() if "dict[" in str(info.annotation)}
    nested: dict[str, Any] = {}
    for key, value in flat.items():
        if "." in key and groups:
            axis, _, rest = key.partition(".")
            if axis in groups:
                nested.setdefault(axis, {})[rest] = value
            else:
                nested.setdefault(next(iter(groups)), {}).setdefault(axis, {})[rest] = value
        else:
            nested[key] = value
    return nested


def build(cls: type[AnySettings], values: Mapping[str, Any], where: str = "settings") -> AnySettings:
    """Settings from nested or flat (``x.rms``) values.

    Raises BadInput that names the value, what is allowed, and for an unknown key the nearest spelling.
    """
    try:
        return cls.model_validate(_nested(cls, values))
    except ValidationError as error:
        raise _explain(cls, error, where) from None


def changed(settings: AnySettings, values: Mapping[str, Any]) -> AnySettings:
    """The same settings with some flat names changed; raises BadInput like ``build``."""
    flat = {item.name: item.value for item in knobs(settings)}
    unknown = [name for name in values if name not in flat]
    if unknown:
        raise unknown_name(unknown[0], flat, type(settings).__name__)
    return build(type(settings), {**flat, **values})


def unknown_name(name: str, known: Mapping[str, Any] | list[str], where: str) -> BadInput:
    """The error for an unknown name, with the nearest known one."""
    near = [item for item in SAID.get(name, ()) if item in known] or difflib.get_close_matches(name, list(known), n=1, cutoff=0.4)
    act = f"Did you mean {near[0]!r}?" if near else "Remove it."
    return BadInput(f"{where}: name", repr(name), ", ".join(known), act)


def _owner(cls: type[Settings], place: Iterable[int | str]) -> type[Settings]:
    """The class of the settings at a place within nested ones."""
    for part in place:
        info = cls.model_fields.get(str(part))
        inner = [one for one in get_args(info.annotation) if isinstance(one, type) and issubclass(one, Settings)] if info else []
        cls = inner[0] if inner else cls
    return cls


def _explain(cls: type[Settings], error: ValidationError, where: str) -> BadInput:
    first = error.errors()[0]
    name = ".".join(str(part) for part in first["loc"])
    if first["type"] == "extra_forbidden":
        return unknown_name(str(first["loc"][-1]), list(_owner(cls, first["loc"][:-1]).model_fields), where)
    context = first.get("ctx", {})
    limits = ", ".join(f"{SIGNS[key]}{value}" for key, value in context.items() if key in SIGNS)
    allowed = limits or KINDS.get(first["type"], first["msg"].removeprefix("Input should be "))
    if "error" in context:
        return BadInput(f"{where}", name or "not consistent", str(context["error"]), "Change one of them.")
    near = difflib.get_close_matches(str(first["input"]), CHOICE.findall(allowed), n=1) if first["type"] == "literal_error" else []
    return BadInput(f"{where}: {name}", repr(first["input"]), allowed, f"Did you mean {near[0]!r}?" if near else "Change it and try again.")
