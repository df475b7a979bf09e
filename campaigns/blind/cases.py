"""Cases: one axis each, with a truth that is hidden from the diagnosis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from campaigns.blind.dirt import Dirt, mixture
from xy_sim.drawing import sizes
from xy_sim.drive import Drive
from xy_sim.machine import Machine
from xy_sim.machine_file import Axis, Spec, read
from xy_sim.parts import PARTS
from xy_sysid.excitation.lockstep import drive
from xy_sysid.samples.recording import Recording
from xy_sysid.settings import AxisExcitation, ExcitationSettings, build

EFFECTS = (
    "coulomb_friction",
    "stribeck_friction",
    "presliding_hysteresis",
    "asymmetric_friction",
    "constant_load",
    "dead_zone",
    "saturation",
    "amplifier_lag",
    "backlash",
    "cogging",
    "lead_error",
    "screw_compliance",
    "base_resonance",
    "hardening_stiffness",
    "gain_drift",
)
FURTHER = (  # laws that came later; gravity is drawn on the axes and joints of MuJoCo
    "asymmetric_viscous_friction",
    "load_dependent_friction",
    "load_side_resonance",
    "position_dependent_drag",
    "position_dependent_gain",
    "quadratic_drag",
    "return_spring",
)
BEHIND = {"load_side_resonance": "screw_compliance"}  # law -> part of the machine that appears as this law at the table's encoder
OUTSIDE = ("loose_mode", "thermal_viscosity")
AMOUNTS = (0.002, 0.01, 0.03)  # of dirt
SMOOTH = 5.0  # sufficient inner steps per sample for an axis without effects
FRICTION = ("coulomb_friction", "stribeck_friction", "presliding_hysteresis", "asymmetric_friction")

Draws = Literal["development", "reporting"]
STREAMS = {"development": 11, "reporting": 1_000_003}


@dataclass(frozen=True, slots=True)
class Case:
    """One axis.

    group: set of the campaign; truth: effects to be named; number: of the draw; draws: name of the random stream
    seconds, rate (Hz), strength: of the excitation; count: encoder count, m, or 0 for the machine's; size: of the effects
    kind: of the excitation; nuisance: with mild friction, a 1 um encoder and a tenth of another effect
    dirt: fraction of the motion (of the axis without the truth) that a mixture of dirt changes; coarse: simulated in first-order steps
    """

    group: str
    truth: tuple[str, ...]
    number: int
    draws: Draws
    seconds: float = 60.0
    rate: float = 2000.0
    strength: float = 1.0
    count: float = 0.0
    size: float = 1.0
    kind: str = "noise"
    nuisance: bool = False
    dirt: float = 0.0
    coarse: bool = False

    @property
    def known(self) -> bool:
        """False if the truth contains a part that no hypothesis describes."""
        return not set(self.truth) & set(OUTSIDE)

    @property
    def name(self) -> str:
        """Name for people."""
        return f"{self.group}/{'+'.join(self.truth) or 'none'}/{self.number}"

    @property
    def parts(self) -> tuple[str, ...]:
        """The part of the machine for each name of the truth."""
        return tuple(BEHIND.get(name, name) for name in self.truth)

    def random(self) -> np.random.Generator:
        """Random numbers of this case alone."""
        words = [int.from_bytes(text.encode(), "big") for text in (self.group, *self.truth)]
        return np.random.default_rng([STREAMS[self.draws], self.number, *words])

    def exact(self) -> Machine:
        """The axis at rest, without its dirt."""
        random = self.random()
        spec = read("rigid.yaml")
        values: dict[str, Any] = {
            "velocity_gain": 0.097 * float(np.exp(random.uniform(-0.4, 0.4))),
            "pole": 246.0 * float(np.exp(random.uniform(-0.5, 0.5))),
            "table_mass": float(random.uniform(12.0, 24.0)),
            "encoder_noise": 0.1e-6,
        }
        count = self.count or (1e-6 if self.nuisance else 0.5e-6)
        values["counts_per_revolution"] = 0.005 / count
        parts: dict[str, dict[str, float]] = {"time_delay": {"delay": float(random.uniform(0.8e-3, 1.8e-3))}}
        if set(self.truth) & set(BEHIND):
            values["encoder_on"] = "table"
        for name in self.parts:
            parts[name] = sizes(PARTS[name], random, self.size)
        if self.nuisance:
            parts |= self._nuisance(random)
        if self.coarse:
            parts["first_order_steps"] = sizes(PARTS["first_order_steps"], random)
        axis = Axis("x", build(Drive, values), parts)
        whole = Spec((axis,), rate=self.rate, inner_rate=max(spec.inner_rate, 20.0 * self.rate), seed=int(random.integers(2**31)))
        return Machine(whole)

    def _nuisance(self, random: np.random.Generator) -> dict[str, dict[str, float]]:
        """Mild friction (if there is none yet) and a tenth of another effect."""
        parts: dict[str, dict[str, float]] = {}
        families = {PARTS[name].family for name in self.truth if PARTS[name].family}
        if "dry_friction" not in families:
            parts["coulomb_friction"] = {"coulomb": float(random.uniform(0.01, 0.03))}
        others = [name for name in EFFECTS if name not in (*self.truth, *FRICTION) and PARTS[name].family not in families]
        if "backlash" in self.truth or "screw_compliance" in self.truth:
            others = [name for name in others if name not in ("backlash", "screw_compliance")]
        other = str(random.choice(others))
        parts[other] = sizes(PARTS[other], random, 0.1)
        return parts

    def machine(self) -> Machine:
        """The axis at rest."""
        return self.exact().with_parts(_dirt(self).parts) if self.dirt else self.exact()

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of its dirt."""
        return tuple(_dirt(self).parts) if self.dirt else ()

    @property
    def dirt_reached(self) -> float:
        """Fraction of the motion that the dirt actually changes."""
        return _dirt(self).reached if self.dirt else 0.0

    def record(self) -> tuple[Machine, Recording]:
        """The machine, and its recording."""
        machine = self.machine()
        return machine, self._driven(machine)

    def _driven(self, machine: Machine) -> Recording:
        seed = int(self.random().integers(2**20)) + 1
        own = build(AxisExcitation, {"seed": seed, "kind": self.kind, "rms": AxisExcitation().rms * self.strength})
        settings = build(ExcitationSettings, {"rate": self.rate, "lockstep": True, "speed": 0.0, "axes": {"x": own}})
        return drive(machine, settings, self.seconds, lambda _: None)


