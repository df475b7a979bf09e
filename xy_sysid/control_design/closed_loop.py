"""A refined model under a controller: PID on the position's error, filters, state feedback, feedforward, limit, encoder noise and counts."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from xy_sysid.axis.model import AxisModel, Library
from xy_sysid.control_design.path import SampledPath
from xy_sysid.control_design.sample_step import Plant, begin, plant, step_of
from xy_sysid.control_design.step_text import ROOM
from xy_sysid.jit import compiled_text
from xy_sysid.samples.block import FloatArray

NO_LIMIT = 1e12  # V
RESTS = 0.5  # s at rest; the second half shows the motion caused by noise
APART = "apart"  # the state of an effect with a gap: motor minus load, m


@dataclass(frozen=True, slots=True)
class States:
    """z = free z + b e + drive v, v = c z within the limit, which is written one period after the reading; free: (n, n), the others: (n,)."""

    free: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    b: FloatArray = field(default_factory=lambda: np.zeros(0))
    c: FloatArray = field(default_factory=lambda: np.zeros(0))
    drive: FloatArray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, slots=True)
class Controller:
    """u = filters(kp e + ki int e + kd de/dt) + states + feedforward, e = path - encoder, sampled with the path, clipped at ``limit``.

    kp: V/m; ki: V/m/s; kd: V s/m; derivative_time: s, of the first-order low-pass on de/dt (0: none)
    sections: (k, 5) second-order sections b0, b1, b2, a1, a2 that the feedback's voltage passes
    states: a controller with states of its own, whose voltage is added
    limit: V; the integral is held while the voltage is clipped and the error would drive it further (clamping)
    """

    kp: float
    ki: float
    kd: float
    derivative_time: float = 0.0
    sections: FloatArray = field(default_factory=lambda: np.zeros((0, 5)))
    limit: float = NO_LIMIT
    states: States | None = None

    def keeps(self, sampling_rate: float) -> float:
        """Factor by which the filtered derivative decays in a sample."""
        return float(np.exp(-1.0 / (sampling_rate * self.derivative_time))) if self.derivative_time > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class Encoder:
    """noise: rms of white noise, m; count: step, m (0: none)."""

    noise: float = 0.0
    count: float = 0.0

    @property
    def white(self) -> Encoder:
        """White noise with the power of noise and quantisation, averaged over all positions within a count (Widrow 1956)."""
        return Encoder(noise=math.sqrt(self.noise**2 + self.count**2 / 12.0))


@dataclass(frozen=True, slots=True)
class Tracked:
    """The motion of a simulated axis.

    position: (n,) encoder reading without noise and counts, m; shown: (n,) with both; voltage: (n,) V; error: (n,) path - position, m
    carried: (n,) true position of the load, m: without the scale's error, and behind the backlash if there is one
    """

    position: FloatArray
    shown: FloatArray
    voltage: FloatArray
    error: FloatArray
    carried: FloatArray

    @property
    def rms(self) -> float:
        """Tracking error, m rms; infinite if the simulation diverged."""
        return rms(self.error)


def rms(values: FloatArray) -> float:
    """Root of the mean square; infinite if the simulation diverged."""
    value = float(np.sqrt(np.mean(values**2)))
    return value if math.isfinite(value) else math.inf


def loop_text(name: str) -> str:
    """Source of the loop; its arguments are those of ``follow_path`` in numbers."""
    return f"""\
