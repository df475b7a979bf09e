"""The exact sampled linear part of a model, with held input and a delay of any length.

Source: Astrom & Wittenmark, Computer-Controlled Systems, 3rd ed., Prentice Hall 1997, sec. 2.3 (sampling of systems with a time delay).
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import scipy

from xy_sysid.axis.linear_part import lag_of
from xy_sysid.axis.model import AxisModel
from xy_sysid.control_design.closed_loop import Controller
from xy_sysid.control_design.sample_step import plant
from xy_sysid.response.frf import ComplexArray
from xy_sysid.samples.block import FloatArray

EVENLY = 2048  # number of evenly spaced frequencies for a mean
LINES = 600  # number of frequencies of a response, logarithmic
TURNED = np.linspace(-89.0, 89.0, 60)  # phase of a resonance, degrees, at the additional frequencies around it
LinearSystem = tuple[FloatArray, FloatArray, FloatArray, float]  # A, B, C, D of a sampled controller
KEPT = 256  # cached models and responses: a design uses the same ones repeatedly


@dataclass(frozen=True, slots=True, eq=False)
class Sampled:
    """x+ = a x + old u[k - whole - 1] + new u[k - whole], y = x[0], in m.

    whole: samples of delay
    """

    sampling_rate: float
    a: FloatArray
    old: FloatArray
    new: FloatArray
    whole: int

    def response(self, frequency: FloatArray) -> ComplexArray:
        """(n,) position over voltage at frequencies, Hz."""
        z = np.exp(2j * np.pi * frequency / self.sampling_rate)
        n = self.old.size
        left = z[:, None, None] * np.eye(n) - self.a
        right = self.new + self.old / z[:, None]
        solved = np.linalg.solve(left, right[:, :, None])
        return np.asarray(solved[:, 0, 0] * z ** (-self.whole))

    def whole_system(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(A, B, C) with the delay as states."""
        n, d = self.old.size, self.whole + 1
        a, b = np.zeros((n + d, n + d)), np.zeros(n + d)
        a[:n, :n] = self.a
        a[:n, n + d - 1] = self.old  # the oldest voltage is the last
        if d > 1:
            a[:n, n + d - 2] = self.new
            a[n + 1 :, n : n + d - 1] = np.eye(d - 1)
        else:
            b[:n] = self.new
        b[n] = 1.0
        c = np.zeros(n + d)
        c[0] = 1.0
        return a, b, c


@functools.lru_cache(maxsize=KEPT)
def grid(system: Sampled) -> FloatArray:
    """(n,) Hz, frequencies for the loop: logarithmic, and additional ones around each resonance with even steps of its phase.

    The phase of a pole s = w (-damping + j) turns by atan(x) at w (1 + damping x).
    """
    rate = system.sampling_rate
    poles = np.log(np.linalg.eigvals(system.a).astype(np.complex128) + 1e-300) * rate / (2.0 * np.pi)
    own = [pole.imag + abs(pole.real) * np.tan(np.radians(TURNED)) for pole in poles if pole.imag > 0.0]
    every = np.concatenate((np.geomspace(2e-4 * rate, 0.499 * rate, LINES), *own))
    return np.unique(every[(every >= 2e-4 * rate) & (every <= 0.499 * rate)])


@functools.lru_cache(maxsize=KEPT)
def on_grid(system: Sampled) -> ComplexArray:
    """(n,) its response at the frequencies of ``grid``."""
    return system.response(grid(system))


@functools.lru_cache(maxsize=KEPT)
def sampled(model: AxisModel, sampling_rate: float) -> Sampled:
    """Base, resonances, lags and delay of a model; everything else is omitted."""
    ready = plant(model, sampling_rate)
    n = ready.order - 1
    whole = ready.moving.reshape(n + 1, n + 1)
    a, b = whole[:n, :n], whole[:n, n]
    for name, values in model.effects:
        lag = lag_of(model.library[name], values)
        if lag is not None:
            size = a.shape[0]
            a = np.block([[a, b[:, None]], [np.zeros((1, size)), np.array([[-1.0 / lag]])]])
            b = np.concatenate((np.zeros(size), [1.0 / lag]))
    late = model.delay * sampling_rate
    back = int(late)
    part = (late - back) / sampling_rate
    rest = 1.0 / sampling_rate - part
    (first, fed_first), (last, fed_last) = _held(a, b, part), _held(a, b, rest)
    return Sampled(sampling_rate=sampling_rate, a=last @ first, old=last @ fed_first, new=fed_last, whole=back)


def response_of(a: FloatArray, b: FloatArray, c: FloatArray, d: float, frequency: FloatArray, sampling_rate: float) -> ComplexArray:
    """(n,) c (z - a)^-1 b + d at frequencies, Hz."""
    z = np.exp(2j * np.pi * frequency / sampling_rate)
    solved = np.linalg.solve(z[:, None, None] * np.eye(b.size) - a, np.broadcast_to(b[:, None], (z.size, b.size, 1)))
    return np.asarray(solved[:, :, 0] @ c + d, dtype=np.complex128)


