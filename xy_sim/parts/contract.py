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
    """One number of a part: drawn from ``low..high``, allowed in ``minimum..maximum``.

    signed: drawn with either sign; whole: drawn as a whole number
    power:  exponent by which it scales with the size of the effect, by default 1 for the first parameter of a part and 0 for
            the others; negative if a larger number is a smaller effect
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
        """The value as a number; raises BadInput for text or a value outside the allowed range."""
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
    meaning:    its cause on a real table
    source:     literature of the law
    parameters: the first one is its size, the number of ``--effect NAME=SIZE``
    kind:       where it acts
    group:      "effect": can be drawn; "outside": can be drawn, but no hypothesis describes it; "base", "added": not drawn;
                "event": a change during the run; "imperfection": small irregularities of every real machine, without a law to identify
    family:     at most one part of a family is drawn
    drawn:      False keeps a newer part out of the draw, so that each seed still gives the same machine
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
        """Every parameter, from nothing (defaults), one number (the size), or names and numbers; raises BadInput for wrong ones."""
        if given is None or given is True:
            given = {}
        if not isinstance(given, Mapping):
            given = {self.parameters[0].name: given}
        known = {parameter.name: parameter for parameter in self.parameters}
        for name in given:
            if name not in known:
                raise unknown_name(str(name), list(known), f"{where}, part {self.name}")
        return {name: parameter.checked(given.get(name, parameter.default), f"{where}, part {self.name}") for name, parameter in known.items()}
