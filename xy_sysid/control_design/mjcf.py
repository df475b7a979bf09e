"""A refined model as MJCF (MuJoCo 4), effect by effect; effects that MJCF cannot represent are named.

Forces are in the unit of the input: the mass is kA, the damping kV. A resonance becomes a mass on a spring behind the joint. Cogging and bristles are
motors (``dcmotor``) with a negligible constant, whose friction and cogging MuJoCo simulates.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from xy_sysid.axis.linear_part import lag_of
from xy_sysid.axis.model import FINE, AxisModel
from xy_sysid.control_design.laws import ask, asks, friction, largest_voltage, of_category
from xy_sysid.control_design.sample_step import sections
from xy_sysid.effects import Effect
from xy_sysid.samples.block import FloatArray

SHORT = 1e-6  # m: deflection of bristles that approximate friction without presliding that falls with speed
CRITICAL = 0.5  # damping of such bristles over the root of stiffness times mass: a damping ratio of 0.25
TINY = 1e-9  # motor constant of a motor that has only friction or cogging
RUBBING = 64_000.0  # Hz of the steps with dry friction: an error of 0.13 % of the motion
LEAD = {"RK4": 1.0 / 6.0, "implicitfast": 0.5}  # of a step, by which the motion is early: weight of RK4's last stage; Euler moves at the new speed
CLEAR = 0.01  # of a step: so long before or after a step an input changes, so that rounding of the times does not matter
EXACT = 1e-6  # of the largest force: tolerance within which a law counts as a sine or a polynomial


@dataclass(slots=True)
class Said:
    """The MJCF content so far.

    polynomial: (4,) of the position, V, lowest power first; square: drag over the square of speed, V/(m/s)2
    waves: (name, amplitude, wave number, phase); lost: (effect, why)
    """

    polynomial: FloatArray = field(default_factory=lambda: np.zeros(4))
    square: float = 0.0
    waves: list[tuple[str, float, float, float]] = field(default_factory=list)
    lost: list[tuple[str, str]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Mjcf:
    """text: the XML; steps: simulation steps in a sample; lost: (effect, what is lost)."""

    text: str
    steps: int
    lost: tuple[tuple[str, str], ...]


def mjcf(model: AxisModel, sampling_rate: float, angular: bool = False) -> Mjcf:
    """The model for one input ``drive``, held for a sample, and one joint with the axis' position; angular: True for a rotary axis, rad."""
    said = Said()
    _forces(model, said)
    turn = math.copysign(1.0, model.gain)
    dry = _friction(model, said)
    lag = _state(model, said)
    limit = _inputs(model, said)
    for effect, _ in of_category(model, "encoder"):
        said.lost.append((effect.name, "the joint's position is the true one, without the error of the scale"))
    mass, drag, hung = _bodies(model, said)
    kind = 'type="hinge" axis="0 0 1"' if angular else 'type="slide" axis="1 0 0"'
    behind, tendon = _behind(hung, kind)
    integrator = "implicitfast" if dry else "RK4"
    fine = 2.0 * FINE if dry == 0.0 and lag is None else RUBBING
    steps, waits, side = _steps(model.delay * sampling_rate, sampling_rate, fine, LEAD[integrator])
    bend, spring = _spring(said.polynomial, turn)
    curve = f" {_num(said.square)} 0" if said.square else ""
    step = 1.0 / (sampling_rate * steps)
    drive = [f'name="drive" joint="axis" gear="{turn:g}" gainprm="1" biastype="affine" biasprm="{_num(-bend)} 0 0"']
    if model.delay > 0.0:
        drive.append(f'delay="{_num(max(waits + side * CLEAR, 0.0) * step)}" nsample="{waits + 2}" interp="zoh"')
    if lag is not None:
        exact = "" if integrator == "RK4" and lag > step else "exact"  # RK4 integrates the filter as all states; the exact step is for Euler
        drive.append(f'dyntype="filter{exact}" dynprm="{_num(lag)}"')
    if limit < math.inf:
        drive.append(f'ctrllimited="true" ctrlrange="{_num(-limit)} {_num(limit)}"')
    quiet = f'joint="axis" motorconst="{TINY}" resistance="1"'
    others = [f'<dcmotor name="{who}" {quiet} cogging="{_num(-turn * size)} {_num(wave)} {_num(phase)}"/>' for who, size, wave, phase in said.waves]
    held = ""
    if isinstance(dry, tuple):
        others.append(f'<dcmotor name="friction" {quiet} lugre="{" ".join(map(_num, dry))}"/>')
    elif dry > 0.0:
        held = f' frictionloss="{_num(dry)}" solreffriction="{_num(2.0 * step)} 1" solimpfriction="0.9999 0.9999 1e-6"'
    moving = f'<inertial pos="0 0 0" mass="{_num(mass)}" diaginertia="{_num(mass)} {_num(mass)} {_num(mass)}"/>'
    lines = [
        '<mujoco model="axis">',
        f"  <!-- forces are in the unit of the input: the mass is kA, the damping kV; hold each input for {steps} steps, 1/{sampling_rate:g} s -->",
        *(f"  <!-- lost: {effect}: {why} -->" for effect, why in said.lost),
        f'  <option timestep="{step!r}" gravity="0 0 0" integrator="{integrator}"/>',
        "  <worldbody>",
        '    <body name="axis">',
        f'      <joint name="axis" {kind} damping="{_num(drag)}{curve}"{spring}{held}/>',
        f"      {moving}",
        "    </body>",
        *behind,
        "  </worldbody>",
        *tendon,
        "  <actuator>",
        f"    <general {' '.join(drive)}/>",
        *(f"    {line}" for line in others),
        "  </actuator>",
        '  <sensor><jointpos name="position" joint="axis"/><jointvel name="speed" joint="axis"/></sensor>',
        "</mujoco>",
    ]
    return Mjcf("\n".join(lines) + "\n", steps, tuple(said.lost))


