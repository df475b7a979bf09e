"""A designed experiment on a machine with its own limits; it is accepted only if it stays within them.

The document is that of ``xy-sysid next``: axis, duration, signal, the required voltage and travel, and the allowed start positions. For a robot
that takes only trajectories it names a file with the expected motion, which is sent in place of the signal.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, NamedTuple, Protocol, get_type_hints

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.excitation.trajectory import Trajectory
from xy_sysid.samples.recording import SAME_RATE
from xy_sysid.settings import AxisExcitation, ExcitationSettings, changed, unknown_name
from xy_sysid.units import USUAL, Units

KEYS = ("axis", "rate", "seconds", "ramp", "excitation", "needs", "units", "motion", "expects", "sets", "made_by")
DRIVES = ("kind", "rms", "low", "high", "period", "steps", "offset", "seed", "centring", "slow", "slow_period")  # allowed settings
AGAIN = "Design it again within these limits: xy-sysid next with --params."


@dataclass(frozen=True, slots=True)
class Needs:
    """The requirements of an experiment on its axis.

    voltage: the largest input; travel: (low, high) expected positions, with margin, for a start at ``start``, the position at design
    reach: (low, high) expected motion without margin, relative to its start; within: the ends of travel in the design
    speed, acceleration: the largest expected, with margin; all in the units of the axis
    """

    voltage: float
    travel: tuple[float, float]
    start: float
    reach: tuple[float, float]
    within: tuple[float, float]
    speed: float
    acceleration: float

    def starts(self, low: float = -math.inf, high: float = math.inf) -> tuple[float, float]:
        """(lowest, highest) start position, so that the expected motion stays within the design's ends and within low and high."""
        return max(low, self.within[0]) - self.reach[0], min(high, self.within[1]) - self.reach[1]


@dataclass(frozen=True, slots=True)
class Planned:
    """How an experiment begins and moves, by axis. starts: lowest and highest start position; motions: about the start, of trajectories."""

    starts: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    motions: Mapping[str, Trajectory] = field(default_factory=dict)


class Taken(NamedTuple):
    """An accepted experiment. settings: of the excitation."""

    settings: ExcitationSettings
    planned: Planned


def with_experiment(settings: ExcitationSettings, document: object, where: str, motion: Trajectory | None = None) -> Taken:
    """The settings of the excitation with a designed experiment on one axis; the other axes get their constant offset, which may hold a load.

    motion: that of the document, for a robot that takes only trajectories; others are driven with the signal
    Raises BadInput, in one line, for an invalid document, and for one that exceeds the settings' limits.
    """
    told = _checked(document, where)
    axis = told["axis"]
    if settings.holds and (motion is None or settings.command != "joint_trajectory"):
        act = "Run its motion as a trajectory: xy-sysid next --trajectory, and command joint_trajectory."
        raise BadInput(f"{where}: interface", "position", "effort or velocity, since an experiment moves the axis by itself", act)
    if axis not in settings.axes:
        raise BadInput(f"{where}: axis", repr(axis), ", ".join(settings.axes), "Design it for one of these.")
    own, units, needs = settings.axes[axis], settings.units, Needs(**told["needs"])
    motions: dict[str, Trajectory] = {}
    if settings.holds and motion is not None:
        motions[axis] = _within_limits(settings, told, motion, where)
        needs = replace(needs, reach=(float(motions[axis].position.min()), float(motions[axis].position.max())))
    else:
        _can_be_sent(settings, told, where)
    low, high = needs.travel
    if not own.travel_min <= low < high <= own.travel_max:
        span, allowed = f"{low:.4g} to {high:.4g} {units.output}", f"{own.travel_min:g} to {own.travel_max:g} {units.output}"
        raise BadInput(f"{where}: travel of axis {axis}", span, f"within {allowed}", AGAIN)
    inside = own.travel_min + own.brake, own.travel_max - own.brake
    reach = needs.start + needs.reach[0], needs.start + needs.reach[1]
    if not inside[0] <= reach[0] < reach[1] <= inside[1]:
        span, allowed = (f"{one:.4g} to {other:.4g} {units.output}" for one, other in (reach, inside))
        raise BadInput(f"{where}: motion of axis {axis}", span, f"within {allowed}, where nothing brakes it", AGAIN)
    for name, asked, most in (("speed", needs.speed, own.max_speed), ("acceleration", needs.acceleration, own.max_acceleration)):
        if 0.0 < most < asked:
            unit = f"{units.output}/s{'^2' * (name == 'acceleration')}"
            raise BadInput(f"{where}: {name} of axis {axis}", f"{asked:.4g} {unit}", f"up to its max_{name} of {most:g} {unit}", AGAIN)
    values: dict[str, Any] = {} if motions else {f"{axis}.{name}": value for name, value in told["excitation"].items()}
    values |= {f"{other}.{name}": value for other in settings.axes if other != axis for name, value in (("kind", "off"), ("slow", 0.0))}
    made = changed(settings, {**values, "duration": told["seconds"]})
    drives = made.axes[axis]
    together = abs(drives.offset) + drives.slow + drives.rms * (drives.kind != "off")
    if not motions and together > own.limit * (1.0 + 1e-9):  # the drive would clip it, and the motion would differ
        words = f"{together:.4g} {units.input} of offset, slow and rms together"
        raise BadInput(f"{where}: excitation of axis {axis}", words, f"up to its limit of {own.limit:g} {units.input}", AGAIN)
    return Taken(made, Planned({axis: needs.starts(*inside)}, motions))


