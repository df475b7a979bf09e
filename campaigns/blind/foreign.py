"""Axes and robot joints of MuJoCo, with hidden effects: other equations, friction, contact and integrators than ``xy_sim``.

Extra ``mujoco`` (pip install '.[mujoco]'). An axis is a DC motor, V to rad, driven with noise in open loop, or following a random path in closed
loop. A joint is driven by a current under a position controller, A to rad, along a slow path; its samples are unevenly spaced.
"""

from __future__ import annotations

import importlib
import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import scipy

from campaigns.blind import judge
from campaigns.blind.cases import STREAMS, Case, Draws
from campaigns.blind.judge import Judged
from xy_sysid.axis.model import STANDARD
from xy_sysid.diagnosis.diagnose import diagnose_prepared, not_enough
from xy_sysid.diagnosis.equal_laws import equals
from xy_sysid.hypotheses.enough_data import prepared
from xy_sysid.samples.block import FloatArray
from xy_sysid.units import Units

Loop = Literal["open", "closed", "joint"]
GROUPS: dict[Loop, str] = {"open": "foreign axes", "closed": "foreign axes, closed loop", "joint": "foreign joints"}
ALSO = {  # bristles are dry friction, too; friction with a load is asymmetric friction
    "presliding_hysteresis": ("coulomb_friction",),
    "stribeck_friction": ("coulomb_friction", "presliding_hysteresis"),
    "constant_load": ("asymmetric_friction",),
}
SECONDS = 30.0  # of an axis
SLOW = 60.0  # s of a joint
STEP = 5e-5  # s, longest step of MuJoCo
LARGEST = 12.0  # V
MASS, ARM = 1e-6, 0.05  # kg and m of a pendulum: its inertia is negligible compared with the motor's
XML = """
<mujoco>
  <option timestep="{step}" integrator="{integrator}" gravity="{gravity} 0 0" iterations="200" tolerance="1e-14"/>
  <worldbody>
    <body>
      <joint name="x" type="hinge" axis="0 0 1" damping="{damping} {square} 0" stiffness="{stiffness} 0 {cubic}" frictionloss="{friction}"
             solreffriction="{soft} 1" solimpfriction="0.9999 0.9999 1e-6"/>
      <inertial pos="{arm} 0 0" mass="{mass}" diaginertia="{inertia} {inertia} {inertia}"/>
      {behind}
    </body>
  </worldbody>
  <actuator>
    <motor name="torque" joint="x"/>
    {motor}
  </actuator>
</mujoco>
"""
LOAD = """
      <body>
        <joint name="behind" type="hinge" axis="0 0 1" {joint}/>
        <inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/>
      </body>
"""
AXES: dict[str, tuple[str, ...]] = {
    "none": (),
    "coulomb": ("coulomb_friction",),
    "lugre": ("presliding_hysteresis",),
    "lugre_stribeck": ("stribeck_friction",),
    "inductance": ("amplifier_lag",),
    "cogging": ("cogging",),
    "pendulum": ("gravity",),
    "spring": ("return_spring",),
    "cubic_spring": ("hardening_stiffness",),
    "limit": ("saturation",),
    "two_masses": ("screw_compliance",),
    "gap": ("backlash",),
    "load": ("constant_load",),
    "square_drag": ("quadratic_drag",),
}
JOINTS: dict[str, tuple[str, ...]] = {
    "none": (),
    "coulomb": ("coulomb_friction",),
    "pendulum": ("gravity",),
    "spring": ("return_spring",),
    "coulomb_pendulum": ("coulomb_friction", "gravity"),
    "coulomb_spring": ("coulomb_friction", "return_spring"),
    "coulomb_load": ("coulomb_friction", "constant_load"),
    "lugre_pendulum": ("presliding_hysteresis", "gravity"),
}


