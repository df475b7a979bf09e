"""The simulated machine: from voltages to encoder positions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from xy_sim import kernel, truth
from xy_sim.couplings import Coupled
from xy_sim.drawing import drawn
from xy_sim.layout import STATES, numbers
from xy_sim.machine_file import Axis, Spec, fitting, parts_from, read
from xy_sim.parts import PARTS
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

_RESOLVED = 1.5  # rad in one inner step: the method of order 4 is stable to 2.6, and exact far below


class _Moving:
    """One axis while it runs: parameters, state, delayed voltages, and its own noise."""

    def __init__(self, axis: Axis, rate: float, seed: int, number: int) -> None:
        self.parameters = numbers(axis.drive, axis.parts)
        self.dirty = any(PARTS[name].group == "imperfection" for name in axis.parts)
        delay = axis.parts.get("time_delay", {}).get("delay", 0.0)
        self.states = np.zeros((kernel.ROWS, len(STATES)))
        self.past = np.zeros(int(delay * rate) + 3)
        self.counters = np.zeros(3, dtype=np.int64)
        self.random = np.random.default_rng([seed, number])


class Machine:
    """A table of one or more axes that keeps its state from step to step; ``truth`` returns its true parameters.

    Any split of the same voltages into blocks gives the same positions, bit for bit.
    """

    def __init__(self, spec: Spec, seed: int | None = None, clean: bool = False) -> None:
        """seed: of the encoder noise (the spec's by default); clean: exact positions. Raises BadInput if inner_rate is too small."""
        self.spec = spec
        self.seed = spec.seed if seed is None else seed
        self.clean = clean
        for axis in spec.axes:
            least, inner = truth.fastest(axis) / _RESOLVED, self._inner(axis)
            if inner < least:
                raise BadInput(f"axis {axis.name}: inner_rate", f"{inner:g}", f"at least {least:.3g} Hz", "Raise it, or soften the parts.")
        self.reset()

    @classmethod
    def from_file(cls, path_or_name: str | Path, seed: int | None = None, clean: bool = False) -> Machine:
        """A machine from a YAML file or a name in config/machines; the effects of a file with ``hidden`` are drawn from the seed.

        Raises BadInput for a missing or wrong file, with the nearest spelling of an unknown name.
        """
        spec = read(path_or_name)
        if spec.hidden is not None:
            spec = drawn(spec, seed)
        return cls(spec, seed, clean)

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes, in the order of the columns."""
        return tuple(axis.name for axis in self.spec.axes)

    @property
    def rate(self) -> float:
        """Samples per second, Hz."""
        return self.spec.rate

    @property
    def samples(self) -> int:
        """Samples since the start."""
        return int(self._moving[0].counters[0])

    def reset(self) -> None:
        """Set the machine to rest at the origin, at sample 0, and start its noise again."""
        self._moving = [_Moving(axis, self.spec.rate, self.seed, number) for number, axis in enumerate(self.spec.axes)]
        drives = [axis.drive for axis in self.spec.axes]
        self._coupled = Coupled(self.spec.coupling, drives, self.spec.rate) if self.spec.coupling.any else None

    def step(self, voltage: FloatArray) -> FloatArray:
        """(n, axes) encoder positions, m: row k is read when row k of ``voltage`` (n, axes), V, is output. Raises BadInput for another shape."""
        given = np.asarray(voltage, dtype=np.float64)
        if given.ndim != 2 or given.shape[1] != len(self._moving) or not np.all(np.isfinite(given)):
            raise BadInput("voltage", f"of shape {given.shape}", f"finite numbers, (n, {len(self._moving)})", "Give one column per axis.")
        out = np.empty_like(given, order="C")
        for column, (axis, moving) in enumerate(zip(self.spec.axes, self._moving, strict=True)):
            seen = np.empty(given.shape[0])
            kernel.run(
                moving.parameters,
                moving.states,
                moving.past,
                moving.counters,
                np.ascontiguousarray(given[:, column]),
                seen,
                self.spec.rate,
                self._inner(axis),
                moving.parameters if moving.dirty else None,
            )
            out[:, column] = seen
        if self._coupled is not None:
            out = self._coupled.seen(out)
        if not self.clean:
            for column, (axis, moving) in enumerate(zip(self.spec.axes, self._moving, strict=True)):
                out[:, column] = self._encoder(axis, moving, out[:, column])
        return out

    def mixing(self, frequency: FloatArray) -> NDArray[np.complex128]:
        """(n, axes, axes) true transfer from the motion of axis j to the reading of encoder i, at (n,) Hz."""
        if self._coupled is not None:
            return self._coupled.mixing(frequency)
        return np.tile(np.eye(len(self.axes), dtype=np.complex128), (len(frequency), 1, 1))

    def _inner(self, axis: Axis) -> float:
        """Fewest inner steps per second, Hz."""
        steps = axis.parts.get("first_order_steps")
        return self.spec.inner_rate if steps is None else 1.0 / steps["step"]

    @staticmethod
    def _encoder(axis: Axis, moving: _Moving, seen: FloatArray) -> FloatArray:
        count = axis.drive.count
        noise = axis.drive.encoder_noise * moving.random.standard_normal(seen.shape[0])
        counted: FloatArray = np.round((seen + noise) / count) * count
        return counted

    def truth(self, axis: str, time: float = 0.0) -> dict[str, Any]:
        """The true linear model of an axis at small signal, with its drifts at ``time``, s; see ``xy_sim.truth.linear``."""
        return truth.linear(self.spec.axes[self._place(axis)], time)

    def state(self, axis: str) -> dict[str, float]:
        """The present states of an axis, by name, SI."""
        return dict(zip(STATES, self._moving[self._place(axis)].states[0].tolist(), strict=True))

    def energy(self, axis: str) -> float:
        """Energy stored in an axis at present, J: motion, springs, contacts, bristles, potentials."""
        moving = self._moving[self._place(axis)]
        return truth.energy(moving.parameters, moving.states[0], self.samples / self.rate)

    def with_parts(self, parts: Mapping[str, Any], axes: Sequence[str] | None = None) -> Machine:
        """A new machine at rest, with parts added or replaced on some axes (all by default).

        parts: name -> size, or name -> {parameter: value}, or name -> {} for the default size, or name -> False to remove it.

        Raises BadInput for an unknown name or a value outside its range.
        """
        for axis in axes or ():
            self._place(axis)
        away = {name for name, value in parts.items() if value is False and name in PARTS}
        added = parts_from({name: value for name, value in parts.items() if name not in away}, "effect")

        def changed(axis: Axis) -> Axis:
            if axes is not None and axis.name not in axes:
                return axis
            return fitting(replace(axis, parts={name: value for name, value in (dict(axis.parts) | added).items() if name not in away}))

        return Machine(replace(self.spec, axes=tuple(changed(axis) for axis in self.spec.axes)), self.seed, self.clean)

    def _place(self, axis: str) -> int:
        if axis not in self.axes:
            raise BadInput("axis", repr(axis), ", ".join(self.axes), "Give one of these.")
        return self.axes.index(axis)
