"""An experiment that was designed, on a machine that has limits of its own: taken over only where it keeps within them.

The document is that of ``xy-sysid next``: which axis, for how long, what drives it, and the voltage and travel that it needs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from xy_sysid.errors import BadInput
from xy_sysid.samples.recording import SAME_RATE
from xy_sysid.settings import AxisExcitation, ExcitationSettings, changed, unknown_name
from xy_sysid.units import USUAL, Units

KEYS = ("axis", "rate", "seconds", "excitation", "needs", "units", "expects", "sets", "made_by")
DRIVES = ("kind", "rms", "low", "high", "period", "steps", "offset", "seed", "centring", "slow", "slow_period")  # settings that it may have
AGAIN = "Design it again within these limits: xy-sysid next with --params."


def with_experiment(settings: ExcitationSettings, document: object, where: str) -> ExcitationSettings:
    """The settings of the excitation with a designed experiment on one axis; the other axes get their constant offset, which may hold a load.

    Raises BadInput, in one line, for a document that is none, and for one that asks for more than the settings allow.
    """
    told = _checked(document, where)
    axis = told["axis"]
    if axis not in settings.axes:
        raise BadInput(f"{where}: axis", repr(axis), ", ".join(settings.axes), "Design it for one of these.")
    if abs(told["rate"] / settings.rate - 1.0) > SAME_RATE:
        raise BadInput(
            f"{where}: rate", f"{told['rate']:g} Hz", f"{settings.rate:g} Hz, that of the excitation", "Design it from recordings of this rate."
        )
    own, units = settings.axes[axis], settings.units
    if told["units"] != list(units):
        asked, allowed = (f"{drive} and {place}" for drive, place in (told["units"], units))
        raise BadInput(f"{where}: units", asked, f"{allowed}, those of the excitation", "Design it from recordings of what the excitation sends.")
    voltage, (low, high) = told["needs"]["voltage"], told["needs"]["travel"]
    if not 0.0 <= voltage <= own.limit * (1.0 + 1e-9):
        raise BadInput(f"{where}: voltage of axis {axis}", f"{voltage:.4g} {units.input}", f"up to its limit of {own.limit:g} {units.input}", AGAIN)
    if not own.travel_min <= low < high <= own.travel_max:
        asked, allowed = f"{low:.4g} to {high:.4g} {units.output}", f"{own.travel_min:g} to {own.travel_max:g} {units.output}"
        raise BadInput(f"{where}: travel of axis {axis}", asked, f"within {allowed}", AGAIN)
    values: dict[str, Any] = {f"{axis}.{name}": value for name, value in told["excitation"].items()}
    values |= {f"{other}.{name}": value for other in settings.axes if other != axis for name, value in (("kind", "off"), ("slow", 0.0))}
    made = changed(settings, {**values, "duration": told["seconds"]})
    drives = made.axes[axis]
    together = abs(drives.offset) + drives.slow + drives.rms * (drives.kind != "off")
    if together > own.limit * (1.0 + 1e-9):  # the drive would cut it off, and the motion would be another one
        words = f"{together:.4g} {units.input} of offset, slow and rms together"
        raise BadInput(f"{where}: excitation of axis {axis}", words, f"up to its limit of {own.limit:g} {units.input}", AGAIN)
    return made


def of_an_experiment(name: str) -> bool:
    """Whether a setting of the excitation, such as x.rms, is one that an experiment changes."""
    axis, _, own = name.rpartition(".")
    return own in DRIVES if axis else name in ("duration", "experiment")


def _checked(document: object, where: str) -> Mapping[str, Any]:
    """The experiment of a document, its numbers as numbers."""
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
    travel = told["needs"].get("travel")
    numbers = [told.get("rate"), told.get("seconds"), told["needs"].get("voltage"), *(travel if isinstance(travel, list | tuple) else ())]
    if len(numbers) != 5 or not all(isinstance(value, int | float) and not isinstance(value, bool) for value in numbers):
        raise BadInput(f"{where}: rate, seconds, needs", repr(numbers), "numbers", "Make the file again.")
    units = told.setdefault("units", list(USUAL))
    if not isinstance(units, list | tuple) or len(units) != 2 or not all(isinstance(unit, str) for unit in units):
        raise BadInput(f"{where}: units", repr(units), "two, as [V, m]", "Make the file again.")
    if not 0.0 < told["seconds"] <= 3600.0:
        raise BadInput(f"{where}: seconds", told["seconds"], "above 0, up to 3600", "Make the file again.")
    return told


class Lasting(Protocol):
    """What drives an axis, and for how many s."""

    @property
    def excitation(self) -> AxisExcitation:
        """Of the axis."""

    @property
    def seconds(self) -> float:
        """Of motion."""


def document_of(axis: str, rate: float, experiment: Lasting, needs: tuple[float, tuple[float, float]], units: Units = USUAL) -> dict[str, Any]:
    """The document of an experiment. rate: Hz; needs: the largest input, and the travel; units: in which they are."""
    values = experiment.excitation.model_dump()
    drives = {name: values[name] for name in DRIVES}
    return {
        "experiment": {
            "axis": axis,
            "rate": rate,
            "seconds": experiment.seconds,
            "excitation": drives,
            "needs": {"voltage": needs[0], "travel": list(needs[1])},
            "units": list(units),
        }
    }
