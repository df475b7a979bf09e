"""The interface of every model of an axis: a transfer function, or a model with physical effects."""

from __future__ import annotations

from typing import Protocol

from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.samples.block import FloatArray


class AnyModel(Protocol):
    """A model of one axis, of either kind."""

    @property
    def tf(self) -> TransferFunction:
        """The transfer function, or the linear part."""

    @property
    def axis(self) -> str:
        """Name of the axis; empty if it is not known."""

    @property
    def data(self) -> tuple[str, ...]:
        """SHA-256 of the samples of each recording in its fit, if known."""

    @property
    def doubt(self) -> str:
        """Why free simulation cannot judge it; empty if it can."""

    @property
    def label(self) -> str:
        """A short text for a legend."""

    def velocity(self, sampling_rate: float, voltage: FloatArray, position: FloatArray) -> FloatArray:
        """(n - 1,) simulated mean velocity of each sample, m/s, from rest, for voltage and measured position (n,), V and m."""