def {name}(path, extra, gains, sections, free, b, c, drive, noise, count, behind, p, on, z, a, still, s, w, position, shown, voltage, carried):
    kp, ki, kd, keeps, limit, h = gains[0], gains[1], gains[2], gains[3], gains[4], gains[5]
    inside = np.zeros((sections.shape[0], 2))
    own, after = np.zeros(c.size), np.zeros(c.size)
    place = s[0]
    total = rate = before = drove = 0.0
    for i in range(path.size):
        position[i] = place
        carried[i] = s[0]
        if behind >= 0:
            carried[i] -= s[behind]
        seen = place + noise[i]
        if count > 0.0:
            seen = math.floor(seen / count + 0.5) * count
        shown[i] = seen
        error = path[i] - seen
        if i == 0:
            before = error
        rate = keeps * rate + (1.0 - keeps) * (error - before) / h
        before = error
        u = kp * error + total + kd * rate
        for j in range(sections.shape[0]):
            out = sections[j, 0] * u + inside[j, 0]
            inside[j, 0] = sections[j, 1] * u - sections[j, 3] * out + inside[j, 1]
            inside[j, 1] = sections[j, 2] * u - sections[j, 4] * out
            u = out
        for j in range(c.size):
            after[j] = b[j] * error + drive[j] * drove
            for k in range(c.size):
                after[j] += free[j, k] * own[k]
        for j in range(c.size):
            own[j] = after[j]
            u += c[j] * own[j]
        u += extra[i]
        held = min(max(u, -limit), limit)
        if held == u or (u - held) * ki * error < 0.0:
            total += ki * error * h
        voltage[i] = held
        drove = held - extra[i]
        place = step(held, p, on, z, a, still, s, w)
"""


@cache
def _loop_of(library: Library) -> Callable[..., None]:
    step = step_of(library)
    return compiled_text(loop_text, {"math": math, "np": np, "step": step}, [inspect.getsource(loop_text), step.__name__])


def follow_path(
    model: AxisModel, path: SampledPath, controller: Controller, extra: FloatArray | None = None, encoder: Encoder | None = None, seed: int = 0
) -> Tracked:
    """Simulate the axis along a path, from its first position and speed; extra: (n,) V of feedforward; seed: of the encoder's noise."""
    ready, encoder = plant(model, path.sampling_rate), encoder or Encoder()
    library = model.library.looped([model.library[name] for name, _ in model.effects])
    count = path.position.size
    state, room = ready.rest(), np.zeros(ROOM * ready.order)
    begin(ready, state, float(path.speed[0]), float(path.position[0]))
    noise = encoder.noise * np.random.default_rng(seed).standard_normal(count)
    h = 1.0 / path.sampling_rate
    gains = np.array([controller.kp, controller.ki, controller.kd, controller.keeps(path.sampling_rate), controller.limit, h])
    position, shown, voltage, carried = (np.empty(count) for _ in range(4))
    given = np.zeros(count) if extra is None else np.ascontiguousarray(extra, dtype=np.float64)
    sections = np.ascontiguousarray(controller.sections, dtype=np.float64)
    numbers = (ready.parameters, ready.flags, ready.numbers, ready.moving, ready.still, state, room)
    own = controller.states or States()
    states = [np.ascontiguousarray(one, dtype=np.float64) for one in (own.free, own.b, own.c, own.drive)]
    asked = (np.ascontiguousarray(path.position), given, gains, sections, *states, noise, encoder.count, _behind(ready))
    _loop_of(library)(*asked, *numbers, position, shown, voltage, carried)
    return Tracked(position=position, shown=shown, voltage=voltage, error=path.position - position, carried=carried)


def shake(model: AxisModel, place: float, sampling_rate: float, controller: Controller, encoder: Encoder) -> float:
    """Mean absolute speed, m/s, that encoder noise causes through the controller while the axis should rest at a position, m.

    Presliding friction (LuGre) relaxes by this motion: with z' = v - |v| z / length, noise of mean 0 leaves z' = -mean(|v|) z / length.
    """
    count = round(RESTS * sampling_rate)
    rest = SampledPath(sampling_rate, np.full(count, place), np.zeros(count), np.zeros(count))
    shown = follow_path(model, rest, controller, None, encoder.white).position[count // 2 :]
    return float(np.mean(np.abs(np.diff(shown)))) * sampling_rate


def _behind(ready: Plant) -> int:
    """Index in the state of the distance across a gap, motor minus load; -1 without one."""
    for name, _ in ready.model.effects:
        effect = ready.model.library[name]
        if APART in effect.states:
            return ready.layout.state(effect, APART)
    return -1