def _steps(late: float, sampling_rate: float, fine: float, lead: float) -> tuple[int, int, int]:
    """Steps of a sample, at least ``fine`` per second; steps of the delay; and -1 if an input changes just before a step, 1 if just after it.

    late: the delay in samples; lead: steps by which the motion is early with an input that changes just before a step, and late just after it
    MuJoCo delays by whole steps. The count is up to 1.5 times the least, whichever meets the delay best.
    """
    least = max(math.ceil(fine / sampling_rate), 1)

    def off(of: tuple[int, int]) -> tuple[float, int, int]:
        count, side = of
        wanted = late * count - side * lead
        return round(abs(wanted - round(wanted)) / count, 6), count, side

    count, side = min(((count, side) for count in range(least, least + max(least // 2, 1) + 1) for side in (-1, 1)), key=off)
    return count, max(round(late * count - side * lead), 0), side


def _num(value: float) -> str:
    return f"{value:.9g}"


def _forces(model: AxisModel, said: Said) -> None:
    """Add quadratic drag, and forces by position as waves or cubic polynomials, which include constant forces."""
    for effect, values in of_category(model, "force"):
        words = asks(effect)
        if "u" in words:
            said.lost.append((effect.name, "a motor constant that changes with position"))
        elif "v" in words and not words & {"x", "direction"} and _square(effect, values, model, said):
            continue
        elif "v" in words:
            said.lost.append((effect.name, "drag that depends on direction or position; its mean is kept"))
        elif "t" in words:
            said.lost.append((effect.name, "it changes with time"))
        elif not _wave(effect, values, model, said):
            _power(effect, values, model, said)


def _square(effect: Effect, values: tuple[float, ...], model: AxisModel, said: Said) -> bool:
    """True if a law is quadratic drag; then it is added."""
    fast = abs(model.gain)

    def at(v: float) -> float:
        return ask(effect, values, "force", {"v": v, "x": 0.0, "u": 0.0, "t": 0.0, "gain": model.gain, "pole": model.pole})

    top = at(fast) / fast**2
    if not np.allclose([at(part * fast) for part in (-1.0, -0.4, 0.3, 0.7)], [top * fast**2 * part * abs(part) for part in (-1.0, -0.4, 0.3, 0.7)]):
        return False
    said.square += abs(top)
    return True


def _wave(effect: Effect, values: tuple[float, ...], model: AxisModel, said: Said) -> bool:
    """True if a law is one sine of the position; then it is added as a wave."""
    if not effect.repeats:
        return False
    period = dict(zip(effect.names, values, strict=True)).get("period", 2.0 * math.pi)
    wave = 2.0 * math.pi / period

    def at(part: float) -> float:
        return ask(effect, values, "force", {"x": part * period, "gain": model.gain, "pole": model.pole})

    sine, cosine = at(0.25), at(0.0)
    size = math.hypot(sine, cosine)
    told = [sine * math.sin(2.0 * math.pi * part) + cosine * math.cos(2.0 * math.pi * part) for part in (0.1, 0.37, 0.8)]
    if not np.allclose(told, [at(part) for part in (0.1, 0.37, 0.8)], rtol=0.0, atol=EXACT * size):
        return False
    said.waves.append((effect.name, size, wave, math.atan2(cosine, sine)))
    return True


def _power(effect: Effect, values: tuple[float, ...], model: AxisModel, said: Said) -> None:
    places = np.array([-1.0, -0.6, -0.2, 0.3, 0.7, 1.0])
    forces = np.array([ask(effect, values, "force", {"x": float(x), "gain": model.gain, "pole": model.pole}) for x in places])
    found = np.polynomial.polynomial.polyfit(places, forces, 3)
    if np.max(np.abs(np.polynomial.polynomial.polyval(places, found) - forces)) > EXACT * np.max(np.abs(forces)):
        said.lost.append((effect.name, "its force is neither a sine nor a polynomial of third order"))
    else:
        said.polynomial += found


def _spring(polynomial: FloatArray, turn: float) -> tuple[float, str]:
    """Constant force, V, and the joint's attributes for the rest: MuJoCo's spring is k0 d + k2 d^3 around its reference.

    turn: sign of the gain; the constant goes through the drive, which has that sign, and the spring acts on the joint itself
    """
    p0, p1, p2, p3 = polynomial.tolist()
    where = -p2 / (3.0 * p3) if abs(p3) > EXACT * abs(p2) else 0.0
    constant = float(np.polynomial.polynomial.polyval(where, polynomial))
    linear = p1 + 2.0 * p2 * where + 3.0 * p3 * where * where
    if linear == 0.0 and p3 == 0.0:
        return p0, ""
    return constant, f' springref="{_num(where)}" stiffness="{_num(turn * linear)} 0 {_num(turn * p3)}"'


def _friction(model: AxisModel, said: Said) -> float | tuple[float, ...]:
    """One level, V (0 without any); or the LuGre model: stiffness, damping, level at speed, level at rest, speed at which it falls."""
    bristles, plain = list(of_category(model, "bristle")), [item for item in of_category(model, "friction") if item[0].is_dry]
    said.lost += [(effect.name, "friction that grows with the input") for effect, _ in of_category(model, "friction") if effect.is_of_the_input]
    if not bristles and not plain:
        return 0.0
    fast = 1e3 * abs(model.gain)
    forth, back = friction(model, fast, 1.0), friction(model, -fast, -1.0)
    turn = math.copysign(1.0, model.gain)
    said.polynomial[0] += turn * 0.5 * (forth - back)  # with one level each way friction is the mean level and a load
    level, rest = 0.5 * (forth + back), 0.5 * (friction(model, 0.0, 1.0) + friction(model, 0.0, -1.0))
    falls = rest - level > EXACT * level
    if not bristles and not falls:
        return level
    speed = _falls(lambda v: friction(model, v, 1.0), forth, fast) if falls else fast
    if bristles:
        effect, values = bristles[0]
        own = {effect.states[0]: 1.0, "v": 0.0, "level": 0.0}
        stiffness = ask(effect, values, "force", own)
        damping = ask(effect, values, "force", {**own, effect.states[0]: 0.0, "v": 1.0})
        return stiffness, damping, level, rest, speed
    said.lost += [(effect.name, "its breakaway before sliding: bristles of 1 um approximate it") for effect, _ in plain]
    stiffness = level / SHORT
    return stiffness, CRITICAL * math.sqrt(stiffness / (abs(model.gain) * model.pole)), level, rest, speed


def _falls(level: Callable[[float], float], end: float, fast: float) -> float:
    """The speed, m/s, at which the excess of friction over its level at high speed has fallen to 1 / e."""
    top = level(0.0) - end
    if top <= EXACT * end:
        return fast
    low, high = 0.0, fast
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if level(middle) - end > top / math.e else (low, middle)
    return high


def _state(model: AxisModel, said: Said) -> float | None:
    lag = None
    for effect, values in of_category(model, "state"):
        found = lag_of(effect, values)
        if found is None or lag is not None:
            said.lost.append((effect.name, "a state between input and force that is not a first-order lag"))
        else:
            lag = found
    return lag


def _inputs(model: AxisModel, said: Said) -> float:
    limit = largest_voltage(model)
    for effect, values in of_category(model, "input"):
        small = 1e-3 * min(limit, 1.0)
        if "t" in asks(effect) or not math.isclose(ask(effect, values, "output", {"u": small, "x": 0.0}), small, rel_tol=1e-9):
            said.lost.append((effect.name, "the response of the amplifier to small inputs, or its change over time"))
    return limit


@dataclass(frozen=True, slots=True)
class Hung:
    """Two masses (V s2/m) with drag (V s/m), and the spring (V/m) and damper (V s/m) between them; the first carries the encoder."""

    masses: tuple[float, float]
    drags: tuple[float, float]
    stiffness: float
    damping: float


def _bodies(model: AxisModel, said: Said) -> tuple[float, float, Hung | None]:
    """Mass and drag at the joint, and the mass attached to it.

    A base resonance is one pole-zero pair, as that of two masses on a spring. With P, Z = 1 at 0 Hz, (m s + c) P has to be
    (J s + c1) Z + (M s + c2) (1 + (d / k) s) with Z = 1 + ((d + c2) / k) s + (M / k) s2: six equations for J, M, c1, c2, d and k.
    """
    whole, drag = 1.0 / (abs(model.gain) * model.pole), 1.0 / abs(model.gain)
    names = [effect.name for effect, _ in of_category(model, "motion")]
    if not names:
        return whole, drag, None
    if len(names) > 1:
        said.lost += [(name, "a second resonance") for name in names[1:]]
        model = replace(model, effects=tuple(item for item in model.effects if item[0] == names[0]))
    (_, z1, z2), (_, p1, p2) = ((part / part[0]).tolist() for part in sections(model, 1.0))
    own = whole * p2 / z2
    a = whole * p1 + drag * p2 - own * z1 - drag * z2
    b = whole + drag * p1 - own - drag * z1
    roots = np.roots([z2 - 0.25 * z1 * z1, 0.5 * a * z1 / z2 - b, -0.25 * (a / z2) ** 2])
    stiffness = max((float(root.real) for root in roots if abs(root.imag) < 1e-9 * abs(root)), default=0.0)
    shared = 0.5 * (stiffness * z1 - a / z2)
    if not (own > 0.0 and stiffness > 0.0):
        said.lost.append((names[0], "a pair of poles and zeros that no mass on a spring has"))
        return whole, drag, None
    return own, drag - shared, Hung((own, stiffness * z2), (drag - shared, shared), stiffness, stiffness * z1 - shared)


def _behind(hung: Hung | None, kind: str) -> tuple[list[str], list[str]]:
    """Lines of the second body, and of the spring between the two."""
    if hung is None:
        return [], []
    mass = _num(hung.masses[1])
    body = [
        '    <body name="behind">',
        f'      <joint name="behind" {kind} damping="{_num(hung.drags[1])}"/>',
        f'      <inertial pos="0 0 0" mass="{mass}" diaginertia="{mass} {mass} {mass}"/>',
        "    </body>",
    ]
    spring = [
        "  <tendon>",
        f'    <fixed name="spring" stiffness="{_num(hung.stiffness)}" damping="{_num(hung.damping)}" springlength="0 0">',
        '      <joint joint="axis" coef="1"/><joint joint="behind" coef="-1"/>',
        "    </fixed>",
        "  </tendon>",
    ]
    return body, spring
