"""Coupling of two axes: axes that are not perpendicular, and a common base that oscillates.

The encoders read the table in a right-angled frame that is fixed to the base. q is the motion of each axis, r the reading, a the skew, d the
direction in which the base swings, m the masses of the tables and M that of the base:

    r_1 = q_1 + sin(a) q_2 - cos(d) b,   r_2 = cos(a) q_2 - sin(d) b,   M (b'' + 2 zeta w b' + w^2 b) = -(cos(d) m_1 q_1'' + sin(d) m_2 q_2'')

The base is heavy: its motion does not affect the drives.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from xy_sim.drive import Drive
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import Settings, knob


class Couplings(Settings):
    """``coupling`` of a machine file."""

    skew: float = knob(0.0, "angle by which the second axis is not perpendicular to the first", "rad", ge=-0.5, le=0.5)
    base_mass: float = knob(0.0, "mass of the base that carries both axes; 0 is a base that does not move", "kg", ge=0.0, le=1e6)
    base_frequency: float = knob(60.0, "frequency at which it swings", "Hz", gt=0.0, le=1e4)
    base_damping: float = knob(0.03, "part of the critical damping", "", gt=0.0, le=1.0)
    base_direction: float = knob(
        0.785, "direction in which it swings, from the first axis: 0 is along it, pi / 2 along the second", "rad", ge=-3.2, le=3.2
    )

    @property
    def any(self) -> bool:
        """True if one axis moves the other."""
        return self.skew != 0.0 or self.base_mass > 0.0


class Coupled:
    """The encoder readings of two coupled axes; keeps the state of the base between blocks."""

    def __init__(self, what: Couplings, drives: Sequence[Drive], rate: float) -> None:
        """drives: of the two axes; rate: samples per second, Hz."""
        self._frame = np.array([[1.0, np.sin(what.skew)], [0.0, np.cos(what.skew)]])
        self._along = np.array([np.cos(what.base_direction), np.sin(what.base_direction)])
        light = 0.0 if what.base_mass == 0.0 else 1.0 / what.base_mass
        self._pushes = self._along * np.array([drive.table_mass for drive in drives]) * light
        self._omega, self._damping = 2.0 * np.pi * what.base_frequency, what.base_damping
        numerator, self._denominator, *_ = scipy.signal.cont2discrete((np.array(self._swing[0]), np.array(self._swing[1])), 1.0 / rate, method="foh")
        self._numerator = np.ravel(numerator)
        self._state = np.zeros(2)

    @property
    def _swing(self) -> tuple[list[float], list[float]]:
        return [1.0, 0.0, 0.0], [1.0, 2.0 * self._damping * self._omega, self._omega**2]

    def seen(self, motion: FloatArray) -> FloatArray:
        """(n, 2) encoder readings for the (n, 2) motion of the axes, m."""
        one, other = motion[:, 0], motion[:, 1]  # summed by hand: a matrix product rounds differently for other lengths
        swings, self._state = scipy.signal.lfilter(
            self._numerator, self._denominator, one * self._pushes[0] + other * self._pushes[1], zi=self._state
        )
        read = [one * row[0] + other * row[1] + swings * along for row, along in zip(self._frame, self._along, strict=True)]
        return np.column_stack(read)

    def mixing(self, frequency: FloatArray) -> NDArray[np.complex128]:
        """(n, 2, 2) transfer from the motion of axis j to the reading of encoder i, at (n,) Hz."""
        _, swings = scipy.signal.freqs(*self._swing, worN=2.0 * np.pi * np.asarray(frequency))
        return np.asarray(self._frame + swings[:, None, None] * np.outer(self._along, self._pushes))
