"""One axis along a path with three kinds of feedforward in turn: voltages out, encoder readings in. A plan and its execution.

The feedback is calculated once for a block of samples, from the newest reading; the feedforward has a value for every sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from xy_sysid.comparison.physical_model import PhysicalModel
from xy_sysid.control_design.closed_loop import Controller, Encoder
from xy_sysid.control_design.compensation import Compensation, compensate_within
from xy_sysid.control_design.feedback import feedback
from xy_sysid.control_design.gains import Gains, gains, simple_feedforward
from xy_sysid.control_design.path import Bounds, Moves, SampledPath, s_curve
from xy_sysid.control_design.uncertain import later, samples
from xy_sysid.samples.block import FloatArray

KINDS = ("PID alone", "with kS, kV, kA", "compensated")
DRAWS = 6  # samples of the parameters for the choice of a compensation
APPROACH = 0.5  # of the path's bounds, on the way to its start
QUIET = 0.5  # s at rest before each path, with its own feedforward


@dataclass(frozen=True, slots=True)
class Tryout:
    """The plan for one axis.

    controller: PID, calculated once a block; block: samples; gains: kS, kV, kA; compensation: the chosen laws; path: of the axis
    asked: (3, n) commanded encoder readings, m; voltage: (3, n) feedforward, V; a row for each of ``KINDS``
    """

    controller: Controller
    block: int
    gains: Gains
    compensation: Compensation
    path: SampledPath
    asked: FloatArray
    voltage: FloatArray


def plan(model: PhysicalModel, moves: Moves, block: int, limit: float, encoder: Encoder | None = None) -> Tryout:
    """The plan of an axis along the path of the moves. Raises BadInput if no controller keeps the margins, or if the path needs too much voltage."""
    sampling_rate = moves.sampling_rate
    late = later(model, 1.0 / sampling_rate)  # the newest reading is of the sample before
    controller = feedback(late, sampling_rate / block, limit=limit).controller
    found = gains(model)
    path, best = compensate_within(samples(model, DRAWS), found, moves, controller, encoder)
    asked = np.array([path.position, path.position, best.path.position])
    voltage = np.array([np.zeros(path.position.size), simple_feedforward(found, path), best.voltage])
    return Tryout(controller=controller, block=block, gains=found, compensation=best, path=path, asked=asked, voltage=voltage)


class Follower:
    """Executes a plan: ``step`` takes the newest reading and returns the voltages of the next block, until ``over``.

    Each kind runs the path twice. The first lap does not count: in it the integral settles to the residual error of the feedforward.
    """

    def __init__(self, made: Tryout, here: float, length: int | None = None) -> None:
        """here: present position, m; length: least samples of each path, so that several axes start together."""
        self.plan = made
        size = max(length or 0, made.path.position.size)
        quiet = round(QUIET * made.path.sampling_rate)
        parts = [self._approach(here, float(made.path.position[0]))]
        extras = [np.zeros(parts[0].size)]
        self._from: list[int] = []
        self._fresh: set[int] = set()
        for asked, extra in zip(made.asked, made.voltage, strict=True):
            self._fresh.add(sum(part.size for part in parts) // made.block)
            parts += [np.full(quiet, float(asked[0])), _longer(asked, size)]  # first lap, not counted
            extras += [np.full(quiet, float(extra[0])), _longer(extra, size)]
            self._from.append(sum(part.size for part in parts))
            parts.append(_longer(asked, size))
            extras.append(_longer(extra, size))
        parts.append(np.full(quiet, float(parts[-1][-1])))
        extras.append(np.full(quiet, float(extras[-1][-1])))
        self._asked, self._extra = np.concatenate(parts), np.concatenate(extras)
        self._at, self._total, self._rate, self._before = 0, 0.0, 0.0, 0.0
        self._shown: list[float] = []

    def _approach(self, here: float, begin: float) -> FloatArray:
        if here == begin:
            return np.zeros(0)
        path = self.plan.path
        speed = max(float(np.max(np.abs(path.speed))), 1e-9)
        acceleration = max(float(np.max(np.abs(path.acceleration))), 1e-9)
        bounds = Bounds(APPROACH * speed, APPROACH * acceleration, APPROACH * acceleration * path.sampling_rate / 10.0)
        return s_curve([here, begin], bounds, path.sampling_rate).position

    @property
    def over(self) -> bool:
        """True if the plan is complete."""
        return self._at >= self._asked.size

    @property
    def kind(self) -> int | None:
        """Index of the current kind in ``KINDS``; None on the way to the first."""
        done = [k for k, first in enumerate(self._from) if self._at >= first]
        return done[-1] if done else None

    def see(self, shown: FloatArray) -> None:
        """Add readings (k,), m, after the last voltage."""
        self._shown += shown.tolist()

    def step(self, shown: FloatArray) -> FloatArray:
        """(block,) V for the next samples; shown: (k,) m, readings since the last call, the newest last."""
        own, block = self.plan.controller, self.plan.block
        if self._at // block in self._fresh:  # reset the integral, which belongs to another feedforward
            self._total = 0.0
        self.see(shown)
        h = block / self.plan.path.sampling_rate
        error = float(self._asked[min(max(self._at - 1, 0), self._asked.size - 1)]) - self._shown[-1]
        keeps = own.keeps(1.0 / h)
        if self._at:
            self._rate = keeps * self._rate + (1.0 - keeps) * (error - self._before) / h
        self._before = error
        fed = own.kp * error + self._total + own.kd * self._rate
        extra = _longer(self._extra[self._at : self._at + block], block)
        voltage = np.clip(fed + extra, -own.limit, own.limit)
        if bool(np.all(np.abs(fed + extra) < own.limit)):
            self._total += own.ki * error * h
        self._at += block
        return voltage

    def errors(self) -> list[FloatArray]:
        """For each completed kind of ``KINDS`` the error of every sample, m: path minus encoder."""
        found, shown = [], np.array(self._shown)
        size = self.plan.path.position.size
        for first in self._from:
            start = first + 1  # the first reading is from before the first voltage
            if start + size <= shown.size:
                found.append(self.plan.path.position - shown[start : start + size])
        return found


def _longer(values: FloatArray, size: int) -> FloatArray:
    """The values, extended to this size by repeating the last."""
    last = float(values[-1]) if values.size else 0.0
    return np.concatenate((values, np.full(max(size - values.size, 0), last)))
