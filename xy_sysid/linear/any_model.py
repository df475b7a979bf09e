"""What every model of an axis can do, a transfer function as well as one with physical effects."""

from __future__ import annotations

from typing import Protocol

from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.samples.block import FloatArray


class AnyModel(Protocol):
    """A model of one axis, whatever it is made of."""

    @property
    def tf(self) -> TransferFunction:
        """The transfer function, or the linear part."""

    @property
    def axis(self) -> str:
        """Name of the axis; empty if it is not known."""

    @property
    def data(self) -> tuple[str, ...]:
        """SHA-256 of the samples of each recording that it was fitted to, as far as they are known."""

    @property
    def doubt(self) -> str:
        """What speaks against judging it by its free simulation; empty if nothing does."""

    @property
    def label(self) -> str:
        """A few words for a legend."""

    def velocity(self, sampling_rate: float, voltage: FloatArray, position: FloatArray) -> FloatArray:
        """(n - 1,) simulated mean velocity of each sample, m/s, from rest, for voltage and measured position (n,), V and m."""
