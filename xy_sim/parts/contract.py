"""The description of a part of the machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from xy_sysid.errors import BadInput
from xy_sysid.settings import unknown_name

Kind = Literal["input", "drive", "friction", "force", "structure", "encoder", "integrator"]
Group = Literal["base", "effect", "added", "outside", "event", "imperfection"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of a part: ``low..high`` is drawn from, ``minimum..maximum`` is allowed.

    signed: drawn with either sign; whole: drawn as a whole number
    power:  how it goes with the size of the effect: 1 for the first parameter of a part and 0 for the others unless given;
            negative where the effect shrinks while the number grows
    """

    name: str
    unit: str
    default: float
    low: float
    high: float
    meaning: str
    minimum: float = 0.0
    maximum: float = float("inf")
    signed: bool = False
    whole: bool = False
    power: float | None = None

    def checked(self, value: object, where: str) -> float:
        """The value as a number; raises BadInput outside the allowed range."""
        allowed = f"{self.minimum:g} to {self.maximum:g} {self.unit}".rstrip()
        try:
            number = float(str(value))
        except ValueError:
            raise BadInput(f"{where}: {self.name}", repr(value), f"a number, {allowed}", "Give a number.") from None
        if isinstance(value, bool) or not self.minimum <= number <= self.maximum or abs(number) == float("inf"):
            raise BadInput(f"{where}: {self.name}", repr(value), allowed, "Change it and try again.")
        return number


@dataclass(frozen=True, slots=True)
class Part:
    """One physical effect of the machine.

    law:        the equation, in the symbols of the parameters
    meaning:    what it is on a real table
    source:     where the law comes from
    parameters: the first one is its size, the number of ``--effect NAME=SIZE``
    kind:       where it acts; group: who may suspect it ("outside": no hypothesis knows it; "event": happens meanwhile;
                "added": known, but not drawn;
                "imperfection": dirt that every real machine has a little of, and that has no law to be found)
    family:     parts of one family replace one another when effects are drawn
    drawn:      False for a part that came later: seeds keep the machines that they have always drawn
    """

    name: str
    kind: Kind
    group: Group
    law: str
    meaning: str
    source: str
    parameters: tuple[Parameter, ...]
    family: str = ""
    drawn: bool = True

    def values(self, given: object, where: str) -> dict[str, float]:
        """Every parameter from what a user gave: nothing (defaults), one number (the size), or names and numbers."""
        if given is None or given is True:
            given = {}
        if not isinstance(given, Mapping):
            given = {self.parameters[0].name: given}
        known = {parameter.name: parameter for parameter in self.parameters}
        for name in given:
            if name not in known:
                raise unknown_name(str(name), list(known), f"{where}, part {self.name}")
        return {name: parameter.checked(given.get(name, parameter.default), f"{where}, part {self.name}") for name, parameter in known.items()}