def _held(a: FloatArray, b: FloatArray, seconds: float) -> tuple[FloatArray, FloatArray]:
    """Transition matrix over a time, and the response to a held input."""
    n = b.size
    made = scipy.linalg.expm(np.block([[a, b[:, None]], [np.zeros((1, n + 1))]]) * seconds)
    return made[:n, :n], made[:n, n]


def controller_response(controller: Controller, frequency: FloatArray, sampling_rate: float) -> ComplexArray:
    """(n,) voltage over error at frequencies, Hz, of the controller as ``closed_loop`` runs it."""
    z = np.exp(2j * np.pi * frequency / sampling_rate)
    h, keeps = 1.0 / sampling_rate, controller.keeps(sampling_rate)
    found = controller.kp + controller.ki * h / (z - 1.0) + controller.kd * (1.0 - keeps) / h * (1.0 - 1.0 / z) / (1.0 - keeps / z)
    for b0, b1, b2, a1, a2 in controller.sections:
        found = found * (b0 + b1 / z + b2 / z**2) / (1.0 + a1 / z + a2 / z**2)
    return np.asarray(found)


def coefficients(controller: Controller, sampling_rate: float) -> FloatArray:
    """(1 + k, 5) b0, b1, b2, a1, a2 of the PID and of each filter behind it: u[n] = b0 e[n] + b1 e[n-1] + b2 e[n-2] - a1 u[n-1] - a2 u[n-2]."""
    h, keeps = 1.0 / sampling_rate, controller.keeps(sampling_rate)
    bottom = np.polymul([1.0, -1.0], [1.0, -keeps])
    proportional = controller.kp * bottom
    integral = controller.ki * h * np.polymul([0.0, 1.0], [1.0, -keeps])
    derivative = controller.kd * (1.0 - keeps) / h * np.polymul([1.0, -1.0], [1.0, -1.0])
    top = proportional + np.concatenate((np.zeros(3 - integral.size), integral)) + derivative
    return np.vstack((np.concatenate((top, bottom[1:])), controller.sections))


def controller_system(controller: Controller, sampling_rate: float) -> LinearSystem:
    """(A, B, C, D) of the controller from error to voltage."""
    h, keeps = 1.0 / sampling_rate, controller.keeps(sampling_rate)
    a = np.array([[1.0, 0.0, 0.0], [0.0, keeps, -(1.0 - keeps) / h], [0.0, 0.0, 0.0]])
    b = np.array([controller.ki * h, (1.0 - keeps) / h, 1.0])
    c = np.array([1.0, controller.kd * keeps, -controller.kd * (1.0 - keeps) / h])
    d = controller.kp + controller.kd * (1.0 - keeps) / h
    for b0, b1, b2, a1, a2 in controller.sections:  # transposed direct form II, fed by what came before
        own = np.array([[-a1, 1.0], [-a2, 0.0]])
        fed = np.array([b1 - a1 * b0, b2 - a2 * b0])
        a = np.block([[a, np.zeros((a.shape[0], 2))], [fed[:, None] @ c[None, :], own]])
        b = np.concatenate((b, fed * d))
        c = np.concatenate((b0 * c, [1.0, 0.0]))
        d = b0 * d
    return a, b, c, d


def closed_poles(system: Sampled, controller: Controller) -> ComplexArray:
    """Poles of the closed loop in z; it is stable if all are within the unit circle."""
    return looped_poles(system, controller_system(controller, system.sampling_rate))


def looped_poles(system: Sampled, controller: LinearSystem) -> ComplexArray:
    """Closed-loop poles with any linear controller from error to voltage."""
    return np.linalg.eigvals(looped(system, controller)).astype(np.complex128)


def looped(system: Sampled, controller: LinearSystem) -> FloatArray:
    """(n, n) transition of the closed loop: the states of the plant first, then those of the controller."""
    a, b, c = system.whole_system()
    ka, kb, kc, kd = controller
    top = np.hstack((a - kd * np.outer(b, c), np.outer(b, kc)))
    bottom = np.hstack((-np.outer(kb, c), ka))
    return np.vstack((top, bottom))


def noise_to_voltage(system: Sampled, controller: Controller) -> float:
    """V rms per 1 m rms of white encoder noise in the closed loop: rms of the response over all frequencies; infinite if unstable."""
    if np.max(np.abs(closed_poles(system, controller))) >= 1.0:
        return float("inf")
    frequency = (np.arange(EVENLY) + 0.5) / EVENLY * 0.5 * system.sampling_rate
    own = controller_response(controller, frequency, system.sampling_rate)
    return float(np.sqrt(np.mean(np.abs(own / (1.0 + system.response(frequency) * own)) ** 2)))
