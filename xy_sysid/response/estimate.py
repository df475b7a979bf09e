"""An estimated number with its 95 % interval: of a transfer function's fit, of a physical model, of a machine over time."""

from __future__ import annotations

from dataclasses import dataclass

from xy_sysid.response.frf import Z95


@dataclass(frozen=True, slots=True)
class Estimate:
    """One parameter with its 95 % interval [low, high] in ``unit``.

    recordings: the values in each recording if the parameter may differ between them; ``value`` is then their mean
    """

    name: str
    value: float
    unit: str
    low: float
    high: float
    recordings: tuple[Estimate, ...] = ()

    @property
    def sigma(self) -> float:
        """Standard error, in ``unit``, of an interval that is symmetric."""
        return (self.high - self.low) / (2.0 * Z95)