def _can_be_sent(settings: ExcitationSettings, told: Mapping[str, Any], where: str) -> None:
    """Raises BadInput if the signal of an experiment differs from that of the excitation in rate, ramp or unit, or exceeds its limit."""
    if abs(told["rate"] / settings.rate - 1.0) > SAME_RATE:
        raise BadInput(
            f"{where}: rate", f"{told['rate']:g} Hz", f"{settings.rate:g} Hz, that of the excitation", "Design it from recordings of this rate."
        )
    if abs(told["ramp"] - settings.ramp) > 1e-6:
        own_ramp = f"{settings.ramp:g} s, that of the excitation"
        raise BadInput(
            f"{where}: ramp", f"{told['ramp']:g} s", own_ramp, "Design it again with --params, which reads the settings of the excitation."
        )
    axis, units = told["axis"], settings.units
    if told["units"] != list(units):
        other, allowed = (f"{drive} and {place}" for drive, place in (told["units"], units))
        raise BadInput(f"{where}: units", other, f"{allowed}, those of the excitation", "Design it from recordings of what the excitation sends.")
    voltage, most = told["needs"]["voltage"], settings.axes[axis].limit
    if not 0.0 <= voltage <= most * (1.0 + 1e-9):
        raise BadInput(f"{where}: voltage of axis {axis}", f"{voltage:.4g} {units.input}", f"up to its limit of {most:g} {units.input}", AGAIN)


def _within_limits(settings: ExcitationSettings, told: Mapping[str, Any], motion: Trajectory, where: str) -> Trajectory:
    """The motion about its start.

    Raises BadInput if it has another unit or rate, does not begin and end at rest there, or exceeds a limit of the axis.
    """
    axis = told["axis"]
    own, unit = settings.axes[axis], settings.units.output
    if told["units"][1] != unit:
        raise BadInput(f"{where}: units", told["units"][1], f"{unit}, that of the excitation", "Design it from its recordings.")
    rate = (motion.time.size - 1) / motion.time[-1]
    if abs(rate / settings.rate - 1.0) > SAME_RATE:
        raise BadInput(f"{where}: points a second", f"{rate:g}", f"{settings.rate:g}, the rate of the excitation", AGAIN)
    moved = motion.position - motion.position[0]
    room = own.limit - 0.5 * own.max_speed / settings.rate  # braking takes up to a sample longer than the limits allow
    speed, acceleration = ("max_speed", motion.speed, own.max_speed, "/s"), ("max_acceleration", motion.acceleration, own.max_acceleration, "/s^2")
    for name, values, most, per in (("limit", moved, room, ""), speed, acceleration):
        peak = float(np.max(np.abs(values)))
        if peak > most:
            raise BadInput(f"{where}: motion of axis {axis}", f"up to {peak:.4g} {unit}{per}", f"up to {most:.4g} {unit}{per}, by its {name}", AGAIN)
    step = own.max_acceleration / rate
    if abs(moved[-1]) > step / rate or max(abs(motion.speed[0]), abs(motion.speed[-1])) > step:
        raise BadInput(f"{where}: motion of axis {axis}", "one that does not end at rest where it began", "one that does", "Make the file again.")
    return replace(motion, position=moved)


