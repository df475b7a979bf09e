"""A model of an axis with physical effects. It can be compared, drawn and saved like a linear model."""

from __future__ import annotations

from dataclasses import dataclass

from xy_sysid.axis.linear_part import linear_part
from xy_sysid.axis.model import AxisModel, simulate
from xy_sysid.greybox.free_run import GreyboxFit
from xy_sysid.greybox.parameters import parameter_table
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.response.estimate import Estimate
from xy_sysid.samples.block import FloatArray
from xy_sysid.tables import Table
from xy_sysid.units import USUAL, Units, listed, moved


@dataclass(frozen=True, slots=True)
class PhysicalModel:
    """A rigid axis with physical effects, with its fit and origin.

    model: gain, delay, pole and the effects with their values; fit: with intervals and errors, None for a model from a file
    axis:  its name; data: SHA-256 of the samples of each recording in the fit; units: of input and output
    known: its parameters with intervals, of a model from a file
    sampling_rate: Hz, of the recording that it was fitted to; None if unknown
    """

    model: AxisModel
    axis: str = ""
    data: tuple[str, ...] = ()
    units: Units = USUAL
    fit: GreyboxFit | None = None
    known: tuple[Estimate, ...] = ()
    sampling_rate: float | None = None

    @property
    def tf(self) -> TransferFunction:
        """The linear part: base, delay, resonances and lags, without friction and other nonlinear effects."""
        return linear_part(self.model, self.units)

    @property
    def effects(self) -> tuple[str, ...]:
        """The names of the effects."""
        return tuple(name for name, _ in self.model.effects)

    @property
    def parameters(self) -> tuple[Estimate, ...]:
        """gain, delay, pole, then ``effect.parameter``, with 95 % intervals; empty if these are unknown (``model.values()`` has the values)."""
        return self.fit.parameters if self.fit is not None else self.known

    @property
    def doubt(self) -> str:
        """Why free simulation cannot judge the model; empty if it can."""
        names = [name for name in self.effects if not self.model.library[name].simulable]
        if not names:
            return ""
        return f"a free simulation cannot follow {listed(names)} (the contact is chaotic), so this error says little about the model"

    @property
    def label(self) -> str:
        """A short text for a legend."""
        return f"rigid with {listed(self.effects).replace('_', ' ')}" if self.effects else "rigid"

    @property
    def table(self) -> Table:
        """Each parameter with its 95 % interval; without intervals for a model from a file."""
        if self.fit is None:
            rows = [(name, value, None, None, "") for name, value in self.model.values().items()]
            return Table(("parameter", "value", "from", "to", "unit"), tuple(rows))
        return parameter_table(self.parameters)

    def __str__(self) -> str:
        """Effects, formula of the linear part, and table of the parameters."""
        return "\n\n".join((repr(self)[1:-1], f"linear part:\n{self.tf}", str(self.table)))

    def velocity(self, sampling_rate: float, voltage: FloatArray, position: FloatArray) -> FloatArray:
        """(n - 1,) simulated mean velocity of each sample, m/s, starting with the initial speed of the position."""
        return simulate(self.model, sampling_rate, voltage, position)

    def __repr__(self) -> str:
        told = f" of axis {self.axis}" if self.axis else ""
        error = f", held-out error {moved(self.fit.held_out_error, self.units.judged)}" if self.fit is not None else ""
        return f"<PhysicalModel{told}: {self.label}{error}>"