@lru_cache(maxsize=64)
def _dirt(case: Case) -> Dirt:
    """The dirt. Its size is set on the axis without the effects to be found, as backlash would let the smallest change grow."""
    spec = case.exact().with_parts(dict.fromkeys(case.parts, False)).spec
    machine = Machine(replace(spec, inner_rate=SMOOTH * case.rate))
    words = [int.from_bytes(text.encode(), "big") for text in (case.group, *case.truth)]
    random = np.random.default_rng([STREAMS[case.draws], 7, case.number, *words])
    return mixture(machine, case._driven(machine).voltage[:, 0], case.dirt, random)


def standard(draws: Draws, each: int = 10, plain: int = 20) -> Iterator[Case]:
    """Every effect, no effect, and parts outside the library."""
    for name in EFFECTS:
        yield from (Case("standard", (name,), k, draws) for k in range(each))
    yield from (Case("standard", (), k, draws) for k in range(plain))
    yield from (Case("standard", (OUTSIDE[k % len(OUTSIDE)],), k, draws) for k in range(plain))


def varied(draws: Draws, group: str, each: int, **changes: Any) -> Iterator[Case]:
    """Every effect with changed fields of ``Case``."""
    for name in EFFECTS:
        yield from (replace(Case(group, (name,), k, draws), **changes) for k in range(each))


def further(draws: Draws, each: int = 6) -> Iterator[Case]:
    """Laws that the other sets do not draw."""
    return (Case("further laws", (name,), k, draws) for name in FURTHER for k in range(each))


def several(draws: Draws, count: int, cases: int, group: str = "", **changes: Any) -> Iterator[Case]:
    """``count`` effects at once, never two of one family."""
    for k in range(cases):
        random = np.random.default_rng([STREAMS[draws], 5, count, k, *group.encode()])
        chosen: list[str] = []
        for name in random.permutation(EFFECTS):
            families = {PARTS[item].family for item in chosen if PARTS[item].family}
            if len(chosen) < count and PARTS[str(name)].family not in families:
                chosen.append(str(name))
        yield replace(Case(group or f"{count} effects", tuple(chosen), k, draws), **changes)


def clean_dirt(draws: Draws, cases: int = 30) -> Iterator[Case]:
    """Axes without an effect, with dirt, in blocks of equal amount."""
    yield from (Case("clean dirt", (), k, draws, dirt=AMOUNTS[k * len(AMOUNTS) // cases]) for k in range(cases))


def outside(draws: Draws, cases: int = 30) -> Iterator[Case]:
    """Axes with parts outside the library, some of them without dirt."""
    amounts = (0.0, *AMOUNTS)
    each = cases // len(OUTSIDE)
    for k in range(each * len(OUTSIDE)):
        yield Case("outside", (OUTSIDE[k // each],), k, draws, dirt=amounts[k % each * len(amounts) // each])


def sets(draws: Draws) -> dict[str, list[Case]]:
    """The full campaign, by set."""
    no_gap = [name for name in EFFECTS if name != "backlash"]
    return {
        "exact": list(standard(draws)),
        **{name: list(varied(draws, name, 10, dirt=amount)) for amount in AMOUNTS for name in [f"imperfect {100 * amount:.2g} %"]},
        "clean dirt": list(clean_dirt(draws)),
        "outside": list(outside(draws)),
        "further laws": list(further(draws)),
        "hard": list(varied(draws, "hard", 6, nuisance=True)),
        "two effects": list(several(draws, 2, 40)),
        "three effects": list(several(draws, 3, 40)),
        "first order": list(varied(draws, "first order", 6, coarse=True)),
        "1 % two effects": list(several(draws, 2, 40, "1 % two effects", dirt=0.01)),
        "10 s": list(varied(draws, "10 s", 6, seconds=10.0)),
        "half": list(varied(draws, "half", 6, strength=0.5)),
        "5 um": [case for case in varied(draws, "5 um", 6, count=5e-6) if case.truth[0] in no_gap],
        "quarter": list(varied(draws, "quarter", 3, strength=0.25)),
        "tenth": list(varied(draws, "tenth", 3, size=0.1)),
        "5 s": list(varied(draws, "5 s", 3, seconds=5.0)),
        "multisine": list(varied(draws, "multisine", 2, kind="multisine")),
        "sweep": list(varied(draws, "sweep", 2, kind="sweep")),
        "prbs": list(varied(draws, "prbs", 2, kind="prbs")),
        "1 kHz": list(varied(draws, "1 kHz", 2, rate=1000.0)),
        "5 kHz": list(varied(draws, "5 kHz", 2, rate=5000.0)),
    }