@dataclass(frozen=True, slots=True)
class Foreign:
    """One axis or joint. kind: of AXES or JOINTS; number: of the draw; draws: name of the random stream."""

    kind: str
    loop: Loop
    number: int
    draws: Draws

    @property
    def truth(self) -> tuple[str, ...]:
        """Effects to be named."""
        return (JOINTS if self.loop == "joint" else AXES)[self.kind]

    @property
    def group(self) -> str:
        """The set of the campaign."""
        return GROUPS[self.loop]

    known, nuisance, dirt = True, False, 0.0  # as of ``cases.Case``

    @property
    def there(self) -> set[str]:
        """Names that are not phantoms: the truth, laws with the same equations, and laws that contain a part of it."""
        own = {other.name for name in self.truth for other in (STANDARD[name], *equals(STANDARD, name))}
        return own | {name for part in self.truth for name in ALSO.get(part, ())}

    @property
    def name(self) -> str:
        """Name for people."""
        return f"{self.group}/{self.kind}/{self.number}"

    def random(self) -> np.random.Generator:
        """Random numbers of this case alone."""
        return np.random.default_rng([STREAMS[self.draws], self.number, *f"{self.loop} {self.kind}".encode()])

    def record(self) -> tuple[float, FloatArray, FloatArray, Units]:
        """Sampling rate (Hz), input (n,), position (n,), rad, and their units."""
        return _joint(self) if self.loop == "joint" else _axis(self)


@dataclass(slots=True)
class _Engine:
    """One MuJoCo model with one torque at joint ``x``, N m."""

    model: Any
    data: Any
    module: Any
    steps: int

    @staticmethod
    def of(rate: float, **words: Any) -> _Engine:
        """words: numbers and texts of the XML; missing ones are 0 or empty."""
        module = importlib.import_module("mujoco")
        steps = math.ceil(1.0 / (rate * STEP))
        step = 1.0 / (rate * steps)
        plain: dict[str, Any] = dict.fromkeys(("gravity", "square", "stiffness", "cubic", "friction", "arm", "mass"), 0.0)
        plain |= {"mass": 1e-6, "behind": "", "motor": "", "soft": 2.0 * step, "step": repr(step), "integrator": "implicitfast"}
        model = module.MjModel.from_xml_string(XML.format(**plain | words))
        return _Engine(model, module.MjData(model), module, steps)

    def advance(self, *controls: float) -> None:
        """Simulate one sample. controls: torque at the joint, N m, and other actuators."""
        self.data.ctrl[: len(controls)] = controls
        self.module.mj_step(self.model, self.data, self.steps)

    @property
    def angle(self) -> float:
        """Angle of the joint, rad."""
        return float(self.data.qpos[0])