def of_an_experiment(name: str) -> bool:
    """True if an experiment changes this setting of the excitation, such as x.rms."""
    axis, _, own = name.rpartition(".")
    return own in DRIVES if axis else name in ("duration", "experiment")


def _checked(document: object, where: str) -> Mapping[str, Any]:
    """The experiment of a document, with all names and numbers checked."""
    if not isinstance(document, Mapping) or not isinstance(document.get("experiment"), Mapping):
        raise BadInput(where, "no experiment", "a file of xy-sysid next", "Make one: xy-sysid next REC -o next.yaml.")
    told = dict(document["experiment"])
    for name in told:
        if name not in KEYS:
            raise unknown_name(str(name), list(KEYS), where)
    for name, kind in (("axis", str), ("excitation", Mapping), ("needs", Mapping)):
        if not isinstance(told.get(name), kind):
            raise BadInput(f"{where}: {name}", repr(told.get(name)), "what xy-sysid next writes", "Make the file again.")
    for name in told["excitation"]:
        if name not in DRIVES:
            raise unknown_name(str(name), list(DRIVES), f"{where}: excitation")
    lacking = [name for name in DRIVES if name not in told["excitation"]]
    if lacking:
        raise BadInput(f"{where}: excitation", f"without {', '.join(lacking)}", f"all of {', '.join(DRIVES)}", "Make the file again.")
    for name in ("rate", "seconds", "ramp"):
        if not _number(told.get(name)):
            raise BadInput(f"{where}: {name}", repr(told.get(name)), "a number", "Make the file again.")
    kinds = get_type_hints(Needs)
    for name in told["needs"]:
        if name not in kinds:
            raise unknown_name(str(name), list(kinds), f"{where}: needs")
    for name, kind in kinds.items():
        value, one = told["needs"].get(name), kind is float
        if not (_number(value) if one else isinstance(value, list | tuple) and len(value) == 2 and all(map(_number, value))):
            raise BadInput(f"{where}: needs.{name}", repr(value), "a number" if one else "two numbers", "Make the file again.")
    units = told.setdefault("units", list(USUAL))
    if not isinstance(units, list | tuple) or len(units) != 2 or not all(isinstance(unit, str) for unit in units):
        raise BadInput(f"{where}: units", repr(units), "two, as [V, m]", "Make the file again.")
    if not 0.0 < told["seconds"] <= 3600.0:
        raise BadInput(f"{where}: seconds", told["seconds"], "above 0, up to 3600", "Make the file again.")
    return told


def motion_file(document: object, where: str) -> str:
    """The name of the file with the motion of a document, empty without one. Raises BadInput for a name that is not of a file beside it."""
    told = document.get("experiment") if isinstance(document, Mapping) else None
    name = told.get("motion", "") if isinstance(told, Mapping) else ""
    if not isinstance(name, str) or "/" in name or "\\" in name or name in (".", ".."):
        raise BadInput(f"{where}: motion", repr(name), "the name of a file beside it", "Make the file again.")
    return name


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


class Lasting(Protocol):
    """A drive signal for an axis with a duration."""

    @property
    def excitation(self) -> AxisExcitation:
        """Settings of the axis's excitation."""

    @property
    def ramp(self) -> float:
        """Fade-in, s."""

    @property
    def seconds(self) -> float:
        """Duration of the motion, s."""


def document_of(axis: str, rate: float, experiment: Lasting, needs: Needs, units: Units = USUAL) -> dict[str, Any]:
    """The document of an experiment. rate: Hz; units: of its requirements."""
    values = experiment.excitation.model_dump()
    drives = {name: values[name] for name in DRIVES}
    return {
        "experiment": {
            "axis": axis,
            "rate": rate,
            "seconds": experiment.seconds,
            "ramp": experiment.ramp,
            "excitation": drives,
            "needs": {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(needs).items()},
            "units": list(units),
        }
    }