def _axis(case: Foreign) -> tuple[float, FloatArray, FloatArray, Units]:
    """A DC motor. Effects are sized as fractions of the torque of the rms voltage at standstill."""
    random = case.random()
    rate = 2000.0 if case.kind == "gap" else float(random.choice([500.0, 1000.0, 2000.0]))
    count = 2.0 * math.pi / float(random.choice([4096, 16384, 65536]))
    constant, late = float(random.uniform(0.02, 0.08)), int(random.integers(0, 4))
    rms = float(random.uniform(1.5, 3.0))
    torque = constant * rms  # resistance 1 ohm
    pole = float(np.exp(random.uniform(math.log(8.0), math.log(60.0))))
    damping = float(random.uniform(0.1, 0.5)) * constant**2
    inertia = (constant**2 + damping) / pole
    speed = torque / (constant**2 + damping)  # at a constant voltage
    part = float(random.uniform(0.08, 0.3))
    words: dict[str, Any] = {"damping": damping, "inertia": inertia}
    limit, motor, steady = LARGEST, {"motorconst": f"{constant}", "resistance": "1"}, 0.0
    if case.kind == "coulomb":
        words["friction"] = part * torque
    elif case.kind in ("lugre", "lugre_stribeck"):
        level = part * torque
        rest = level * (float(random.uniform(1.4, 2.0)) if case.kind == "lugre_stribeck" else 1.0)
        bend = count * float(random.uniform(4.0, 20.0))
        stiffness = rest / bend
        motor["lugre"] = f"{stiffness} {math.sqrt(stiffness * inertia)} {level} {rest} {0.05 * speed}"
    elif case.kind == "inductance":
        motor["inductance"] = f"{float(random.uniform(1.5e-3, 6e-3))}"
    elif case.kind == "cogging":
        motor["cogging"] = f"{part * torque} {int(random.integers(8, 40))} {float(random.uniform(0.0, 6.0))}"
    elif case.kind == "pendulum":
        words |= {"mass": MASS, "arm": ARM, "gravity": 3.0 * part * torque / (MASS * ARM), "inertia": inertia - MASS * ARM**2}
    elif case.kind in ("spring", "cubic_spring"):
        words["stiffness" if case.kind == "spring" else "cubic"] = 3.0 * part * torque  # at 1 rad, about the largest position
    elif case.kind == "limit":
        limit = rms * float(random.uniform(0.7, 1.4))
    elif case.kind in ("two_masses", "gap"):
        ratio = float(random.uniform(0.35, 0.75))  # the motor's part
        words["inertia"] = ratio * inertia
        far = (1.0 - ratio) * inertia
        if case.kind == "two_masses":
            omega = 2.0 * math.pi * float(np.exp(random.uniform(math.log(8.0), math.log(60.0))))
            joint = f'stiffness="{far * omega**2}" damping="{2.0 * float(random.uniform(0.01, 0.05)) * far * omega}"'
        else:
            gap = max(8.0 * count, float(random.uniform(3.0, 12.0)) * 0.25 * speed / rate)  # wider than the typical motion in a sample
            omega = 2.0 * math.pi * float(np.exp(random.uniform(math.log(300.0), math.log(900.0))))
            half = math.degrees(0.5 * gap)  # the unit of a range, unlike that of an angle
            joint = f'limited="true" range="{-half} {half}" solreflimit="{-(omega**2)} {-2.0 * float(random.uniform(0.05, 0.4)) * omega}"'
            joint += ' solimplimit="0.95 0.95 1e-9"'
        words["behind"] = LOAD.format(joint=joint, inertia=far)
    elif case.kind == "load":
        steady = part * torque
    elif case.kind == "square_drag":
        words["square"] = 3.0 * part * torque / speed**2
    words["motor"] = "<dcmotor joint='x' " + " ".join(f"{name}='{value}'" for name, value in motor.items()) + "/>"
    engine = _Engine.of(rate, **words)
    samples = int(SECONDS * rate)
    noise = _band(random, rate, samples, 0.1, min(200.0, 0.3 * rate)) * rms
    asked = _band(random, rate, samples, 0.1, 8.0)
    asked *= 0.6 * speed / max(float(np.std(np.diff(asked))) * rate, 1e-9)
    stiff = 0.5 * rms / max(float(np.std(asked)), 1e-9) + 4.0 * inertia * pole**2 / constant / 4.0
    voltage, seen, past = np.zeros(samples), np.zeros(samples), [0.0] * late
    fuzz = count * random.standard_normal(samples) * 0.3
    for k in range(samples):
        seen[k] = count * round((engine.angle + fuzz[k]) / count)
        rate_of = (seen[k] - seen[k - 1]) * rate if k else 0.0
        wanted = noise[k] if case.loop == "open" else stiff * (asked[k] - seen[k]) - 0.02 * stiff * rate_of + 0.3 * noise[k]
        voltage[k] = min(max(wanted, -LARGEST), LARGEST)
        past.append(voltage[k])
        u = min(max(past.pop(0), -limit), limit)
        engine.advance(-steady, u)
    return rate, voltage, seen, Units("V", "rad")


def _band(random: np.random.Generator, rate: float, samples: int, low: float, high: float) -> FloatArray:
    """(samples,) noise of rms 1 within a band, Hz."""
    sections = scipy.signal.butter(2, [low, high], btype="bandpass", fs=rate, output="sos")
    found = scipy.signal.sosfilt(sections, random.standard_normal(samples + int(2.0 * rate)))[int(2.0 * rate) :]
    return np.asarray(found / np.std(found))


def _joint(case: Foreign) -> tuple[float, FloatArray, FloatArray, Units]:
    """A geared joint under a PD controller with the current as its input."""
    random = case.random()
    rate = float(random.choice([100.0, 125.0, 200.0, 250.0]))
    count = 2.0 * math.pi / float(random.choice([65536, 262144]))
    torque_constant = float(random.uniform(5.0, 15.0))  # N m/A at the joint
    inertia = float(random.uniform(0.5, 3.0))
    viscous = inertia * float(random.uniform(2.0, 8.0))
    level = viscous * float(random.uniform(0.3, 1.0))
    words: dict[str, Any] = {"damping": viscous, "inertia": inertia}
    steady = 0.0
    if "coulomb" in case.kind:
        words["friction"] = level
    if "lugre" in case.kind:
        stiffness = level / float(random.uniform(2e-4, 1e-3))
        words["motor"] = f"<dcmotor joint='x' motorconst='1e-9' resistance='1' lugre='{stiffness} {math.sqrt(stiffness)} {level} {level} 1'/>"
    if "pendulum" in case.kind:
        words |= {"mass": 1.0, "arm": 0.1, "gravity": level * float(random.uniform(1.0, 4.0)) / 0.1}
        words["inertia"] = inertia - 0.01
    if "spring" in case.kind:
        words["stiffness"] = level * float(random.uniform(1.0, 3.0))
    if "load" in case.kind:
        steady = level * float(random.uniform(0.4, 1.0))
    engine = _Engine.of(rate, **words)
    samples = int(SLOW * rate)
    path = _fourier(random, rate, samples) if case.number % 2 else _moves(random, rate, samples)
    stiff, damped = inertia * 20.0**2, 2.0 * 0.7 * inertia * 20.0
    fuzz = float(random.uniform(0.005, 0.02)) * level / torque_constant * 4.0
    current, seen, times, now = np.zeros(samples), np.zeros(samples), np.zeros(samples), 0.0
    for k in range(samples):
        jitter = 1.0 + 0.1 * float(random.uniform(-1.0, 1.0))
        times[k] = now
        seen[k] = count * round(engine.angle / count)
        speed = (seen[k] - seen[k - 1]) * rate if k else 0.0
        current[k] = (stiff * (path[k] - seen[k]) - damped * speed) / torque_constant
        engine.advance(current[k] * torque_constant - steady)
        now += jitter / rate
    measured = current + fuzz * random.standard_normal(samples)
    return rate, measured, seen, Units("A", "rad")


def _fourier(random: np.random.Generator, rate: float, samples: int) -> FloatArray:
    """(samples,) five harmonics of 0.1 Hz, up to about 1 rad, from rest."""
    t = np.arange(samples) / rate
    found = sum(float(random.normal()) / k * np.sin(2.0 * math.pi * 0.1 * k * t + float(random.uniform(0.0, 6.0))) for k in range(1, 6))
    start = float(np.asarray(found)[0])
    return np.asarray((found - start) * 0.5 * np.clip(t, 0.0, 1.0))


def _moves(random: np.random.Generator, rate: float, samples: int) -> FloatArray:
    """(samples,) moves between random positions with trapezoidal speed, and short rests."""
    places: list[float] = [0.0]
    fast, harder = float(random.uniform(0.5, 1.5)), float(random.uniform(2.0, 5.0))
    while len(places) < samples:
        at, goal = places[-1], float(random.uniform(-1.2, 1.2))
        way = abs(goal - at)
        ramp = min(fast / harder, math.sqrt(way / harder))
        top = harder * ramp
        cruise = max(way / max(top, 1e-9) - ramp, 0.0)
        t = np.arange(0.0, 2.0 * ramp + cruise, 1.0 / rate)
        rise = 0.5 * harder * np.minimum(t, ramp) ** 2
        rise += top * np.clip(t - ramp, 0.0, cruise)
        last = np.clip(t - ramp - cruise, 0.0, ramp)
        rise += top * last - 0.5 * harder * last**2
        places += (at + math.copysign(1.0, goal - at) * rise).tolist() + [goal] * int(0.3 * rate)
    return np.asarray(places[:samples])


def run(case: Foreign) -> Judged:
    """Drive, diagnose and judge; with several effects, all must be named, one of them first."""
    rate, voltage, position, units = case.record()
    begun = time.process_time()
    ready = prepared(rate, [(voltage, position)], units=units)
    found = not_enough(ready, units) if isinstance(ready, str) else diagnose_prepared(ready)
    seconds = time.process_time() - begun
    named = judge.names(found)
    first = bool(named) and named[0] in case.there
    every = all({name, *ALSO.get(name, ())} & {*named, *judge.laws(named)} for name in case.truth)
    right = (first and every) if case.truth else found.verdict == "nothing_missing"
    phantoms = tuple(name for name in named if name not in case.there)
    return judge.outcome(case, found, seconds, right=right, first=first, stray=bool(named) and not first, phantoms=phantoms)


def judged(case: Case | Foreign, folder: Path | None = None) -> Judged:
    """The result of any case. folder: for recordings of machines of ``xy_sim``, which are kept."""
    return run(case) if isinstance(case, Foreign) else judge.run(case, folder)


def foreign(draws: Draws, each: int = 4) -> dict[str, list[Foreign]]:
    """The sets by name, with ``each`` cases of each kind."""
    return {
        group: [Foreign(kind, loop, k, draws) for kind in (JOINTS if loop == "joint" else AXES) for k in range(each)]
        for loop, group in GROUPS.items()
    }
